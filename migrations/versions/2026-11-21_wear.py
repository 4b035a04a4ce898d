"""What the wear curve and its forecast are drawn from.

Revision ID: 0008
Revises: 0007
Create Date: 2026-11-21
"""

revision = "0008"
down_revision: str | None = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
