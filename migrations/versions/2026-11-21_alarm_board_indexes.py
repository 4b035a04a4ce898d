"""What the operator's board and the writer look for: the few active alarms among all there ever were, and the last ones acknowledged.

Revision ID: 0003
Revises: 0002
Create Date: 2026-11-21
"""

from alembic import op

revision = "0003"
down_revision: str | None = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("CREATE INDEX alarm_active_idx ON alarm (machine_id, id) WHERE acknowledged_at IS NULL")
    op.execute("CREATE INDEX alarm_acknowledged_idx ON alarm (acknowledged_at, id) WHERE acknowledged_at IS NOT NULL")


def downgrade() -> None:
    op.execute("DROP INDEX alarm_active_idx, alarm_acknowledged_idx")
