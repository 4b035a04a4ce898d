"""Import mappings: which characteristics of measuring machines' files belong to which here.

`downgrade` loses them: the next import of each file is chosen anew.

Revision ID: 0107
Revises: 0105
Create Date: 2026-11-23
"""

from alembic import op

revision = "0107"
down_revision: str | None = "0105"
branch_labels = None
depends_on = None

TABLE = """
CREATE TABLE import_mapping (
    machine_id INTEGER NOT NULL,
    characteristic_id INTEGER NOT NULL,
    part TEXT NOT NULL,
    number TEXT NOT NULL,
    name TEXT NOT NULL,
    actor TEXT NOT NULL,
    at timestamptz NOT NULL,
    CONSTRAINT import_mapping_pkey PRIMARY KEY (machine_id, characteristic_id, part, number, name),
    CONSTRAINT import_mapping_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
        REFERENCES characteristic (machine_id, id)
)
"""


def upgrade() -> None:
    op.execute(TABLE)


def downgrade() -> None:
    op.execute("DROP TABLE import_mapping")
