"""Readings by part and by time of arrival.

Two indexes of `reading`: whoever names a part finds all that was measured on it, and a list across characteristics comes
newest first. They cost a batch about a quarter of its speed; a single reading waits for its commit first of all. They are
built while nobody writes.

Revision ID: 0102
Revises: 0101
Create Date: 2026-11-23
"""

from alembic import op

revision = "0102"
down_revision: str | None = "0101"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("CREATE INDEX reading_part_idx ON reading (part text_pattern_ops, received_at) WHERE part IS NOT NULL")
    op.execute("CREATE INDEX reading_received_idx ON reading (machine_id, received_at)")


def downgrade() -> None:
    op.execute("DROP INDEX reading_received_idx, reading_part_idx")
