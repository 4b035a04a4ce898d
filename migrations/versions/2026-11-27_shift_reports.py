"""Reports of shifts by mail: who wants them, and up to which shift they were sent.

`downgrade` loses both, and the record of these deliveries.

Revision ID: 0126
Revises: 0125
Create Date: 2026-11-27
"""

from alembic import op

revision = "0126"
down_revision: str | None = "0125"
branch_labels = None
depends_on = None

ABOUT = "ALTER TABLE delivery ADD CONSTRAINT delivery_about_check CHECK (about IN ({}))"
UPGRADE = (
    "ALTER TABLE receiver ADD COLUMN shift_report BOOLEAN DEFAULT false NOT NULL",
    "ALTER TABLE receiver ADD COLUMN shift_reported timestamptz",
    "ALTER TABLE delivery DROP CONSTRAINT delivery_about_check",
    ABOUT.format("'alarms', 'changes', 'test', 'shift'"),
)
DOWNGRADE = (
    "DELETE FROM delivery WHERE about = 'shift'",
    "ALTER TABLE delivery DROP CONSTRAINT delivery_about_check",
    ABOUT.format("'alarms', 'changes', 'test'"),
    "ALTER TABLE receiver DROP COLUMN shift_reported",
    "ALTER TABLE receiver DROP COLUMN shift_report",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
