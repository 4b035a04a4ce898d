"""Tools that are paused, tool edges and sister tools, expiry and plausibility.

Revision ID: 0007
Revises: 0006
Create Date: 2026-11-21
"""

from alembic import op

revision = "0007"
down_revision: str | None = "0006"
branch_labels = None
depends_on = None

COLUMNS = {
    "machine": (
        "corrections_expire_after float8 CONSTRAINT machine_corrections_expire_after_check CHECK (corrections_expire_after > 0)",
    ),
    "tool": (
        "paused_by BIGINT",
        "parts_kept INTEGER DEFAULT '0' NOT NULL",
        "edge TEXT",
        "name TEXT",
        "kind TEXT",
        "planned_parts INTEGER",
        "planned_total double precision",
        "sister INTEGER CONSTRAINT tool_sister_check CHECK (sister BETWEEN 1 AND 32 AND sister <> number)",
        "life_told BOOLEAN DEFAULT 'false' NOT NULL",
    ),
    "tool_event": (
        "total double precision",
        "edge TEXT",
        "name TEXT",
    ),
    "stream": (
        "level double precision",
        "level_sequence BIGINT",
    ),
}


def upgrade() -> None:
    for table, columns in COLUMNS.items():
        op.execute(f"ALTER TABLE {table} " + ", ".join(f"ADD COLUMN {column}" for column in columns))


def downgrade() -> None:
    for table, columns in COLUMNS.items():
        op.execute(f"ALTER TABLE {table} " + ", ".join(f"DROP COLUMN {column.split()[0]}" for column in columns))
