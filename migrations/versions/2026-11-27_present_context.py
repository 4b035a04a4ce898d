"""The context that a machine works at, put on its readings that bring none.

`downgrade` loses it; readings that have it keep it.

Revision ID: 0134
Revises: 0133
Create Date: 2026-11-27
"""

from alembic import op

revision = "0134"
down_revision: str | None = "0133"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("""
        CREATE TABLE present_context (
            machine_id INTEGER NOT NULL,
            context JSONB NOT NULL,
            since TIMESTAMP WITH TIME ZONE NOT NULL,
            filled TIMESTAMP WITH TIME ZONE NOT NULL,
            changed_by TEXT NOT NULL,
            CONSTRAINT present_context_pkey PRIMARY KEY (machine_id)
        )
    """)
    op.execute("""
        ALTER TABLE present_context ADD CONSTRAINT present_context_machine_id_fkey
            FOREIGN KEY (machine_id) REFERENCES machine (id)
    """)


def downgrade() -> None:
    op.execute("DROP TABLE present_context")
