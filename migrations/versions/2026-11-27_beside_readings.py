"""Readings by time and by part; context, thermal expansion, characteristics of form and mappings of imported files.

Readings are stored in the order of their arrival. So it suffices to know of each 64 pages (some 3,000 readings) from when to
when they came and were measured, which zones, actions and parts they have: BRIN indexes, of less than a hundredth of the
table, written when a range is full; trees cost a batch a quarter of its speed. They are built while nobody writes. Autovacuum
writes a summary within a minute or two after its range is full; until then the range is always read.

`downgrade` loses contexts, answered next measurements, thermal expansion, mappings of imports and which characteristic a
characteristic of form belongs to. Readings stay, with the context that was put on them.

Revision ID: 0112
Revises: 0106
Create Date: 2026-11-27
"""

from alembic import op

revision = "0112"
down_revision: str | None = "0106"
branch_labels = None
depends_on = None

INDEXES = (  # one by one: a plant may lie on a node of Citus
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
    """
    CREATE INDEX reading_part_end_idx ON reading USING brin (
        "right"(part, 4) text_bloom_ops (n_distinct_per_range = 2500),
        "right"(part, 7) text_bloom_ops (n_distinct_per_range = 2500)
    ) WITH (pages_per_range = 64, autosummarize = on)
    """,
    # The range at the end, not full yet, loses its summary again: each reading that comes would rewrite it.
    """
    SELECT brin_desummarize_range(index, greatest(pg_relation_size('reading') / current_setting('block_size')::int - 1, 0))
    FROM unnest(ARRAY['reading_received_idx', 'reading_part_idx', 'reading_part_end_idx']::regclass[]) AS index
    """,
)
CONTEXT = (
    """
    CREATE TABLE reading_context (
        machine_id INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        sequence BIGINT NOT NULL,
        context JSONB NOT NULL,
        CONSTRAINT reading_context_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
    )
    """,
    """
    CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON reading_context
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()
    """,
    """
    CREATE TABLE present_context (
        machine_id INTEGER NOT NULL,
        context JSONB NOT NULL,
        since timestamptz NOT NULL,
        filled timestamptz NOT NULL,
        changed_by TEXT NOT NULL,
        CONSTRAINT present_context_pkey PRIMARY KEY (machine_id),
        CONSTRAINT present_context_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
    )
    """,
    # Parts until the next measurement, as each reading was answered.
    """
    CREATE TABLE reading_next (
        machine_id INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        sequence BIGINT NOT NULL,
        measure_next INTEGER NOT NULL,
        CONSTRAINT reading_next_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
    )
    """,
    """
    CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON reading_next
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()
    """,
    """
    CREATE TABLE import_mapping (
        machine_id INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        part TEXT NOT NULL,
        number TEXT NOT NULL,
        name TEXT NOT NULL,
        actor TEXT NOT NULL,
        at timestamptz NOT NULL,
        CONSTRAINT import_mapping_pkey PRIMARY KEY (machine_id, characteristic_id, part, number, name),
        CONSTRAINT import_mapping_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id)
    )
    """,
)
CHARACTERISTICS = (
    """
    CREATE TABLE thermal_expansion (
        machine_id INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        coefficient DOUBLE PRECISION,
        coefficient_uncertainty DOUBLE PRECISION,
        scale_coefficient DOUBLE PRECISION,
        temperature_uncertainty DOUBLE PRECISION,
        length DOUBLE PRECISION,
        changed_by TEXT NOT NULL,
        changed_at timestamptz DEFAULT now() NOT NULL,
        reason TEXT NOT NULL,
        CONSTRAINT thermal_expansion_pkey PRIMARY KEY (machine_id, characteristic_id),
        CONSTRAINT thermal_expansion_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id),
        CONSTRAINT thermal_expansion_coefficient_uncertainty_check CHECK (coefficient_uncertainty >= 0),
        CONSTRAINT thermal_expansion_temperature_uncertainty_check CHECK (temperature_uncertainty >= 0),
        CONSTRAINT thermal_expansion_length_check CHECK (length >= 0)
    )
    """,
    # Which result of which characteristic the readings of a characteristic of form are.
    "ALTER TABLE characteristic ADD COLUMN form_of INTEGER, ADD COLUMN form TEXT",
    """
    ALTER TABLE characteristic ADD CONSTRAINT characteristic_form_check
        CHECK (form IN ('run_out', 'out_of_roundness', 'taper', 'straightness') AND form_of <> id)
    """,
    "ALTER TABLE characteristic ADD CONSTRAINT characteristic_form_whole_check CHECK ((form IS NULL) = (form_of IS NULL))",
    """
    ALTER TABLE characteristic ADD CONSTRAINT characteristic_machine_id_form_of_fkey
        FOREIGN KEY (machine_id, form_of) REFERENCES characteristic (machine_id, id)
    """,
    "CREATE UNIQUE INDEX characteristic_form_idx ON characteristic (machine_id, form_of, form) WHERE form_of IS NOT NULL",
    "ALTER TABLE reading_results ADD COLUMN straightness DOUBLE PRECISION",
)
DOWNGRADE = (
    "ALTER TABLE reading_results DROP COLUMN straightness",
    "ALTER TABLE characteristic DROP COLUMN form_of, DROP COLUMN form",
    "DROP TABLE thermal_expansion",
    "DROP TABLE import_mapping",
    "DROP TABLE reading_next",
    "DROP TABLE present_context",
    "DROP TABLE reading_context",
    "DROP INDEX reading_part_end_idx",
    "DROP INDEX reading_part_idx",
    "DROP INDEX reading_received_idx",
)


def upgrade() -> None:
    for command in INDEXES + CONTEXT + CHARACTERISTICS:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
