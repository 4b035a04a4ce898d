"""Alarms by the time they were raised: of one shift among those of years.

One entry for each new alarm; a reading that raises none writes nothing.

Revision ID: 0123
Revises: 0122
Create Date: 2026-11-27
"""

from alembic import op

revision = "0123"
down_revision: str | None = "0122"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("CREATE INDEX alarm_raised_idx ON alarm (raised_at)")


def downgrade() -> None:
    op.execute("DROP INDEX alarm_raised_idx")
