"""Stations: devices bound to machines, PINs and badges of people.

`downgrade` loses devices, PINs, badges, and in the record of changes the number of the station device; every entry stays.

Revision ID: 0103
Revises: 0102
Create Date: 2026-11-23
"""

from alembic import op

revision = "0103"
down_revision: str | None = "0102"
branch_labels = None
depends_on = None

TABLES = """
ALTER TABLE person ADD COLUMN pin_hash TEXT;

-- A tablet bound to one machine, by a one-time code; from then on its cookie holds the token. Only the SHA-256 of either is kept.
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
);
CREATE INDEX station_device_machine_id_idx ON station_device (machine_id);

CREATE TABLE badge (
    code_hash BYTEA NOT NULL,
    person_id INTEGER NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT badge_pkey PRIMARY KEY (code_hash),
    CONSTRAINT badge_person_id_fkey FOREIGN KEY (person_id) REFERENCES person (id)
);
CREATE INDEX badge_person_id_idx ON badge (person_id);

-- Where a person has identified themselves for this one action.
ALTER TABLE audit_entry ADD COLUMN device_id INTEGER;
CREATE INDEX audit_entry_device_idx ON audit_entry (device_id, id) WHERE device_id IS NOT NULL;
"""


def upgrade() -> None:
    op.execute(TABLES)


def downgrade() -> None:
    op.execute(
        "ALTER TABLE audit_entry DROP COLUMN device_id; DROP TABLE badge; DROP TABLE station_device;"
        " ALTER TABLE person DROP COLUMN pin_hash"
    )
