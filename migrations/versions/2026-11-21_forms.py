"""Form measurements with their touches.

Revision ID: 0015
Revises: 0014
Create Date: 2026-11-21
"""

revision = "0015"
down_revision: str | None = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
