"""Characteristics of form: which result of which characteristic their readings are; straightness beside the other results.

`downgrade` loses which characteristic they belong to; their readings stay.

Revision ID: 0119
Revises: 0118
Create Date: 2026-11-27
"""

from alembic import op

revision = "0119"
down_revision: str | None = "0118"
branch_labels = None
depends_on = None


CONSTRAINTS = (  # one by one: a plant may lie on a node of Citus, which takes no constraint beside another command
    """
    characteristic_form_check
        CHECK (form IN ('run_out', 'out_of_roundness', 'taper', 'straightness') AND form_of <> id)
    """,
    "characteristic_form_whole_check CHECK ((form IS NULL) = (form_of IS NULL))",
    """
    characteristic_machine_id_form_of_fkey
        FOREIGN KEY (machine_id, form_of) REFERENCES characteristic (machine_id, id)
    """,
)


def upgrade() -> None:
    op.execute("ALTER TABLE characteristic ADD COLUMN form_of INTEGER, ADD COLUMN form TEXT")
    for constraint in CONSTRAINTS:
        op.execute(f"ALTER TABLE characteristic ADD CONSTRAINT {constraint}")
    op.execute("""
        CREATE UNIQUE INDEX characteristic_form_idx ON characteristic (machine_id, form_of, form)
            WHERE form_of IS NOT NULL
    """)
    op.execute("ALTER TABLE reading_results ADD COLUMN straightness double precision")


def downgrade() -> None:
    op.execute("ALTER TABLE reading_results DROP COLUMN straightness")
    op.execute("ALTER TABLE characteristic DROP COLUMN form_of, DROP COLUMN form")
