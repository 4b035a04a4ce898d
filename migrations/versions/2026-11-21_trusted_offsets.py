"""Tools that are paused, tool edges and sister tools, expiry and plausibility.

Revision ID: 0007
Revises: 0006
Create Date: 2026-11-21
"""

revision = "0007"
down_revision: str | None = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
