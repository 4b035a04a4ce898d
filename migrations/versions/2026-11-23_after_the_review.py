"""After the review.

From the schema of the first published program to that of the repairs in CHANGELOG.md, "after the review". Added columns come
last in their tables, as ALTER TABLE has it. No row is lost and none of the record is altered: what an old row cannot say stays
NULL, and the program reads that as "not known".

`downgrade` keeps every machine, reading, correction, alarm and entry of the record of changes. Lost are: the numbers of people
and keys beside the names; types, numbers of locations and plausible set-up errors of machines; who acknowledged the warnings
of a result (the record of changes still says it); the notes of the background jobs; the places that people signed in from. An
alarm answered `measured_by_hand` becomes `noted`, its outcome says what the hand has found. It is refused where a location
beyond 32 (R10) or 20 (R11) or a characteristic of a tool's own size is in use: the program before could not serve that.

Revision ID: 0101
Revises: 0100
Create Date: 2026-11-23
"""

from alembic import op

revision = "0101"
down_revision: str | None = "0100"
branch_labels = None
depends_on = None

LOOP = """
-- `type` is `other` until somebody says more: that one warns of nothing. The numbers of locations are those that every
-- machine had so far; a machine that has more says so. Set-up errors beyond the plausible ones, of parts and of rotary axes
-- (degrees, mm), are warned of.
ALTER TABLE machine
    ADD COLUMN type TEXT DEFAULT 'other' NOT NULL,
    ADD COLUMN tool_locations INTEGER DEFAULT 32 NOT NULL,
    ADD COLUMN average_locations INTEGER DEFAULT 20 NOT NULL,
    ADD COLUMN plausible_turn double precision DEFAULT 5 NOT NULL,
    ADD COLUMN plausible_shift double precision DEFAULT 10 NOT NULL,
    ADD COLUMN plausible_axis_turn double precision DEFAULT 1 NOT NULL,
    ADD COLUMN plausible_axis_shift double precision DEFAULT 1 NOT NULL,
    ADD CONSTRAINT machine_type_check CHECK (type IN ('lathe', 'mill', 'mill_turn', 'grinder', 'other')),
    ADD CONSTRAINT machine_tool_locations_check CHECK (tool_locations BETWEEN 1 AND 999),
    ADD CONSTRAINT machine_average_locations_check CHECK (average_locations BETWEEN 1 AND 999);
ALTER TABLE tool
    DROP CONSTRAINT tool_number_check,
    DROP CONSTRAINT tool_sister_check,
    ADD CONSTRAINT tool_number_check CHECK (number BETWEEN 1 AND 999),
    ADD CONSTRAINT tool_sister_check CHECK (sister BETWEEN 1 AND 999 AND sister <> number);
ALTER TABLE average_memory
    DROP CONSTRAINT average_memory_location_check,
    ADD CONSTRAINT average_memory_location_check CHECK (location BETWEEN 1 AND 999);

-- A person has looked at the warnings of a result and takes it as it is.
CREATE TABLE warning_acknowledgement (
    machine_id INTEGER NOT NULL,
    subject TEXT NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    codes JSONB NOT NULL,
    CONSTRAINT warning_acknowledgement_pkey PRIMARY KEY (machine_id, subject),
    CONSTRAINT warning_acknowledgement_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
);
"""

ACCESS = """
-- Tries to change the password without knowing it; the fifth ends the session.
ALTER TABLE browser_session ADD COLUMN wrong_passwords INTEGER DEFAULT 0 NOT NULL;

-- Where somebody has signed in: from there, strangers who guess the password elsewhere keep nobody out.
CREATE TABLE known_place (
    person_id INTEGER NOT NULL,
    place TEXT NOT NULL,
    last_at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT known_place_pkey PRIMARY KEY (person_id, place),
    CONSTRAINT known_place_person_id_fkey FOREIGN KEY (person_id) REFERENCES person (id)
);

-- Who acts stands as a name, and by number too, because a name can be given again. Entries from before keep the name alone:
-- the record is not altered, and whose the name was then, a person's or a key's, is not known for certain.
ALTER TABLE audit_entry
    ADD COLUMN person_id INTEGER,
    ADD COLUMN key_id INTEGER;
"""

GROUND = """
-- The last run of a periodic job.
CREATE TABLE job_run (
    job TEXT NOT NULL,
    finished_at timestamptz NOT NULL,
    seconds double precision NOT NULL,
    units INTEGER NOT NULL,
    CONSTRAINT job_run_pkey PRIMARY KEY (job)
) WITH (fillfactor = 50);

-- A unit of work that fails: since when, how often in a row, why, and when it is tried again.
CREATE TABLE job_failure (
    job TEXT NOT NULL,
    subject TEXT NOT NULL,
    machine_id INTEGER,
    characteristic_id INTEGER,
    failures INTEGER DEFAULT 1 NOT NULL,
    error TEXT NOT NULL,
    first_at timestamptz DEFAULT now() NOT NULL,
    last_at timestamptz DEFAULT now() NOT NULL,
    retry_at timestamptz NOT NULL,
    CONSTRAINT job_failure_pkey PRIMARY KEY (job, subject),
    CONSTRAINT job_failure_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);
CREATE INDEX job_failure_characteristic_idx ON job_failure (machine_id, characteristic_id);
"""

QUALITY = """
-- How the forecasts of earlier edges came out, worked out at the last tool change (record_of).
ALTER TABLE outlook
    ADD COLUMN record_of BIGINT,
    ADD COLUMN lives INTEGER,
    ADD COLUMN tested INTEGER,
    ADD COLUMN held INTEGER,
    ADD COLUMN widening double precision;
-- Forecasts were given too narrow an interval: made of no reading, the outlook is made anew within the first minute. The row
-- stays because of `hunting`, so that a loop that hunts already raises no second alarm.
UPDATE outlook SET sequence = 0;

-- The index of a characteristic that may be quoted, as a periodic job worked it out: the last that could be, and, where the
-- newest readings carry none, the reason. A note, made anew at any time.
CREATE TABLE capability_verdict (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    quotable BOOLEAN NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    newest BIGINT NOT NULL,
    parameters_version INTEGER NOT NULL,
    baseline INTEGER,
    excluded INTEGER NOT NULL,
    half double precision NOT NULL,
    readings INTEGER NOT NULL,
    first BIGINT,
    last BIGINT,
    first_at timestamptz,
    last_at timestamptz,
    quote TEXT NOT NULL,
    value double precision,
    low double precision,
    high double precision,
    preliminary BOOLEAN NOT NULL,
    why TEXT,
    CONSTRAINT capability_verdict_pkey PRIMARY KEY (machine_id, characteristic_id, quotable),
    CONSTRAINT capability_verdict_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
) WITH (fillfactor = 70);
"""

VIEWS = """
-- Reports belong to whoever asked for them. Those from before belong to the name, as they did; they are kept for a week.
ALTER TABLE report_job
    ADD COLUMN person_id INTEGER,
    ADD COLUMN key_id INTEGER;
"""

# Whoever owns the database can still drop the triggers below; nobody alters a fact by accident or through Inband. A statement
# that names a protected column is refused before it touches a row, so that inserts and ordinary updates pay nothing.
REFUSE = """
CREATE FUNCTION refuse_loss() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    RAISE EXCEPTION '% of the table % is refused: what it says is a fact', TG_OP, TG_TABLE_NAME;
END
$$;
"""
# Measurements stay as they were written too; so far only records and results did.
APPEND_ONLY = (
    "warning_acknowledgement",
    "parameters_version",
    "reading",
    "reading_touches",
    "reading_results",
    "hand_measurement",
    "exclusion",
    "tool_event",
    "reading_summary",
    "rule_set",
)
# Rows with a life: the columns that never change once they are written. None of these rows is ever deleted.
FIXED = {
    "machine": "id, key, created_at",
    "characteristic": "machine_id, id, key, unit, created_at",
    "person": "id, name, created_at",
    "api_key": "id, secret_hash, name, role, machine_id, created_at",
    "correction": "machine_id, number, characteristic_id, sequence, tool_memory, size_error, amount, created_at",
    "alarm": "machine_id, id, kind, characteristic_id, tool_memory, raised_at",
    "signal": "machine_id, id, characteristic_id, chart, rule, side, baseline_version, at",
    "parameter_proposal": "id, machine_id, characteristic_id, from_version, changes, evidence, reason, proposed_at, proposed_by",
    "paired_reading": "machine_id, id, location, at, actor, key, machine_value, true_value, instrument, characteristic_id, sequence",
    "result_reading": "machine_id, characteristic_id, key, measured, measured_at, part, asked_at",
    "baseline": (
        "machine_id, characteristic_id, version, key, chart, quantity, grouping, group_size, group_pause, ewma_lambda,"
        " ewma_width, ewma_exact, cusum_k, cusum_h, cusum_headstart, average_span, first_sequence, last_sequence, excluded,"
        " centre, sigma, estimator, freedom, readings, groups, factor, slope, slope_error, settle, signals, normal_p, repeats,"
        " parameters_version, at, actor, reason"
    ),
}
# The end of a row's life is not taken back.
CLOSED = {
    "correction": "OLD.status IN ('applied', 'rejected', 'superseded') AND NEW.status <> OLD.status",
    "alarm": "OLD.acknowledged_at IS NOT NULL",
    "parameter_proposal": "OLD.status <> 'open'",
    "paired_reading": "OLD.excluded_at IS NOT NULL",
    "baseline": "OLD.retired_at IS NOT NULL",
    "api_key": "OLD.revoked_at IS NOT NULL",
    "result_reading": "OLD.sequence IS NOT NULL OR OLD.refused IS NOT NULL",
}
# The running state of a machine moves, but it does not go away.
KEPT = ("machine_state", "stream", "tool", "average_memory")

UNREADABLE = """
DO $$
BEGIN
    IF EXISTS (SELECT FROM tool WHERE number > 32 OR sister > 32)
        OR EXISTS (SELECT FROM average_memory WHERE location > 20)
        OR EXISTS (SELECT FROM stream WHERE tool_memory > 32 OR average_memory > 20)
        OR EXISTS (SELECT FROM parameters_version WHERE parameters ->> 'feature' = 'tool')
    THEN
        RAISE EXCEPTION 'locations beyond R10 = 32 or R11 = 20, or a characteristic of a tool''s own size, are in use:'
            ' the program before cannot serve them. Restore the backup made before the upgrade instead.';
    END IF;
END
$$;
"""
BACK = """
DROP TABLE warning_acknowledgement, known_place, job_run, job_failure, capability_verdict;
ALTER TABLE report_job DROP COLUMN person_id, DROP COLUMN key_id;
ALTER TABLE audit_entry DROP COLUMN person_id, DROP COLUMN key_id;
ALTER TABLE browser_session DROP COLUMN wrong_passwords;
ALTER TABLE outlook
    DROP COLUMN record_of, DROP COLUMN lives, DROP COLUMN tested, DROP COLUMN held, DROP COLUMN widening;
UPDATE outlook SET sequence = 0; -- made anew, as above
UPDATE alarm SET action = 'noted' WHERE action = 'measured_by_hand';
ALTER TABLE machine
    DROP COLUMN type, DROP COLUMN tool_locations, DROP COLUMN average_locations,
    DROP COLUMN plausible_turn, DROP COLUMN plausible_shift,
    DROP COLUMN plausible_axis_turn, DROP COLUMN plausible_axis_shift;
ALTER TABLE tool
    DROP CONSTRAINT tool_number_check,
    DROP CONSTRAINT tool_sister_check,
    ADD CONSTRAINT tool_number_check CHECK (number BETWEEN 1 AND 32),
    ADD CONSTRAINT tool_sister_check CHECK (sister BETWEEN 1 AND 32 AND sister <> number);
ALTER TABLE average_memory
    DROP CONSTRAINT average_memory_location_check,
    ADD CONSTRAINT average_memory_location_check CHECK (location BETWEEN 1 AND 20);
"""


def upgrade() -> None:
    for changes in (LOOP, ACCESS, GROUND, QUALITY, VIEWS, REFUSE):
        op.execute(changes)
    for table in APPEND_ONLY:
        op.execute(
            f"CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {table}"
            " FOR EACH STATEMENT EXECUTE FUNCTION refuse_change()"
        )
    for table, columns in FIXED.items():
        op.execute(
            f"CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE OF {columns} ON {table}"
            " FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()"
        )
    for table, closed in CLOSED.items():
        op.execute(
            f"CREATE TRIGGER closed_stays BEFORE UPDATE ON {table} FOR EACH ROW WHEN ({closed})"
            " EXECUTE FUNCTION refuse_loss()"
        )
    for table in KEPT:
        op.execute(
            f"CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE ON {table}"
            " FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()"
        )


def downgrade() -> None:
    op.execute(UNREADABLE)
    for table in APPEND_ONLY:
        op.execute(f"DROP TRIGGER append_only ON {table}")
    op.execute("DROP FUNCTION refuse_loss() CASCADE")  # with every trigger that calls it: facts_stay, closed_stays
    op.execute(BACK)
