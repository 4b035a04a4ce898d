"""Block ranges of readings by time of arrival and by part, in place of trees.

Readings are stored in the order of their arrival. So it suffices to know of each 64 pages (some 3,000 readings) from when to
when they came and were measured, which zones, actions and parts they have: two BRIN indexes, of less than a hundredth of
the table, written when a range is full. The trees of 0102 cost a batch a quarter of its speed.

A summary is written by autovacuum within a minute or two after its range is full; until then the range is always read.

Revision ID: 0104
Revises: 0103
Create Date: 2026-11-23
"""

from alembic import op

revision = "0104"
down_revision: str | None = "0103"
branch_labels = None
depends_on = None

UPGRADE = (
    "DROP INDEX IF EXISTS reading_part_idx",  # one by one: a plant may lie on a node of Citus
    "DROP INDEX IF EXISTS reading_received_idx",
    """
    CREATE INDEX reading_received_idx ON reading USING brin (
        received_at timestamptz_minmax_multi_ops,
        measured_at timestamptz_minmax_multi_ops,
        zone text_bloom_ops (n_distinct_per_range = 16),
        action text_bloom_ops (n_distinct_per_range = 16)
    ) WITH (pages_per_range = 64, autosummarize = on)
    """,
    """
    CREATE INDEX reading_part_idx ON reading USING brin (
        part text_bloom_ops (n_distinct_per_range = 2500),
        "left"(part, 3) text_bloom_ops (n_distinct_per_range = 64),
        "left"(part, 8) text_bloom_ops (n_distinct_per_range = 600)
    ) WITH (pages_per_range = 64, autosummarize = on)
    """,
    # The range at the end, not full yet, loses its summary again: with it, each reading that comes would write it anew.
    """
    SELECT brin_desummarize_range(index, greatest(pg_relation_size('reading') / current_setting('block_size')::int - 1, 0))
    FROM unnest(ARRAY['reading_received_idx', 'reading_part_idx']::regclass[]) AS index
    """,
)
DOWNGRADE = (
    "DROP INDEX reading_received_idx",
    "DROP INDEX reading_part_idx",
    "CREATE INDEX reading_part_idx ON reading (part text_pattern_ops, received_at) WHERE part IS NOT NULL",
    "CREATE INDEX reading_received_idx ON reading (machine_id, received_at)",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
