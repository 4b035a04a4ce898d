"""What the measuring variants yield beside the value, the signal path of each machine, and measurements by hand.

Revision ID: 0004
Revises: 0003
Create Date: 2026-11-21
"""

revision = "0004"
down_revision: str | None = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
