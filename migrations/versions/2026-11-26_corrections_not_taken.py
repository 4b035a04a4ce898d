"""What a bridge holds back, and whether it carries decisions to the control.

`downgrade` loses both; the next heartbeat says them again.

Revision ID: 0111
Revises: 0110
Create Date: 2026-11-26
"""

from alembic import op

revision = "0111"
down_revision: str | None = "0110"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("ALTER TABLE connection ADD COLUMN held_back JSONB DEFAULT '[]' NOT NULL")
    op.execute("ALTER TABLE connection ADD COLUMN carries_decisions BOOLEAN")


def downgrade() -> None:
    op.execute("ALTER TABLE connection DROP COLUMN carries_decisions")
    op.execute("ALTER TABLE connection DROP COLUMN held_back")
