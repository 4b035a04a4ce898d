"""Reports that are made in the background.

Revision ID: 0013
Revises: 0012
Create Date: 2026-11-21
"""

from alembic import op

revision = "0013"
down_revision: str | None = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("""
        CREATE TABLE report_job (
            id INTEGER GENERATED ALWAYS AS IDENTITY,
            asked_by TEXT NOT NULL,
            asked_at timestamptz DEFAULT now() NOT NULL,
            request JSONB NOT NULL,
            state TEXT DEFAULT 'queued' NOT NULL,
            done INTEGER DEFAULT 0 NOT NULL,
            total INTEGER NOT NULL,
            problems INTEGER DEFAULT 0 NOT NULL,
            current TEXT,
            taken_by TEXT,
            started_at timestamptz,
            finished_at timestamptz,
            finished_by TEXT,
            trouble TEXT,
            file_name TEXT,
            size INTEGER,
            CONSTRAINT report_job_pkey PRIMARY KEY (id),
            CONSTRAINT report_job_state_check CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled'))
        )
    """)
    op.execute("CREATE INDEX report_job_open_idx ON report_job (id) WHERE state IN ('queued', 'running')")
    op.execute("CREATE INDEX report_job_finished_idx ON report_job (finished_at) WHERE finished_at IS NOT NULL")
    op.execute("""
        CREATE TABLE report_part (
            job_id INTEGER NOT NULL,
            place INTEGER NOT NULL,
            characteristic TEXT NOT NULL,
            content BYTEA,
            trouble TEXT,
            CONSTRAINT report_part_pkey PRIMARY KEY (job_id, place),
            CONSTRAINT report_part_job_id_fkey FOREIGN KEY(job_id) REFERENCES report_job (id) ON DELETE CASCADE
        )
    """)
    # Files are packed already: no second packing by the database.
    op.execute("ALTER TABLE report_part ALTER COLUMN content SET STORAGE EXTERNAL")
    op.execute("""
        CREATE TABLE report_file (
            job_id INTEGER NOT NULL,
            content BYTEA NOT NULL,
            CONSTRAINT report_file_pkey PRIMARY KEY (job_id),
            CONSTRAINT report_file_job_id_fkey FOREIGN KEY(job_id) REFERENCES report_job (id) ON DELETE CASCADE
        )
    """)
    op.execute("ALTER TABLE report_file ALTER COLUMN content SET STORAGE EXTERNAL")


def downgrade() -> None:
    op.execute("DROP TABLE report_file")
    op.execute("DROP TABLE report_part")
    op.execute("DROP TABLE report_job")
