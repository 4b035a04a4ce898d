"""Connections: the last heartbeat of each bridge, the last use of keys, the mapping of corrections.

`downgrade` loses these three.

Revision ID: 0105
Revises: 0104
Create Date: 2026-11-23
"""

from alembic import op

revision = "0105"
down_revision: str | None = "0104"
branch_labels = None
depends_on = None

UPGRADE = (
    """
    CREATE TABLE connection (
        machine_id INTEGER NOT NULL,
        received_at timestamptz NOT NULL,
        state TEXT NOT NULL,
        since timestamptz NOT NULL,
        detail TEXT,
        error TEXT,
        error_at timestamptz,
        version TEXT NOT NULL,
        kind TEXT,
        started_at timestamptz,
        waiting INTEGER NOT NULL,
        oldest_waiting_at timestamptz,
        backing_up_since timestamptz,
        quarantined INTEGER NOT NULL,
        quarantine JSONB NOT NULL,
        clock_offset DOUBLE PRECISION,
        mapping TEXT,
        hold_all BOOLEAN NOT NULL,
        identity TEXT,
        locations JSONB NOT NULL,
        CONSTRAINT connection_pkey PRIMARY KEY (machine_id),
        CONSTRAINT connection_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
    ) WITH (fillfactor = 50)
    """,
    "ALTER TABLE api_key ADD COLUMN last_used_at timestamptz",
    "ALTER TABLE correction ADD COLUMN mapping TEXT",
)
DOWNGRADE = (
    "ALTER TABLE correction DROP COLUMN mapping",
    "ALTER TABLE api_key DROP COLUMN last_used_at",
    "DROP TABLE connection",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
