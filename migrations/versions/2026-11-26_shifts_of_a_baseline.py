"""The shifts by which a baseline forms its subgroups; of old ones they are not known, and stay those of the plant.

Revision ID: 0117
Revises: 0116
Create Date: 2026-11-26
"""

from alembic import op

revision = "0117"
down_revision: str | None = "0116"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("ALTER TABLE baseline ADD COLUMN shifts TEXT")


def downgrade() -> None:
    op.execute("ALTER TABLE baseline DROP COLUMN shifts")
