"""Parameter changes that were proposed from a what-if.

Revision ID: 0012
Revises: 0011
Create Date: 2026-11-21
"""

revision = "0012"
down_revision: str | None = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
