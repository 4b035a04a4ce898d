"""Reports that are made in the background.

Revision ID: 0013
Revises: 0012
Create Date: 2026-11-21
"""

revision = "0013"
down_revision: str | None = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
