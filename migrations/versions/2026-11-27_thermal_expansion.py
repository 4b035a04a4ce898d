"""Thermal expansion of characteristics.

`downgrade` loses it; the record of changes keeps what was set.

Revision ID: 0129
Revises: 0128
Create Date: 2026-11-27
"""

from alembic import op

revision = "0129"
down_revision: str | None = "0128"
branch_labels = None
depends_on = None

TABLE = """
CREATE TABLE thermal_expansion (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    coefficient DOUBLE PRECISION,
    coefficient_uncertainty DOUBLE PRECISION,
    scale_coefficient DOUBLE PRECISION,
    temperature_uncertainty DOUBLE PRECISION,
    length DOUBLE PRECISION,
    changed_by TEXT NOT NULL,
    changed_at timestamptz DEFAULT now() NOT NULL,
    reason TEXT NOT NULL,
    CONSTRAINT thermal_expansion_pkey PRIMARY KEY (machine_id, characteristic_id),
    CONSTRAINT thermal_expansion_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id),
    CONSTRAINT thermal_expansion_coefficient_uncertainty_check CHECK (coefficient_uncertainty >= 0),
    CONSTRAINT thermal_expansion_temperature_uncertainty_check CHECK (temperature_uncertainty >= 0),
    CONSTRAINT thermal_expansion_length_check CHECK (length >= 0)
)
"""


def upgrade() -> None:
    op.execute(TABLE)


def downgrade() -> None:
    op.execute("DROP TABLE thermal_expansion")
