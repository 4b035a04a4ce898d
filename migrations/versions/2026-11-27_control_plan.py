"""Control plans of characteristics, and the measurements that were missed.

`downgrade` loses them; the record of changes keeps every plan.

Revision ID: 0125
Revises: 0124
Create Date: 2026-11-27
"""

from alembic import op

revision = "0125"
down_revision: str | None = "0124"
branch_labels = None
depends_on = None

UPGRADE = (
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
        CONSTRAINT control_plan_pkey PRIMARY KEY (machine_id, characteristic_id),
        CONSTRAINT control_plan_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id),
        CONSTRAINT control_plan_every_check CHECK (every >= 1),
        CONSTRAINT control_plan_minutes_check CHECK (minutes > 0)
    )
    """,
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
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    op.execute("DROP TABLE missed_measurement")
    op.execute("DROP TABLE control_plan")
