"""The index of each of the last weeks beside a capability verdict.

Revision ID: 0120
Revises: 0119
Create Date: 2026-11-27
"""

from alembic import op

revision = "0120"
down_revision: str | None = "0119"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("ALTER TABLE capability_verdict ADD COLUMN weeks JSONB")


def downgrade() -> None:
    op.execute("ALTER TABLE capability_verdict DROP COLUMN weeks")
