"""Indexes for zeros in the order in which they were touched, and for what was computed again.

Revision ID: 0018
Revises: 0017
Create Date: 2026-11-22
"""

from alembic import op

revision = "0018"
down_revision: str | None = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("CREATE INDEX work_zero_touched_idx ON work_zero (machine_id, fixture, work_offset, touched_at, id)")
    op.execute(
        "CREATE INDEX work_zero_recomputed_idx ON work_zero (machine_id, recomputed_from)"
        " WHERE recomputed_from IS NOT NULL"
    )


def downgrade() -> None:
    op.execute("DROP INDEX work_zero_touched_idx")
    op.execute("DROP INDEX work_zero_recomputed_idx")
