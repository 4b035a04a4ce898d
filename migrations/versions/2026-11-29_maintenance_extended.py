"""The end of maintenance may be moved.

`downgrade` keeps the ends as they are then.

Revision ID: 0139
Revises: 0138
Create Date: 2026-11-29
"""

from alembic import op

revision = "0139"
down_revision: str | None = "0138"
branch_labels = None
depends_on = None

DROPPED = "DROP TRIGGER facts_stay ON maintenance"
KEPT = """
CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE OF {columns} ON maintenance
FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
"""


def upgrade() -> None:
    op.execute(DROPPED)
    op.execute(KEPT.format(columns="id, machine_id, begins, reason, stopping_anyway, entered_at, entered_by"))


def downgrade() -> None:
    op.execute(DROPPED)
    op.execute(KEPT.format(columns="id, machine_id, begins, ends, reason, stopping_anyway, entered_at, entered_by"))
