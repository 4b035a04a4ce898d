"""Control baselines, frozen on purpose.

Revision ID: 0010
Revises: 0009
Create Date: 2026-11-21
"""

from alembic import op

revision = "0010"
down_revision: str | None = "0009"
branch_labels = None
depends_on = None

TABLES = """
CREATE TABLE baseline (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    version INTEGER NOT NULL,
    key TEXT,
    chart TEXT NOT NULL,
    quantity TEXT NOT NULL,
    grouping TEXT,
    group_size INTEGER,
    group_pause double precision,
    ewma_lambda double precision NOT NULL,
    ewma_width double precision NOT NULL,
    ewma_exact BOOLEAN NOT NULL,
    cusum_k double precision NOT NULL,
    cusum_h double precision NOT NULL,
    cusum_headstart double precision NOT NULL,
    average_span INTEGER NOT NULL,
    first_sequence BIGINT NOT NULL,
    last_sequence BIGINT NOT NULL,
    excluded JSONB NOT NULL,
    centre double precision NOT NULL,
    sigma double precision NOT NULL,
    estimator TEXT NOT NULL,
    freedom double precision NOT NULL,
    readings INTEGER NOT NULL,
    groups INTEGER NOT NULL,
    factor double precision NOT NULL,
    slope double precision,
    slope_error double precision,
    settle INTEGER,
    signals INTEGER NOT NULL,
    normal_p double precision,
    repeats INTEGER,
    parameters_version INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    retired_at timestamptz,
    retired_by TEXT,
    retired_why TEXT,
    CONSTRAINT baseline_pkey PRIMARY KEY (machine_id, characteristic_id, version),
    CONSTRAINT baseline_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id),
    CONSTRAINT baseline_chart_check CHECK (chart IN ('individuals', 'xbar_r', 'xbar_s')),
    CONSTRAINT baseline_quantity_check
        CHECK (quantity IN ('deviation', 'without_corrections', 'differences', 'wear_residuals')),
    CONSTRAINT baseline_numbers_check CHECK (sigma > 0 AND first_sequence <= last_sequence)
);

CREATE UNIQUE INDEX baseline_key_key ON baseline (machine_id, characteristic_id, key) WHERE key IS NOT NULL;
"""


def upgrade() -> None:
    op.execute(TABLES)


def downgrade() -> None:
    op.execute("DROP TABLE baseline")
