"""What the measuring variants yield beside the value, the signal path of each machine, and measurements by hand.

Revision ID: 0004
Revises: 0003
Create Date: 2026-11-21
"""

from alembic import op

revision = "0004"
down_revision: str | None = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("""
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
        )
    """)
    op.execute("""
        CREATE INDEX reading_results_outside_idx ON reading_results (machine_id, characteristic_id, sequence)
            INCLUDE (sections_outside, rejected) WHERE sections_outside > 0
    """)
    op.execute("""
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
            CONSTRAINT hand_measurement_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
                REFERENCES characteristic (machine_id, id)
        )
    """)
    op.execute("""
        ALTER TABLE machine
            ADD COLUMN signal_path TEXT DEFAULT 'direct' NOT NULL,
            ADD COLUMN signal_delay double precision DEFAULT '0.25' NOT NULL,
            ADD COLUMN signal_jitter double precision,
            ADD COLUMN probing_feed double precision DEFAULT '150' NOT NULL,
            ADD CONSTRAINT machine_signal_path_check CHECK (signal_path IN ('direct', 'plc'))
    """)


def downgrade() -> None:
    op.execute("""
        ALTER TABLE machine DROP COLUMN signal_path, DROP COLUMN signal_delay, DROP COLUMN signal_jitter,
            DROP COLUMN probing_feed
    """)
    op.execute("DROP TABLE hand_measurement")
    op.execute("DROP TABLE reading_results")
