"""Rules that are watched, and the signals they gave.

Revision ID: 0011
Revises: 0010
Create Date: 2026-11-21
"""

revision = "0011"
down_revision: str | None = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
