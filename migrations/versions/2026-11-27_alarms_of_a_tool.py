"""Alarms of a tool by their number: control plans look for the last ones with every reading of a machine that has such plans.

Revision ID: 0135
Revises: 0134
Create Date: 2026-11-27
"""

from alembic import op

revision = "0135"
down_revision: str | None = "0134"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("CREATE INDEX alarm_tool_idx ON alarm (machine_id, tool_memory, id) WHERE characteristic_id IS NULL")


def downgrade() -> None:
    op.execute("DROP INDEX alarm_tool_idx")
