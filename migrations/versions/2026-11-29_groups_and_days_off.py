"""Groups of receivers with a rota, and the days off of the plant.

`downgrade` loses them; the record of changes keeps who set up which.

Revision ID: 0136
Revises: 0135
Create Date: 2026-11-29
"""

from alembic import op

revision = "0136"
down_revision: str | None = "0135"
branch_labels = None
depends_on = None

UPGRADE = (  # one by one: a plant may lie on a node of Citus
    "CREATE SEQUENCE receiver_group_id AS bigint",
    """
    CREATE TABLE receiver_group (
        id BIGINT DEFAULT nextval('receiver_group_id') NOT NULL,
        name TEXT NOT NULL,
        members JSONB NOT NULL,
        rota JSONB NOT NULL,
        created_at timestamptz DEFAULT now() NOT NULL,
        created_by TEXT NOT NULL,
        CONSTRAINT receiver_group_pkey PRIMARY KEY (id)
    )
    """,
    """
    CREATE TABLE plant_calendar (
        id INTEGER NOT NULL,
        country TEXT,
        subdivision TEXT,
        days JSONB NOT NULL,
        changed_at timestamptz DEFAULT now() NOT NULL,
        changed_by TEXT NOT NULL,
        CONSTRAINT plant_calendar_pkey PRIMARY KEY (id),
        CONSTRAINT plant_calendar_one_check CHECK (id = 1)
    )
    """,
)
DOWNGRADE = (
    "DROP TABLE plant_calendar",
    "DROP TABLE receiver_group",
    "DROP SEQUENCE receiver_group_id",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
