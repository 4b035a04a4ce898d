"""Corrections fetched as program text.

Revision ID: 0006
Revises: 0005
Create Date: 2026-11-21
"""

from alembic import op

revision = "0006"
down_revision: str | None = "0005"
branch_labels = None
depends_on = None


COLUMNS = ("fetched_at timestamptz", "fetched_by TEXT", "fetched_as TEXT")


def upgrade() -> None:
    op.execute("ALTER TABLE correction " + ", ".join(f"ADD COLUMN {column}" for column in COLUMNS))


def downgrade() -> None:
    op.execute("ALTER TABLE correction " + ", ".join(f"DROP COLUMN {column.split()[0]}" for column in COLUMNS))
