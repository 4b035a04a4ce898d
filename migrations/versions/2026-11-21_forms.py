"""Form measurements with their touches.

Revision ID: 0015
Revises: 0014
Create Date: 2026-11-21
"""

from alembic import op

revision = "0015"
down_revision: str | None = "0014"
branch_labels = None
depends_on = None

TABLES = """
CREATE SEQUENCE form_id;

CREATE TABLE form_measurement (
    machine_id INTEGER NOT NULL,
    id BIGINT DEFAULT nextval('form_id') NOT NULL,
    feature TEXT NOT NULL,
    kind TEXT NOT NULL,
    part TEXT,
    measured_at timestamptz NOT NULL,
    received_at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    key TEXT,
    given JSONB NOT NULL,
    method TEXT,
    tolerance double precision,
    repeatability double precision,
    characteristic_id INTEGER,
    CONSTRAINT form_measurement_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT form_measurement_tolerance_check CHECK (tolerance >= 0),
    CONSTRAINT form_measurement_repeatability_check CHECK (repeatability >= 0),
    CONSTRAINT form_measurement_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX form_measurement_id_key ON form_measurement (id);

CREATE INDEX form_measurement_feature_idx ON form_measurement (machine_id, feature, kind, id);

CREATE UNIQUE INDEX form_measurement_key_key ON form_measurement (machine_id, key) WHERE key IS NOT NULL;

CREATE TABLE form_evaluation (
    machine_id INTEGER NOT NULL,
    form_id BIGINT NOT NULL,
    number INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    engine INTEGER NOT NULL,
    method TEXT NOT NULL,
    value double precision NOT NULL,
    uncertainty double precision,
    verdict TEXT,
    suspects INTEGER NOT NULL,
    result JSONB NOT NULL,
    CONSTRAINT form_evaluation_pkey PRIMARY KEY (machine_id, form_id, number),
    CONSTRAINT form_evaluation_machine_id_form_id_fkey FOREIGN KEY(machine_id, form_id)
        REFERENCES form_measurement (machine_id, id)
);
"""

# Like the record of changes: what was touched, and what was found in it, stays as it was.
APPEND_ONLY = """
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON form_measurement
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON form_evaluation
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
"""


def upgrade() -> None:
    op.execute(TABLES)
    op.execute(APPEND_ONLY)


def downgrade() -> None:
    op.execute("DROP TABLE form_evaluation, form_measurement")
    op.execute("DROP SEQUENCE form_id")
