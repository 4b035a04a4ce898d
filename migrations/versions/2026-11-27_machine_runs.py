"""Times in which a control reported that it ran.

`downgrade` loses them.

Revision ID: 0131
Revises: 0130
Create Date: 2026-11-27
"""

from alembic import op

revision = "0131"
down_revision: str | None = "0130"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("""
        CREATE TABLE machine_run (
            machine_id INTEGER NOT NULL,
            begin timestamptz NOT NULL,
            until timestamptz NOT NULL,
            CONSTRAINT machine_run_pkey PRIMARY KEY (machine_id, begin),
            CONSTRAINT machine_run_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
        )
    """)


def downgrade() -> None:
    op.execute("DROP TABLE machine_run")
