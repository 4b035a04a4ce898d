"""Control plans and missed measurements; the rule and the weeks of capability verdicts, the shifts of baselines.

`downgrade` loses them; the record of changes keeps every plan. Verdicts are judged again by the job.

Revision ID: 0113
Revises: 0112
Create Date: 2026-11-27
"""

from alembic import op

revision = "0113"
down_revision: str | None = "0112"
branch_labels = None
depends_on = None

UPGRADE = (  # one by one: a plant may lie on a node of Citus
    """
    CREATE TABLE control_plan (
        machine_id INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        every INTEGER,
        minutes DOUBLE PRECISION,
        per_shift BOOLEAN DEFAULT false NOT NULL,
        after_change INTEGER DEFAULT 0 NOT NULL,
        after_alarm INTEGER DEFAULT 0 NOT NULL,
        on_the_way INTEGER DEFAULT 0 NOT NULL,
        numbered BOOLEAN DEFAULT false NOT NULL,
        changed_by TEXT NOT NULL,
        reason TEXT NOT NULL,
        since timestamptz DEFAULT now() NOT NULL,
        seen BIGINT DEFAULT 0 NOT NULL,
        required_context TEXT[] DEFAULT '{}' NOT NULL,
        context_seen BIGINT DEFAULT 0 NOT NULL,
        CONSTRAINT control_plan_pkey PRIMARY KEY (machine_id, characteristic_id),
        CONSTRAINT control_plan_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id),
        CONSTRAINT control_plan_every_check CHECK (every >= 1),
        CONSTRAINT control_plan_minutes_check CHECK (minutes > 0)
    )
    """,
    "ALTER TABLE machine_state ADD COLUMN planned BOOLEAN DEFAULT false NOT NULL",
    """
    CREATE TABLE missed_measurement (
        machine_id INTEGER NOT NULL,
        id BIGINT GENERATED ALWAYS AS IDENTITY,
        characteristic_id INTEGER NOT NULL,
        by TEXT NOT NULL,
        after BIGINT NOT NULL,
        every INTEGER,
        found_at timestamptz DEFAULT now() NOT NULL,
        parts INTEGER,
        minutes DOUBLE PRECISION NOT NULL,
        shifts INTEGER DEFAULT 0 NOT NULL,
        until BIGINT,
        ended_at timestamptz,
        CONSTRAINT missed_measurement_pkey PRIMARY KEY (machine_id, id),
        CONSTRAINT missed_measurement_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id),
        CONSTRAINT missed_measurement_by_check CHECK (by IN ('parts', 'minutes', 'shift'))
    )
    """,
    "CREATE INDEX missed_measurement_characteristic_idx ON missed_measurement (machine_id, characteristic_id, id)",
    """
    CREATE UNIQUE INDEX missed_measurement_open_key ON missed_measurement (machine_id, characteristic_id)
        WHERE ended_at IS NULL
    """,
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF machine_id, id, characteristic_id, by, after, found_at ON missed_measurement
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    # Verdicts of rule 0 are judged again by the job.
    "ALTER TABLE capability_verdict ADD COLUMN rule INTEGER DEFAULT 0 NOT NULL",
    "ALTER TABLE capability_verdict ALTER COLUMN rule DROP DEFAULT",
    "ALTER TABLE capability_verdict ADD COLUMN weeks JSONB",
    # By these a baseline forms its subgroups; those of old baselines are not known, and are the shifts of the plant.
    "ALTER TABLE baseline ADD COLUMN shifts TEXT",
)
DOWNGRADE = (
    "ALTER TABLE baseline DROP COLUMN shifts",
    "ALTER TABLE capability_verdict DROP COLUMN weeks, DROP COLUMN rule",
    "DROP TABLE missed_measurement",
    "ALTER TABLE machine_state DROP COLUMN planned",
    "DROP TABLE control_plan",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
