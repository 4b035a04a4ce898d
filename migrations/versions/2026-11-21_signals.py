"""Rules that are watched, and the signals they gave.

Revision ID: 0011
Revises: 0010
Create Date: 2026-11-21
"""

from alembic import op

revision = "0011"
down_revision: str | None = "0010"
branch_labels = None
depends_on = None

TABLES = """
CREATE SEQUENCE signal_id;

CREATE TABLE rule_set (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    version INTEGER NOT NULL,
    rules JSONB NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    actor TEXT NOT NULL,
    reason TEXT NOT NULL,
    CONSTRAINT rule_set_pkey PRIMARY KEY (machine_id, characteristic_id, version),
    CONSTRAINT rule_set_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
);

CREATE TABLE watching (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    baseline_version INTEGER DEFAULT '0' NOT NULL,
    rules_version INTEGER DEFAULT '0' NOT NULL,
    begun BIGINT DEFAULT '0' NOT NULL,
    looked BIGINT DEFAULT '0' NOT NULL,
    pointed BIGINT DEFAULT '0' NOT NULL,
    excluded INTEGER DEFAULT '0' NOT NULL,
    memory JSONB DEFAULT '{}' NOT NULL,
    at timestamptz DEFAULT now() NOT NULL,
    CONSTRAINT watching_pkey PRIMARY KEY (machine_id, characteristic_id),
    CONSTRAINT watching_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
) WITH (fillfactor = 70);

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
    excluded INTEGER DEFAULT '0' NOT NULL,
    withdrawn_at timestamptz,
    explained_at timestamptz,
    explained_by TEXT,
    cause TEXT,
    comment TEXT,
    CONSTRAINT signal_pkey PRIMARY KEY (machine_id, id),
    CONSTRAINT signal_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id),
    CONSTRAINT signal_run_check CHECK (side IN (-1, 0, 1) AND first_sequence <= last_sequence AND points > 0)
);

CREATE UNIQUE INDEX signal_id_key ON signal (id);

CREATE UNIQUE INDEX signal_run_key
    ON signal (machine_id, characteristic_id, baseline_version, chart, rule, side, first_sequence);

CREATE INDEX signal_open_idx ON signal (machine_id, characteristic_id, id)
    WHERE explained_at IS NULL AND withdrawn_at IS NULL;
"""


def upgrade() -> None:
    op.execute(TABLES)


def downgrade() -> None:
    op.execute("DROP TABLE signal, watching, rule_set")
    op.execute("DROP SEQUENCE signal_id")
