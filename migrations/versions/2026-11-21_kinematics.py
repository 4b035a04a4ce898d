"""Kinematics of machines, runs of the preset compensation, back-ups.

Revision ID: 0017
Revises: 0016
Create Date: 2026-11-21
"""

from alembic import op

revision = "0017"
down_revision: str | None = "0016"
branch_labels = None
depends_on = None

TABLES = """
CREATE SEQUENCE kinematics_run_id;

CREATE TABLE kinematics_run (
    machine_id INTEGER NOT NULL,
    id BIGINT DEFAULT nextval('kinematics_run_id') NOT NULL,
    form TEXT NOT NULL,
    head TEXT DEFAULT '' NOT NULL,
    measured_at timestamptz NOT NULL,
    received_at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    key TEXT,
    given JSONB NOT NULL,
    limits JSONB NOT NULL,
    outcome TEXT NOT NULL,
    reason JSONB NOT NULL,
    results JSONB NOT NULL,
    in_effect JSONB NOT NULL,
    version INTEGER NOT NULL,
    CONSTRAINT kinematics_run_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT kinematics_run_form_check CHECK (form IN ('touches', 'centres', 'results', 'protocol')),
    CONSTRAINT kinematics_run_outcome_check CHECK (outcome IN ('measured', 'too_large', 'refused')),
    CONSTRAINT kinematics_run_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX kinematics_run_id_key ON kinematics_run (id);

CREATE INDEX kinematics_run_measured_idx ON kinematics_run (machine_id, measured_at, id);

CREATE UNIQUE INDEX kinematics_run_key_key ON kinematics_run (machine_id, key) WHERE key IS NOT NULL;

CREATE TABLE kinematics_decision (
    machine_id INTEGER NOT NULL,
    run BIGINT NOT NULL,
    what TEXT NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    CONSTRAINT kinematics_decision_pkey PRIMARY KEY (machine_id, run, what),
    CONSTRAINT kinematics_decision_what_check CHECK (what IN ('confirmed', 'entered')),
    CONSTRAINT kinematics_decision_machine_id_run_fkey FOREIGN KEY(machine_id, run)
        REFERENCES kinematics_run (machine_id, id)
);

CREATE TABLE kinematics_backup (
    machine_id INTEGER NOT NULL,
    version INTEGER NOT NULL,
    head TEXT DEFAULT '' NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    since timestamptz NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    errors JSONB NOT NULL,
    run BIGINT,
    restores INTEGER,
    CONSTRAINT kinematics_backup_pkey PRIMARY KEY (machine_id, version),
    CONSTRAINT kinematics_backup_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE TABLE kinematics_plan (
    machine_id INTEGER NOT NULL,
    ball_radius double precision,
    max_modification double precision,
    max_modification_angle double precision,
    max_dev_cal_ball double precision,
    reference_head TEXT,
    limits JSONB DEFAULT '{}' NOT NULL,
    characteristics JSONB DEFAULT '{}' NOT NULL,
    CONSTRAINT kinematics_plan_pkey PRIMARY KEY (machine_id),
    CONSTRAINT kinematics_plan_ball_radius_check CHECK (ball_radius > 0),
    CONSTRAINT kinematics_plan_max_modification_check CHECK (max_modification > 0),
    CONSTRAINT kinematics_plan_max_modification_angle_check CHECK (max_modification_angle > 0),
    CONSTRAINT kinematics_plan_max_dev_cal_ball_check CHECK (max_dev_cal_ball > 0),
    CONSTRAINT kinematics_plan_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);
"""

# What was measured, decided and backed up stays as it was.
APPEND_ONLY = """
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON kinematics_run
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON kinematics_decision
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON kinematics_backup
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
"""


def upgrade() -> None:
    op.execute(TABLES)
    op.execute(APPEND_ONLY)


def downgrade() -> None:
    op.execute("DROP TABLE kinematics_plan, kinematics_backup, kinematics_decision, kinematics_run")
    op.execute("DROP SEQUENCE kinematics_run_id")
