"""What the wear curve and its forecast are drawn from.

Revision ID: 0008
Revises: 0007
Create Date: 2026-11-21
"""

from alembic import op

revision = "0008"
down_revision: str | None = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # Readings of before do not say with which corrections they were cut; their wear curve begins with the next reading.
    op.execute("ALTER TABLE reading ADD COLUMN compensated double precision")
    op.execute("""
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
            CONSTRAINT outlook_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
                REFERENCES characteristic (machine_id, id)
        ) WITH (fillfactor = 70)
    """)


def downgrade() -> None:
    op.execute("DROP TABLE outlook")
    op.execute("ALTER TABLE reading DROP COLUMN compensated")
