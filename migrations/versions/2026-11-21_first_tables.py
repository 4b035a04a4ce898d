"""The first tables.

Written as SQL, because that is what a database administrator reads. Later migrations may use `op`.

Revision ID: 0001
Revises:
Create Date: 2026-11-21
"""

from alembic import op

revision = "0001"
down_revision: str | None = None
branch_labels = None
depends_on = None

TABLES = """
CREATE SEQUENCE alarm_id;

CREATE TABLE audit_entry (
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    action TEXT NOT NULL,
    subject TEXT NOT NULL,
    before JSONB,
    after JSONB,
    why TEXT,
    CONSTRAINT audit_entry_pkey PRIMARY KEY (id)
);

CREATE INDEX audit_entry_subject_idx ON audit_entry (subject, id);

CREATE TABLE event (
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    at timestamptz DEFAULT now() NOT NULL,
    changes JSONB NOT NULL,
    CONSTRAINT event_pkey PRIMARY KEY (id)
);

CREATE TABLE machine (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    key TEXT NOT NULL,
    name TEXT NOT NULL,
    control TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT machine_pkey PRIMARY KEY (id),
    CONSTRAINT machine_control_check CHECK (control IN ('sinumerik', 'fanuc', 'heidenhain', 'other')),
    CONSTRAINT machine_key_key UNIQUE (key)
);

CREATE TABLE person (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    name TEXT NOT NULL,
    role TEXT NOT NULL,
    password_hash TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    disabled_at timestamptz,
    CONSTRAINT person_pkey PRIMARY KEY (id),
    CONSTRAINT person_role_check CHECK (role IN ('viewer', 'operator', 'engineer', 'admin'))
);

CREATE UNIQUE INDEX person_name_key ON person (lower(name));

CREATE TABLE invitation (
    token_hash BYTEA NOT NULL,
    role TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    expires_at timestamptz NOT NULL,
    used_at timestamptz,
    CONSTRAINT invitation_pkey PRIMARY KEY (token_hash),
    CONSTRAINT invitation_role_check CHECK (role IN ('viewer', 'operator', 'engineer', 'admin'))
);

CREATE TABLE login_failure (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    name TEXT NOT NULL,
    address TEXT NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT login_failure_pkey PRIMARY KEY (id)
);

CREATE INDEX login_failure_at_idx ON login_failure (at);

CREATE TABLE reading (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    measured double precision NOT NULL,
    deviation double precision NOT NULL,
    decided double precision NOT NULL,
    average_before double precision NOT NULL,
    average_after double precision NOT NULL,
    measured_at timestamptz NOT NULL,
    received_at timestamptz NOT NULL,
    machined_at timestamptz,
    parameters_version INTEGER NOT NULL,
    correction_in_effect INTEGER,
    correction INTEGER,
    paused_by BIGINT,
    late BOOLEAN NOT NULL,
    zone TEXT NOT NULL,
    action TEXT NOT NULL,
    code TEXT NOT NULL,
    key TEXT,
    part TEXT,
    outstanding INTEGER[],
    alarms BIGINT[],
    CONSTRAINT reading_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
);

CREATE UNIQUE INDEX reading_key_key ON reading (machine_id, characteristic_id, key) WHERE key IS NOT NULL;

CREATE TABLE reading_touches (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    touches JSONB NOT NULL,
    CONSTRAINT reading_touches_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
);

CREATE TABLE exclusion (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    CONSTRAINT exclusion_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
);

CREATE TABLE reading_summary (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    level SMALLINT NOT NULL,
    block BIGINT NOT NULL,
    count INTEGER NOT NULL,
    minimum double precision NOT NULL,
    maximum double precision NOT NULL,
    sum double precision NOT NULL,
    sum_squares double precision NOT NULL,
    first double precision NOT NULL,
    last double precision NOT NULL,
    average double precision NOT NULL,
    corrections INTEGER NOT NULL,
    zones INTEGER[] NOT NULL,
    first_at timestamptz NOT NULL,
    last_at timestamptz NOT NULL,
    CONSTRAINT reading_summary_pkey PRIMARY KEY (machine_id, characteristic_id, level, block)
);

CREATE TABLE alarm (
    machine_id INTEGER NOT NULL,
    id BIGINT DEFAULT nextval('alarm_id') NOT NULL,
    kind TEXT NOT NULL,
    characteristic_id INTEGER,
    tool_memory INTEGER,
    raised_at timestamptz DEFAULT now() NOT NULL,
    last_at timestamptz DEFAULT now() NOT NULL,
    count INTEGER DEFAULT '1' NOT NULL,
    sequence BIGINT,
    last_sequence BIGINT,
    data JSONB DEFAULT '{}' NOT NULL,
    acknowledged_at timestamptz,
    acknowledged_by TEXT,
    action TEXT,
    comment TEXT,
    outcome JSONB,
    CONSTRAINT alarm_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT alarm_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE UNIQUE INDEX alarm_active_tool_key ON alarm (machine_id, tool_memory, kind) WHERE acknowledged_at IS NULL AND characteristic_id IS NULL;

CREATE UNIQUE INDEX alarm_active_characteristic_key ON alarm (machine_id, characteristic_id, kind) WHERE acknowledged_at IS NULL AND characteristic_id IS NOT NULL;

CREATE INDEX alarm_id_key ON alarm (id);

CREATE TABLE characteristic (
    machine_id INTEGER NOT NULL,
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    key TEXT NOT NULL,
    name TEXT NOT NULL,
    part TEXT,
    unit TEXT DEFAULT 'mm' NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT characteristic_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT characteristic_unit_check CHECK (unit = 'mm'),
    CONSTRAINT characteristic_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id),
    CONSTRAINT characteristic_key_key UNIQUE (key)
);

CREATE TABLE machine_state (
    machine_id INTEGER NOT NULL,
    last_correction INTEGER DEFAULT '0' NOT NULL,
    CONSTRAINT machine_state_pkey PRIMARY KEY (machine_id),
    CONSTRAINT machine_state_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
)
 WITH (fillfactor = 50);

CREATE TABLE tool (
    machine_id INTEGER NOT NULL,
    number INTEGER NOT NULL,
    "offset" double precision DEFAULT '0' NOT NULL,
    total double precision DEFAULT '0' NOT NULL,
    changed_at timestamptz,
    reset_at timestamptz,
    CONSTRAINT tool_pkey PRIMARY KEY (machine_id, number),
    CONSTRAINT tool_number_check CHECK (number BETWEEN 1 AND 32),
    CONSTRAINT tool_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE TABLE tool_event (
    machine_id INTEGER NOT NULL,
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    number INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    kind TEXT NOT NULL,
    offset_before double precision NOT NULL,
    offset_after double precision NOT NULL,
    correction INTEGER,
    parts INTEGER,
    actor TEXT NOT NULL,
    reason TEXT,
    CONSTRAINT tool_event_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT tool_event_kind_check CHECK (kind IN ('change', 'edit', 'correction')),
    CONSTRAINT tool_event_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX tool_event_tool_idx ON tool_event (machine_id, number, id);

CREATE TABLE average_memory (
    machine_id INTEGER NOT NULL,
    location INTEGER NOT NULL,
    average double precision DEFAULT '0' NOT NULL,
    empirical_value double precision DEFAULT '0' NOT NULL,
    updated_at timestamptz,
    CONSTRAINT average_memory_pkey PRIMARY KEY (machine_id, location),
    CONSTRAINT average_memory_location_check CHECK (location BETWEEN 1 AND 20),
    CONSTRAINT average_memory_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
)
 WITH (fillfactor = 50);

CREATE TABLE correction (
    machine_id INTEGER NOT NULL,
    number INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    tool_memory INTEGER NOT NULL,
    size_error double precision NOT NULL,
    amount double precision NOT NULL,
    status TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    decided_at timestamptz,
    decided_by TEXT,
    reason TEXT,
    superseded_by INTEGER,
    applied_at timestamptz,
    applied_by TEXT,
    offset_after double precision,
    CONSTRAINT correction_pkey PRIMARY KEY (machine_id, number),
    CONSTRAINT correction_status_check CHECK (status IN ('held', 'awaiting_approval', 'pending', 'applied', 'rejected', 'superseded')),
    CONSTRAINT correction_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX correction_tool_idx ON correction (machine_id, tool_memory, number);

CREATE INDEX correction_open_idx ON correction (machine_id, tool_memory) WHERE status IN ('held', 'awaiting_approval', 'pending');

CREATE INDEX correction_applied_idx ON correction (machine_id, tool_memory, applied_at) WHERE status = 'applied';

CREATE INDEX correction_reading_idx ON correction (machine_id, characteristic_id, sequence);

CREATE TABLE browser_session (
    token_hash BYTEA NOT NULL,
    person_id INTEGER NOT NULL,
    csrf TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    expires_at timestamptz NOT NULL,
    CONSTRAINT browser_session_pkey PRIMARY KEY (token_hash),
    CONSTRAINT browser_session_person_id_fkey FOREIGN KEY(person_id) REFERENCES person (id)
);

CREATE INDEX browser_session_person_id_idx ON browser_session (person_id);

CREATE TABLE api_key (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    secret_hash BYTEA NOT NULL,
    name TEXT NOT NULL,
    role TEXT,
    machine_id INTEGER,
    created_at timestamptz DEFAULT now() NOT NULL,
    revoked_at timestamptz,
    CONSTRAINT api_key_pkey PRIMARY KEY (id),
    CONSTRAINT api_key_role_or_machine_check CHECK ((role IS NULL) <> (machine_id IS NULL)),
    CONSTRAINT api_key_role_check CHECK (role IS NULL OR role IN ('viewer', 'operator', 'engineer', 'admin')),
    CONSTRAINT api_key_secret_hash_key UNIQUE (secret_hash),
    CONSTRAINT api_key_machine_id_fkey FOREIGN KEY(machine_id) REFERENCES machine (id)
);

CREATE INDEX api_key_machine_id_idx ON api_key (machine_id);

CREATE TABLE parameters_version (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    version INTEGER NOT NULL,
    parameters JSONB NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    created_by TEXT NOT NULL,
    reason TEXT,
    CONSTRAINT parameters_version_pkey PRIMARY KEY (machine_id, characteristic_id, version),
    CONSTRAINT parameters_version_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id) REFERENCES characteristic (machine_id, id)
);

CREATE TABLE stream (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT DEFAULT '0' NOT NULL,
    parameters_version INTEGER NOT NULL,
    tool_memory INTEGER NOT NULL,
    average_memory INTEGER NOT NULL,
    paused_by BIGINT,
    sequence_at_tool_change BIGINT DEFAULT '0' NOT NULL,
    last_measured_at timestamptz,
    last_received_at timestamptz,
    last_measured double precision,
    last_deviation double precision,
    last_average double precision,
    last_zone TEXT,
    CONSTRAINT stream_pkey PRIMARY KEY (machine_id, characteristic_id),
    CONSTRAINT stream_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id) REFERENCES characteristic (machine_id, id)
)
 WITH (fillfactor = 50);
"""

# The record of changes is written once. Whoever owns the database can still drop the trigger;
# nobody alters the record by accident or through Inband.
APPEND_ONLY = """
CREATE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    RAISE EXCEPTION 'the table % is append-only', TG_TABLE_NAME;
END
$$;
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON audit_entry
    FOR EACH STATEMENT EXECUTE FUNCTION refuse_change();
"""


def upgrade() -> None:
    op.execute(TABLES)
    op.execute(APPEND_ONLY)


def downgrade() -> None:
    raise NotImplementedError("There is nothing before the first tables: drop the database instead.")
