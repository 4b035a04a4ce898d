"""Work zeros and alignments with their touches, fixtures, and results that become readings.

Revision ID: 0016
Revises: 0015
Create Date: 2026-11-21
"""

from alembic import op

revision = "0016"
down_revision: str | None = "0015"
branch_labels = None
depends_on = None

TABLES = """
CREATE TABLE result_reading (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    key TEXT NOT NULL,
    measured double precision NOT NULL,
    measured_at timestamptz NOT NULL,
    part TEXT,
    asked_at timestamptz DEFAULT now() NOT NULL,
    sequence BIGINT,
    refused TEXT,
    CONSTRAINT result_reading_pkey PRIMARY KEY (machine_id, characteristic_id, key),
    CONSTRAINT result_reading_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);

CREATE INDEX result_reading_waiting_idx ON result_reading (machine_id)
    WHERE sequence IS NULL AND refused IS NULL;

CREATE INDEX result_reading_key_idx ON result_reading (key);

CREATE SEQUENCE work_zero_id;

CREATE TABLE work_zero (
    machine_id INTEGER NOT NULL,
    id BIGINT DEFAULT nextval('work_zero_id') NOT NULL,
    kind TEXT NOT NULL,
    fixture TEXT,
    work_offset TEXT NOT NULL,
    part TEXT,
    touched_at timestamptz NOT NULL,
    received_at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    key TEXT,
    given JSONB NOT NULL,
    x double precision,
    y double precision,
    z double precision,
    rotation double precision,
    diameter double precision,
    length double precision,
    width double precision,
    result JSONB NOT NULL,
    recomputed_from BIGINT,
    CONSTRAINT work_zero_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT work_zero_kind_check CHECK (kind IN ('bore', 'boss', 'pocket', 'web', 'corner')),
    CONSTRAINT work_zero_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX work_zero_id_key ON work_zero (id);

CREATE INDEX work_zero_fixture_idx ON work_zero (machine_id, fixture, id);

CREATE UNIQUE INDEX work_zero_key_key ON work_zero (machine_id, key) WHERE key IS NOT NULL;

CREATE TABLE fixture (
    machine_id INTEGER NOT NULL,
    key TEXT NOT NULL,
    basis TEXT DEFAULT 'first' NOT NULL,
    reference BIGINT,
    warning double precision,
    alarm double precision,
    characteristics JSONB DEFAULT '{}' NOT NULL,
    CONSTRAINT fixture_pkey PRIMARY KEY (machine_id, key),
    CONSTRAINT fixture_basis_check CHECK (basis IN ('first', 'median', 'frozen')),
    CONSTRAINT fixture_warning_check CHECK (warning > 0),
    CONSTRAINT fixture_alarm_check CHECK (alarm > 0),
    CONSTRAINT fixture_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE SEQUENCE alignment_id;

CREATE TABLE alignment (
    machine_id INTEGER NOT NULL,
    id BIGINT DEFAULT nextval('alignment_id') NOT NULL,
    kind TEXT NOT NULL,
    method TEXT NOT NULL,
    name TEXT,
    part TEXT,
    aligned_at timestamptz NOT NULL,
    received_at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    key TEXT,
    given JSONB NOT NULL,
    result JSONB NOT NULL,
    pallet_id BIGINT,
    part_id BIGINT,
    recomputed_from BIGINT,
    CONSTRAINT alignment_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT alignment_kind_check CHECK (kind IN ('two_points', 'two_holes', 'points', 'pallet')),
    CONSTRAINT alignment_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX alignment_id_key ON alignment (id);

CREATE UNIQUE INDEX alignment_key_key ON alignment (machine_id, key) WHERE key IS NOT NULL;
"""

# What was touched and what followed from it stays as it was; a recomputation is another row.
APPEND_ONLY = """
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON work_zero
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON alignment
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
"""


def upgrade() -> None:
    op.execute(TABLES)
    op.execute(APPEND_ONLY)


def downgrade() -> None:
    op.execute("DROP TABLE alignment, fixture, work_zero, result_reading")
    op.execute("DROP SEQUENCE alignment_id, work_zero_id")
