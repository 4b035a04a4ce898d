"""Contexts of readings: order, batch, nest, people and means, events, process parameters.

`downgrade` loses them.

Revision ID: 0109
Revises: 0108
Create Date: 2026-11-23
"""

from alembic import op

revision = "0109"
down_revision: str | None = "0108"
branch_labels = None
depends_on = None

UPGRADE = (
    """
    CREATE TABLE reading_context (
        machine_id INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        sequence BIGINT NOT NULL,
        context JSONB NOT NULL,
        CONSTRAINT reading_context_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
    )
    """,
    """
    CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON reading_context
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()
    """,
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    op.execute("DROP TABLE reading_context")
