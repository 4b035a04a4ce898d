"""Reaction plans, the catalogue of causes and corrective actions, and what was chosen of it at an alarm.

`downgrade` loses them; the record of changes keeps who wrote which plan, and what was said to each alarm.

Revision ID: 0128
Revises: 0127
Create Date: 2026-11-27
"""

from alembic import op

revision = "0128"
down_revision: str | None = "0127"
branch_labels = None
depends_on = None

OF_ALARM = ("cause BIGINT", "corrective_action BIGINT", "reaction_plan BIGINT", "reaction_version INTEGER")
UPGRADE = (
    "CREATE SEQUENCE reaction_plan_id AS bigint",
    "CREATE SEQUENCE catalogue_entry_id AS bigint",
    """
    CREATE TABLE reaction_plan (
        id BIGINT NOT NULL,
        version INTEGER NOT NULL,
        name TEXT NOT NULL,
        characteristic TEXT,
        kind TEXT,
        rule TEXT,
        steps JSONB NOT NULL,
        cause_needed BOOLEAN NOT NULL,
        action_needed BOOLEAN NOT NULL,
        receivers JSONB NOT NULL,
        ended BOOLEAN NOT NULL,
        reason TEXT NOT NULL,
        made_at timestamptz DEFAULT now() NOT NULL,
        made_by TEXT NOT NULL,
        CONSTRAINT reaction_plan_pkey PRIMARY KEY (id, version)
    )
    """,
    """
    CREATE TABLE catalogue_entry (
        id BIGINT DEFAULT nextval('catalogue_entry_id') NOT NULL,
        sort TEXT NOT NULL,
        name TEXT NOT NULL,
        made_at timestamptz DEFAULT now() NOT NULL,
        made_by TEXT NOT NULL,
        retired_at timestamptz,
        CONSTRAINT catalogue_entry_pkey PRIMARY KEY (id),
        CONSTRAINT catalogue_entry_sort_check CHECK (sort IN ('cause', 'action'))
    )
    """,
    "CREATE UNIQUE INDEX catalogue_entry_name_key ON catalogue_entry (sort, lower(name))",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE ON reaction_plan
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE OF id, sort, name, made_at, made_by ON catalogue_entry
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    *(f"ALTER TABLE alarm ADD COLUMN {column}" for column in OF_ALARM),
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for column in reversed(OF_ALARM):
        op.execute(f"ALTER TABLE alarm DROP COLUMN {column.partition(' ')[0]}")
    for table in ("catalogue_entry", "reaction_plan"):
        op.execute(f"DROP TABLE {table}")
        op.execute(f"DROP SEQUENCE {table}_id")
