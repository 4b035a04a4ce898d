"""Context that a control plan requires of every reading.

Revision ID: 0133
Revises: 0132
Create Date: 2026-11-27
"""

from alembic import op

revision = "0133"
down_revision: str | None = "0132"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("ALTER TABLE control_plan ADD COLUMN required_context TEXT[] NOT NULL DEFAULT '{}'")
    op.execute("ALTER TABLE control_plan ADD COLUMN context_seen BIGINT NOT NULL DEFAULT 0")


def downgrade() -> None:
    op.execute("ALTER TABLE control_plan DROP COLUMN required_context, DROP COLUMN context_seen")
