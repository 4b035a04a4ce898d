"""Work zeros and alignments with their touches.

Revision ID: 0016
Revises: 0015
Create Date: 2026-11-21
"""

revision = "0016"
down_revision: str | None = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
