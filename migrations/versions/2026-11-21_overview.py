"""What ranks the characteristics that need somebody.

Revision ID: 0018
Revises: 0017
Create Date: 2026-11-21
"""

revision = "0018"
down_revision: str | None = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
