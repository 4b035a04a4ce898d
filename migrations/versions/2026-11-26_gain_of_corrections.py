"""From which reading on the effect of corrections is judged.

`downgrade` loses it: every reading of the newest ones tells of the gain again.

Revision ID: 0116
Revises: 0115
Create Date: 2026-11-26
"""

from alembic import op

revision = "0116"
down_revision: str | None = "0115"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.execute("ALTER TABLE stream ADD COLUMN gain_from BIGINT DEFAULT 0 NOT NULL")
    op.execute("UPDATE stream SET gain_from = sequence")  # parts of before say nothing: who knows what happened to them


def downgrade() -> None:
    op.execute("ALTER TABLE stream DROP COLUMN gain_from")
