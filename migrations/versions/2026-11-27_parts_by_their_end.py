"""Parts by the last letters of their names: block ranges, as for their beginning.

Built while nobody writes, by one pass over the readings, and next to nothing for a reading that comes.

Revision ID: 0122
Revises: 0121
Create Date: 2026-11-27
"""

from alembic import op

revision = "0122"
down_revision: str | None = "0121"
branch_labels = None
depends_on = None

UPGRADE = (
    """
    CREATE INDEX reading_part_end_idx ON reading USING brin (
        "right"(part, 4) text_bloom_ops (n_distinct_per_range = 2500),
        "right"(part, 7) text_bloom_ops (n_distinct_per_range = 2500)
    ) WITH (pages_per_range = 64, autosummarize = on)
    """,
    # The range at the end, not full yet, loses its summary again: with it, each reading that comes would write it anew.
    """
    SELECT brin_desummarize_range(
        'reading_part_end_idx', greatest(pg_relation_size('reading') / current_setting('block_size')::int - 1, 0)
    )
    """,
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    op.execute("DROP INDEX reading_part_end_idx")
