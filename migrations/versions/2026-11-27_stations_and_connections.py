"""Stations, wall screens, bridges and what a machine runs.

`downgrade` loses devices, PINs, badges, wall screens, heartbeats of bridges, the last use of keys, touch tests, the times that
controls ran, notes, the mapping of corrections and which machines are simulated; of the record of changes the number of the
station device. Its entries stay, with the words of the notes and who asked for which touch test.

Revision ID: 0106
Revises: 0101
Create Date: 2026-11-27
"""

from alembic import op

revision = "0106"
down_revision: str | None = "0101"
branch_labels = None
depends_on = None

STATIONS = (  # one by one: a plant may lie on a node of Citus
    "ALTER TABLE person ADD COLUMN pin_hash TEXT",
    # A tablet bound to one machine by a one-time code; its cookie then holds the token. Only the SHA-256 of either is kept.
    """
    CREATE TABLE station_device (
        id INTEGER GENERATED ALWAYS AS IDENTITY,
        machine_id INTEGER NOT NULL,
        name TEXT NOT NULL,
        code_hash BYTEA,
        token_hash BYTEA,
        csrf TEXT NOT NULL,
        created_at timestamptz DEFAULT now() NOT NULL,
        bound_at timestamptz,
        last_used_at timestamptz,
        revoked_at timestamptz,
        CONSTRAINT station_device_pkey PRIMARY KEY (id),
        CONSTRAINT station_device_code_hash_key UNIQUE (code_hash),
        CONSTRAINT station_device_token_hash_key UNIQUE (token_hash),
        CONSTRAINT station_device_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id),
        CONSTRAINT station_device_code_or_token_check CHECK ((code_hash IS NULL) <> (token_hash IS NULL))
    )
    """,
    "CREATE INDEX station_device_machine_id_idx ON station_device (machine_id)",
    """
    CREATE TABLE badge (
        code_hash BYTEA NOT NULL,
        person_id INTEGER NOT NULL,
        created_at timestamptz DEFAULT now() NOT NULL,
        CONSTRAINT badge_pkey PRIMARY KEY (code_hash),
        CONSTRAINT badge_person_id_fkey FOREIGN KEY (person_id) REFERENCES person (id)
    )
    """,
    "CREATE INDEX badge_person_id_idx ON badge (person_id)",
    # Where a person has identified themselves for this one action.
    "ALTER TABLE audit_entry ADD COLUMN device_id INTEGER",
    "CREATE INDEX audit_entry_device_idx ON audit_entry (device_id, id) WHERE device_id IS NOT NULL",
    """
    CREATE TABLE wall_screen (
        id INTEGER GENERATED ALWAYS AS IDENTITY,
        secret_hash BYTEA NOT NULL,
        name TEXT NOT NULL,
        created_at timestamptz DEFAULT now() NOT NULL,
        created_by TEXT NOT NULL,
        last_used_at timestamptz,
        revoked_at timestamptz,
        CONSTRAINT wall_screen_pkey PRIMARY KEY (id),
        CONSTRAINT wall_screen_secret_hash_key UNIQUE (secret_hash)
    )
    """,
)
BRIDGES = (
    """
    CREATE TABLE connection (
        machine_id INTEGER NOT NULL,
        received_at timestamptz NOT NULL,
        state TEXT NOT NULL,
        since timestamptz NOT NULL,
        detail TEXT,
        error TEXT,
        error_at timestamptz,
        version TEXT NOT NULL,
        kind TEXT,
        started_at timestamptz,
        waiting INTEGER NOT NULL,
        oldest_waiting_at timestamptz,
        backing_up_since timestamptz,
        quarantined INTEGER NOT NULL,
        quarantine JSONB NOT NULL,
        clock_offset DOUBLE PRECISION,
        mapping TEXT,
        hold_all BOOLEAN NOT NULL,
        identity TEXT,
        locations JSONB NOT NULL,
        held_back JSONB DEFAULT '[]' NOT NULL,
        carries_decisions BOOLEAN,
        CONSTRAINT connection_pkey PRIMARY KEY (machine_id),
        CONSTRAINT connection_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
    ) WITH (fillfactor = 50)
    """,
    "ALTER TABLE api_key ADD COLUMN last_used_at timestamptz",
    "ALTER TABLE correction ADD COLUMN mapping TEXT",
    # The effect of corrections is judged from the next reading on: what happened to the parts before is not known.
    "ALTER TABLE stream ADD COLUMN gain_from BIGINT DEFAULT 0 NOT NULL",
    "UPDATE stream SET gain_from = sequence",
    "CREATE SEQUENCE touch_test_id AS bigint",
    """
    CREATE TABLE touch_test (
        machine_id INTEGER NOT NULL,
        id BIGINT DEFAULT nextval('touch_test_id') NOT NULL,
        tool_memory INTEGER NOT NULL,
        amount FLOAT NOT NULL,
        asked_at timestamptz DEFAULT now() NOT NULL,
        asked_by TEXT NOT NULL,
        state TEXT NOT NULL,
        state_at timestamptz DEFAULT now() NOT NULL,
        answered_by TEXT,
        refused TEXT,
        mapping TEXT,
        place TEXT,
        unit TEXT,
        before FLOAT,
        shown_before FLOAT,
        shown_after FLOAT,
        detail TEXT,
        ended_at timestamptz,
        CONSTRAINT touch_test_pkey PRIMARY KEY (machine_id, id),
        CONSTRAINT touch_test_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
    )
    """,
    "CREATE INDEX touch_test_id_key ON touch_test (id)",
    "CREATE UNIQUE INDEX touch_test_open_key ON touch_test (machine_id) WHERE ended_at IS NULL",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF machine_id, id, tool_memory, amount, asked_at, asked_by ON touch_test
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER closed_stays BEFORE UPDATE ON touch_test FOR EACH ROW WHEN (OLD.ended_at IS NOT NULL)
        EXECUTE FUNCTION refuse_loss()
    """,
)
MACHINES = (
    # A simulated machine is that for good: it alone can be removed again, with all that it has left.
    "ALTER TABLE machine ADD COLUMN simulated BOOLEAN DEFAULT false NOT NULL",
    """
    CREATE TRIGGER simulated_stays BEFORE UPDATE OF simulated ON machine
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TABLE machine_run (
        machine_id INTEGER NOT NULL,
        begin timestamptz NOT NULL,
        until timestamptz NOT NULL,
        CONSTRAINT machine_run_pkey PRIMARY KEY (machine_id, begin),
        CONSTRAINT machine_run_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
    )
    """,
    "CREATE SEQUENCE note_id AS bigint",
    """
    CREATE TABLE note (
        machine_id INTEGER NOT NULL,
        id BIGINT DEFAULT nextval('note_id') NOT NULL,
        characteristic_id INTEGER,
        sequence BIGINT,
        at timestamptz NOT NULL,
        text TEXT NOT NULL,
        key TEXT,
        written_at timestamptz DEFAULT now() NOT NULL,
        written_by TEXT NOT NULL,
        person_id INTEGER,
        key_id INTEGER,
        withdrawn_at timestamptz,
        withdrawn_by TEXT,
        withdrawn_why TEXT,
        CONSTRAINT note_pkey PRIMARY KEY (machine_id, id),
        CONSTRAINT note_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id),
        CONSTRAINT note_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id)
    )
    """,
    "CREATE INDEX note_id_key ON note (id)",
    "CREATE INDEX note_at_idx ON note (machine_id, at)",
    "CREATE UNIQUE INDEX note_key_key ON note (machine_id, key) WHERE key IS NOT NULL",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF machine_id, id, characteristic_id, sequence, at, text, key, written_at, written_by, person_id, key_id ON note
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER closed_stays BEFORE UPDATE ON note FOR EACH ROW WHEN (OLD.withdrawn_at IS NOT NULL)
        EXECUTE FUNCTION refuse_loss()
    """,
)
DOWNGRADE = (
    "DROP TABLE note",
    "DROP SEQUENCE note_id",
    "DROP TABLE machine_run",
    "DROP TRIGGER simulated_stays ON machine",
    "ALTER TABLE machine DROP COLUMN simulated",
    "DROP TABLE touch_test",
    "DROP SEQUENCE touch_test_id",
    "ALTER TABLE stream DROP COLUMN gain_from",
    "ALTER TABLE correction DROP COLUMN mapping",
    "ALTER TABLE api_key DROP COLUMN last_used_at",
    "DROP TABLE connection",
    "DROP TABLE wall_screen",
    "ALTER TABLE audit_entry DROP COLUMN device_id",
    "DROP TABLE badge",
    "DROP TABLE station_device",
    "ALTER TABLE person DROP COLUMN pin_hash",
)


def upgrade() -> None:
    for command in STATIONS + BRIDGES + MACHINES:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
