"""Calibrations, paired readings against an external gauge, and when the next calibration is due.

Revision ID: 0005
Revises: 0004
Create Date: 2026-11-21
"""

from alembic import op

revision = "0005"
down_revision: str | None = "0004"
branch_labels = None
depends_on = None

TABLES = """
CREATE TABLE calibration (
    machine_id INTEGER NOT NULL,
    number INTEGER NOT NULL,
    kind TEXT NOT NULL,
    memory TEXT NOT NULL,
    location INTEGER NOT NULL,
    calibrated_at timestamptz NOT NULL,
    received_at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    key TEXT,
    outcome TEXT NOT NULL,
    refused BOOLEAN NOT NULL,
    settings JSONB NOT NULL,
    touches JSONB NOT NULL,
    size double precision,
    measured double precision,
    difference double precision,
    average double precision,
    value_before double precision NOT NULL,
    proposed double precision,
    CONSTRAINT calibration_pkey PRIMARY KEY (machine_id, number),
    CONSTRAINT calibration_kind_check CHECK (kind IN ('gauge', 'ring', 'pairs')),
    CONSTRAINT calibration_memory_check CHECK (memory IN ('average', 'tool')),
    CONSTRAINT calibration_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX calibration_place_idx ON calibration (machine_id, memory, location, number);

CREATE UNIQUE INDEX calibration_key_key ON calibration (machine_id, key) WHERE key IS NOT NULL;

CREATE TABLE calibration_acceptance (
    machine_id INTEGER NOT NULL,
    number INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    automatic BOOLEAN NOT NULL,
    CONSTRAINT calibration_acceptance_pkey PRIMARY KEY (machine_id, number),
    CONSTRAINT calibration_acceptance_machine_id_number_fkey FOREIGN KEY(machine_id, number)
        REFERENCES calibration (machine_id, number)
);

CREATE TABLE calibration_plan (
    machine_id INTEGER NOT NULL,
    memory TEXT NOT NULL,
    location INTEGER NOT NULL,
    due_parts INTEGER,
    due_days double precision,
    acceptance TEXT DEFAULT 'accept' NOT NULL,
    since timestamptz DEFAULT now() NOT NULL,
    counts JSONB DEFAULT '{}' NOT NULL,
    told BOOLEAN DEFAULT 'false' NOT NULL,
    CONSTRAINT calibration_plan_pkey PRIMARY KEY (machine_id, memory, location),
    CONSTRAINT calibration_plan_memory_check CHECK (memory IN ('average', 'tool')),
    CONSTRAINT calibration_plan_acceptance_check CHECK (acceptance IN ('accept', 'automatic')),
    CONSTRAINT calibration_plan_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE TABLE paired_reading (
    machine_id INTEGER NOT NULL,
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    location INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    key TEXT,
    machine_value double precision NOT NULL,
    true_value double precision NOT NULL,
    instrument TEXT NOT NULL,
    characteristic_id INTEGER,
    sequence BIGINT,
    excluded_at timestamptz,
    excluded_by TEXT,
    excluded_why TEXT,
    CONSTRAINT paired_reading_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT paired_reading_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX paired_reading_place_idx ON paired_reading (machine_id, location, id);

CREATE UNIQUE INDEX paired_reading_key_key ON paired_reading (machine_id, key) WHERE key IS NOT NULL;
"""

# Like the record of changes: what was calibrated stays as it was.
APPEND_ONLY = """
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON calibration
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON calibration_acceptance
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
"""


def upgrade() -> None:
    op.execute(TABLES)
    op.execute(APPEND_ONLY)


def downgrade() -> None:
    op.execute("DROP TABLE paired_reading, calibration_plan, calibration_acceptance, calibration")
