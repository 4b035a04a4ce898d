"""Gauge studies with all their values, and every revision of them.

Revision ID: 0014
Revises: 0013
Create Date: 2026-11-21
"""

from alembic import op

revision = "0014"
down_revision: str | None = "0013"
branch_labels = None
depends_on = None

TABLES = """
CREATE TABLE gauge_study (
    machine_id INTEGER NOT NULL,
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    kind TEXT NOT NULL,
    characteristic_id INTEGER,
    key TEXT,
    created_at timestamptz DEFAULT now() NOT NULL,
    created_by TEXT NOT NULL,
    CONSTRAINT gauge_study_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT gauge_study_kind_check CHECK (kind IN ('type_one', 'bias', 'linearity', 'grr')),
    CONSTRAINT gauge_study_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id),
    CONSTRAINT gauge_study_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);

CREATE UNIQUE INDEX gauge_study_id_key ON gauge_study (id);

CREATE UNIQUE INDEX gauge_study_key_key ON gauge_study (machine_id, key) WHERE key IS NOT NULL;

CREATE TABLE gauge_study_revision (
    machine_id INTEGER NOT NULL,
    study_id BIGINT NOT NULL,
    revision INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT,
    settings JSONB NOT NULL,
    rows JSONB NOT NULL,
    CONSTRAINT gauge_study_revision_pkey PRIMARY KEY (machine_id, study_id, revision),
    CONSTRAINT gauge_study_revision_machine_id_study_id_fkey FOREIGN KEY(machine_id, study_id)
        REFERENCES gauge_study (machine_id, id)
);
"""

# What was measured stays as it was; a correction is a revision of its own.
APPEND_ONLY = """
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON gauge_study
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON gauge_study_revision
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
"""


def upgrade() -> None:
    op.execute(TABLES)
    op.execute(APPEND_ONLY)


def downgrade() -> None:
    op.execute("DROP TABLE gauge_study_revision, gauge_study")
