"""Maintenance of machines, in which notifications are withheld.

`downgrade` loses it; the record of changes keeps who entered which.

Revision ID: 0137
Revises: 0136
Create Date: 2026-11-29
"""

from alembic import op

revision = "0137"
down_revision: str | None = "0136"
branch_labels = None
depends_on = None

UPGRADE = (  # one by one: a plant may lie on a node of Citus
    "CREATE SEQUENCE maintenance_id AS bigint",
    """
    CREATE TABLE maintenance (
        id BIGINT DEFAULT nextval('maintenance_id') NOT NULL,
        machine_id INTEGER,
        begins timestamptz NOT NULL,
        ends timestamptz NOT NULL,
        reason TEXT NOT NULL,
        stopping_anyway BOOLEAN NOT NULL,
        entered_at timestamptz DEFAULT now() NOT NULL,
        entered_by TEXT NOT NULL,
        ended_at timestamptz,
        ended_by TEXT,
        CONSTRAINT maintenance_pkey PRIMARY KEY (id),
        CONSTRAINT maintenance_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id),
        CONSTRAINT maintenance_ends_check CHECK (ends > begins)
    )
    """,
    "CREATE INDEX maintenance_ends_idx ON maintenance (COALESCE(ended_at, ends))",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF id, machine_id, begins, ends, reason, stopping_anyway, entered_at, entered_by ON maintenance
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER closed_stays BEFORE UPDATE ON maintenance FOR EACH ROW WHEN (OLD.ended_at IS NOT NULL)
        EXECUTE FUNCTION refuse_loss()
    """,
)
DOWNGRADE = (
    "DROP TABLE maintenance",
    "DROP SEQUENCE maintenance_id",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
