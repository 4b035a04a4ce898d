"""Parts until the next measurement, as each reading was answered; machines of which a control plan counts parts.

`downgrade` loses the answers.

Revision ID: 0130
Revises: 0129
Create Date: 2026-11-27
"""

from alembic import op

revision = "0130"
down_revision: str | None = "0129"
branch_labels = None
depends_on = None

UPGRADE = (
    """
    CREATE TABLE reading_next (
        machine_id INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        sequence BIGINT NOT NULL,
        measure_next INTEGER NOT NULL,
        CONSTRAINT reading_next_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
    )
    """,
    """
    CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON reading_next
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()
    """,
    "ALTER TABLE machine_state ADD COLUMN planned BOOLEAN DEFAULT false NOT NULL",
    # With another version: a server that runs remembers the machine without its plans.
    """
    UPDATE machine_state SET planned = true, version = version + 1 WHERE machine_id IN (
        SELECT machine_id FROM control_plan WHERE every IS NOT NULL OR after_change > 0 OR after_alarm > 0
    )
    """,
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    op.execute("ALTER TABLE machine_state DROP COLUMN planned")
    op.execute("DROP TABLE reading_next")
