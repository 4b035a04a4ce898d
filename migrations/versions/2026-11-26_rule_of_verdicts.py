"""The rule by which a capability verdict was judged; those of rule 0 are judged again by the job.

Revision ID: 0115
Revises: 0111
Create Date: 2026-11-26
"""

from alembic import op

revision = "0115"
down_revision: str | None = "0111"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("ALTER TABLE capability_verdict ADD COLUMN rule INTEGER DEFAULT 0 NOT NULL")
    op.execute("ALTER TABLE capability_verdict ALTER COLUMN rule DROP DEFAULT")


def downgrade() -> None:
    op.execute("ALTER TABLE capability_verdict DROP COLUMN rule")
