"""First schema.

Written as SQL, because a database administrator reads SQL. Tables stand in the order of the rooms of app/__init__.py, from the
ground up, except that the loop is first: the other rooms refer to its machines and characteristics. It is the outcome, column
for column, of the revisions 0001 to 0018 of the first program that was published (app.db.migrate.SQUASHED).

Revision ID: 0100
Revises:
Create Date: 2026-11-22
"""

from alembic import op

revision = "0100"
down_revision: str | None = None
branch_labels = None
depends_on = None

LOOP = """
-- A machine tool; its key is its name in addresses and readings.
CREATE TABLE machine (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    key TEXT NOT NULL,
    name TEXT NOT NULL,
    control TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    signal_path TEXT DEFAULT 'direct' NOT NULL,
    signal_delay double precision DEFAULT '0.25' NOT NULL,
    signal_jitter double precision,
    probing_feed double precision DEFAULT '150' NOT NULL,
    corrections_expire_after double precision,
    CONSTRAINT machine_pkey PRIMARY KEY (id),
    CONSTRAINT machine_control_check CHECK (control IN ('sinumerik', 'fanuc', 'heidenhain', 'other')),
    CONSTRAINT machine_corrections_expire_after_check CHECK (corrections_expire_after > 0),
    CONSTRAINT machine_signal_path_check CHECK (signal_path IN ('direct', 'plc')),
    CONSTRAINT machine_key_key UNIQUE (key)
);

-- The lock of a machine: whoever changes anything on it holds this row. The version moves with every change, so that what
-- is held in memory can be known to be true. Half of each page stays free: an update then touches no index.
CREATE TABLE machine_state (
    machine_id INTEGER NOT NULL,
    last_correction INTEGER DEFAULT 0 NOT NULL,
    version BIGINT DEFAULT 0 NOT NULL,
    CONSTRAINT machine_state_pkey PRIMARY KEY (machine_id),
    CONSTRAINT machine_state_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
) WITH (fillfactor = 50);

-- A dimension of a part that one machine cuts and measures.
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
    CONSTRAINT characteristic_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id),
    CONSTRAINT characteristic_key_key UNIQUE (key)
);

-- A parameter set as it was from one moment on; never altered, because readings were judged by it.
CREATE TABLE parameters_version (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    version INTEGER NOT NULL,
    parameters JSONB NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    created_by TEXT NOT NULL,
    reason TEXT,
    CONSTRAINT parameters_version_pkey PRIMARY KEY (machine_id, characteristic_id, version),
    CONSTRAINT parameters_version_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);

-- The running state of one characteristic, changed only under its machine's lock.
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
    level double precision,
    level_sequence BIGINT,
    CONSTRAINT stream_pkey PRIMARY KEY (machine_id, characteristic_id),
    CONSTRAINT stream_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
) WITH (fillfactor = 50);

-- One probe reading with the decision on it, mm. No foreign keys: the door has looked, and a check of each row costs it.
-- compensated is NULL where it is not known with which corrections the part was cut; the wear curve leaves such readings
-- out.
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
    compensated double precision,
    CONSTRAINT reading_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
);
CREATE UNIQUE INDEX reading_key_key ON reading (machine_id, characteristic_id, key) WHERE key IS NOT NULL;

-- The single touches of a reading that came as touches: rarer than readings, so in a table of their own.
CREATE TABLE reading_touches (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    touches JSONB NOT NULL,
    CONSTRAINT reading_touches_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
);

-- Results of a measuring variant beside its value; only for readings that have any.
CREATE TABLE reading_results (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    run_out double precision,
    out_of_roundness double precision,
    taper double precision,
    slope double precision,
    repeat_range double precision,
    repeat_deviation double precision,
    sections_outside SMALLINT,
    rejected BOOLEAN,
    CONSTRAINT reading_results_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
);
CREATE INDEX reading_results_outside_idx ON reading_results (machine_id, characteristic_id, sequence)
    INCLUDE (sections_outside, rejected)
    WHERE sections_outside > 0;

-- Measured by a person on the part of a reading; it replaces no value of the machine.
CREATE TABLE hand_measurement (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    measured double precision,
    good BOOLEAN,
    comment TEXT,
    alarm BIGINT,
    CONSTRAINT hand_measurement_pkey PRIMARY KEY (machine_id, characteristic_id, sequence, id),
    CONSTRAINT hand_measurement_something_check CHECK (measured IS NOT NULL OR good IS NOT NULL),
    CONSTRAINT hand_measurement_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);

-- A reading taken out of the statistics, never out of the record.
CREATE TABLE exclusion (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    CONSTRAINT exclusion_pkey PRIMARY KEY (machine_id, characteristic_id, sequence)
);

-- A result of another measuring system that is to become a reading, and what became of it. Neither sequence nor refused: it
-- waits.
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
    CONSTRAINT result_reading_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);
CREATE INDEX result_reading_waiting_idx ON result_reading (machine_id) WHERE sequence IS NULL AND refused IS NULL;
CREATE INDEX result_reading_key_idx ON result_reading (key);

-- Something that needs a person, active until acknowledged. The unique indexes let one kind be active once per place; the
-- board and the writer look for the few active ones among all there ever were.
CREATE SEQUENCE alarm_id;
CREATE TABLE alarm (
    machine_id INTEGER NOT NULL,
    id BIGINT DEFAULT nextval('alarm_id') NOT NULL,
    kind TEXT NOT NULL,
    characteristic_id INTEGER,
    tool_memory INTEGER,
    raised_at timestamptz DEFAULT now() NOT NULL,
    last_at timestamptz DEFAULT now() NOT NULL,
    count INTEGER DEFAULT 1 NOT NULL,
    sequence BIGINT,
    last_sequence BIGINT,
    data JSONB DEFAULT '{}' NOT NULL,
    acknowledged_at timestamptz,
    acknowledged_by TEXT,
    action TEXT,
    comment TEXT,
    outcome JSONB,
    CONSTRAINT alarm_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT alarm_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX alarm_active_idx ON alarm (machine_id, id) WHERE acknowledged_at IS NULL;
CREATE INDEX alarm_acknowledged_idx ON alarm (acknowledged_at, id) WHERE acknowledged_at IS NOT NULL;
CREATE INDEX alarm_characteristic_idx ON alarm (machine_id, characteristic_id, id);
CREATE UNIQUE INDEX alarm_active_tool_key ON alarm (machine_id, tool_memory, kind)
    WHERE acknowledged_at IS NULL AND characteristic_id IS NULL;
CREATE UNIQUE INDEX alarm_active_characteristic_key ON alarm (machine_id, characteristic_id, kind)
    WHERE acknowledged_at IS NULL AND characteristic_id IS NOT NULL;
CREATE INDEX alarm_id_key ON alarm (id);

-- One location of the tool memory (R10): the offset that the control is known to hold.
CREATE TABLE tool (
    machine_id INTEGER NOT NULL,
    number INTEGER NOT NULL,
    "offset" double precision DEFAULT '0' NOT NULL,
    total double precision DEFAULT '0' NOT NULL,
    changed_at timestamptz,
    reset_at timestamptz,
    paused_by BIGINT,
    parts_kept INTEGER DEFAULT 0 NOT NULL,
    edge TEXT,
    name TEXT,
    kind TEXT,
    planned_parts INTEGER,
    planned_total double precision,
    sister INTEGER,
    life_told BOOLEAN DEFAULT false NOT NULL,
    CONSTRAINT tool_pkey PRIMARY KEY (machine_id, number),
    CONSTRAINT tool_number_check CHECK (number BETWEEN 1 AND 32),
    CONSTRAINT tool_sister_check CHECK (sister BETWEEN 1 AND 32 AND sister <> number),
    CONSTRAINT tool_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);

-- A step of an offset. The charts look for the few changes among the many corrections.
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
    total double precision,
    edge TEXT,
    name TEXT,
    CONSTRAINT tool_event_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT tool_event_kind_check CHECK (kind IN ('change', 'edit', 'correction')),
    CONSTRAINT tool_event_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX tool_event_change_idx ON tool_event (machine_id, number, id) WHERE kind <> 'correction';
CREATE INDEX tool_event_tool_idx ON tool_event (machine_id, number, id);

-- One location of the average memory (R11).
CREATE TABLE average_memory (
    machine_id INTEGER NOT NULL,
    location INTEGER NOT NULL,
    average double precision DEFAULT '0' NOT NULL,
    empirical_value double precision DEFAULT '0' NOT NULL,
    updated_at timestamptz,
    CONSTRAINT average_memory_pkey PRIMARY KEY (machine_id, location),
    CONSTRAINT average_memory_location_check CHECK (location BETWEEN 1 AND 20),
    CONSTRAINT average_memory_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
) WITH (fillfactor = 50);

-- A change of a tool offset, from the reading that asked for it to the machine that made it.
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
    fetched_at timestamptz,
    fetched_by TEXT,
    fetched_as TEXT,
    CONSTRAINT correction_pkey PRIMARY KEY (machine_id, number),
    CONSTRAINT correction_status_check
        CHECK (status IN ('held', 'awaiting_approval', 'pending', 'applied', 'rejected', 'superseded')),
    CONSTRAINT correction_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX correction_tool_idx ON correction (machine_id, tool_memory, number);
CREATE INDEX correction_open_idx ON correction (machine_id, tool_memory)
    WHERE status IN ('held', 'awaiting_approval', 'pending');
CREATE INDEX correction_applied_idx ON correction (machine_id, tool_memory, applied_at) WHERE status = 'applied';
CREATE INDEX correction_reading_idx ON correction (machine_id, characteristic_id, sequence);

-- One calibration as it came out, refused ones too.
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
    CONSTRAINT calibration_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX calibration_place_idx ON calibration (machine_id, memory, location, number);
CREATE UNIQUE INDEX calibration_key_key ON calibration (machine_id, key) WHERE key IS NOT NULL;

-- What a calibration proposed has come into effect.
CREATE TABLE calibration_acceptance (
    machine_id INTEGER NOT NULL,
    number INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    automatic BOOLEAN NOT NULL,
    CONSTRAINT calibration_acceptance_pkey PRIMARY KEY (machine_id, number),
    CONSTRAINT calibration_acceptance_machine_id_number_fkey FOREIGN KEY (machine_id, number)
        REFERENCES calibration (machine_id, number)
);

-- How often a place is to be calibrated, and what has passed since it was.
CREATE TABLE calibration_plan (
    machine_id INTEGER NOT NULL,
    memory TEXT NOT NULL,
    location INTEGER NOT NULL,
    due_parts INTEGER,
    due_days double precision,
    acceptance TEXT DEFAULT 'accept' NOT NULL,
    since timestamptz DEFAULT now() NOT NULL,
    counts JSONB DEFAULT '{}' NOT NULL,
    told BOOLEAN DEFAULT false NOT NULL,
    CONSTRAINT calibration_plan_pkey PRIMARY KEY (machine_id, memory, location),
    CONSTRAINT calibration_plan_memory_check CHECK (memory IN ('average', 'tool')),
    CONSTRAINT calibration_plan_acceptance_check CHECK (acceptance IN ('accept', 'automatic')),
    CONSTRAINT calibration_plan_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);

-- The same part on the machine and on an external gauge.
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
    CONSTRAINT paired_reading_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX paired_reading_place_idx ON paired_reading (machine_id, location, id);
CREATE UNIQUE INDEX paired_reading_key_key ON paired_reading (machine_id, key) WHERE key IS NOT NULL;

-- What a full block of 2^level readings amounts to, so that a chart of millions reads a few thousand rows.
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
"""

ACCESS = """
-- Somebody who signs in. Disabled people stay, because the record names them.
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

-- A signed-in browser. The cookie holds the token, the table only its SHA-256.
CREATE TABLE browser_session (
    token_hash BYTEA NOT NULL,
    person_id INTEGER NOT NULL,
    csrf TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    expires_at timestamptz NOT NULL,
    CONSTRAINT browser_session_pkey PRIMARY KEY (token_hash),
    CONSTRAINT browser_session_person_id_fkey FOREIGN KEY (person_id) REFERENCES person (id)
);
CREATE INDEX browser_session_person_id_idx ON browser_session (person_id);

-- A one-time link with which somebody chooses a name and a password.
CREATE TABLE invitation (
    token_hash BYTEA NOT NULL,
    role TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    expires_at timestamptz NOT NULL,
    used_at timestamptz,
    CONSTRAINT invitation_pkey PRIMARY KEY (token_hash),
    CONSTRAINT invitation_role_check CHECK (role IN ('viewer', 'operator', 'engineer', 'admin'))
);

-- A sign-in that failed; too many of them slow the next one down.
CREATE TABLE login_failure (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    name TEXT NOT NULL,
    address TEXT NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT login_failure_pkey PRIMARY KEY (id)
);
CREATE INDEX login_failure_at_idx ON login_failure (at);

-- A secret that programs call with: a machine's own, or one with a person's role.
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
    CONSTRAINT api_key_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX api_key_machine_id_idx ON api_key (machine_id);

-- The record of changes.
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
"""

GROUND = """
-- What changed, in the order of the commits. Kept for some hours, so that a client can resume.
CREATE TABLE event (
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    at timestamptz DEFAULT now() NOT NULL,
    changes JSONB NOT NULL,
    CONSTRAINT event_pkey PRIMARY KEY (id)
);
"""

GEOMETRY = """
-- One run of the preset compensation as it came out, refused ones too. Its number is global, so that a run can be named
-- without its machine.
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
    CONSTRAINT kinematics_run_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX kinematics_run_id_key ON kinematics_run (id);
CREATE INDEX kinematics_run_measured_idx ON kinematics_run (machine_id, measured_at, id);
CREATE UNIQUE INDEX kinematics_run_key_key ON kinematics_run (machine_id, key) WHERE key IS NOT NULL;

-- A run was confirmed (its change is larger than permitted) or entered on the control.
CREATE TABLE kinematics_decision (
    machine_id INTEGER NOT NULL,
    run BIGINT NOT NULL,
    what TEXT NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    CONSTRAINT kinematics_decision_pkey PRIMARY KEY (machine_id, run, what),
    CONSTRAINT kinematics_decision_what_check CHECK (what IN ('confirmed', 'entered')),
    CONSTRAINT kinematics_decision_machine_id_run_fkey FOREIGN KEY (machine_id, run) REFERENCES kinematics_run (machine_id, id)
);

-- The kinematics of a machine, with one of its heads, as it was from one moment on.
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
    CONSTRAINT kinematics_backup_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);

-- What the runs of a machine are held against: limits of the control, of the drift, and the reference head.
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
    CONSTRAINT kinematics_plan_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);

-- One feature as it was touched.
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
    CONSTRAINT form_measurement_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX form_measurement_id_key ON form_measurement (id);
CREATE INDEX form_measurement_feature_idx ON form_measurement (machine_id, feature, kind, id);
CREATE UNIQUE INDEX form_measurement_key_key ON form_measurement (machine_id, key) WHERE key IS NOT NULL;

-- A judgement of a measurement of form; the newest counts.
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
    CONSTRAINT form_evaluation_machine_id_form_id_fkey FOREIGN KEY (machine_id, form_id)
        REFERENCES form_measurement (machine_id, id)
);

-- One work zero with its touches; a recomputation is another row.
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
    CONSTRAINT work_zero_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX work_zero_id_key ON work_zero (id);
CREATE INDEX work_zero_fixture_idx ON work_zero (machine_id, fixture, id);
CREATE UNIQUE INDEX work_zero_key_key ON work_zero (machine_id, key) WHERE key IS NOT NULL;
CREATE INDEX work_zero_touched_idx ON work_zero (machine_id, fixture, work_offset, touched_at, id);
CREATE INDEX work_zero_recomputed_idx ON work_zero (machine_id, recomputed_from) WHERE recomputed_from IS NOT NULL;

-- A vice or fixture: against which zero it is watched, and how far it may have shifted.
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
    CONSTRAINT fixture_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);

-- Where a part or pallet lies; a recomputation is another row.
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
    CONSTRAINT alignment_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
CREATE INDEX alignment_id_key ON alignment (id);
CREATE UNIQUE INDEX alignment_key_key ON alignment (machine_id, key) WHERE key IS NOT NULL;
"""

QUALITY = """
-- The limit that a characteristic comes to first, and in how many parts. A note, made anew at any time.
CREATE TABLE outlook (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    sequence BIGINT NOT NULL,
    parameters_version INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    towards TEXT,
    parts double precision,
    parts_low double precision,
    parts_high double precision,
    hunting TEXT NOT NULL,
    CONSTRAINT outlook_pkey PRIMARY KEY (machine_id, characteristic_id),
    CONSTRAINT outlook_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
) WITH (fillfactor = 70);

-- Centre and sigma as they were frozen on purpose, from which readings, by whom and why.
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
    CONSTRAINT baseline_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id),
    CONSTRAINT baseline_chart_check CHECK (chart IN ('individuals', 'xbar_r', 'xbar_s')),
    CONSTRAINT baseline_quantity_check
        CHECK (quantity IN ('deviation', 'without_corrections', 'differences', 'wear_residuals')),
    CONSTRAINT baseline_numbers_check CHECK (sigma > 0 AND first_sequence <= last_sequence)
);
CREATE UNIQUE INDEX baseline_key_key ON baseline (machine_id, characteristic_id, key) WHERE key IS NOT NULL;

-- The run rules that watch a characteristic; the newest version does.
CREATE TABLE rule_set (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    version INTEGER NOT NULL,
    rules JSONB NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    CONSTRAINT rule_set_pkey PRIMARY KEY (machine_id, characteristic_id, version),
    CONSTRAINT rule_set_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);

-- How far the rules of a characteristic have looked. A note, made anew at any time.
CREATE TABLE watching (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    baseline_version INTEGER DEFAULT 0 NOT NULL,
    rules_version INTEGER DEFAULT 0 NOT NULL,
    begun BIGINT DEFAULT '0' NOT NULL,
    looked BIGINT DEFAULT '0' NOT NULL,
    pointed BIGINT DEFAULT '0' NOT NULL,
    excluded INTEGER DEFAULT 0 NOT NULL,
    memory JSONB DEFAULT '{}' NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT watching_pkey PRIMARY KEY (machine_id, characteristic_id),
    CONSTRAINT watching_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
) WITH (fillfactor = 70);

-- One signal of one rule: a run of points; while the run goes on, its end moves.
CREATE SEQUENCE signal_id;
CREATE TABLE signal (
    machine_id INTEGER NOT NULL,
    id BIGINT DEFAULT nextval('signal_id') NOT NULL,
    characteristic_id INTEGER NOT NULL,
    chart TEXT NOT NULL,
    rule TEXT NOT NULL,
    side INTEGER NOT NULL,
    first_sequence BIGINT NOT NULL,
    last_sequence BIGINT NOT NULL,
    points INTEGER NOT NULL,
    baseline_version INTEGER NOT NULL,
    rules_version INTEGER NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    last_at timestamptz DEFAULT now() NOT NULL,
    alarm BIGINT,
    excluded INTEGER DEFAULT 0 NOT NULL,
    withdrawn_at timestamptz,
    explained_at timestamptz,
    explained_by TEXT,
    cause TEXT,
    comment TEXT,
    CONSTRAINT signal_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT signal_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id),
    CONSTRAINT signal_run_check CHECK (side IN (-1, 0, 1) AND first_sequence <= last_sequence AND points > 0)
);
CREATE UNIQUE INDEX signal_id_key ON signal (id);
CREATE UNIQUE INDEX signal_run_key
    ON signal (machine_id, characteristic_id, baseline_version, chart, rule, side, first_sequence);
CREATE INDEX signal_open_idx ON signal (machine_id, characteristic_id, id) WHERE explained_at IS NULL AND withdrawn_at IS NULL;

-- One study of one gauge on one machine; the values lie in its revisions.
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
    CONSTRAINT gauge_study_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id),
    CONSTRAINT gauge_study_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);
CREATE UNIQUE INDEX gauge_study_id_key ON gauge_study (id);
CREATE UNIQUE INDEX gauge_study_key_key ON gauge_study (machine_id, key) WHERE key IS NOT NULL;

-- A study as it stood from one moment on; a correction is a revision of its own.
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
    CONSTRAINT gauge_study_revision_machine_id_study_id_fkey FOREIGN KEY (machine_id, study_id)
        REFERENCES gauge_study (machine_id, id)
);

-- A change of parameters, proposed from a what-if, that waits for an engineer.
CREATE TABLE parameter_proposal (
    id BIGINT GENERATED ALWAYS AS IDENTITY,
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    from_version INTEGER NOT NULL,
    changes JSONB NOT NULL,
    evidence JSONB NOT NULL,
    reason TEXT NOT NULL,
    proposed_at timestamptz DEFAULT now() NOT NULL,
    proposed_by TEXT NOT NULL,
    status TEXT DEFAULT 'open' NOT NULL,
    decided_at timestamptz,
    decided_by TEXT,
    decided_why TEXT,
    made_version INTEGER,
    CONSTRAINT parameter_proposal_pkey PRIMARY KEY (id),
    CONSTRAINT parameter_proposal_status_check CHECK (status IN ('open', 'approved', 'rejected', 'withdrawn')),
    CONSTRAINT parameter_proposal_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);
CREATE INDEX parameter_proposal_characteristic_idx ON parameter_proposal (machine_id, characteristic_id, id);
CREATE INDEX parameter_proposal_open_idx ON parameter_proposal (id) WHERE status = 'open';
"""

VIEWS = """
-- Reports of many characteristics, made in the background.
CREATE TABLE report_job (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    asked_by TEXT NOT NULL,
    asked_at timestamptz DEFAULT now() NOT NULL,
    request JSONB NOT NULL,
    state TEXT DEFAULT 'queued' NOT NULL,
    done INTEGER DEFAULT 0 NOT NULL,
    total INTEGER NOT NULL,
    problems INTEGER DEFAULT 0 NOT NULL,
    current TEXT,
    taken_by TEXT,
    started_at timestamptz,
    finished_at timestamptz,
    finished_by TEXT,
    trouble TEXT,
    file_name TEXT,
    size INTEGER,
    CONSTRAINT report_job_pkey PRIMARY KEY (id),
    CONSTRAINT report_job_state_check CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled'))
);
CREATE INDEX report_job_open_idx ON report_job (id) WHERE state IN ('queued', 'running');
CREATE INDEX report_job_finished_idx ON report_job (finished_at) WHERE finished_at IS NOT NULL;

-- What is ready of one characteristic, so that another process goes on where one was killed. Files are packed already: the
-- database does not pack them again.
CREATE TABLE report_part (
    job_id INTEGER NOT NULL,
    place INTEGER NOT NULL,
    characteristic TEXT NOT NULL,
    content BYTEA STORAGE EXTERNAL,
    trouble TEXT,
    CONSTRAINT report_part_pkey PRIMARY KEY (job_id, place),
    CONSTRAINT report_part_job_id_fkey FOREIGN KEY (job_id) REFERENCES report_job (id) ON DELETE CASCADE
);

-- The whole file of a job that is done.
CREATE TABLE report_file (
    job_id INTEGER NOT NULL,
    content BYTEA STORAGE EXTERNAL NOT NULL,
    CONSTRAINT report_file_pkey PRIMARY KEY (job_id),
    CONSTRAINT report_file_job_id_fkey FOREIGN KEY (job_id) REFERENCES report_job (id) ON DELETE CASCADE
);
"""

# Whoever owns the database can still drop the triggers below; nobody alters these rows by accident or through Inband.
REFUSE = """
CREATE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    RAISE EXCEPTION 'the table % is append-only', TG_TABLE_NAME;
END
$$;
"""
# Records and results stay as they were written; a correction or recomputation is another row.
APPEND_ONLY = (
    "audit_entry",
    "calibration",
    "calibration_acceptance",
    "kinematics_run",
    "kinematics_decision",
    "kinematics_backup",
    "form_measurement",
    "form_evaluation",
    "work_zero",
    "alignment",
    "gauge_study",
    "gauge_study_revision",
)


def upgrade() -> None:
    for tables in (LOOP, ACCESS, GROUND, GEOMETRY, QUALITY, VIEWS, REFUSE):
        op.execute(tables)
    for table in APPEND_ONLY:
        op.execute(
            f"CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {table}"
            " FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()"
        )


def downgrade() -> None:
    raise NotImplementedError("There is nothing before the first schema: drop the database instead.")
