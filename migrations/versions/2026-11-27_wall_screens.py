"""Wall screens: the keys that open one, as their SHA-256.

`downgrade` loses them; the record of changes keeps who made which.

Revision ID: 0127
Revises: 0126
Create Date: 2026-11-27
"""

from alembic import op

revision = "0127"
down_revision: str | None = "0126"
branch_labels = None
depends_on = None

TABLE = """
CREATE TABLE wall_screen (
    id INTEGER GENERATED ALWAYS AS IDENTITY,
    secret_hash BYTEA NOT NULL,
    name TEXT NOT NULL,
    created_at timestamptz DEFAULT now() NOT NULL,
    created_by TEXT NOT NULL,
    last_used_at timestamptz,
    revoked_at timestamptz,
    CONSTRAINT wall_screen_pkey PRIMARY KEY (id),
    CONSTRAINT wall_screen_secret_hash_key UNIQUE (secret_hash)
)
"""


def upgrade() -> None:
    op.execute(TABLE)


def downgrade() -> None:
    op.execute("DROP TABLE wall_screen")
