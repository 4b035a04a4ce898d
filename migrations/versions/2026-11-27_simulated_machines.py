"""A machine that is simulated says so, for good: it alone can be removed again, with all that it has left.

Revision ID: 0124
Revises: 0123
Create Date: 2026-11-27
"""

from alembic import op

revision = "0124"
down_revision: str | None = "0123"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("ALTER TABLE machine ADD COLUMN simulated BOOLEAN DEFAULT false NOT NULL")
    op.execute(
        "CREATE TRIGGER simulated_stays BEFORE UPDATE OF simulated ON machine"
        " FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()"
    )


def downgrade() -> None:
    op.execute("DROP TRIGGER simulated_stays ON machine")
    op.execute("ALTER TABLE machine DROP COLUMN simulated")
