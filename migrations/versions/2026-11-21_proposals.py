"""Parameter changes that were proposed from a what-if.

Revision ID: 0012
Revises: 0011
Create Date: 2026-11-21
"""

from alembic import op

revision = "0012"
down_revision: str | None = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("""
        CREATE TABLE parameter_proposal (
            id BIGINT GENERATED ALWAYS AS IDENTITY,
            machine_id INTEGER NOT NULL,
            characteristic_id INTEGER NOT NULL,
            from_version INTEGER NOT NULL,
            changes JSONB NOT NULL,
            evidence JSONB NOT NULL,
            reason TEXT NOT NULL,
            proposed_at timestamptz DEFAULT now() NOT NULL,
            proposed_by TEXT NOT NULL,
            status TEXT DEFAULT 'open' NOT NULL,
            decided_at timestamptz,
            decided_by TEXT,
            decided_why TEXT,
            made_version INTEGER,
            CONSTRAINT parameter_proposal_pkey PRIMARY KEY (id),
            CONSTRAINT parameter_proposal_status_check CHECK
                (status IN ('open', 'approved', 'rejected', 'withdrawn')),
            CONSTRAINT parameter_proposal_machine_id_characteristic_id_fkey FOREIGN KEY(machine_id, characteristic_id)
                REFERENCES characteristic (machine_id, id)
        )
    """)
    op.execute(
        "CREATE INDEX parameter_proposal_characteristic_idx ON parameter_proposal (machine_id, characteristic_id, id)"
    )
    op.execute("CREATE INDEX parameter_proposal_open_idx ON parameter_proposal (id) WHERE status = 'open'")


def downgrade() -> None:
    op.execute("DROP TABLE parameter_proposal")
