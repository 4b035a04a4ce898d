"""What charts look for: the alarms of a characteristic, and the changes of a tool among its many corrections.

Revision ID: 0002
Revises: 0001
Create Date: 2026-11-21
"""

from alembic import op

revision = "0002"
down_revision: str | None = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("CREATE INDEX alarm_characteristic_idx ON alarm (machine_id, characteristic_id, id)")
    op.execute("CREATE INDEX tool_event_change_idx ON tool_event (machine_id, number, id) WHERE kind <> 'correction'")


def downgrade() -> None:
    op.execute("DROP INDEX alarm_characteristic_idx, tool_event_change_idx")
