"""Receivers of notifications, routes to them, and each delivery.

`downgrade` loses them; the record of changes keeps who set them up.

Revision ID: 0118
Revises: 0117
Create Date: 2026-11-26
"""

from alembic import op

revision = "0118"
down_revision: str | None = "0117"
branch_labels = None
depends_on = None

NUMBERED = ("receiver", "notification_route", "delivery")
UPGRADE = (
    *(f"CREATE SEQUENCE {table}_id AS bigint" for table in NUMBERED),
    """
    CREATE TABLE receiver (
        id BIGINT DEFAULT nextval('receiver_id') NOT NULL,
        name TEXT NOT NULL,
        means TEXT NOT NULL,
        address TEXT NOT NULL,
        secret TEXT,
        person_id INTEGER,
        quiet JSONB DEFAULT '[]' NOT NULL,
        away_until timestamptz,
        events JSONB DEFAULT '[]' NOT NULL,
        cursor BIGINT DEFAULT 0 NOT NULL,
        failures INTEGER DEFAULT 0 NOT NULL,
        retry_at timestamptz,
        busy_until timestamptz,
        last_at timestamptz,
        created_at timestamptz DEFAULT now() NOT NULL,
        created_by TEXT NOT NULL,
        deleted_at timestamptz,
        CONSTRAINT receiver_pkey PRIMARY KEY (id),
        CONSTRAINT receiver_person_id_fkey FOREIGN KEY (person_id) REFERENCES person (id),
        CONSTRAINT receiver_means_check CHECK (means IN ('mail', 'webhook', 'apprise'))
    ) WITH (fillfactor = 50)
    """,
    """
    CREATE UNIQUE INDEX receiver_person_key ON receiver (person_id)
        WHERE person_id IS NOT NULL AND deleted_at IS NULL
    """,
    """
    CREATE TABLE notification_route (
        id BIGINT DEFAULT nextval('notification_route_id') NOT NULL,
        name TEXT NOT NULL,
        enabled BOOLEAN DEFAULT true NOT NULL,
        rule JSONB NOT NULL,
        created_at timestamptz DEFAULT now() NOT NULL,
        created_by TEXT NOT NULL,
        CONSTRAINT notification_route_pkey PRIMARY KEY (id)
    )
    """,
    """
    CREATE TABLE announced (
        alarm_id BIGINT NOT NULL,
        receiver_id BIGINT NOT NULL,
        at timestamptz NOT NULL,
        CONSTRAINT announced_pkey PRIMARY KEY (alarm_id, receiver_id),
        CONSTRAINT announced_receiver_id_fkey FOREIGN KEY (receiver_id) REFERENCES receiver (id)
    )
    """,
    "CREATE INDEX announced_at_idx ON announced (at)",
    """
    CREATE TABLE delivery (
        id BIGINT DEFAULT nextval('delivery_id') NOT NULL,
        receiver_id BIGINT NOT NULL,
        about TEXT NOT NULL,
        subject TEXT NOT NULL,
        alarms JSONB DEFAULT '[]' NOT NULL,
        changes INTEGER DEFAULT 0 NOT NULL,
        state TEXT NOT NULL,
        asked_at timestamptz DEFAULT now() NOT NULL,
        asked_by TEXT,
        ended_at timestamptz,
        answer TEXT,
        CONSTRAINT delivery_pkey PRIMARY KEY (id),
        CONSTRAINT delivery_receiver_id_fkey FOREIGN KEY (receiver_id) REFERENCES receiver (id),
        CONSTRAINT delivery_about_check CHECK (about IN ('alarms', 'changes', 'test')),
        CONSTRAINT delivery_state_check CHECK (state IN ('waiting', 'sending', 'delivered', 'failed', 'lost'))
    )
    """,
    "CREATE INDEX delivery_open_idx ON delivery (receiver_id) WHERE state IN ('waiting', 'sending')",
    "CREATE INDEX delivery_asked_idx ON delivery (asked_at)",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for table in ("delivery", "announced", "notification_route", "receiver"):
        op.execute(f"DROP TABLE {table}")
    for table in NUMBERED:
        op.execute(f"DROP SEQUENCE {table}_id")
