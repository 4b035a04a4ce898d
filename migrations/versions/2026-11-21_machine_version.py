"""A number that moves with every change of a machine, so that what is held in memory can be known to be true.

Revision ID: 0009
Revises: 0008
Create Date: 2026-11-21
"""

revision = "0009"
down_revision: str | None = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
