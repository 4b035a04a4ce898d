"""Since when a receiver fails and why, and to whom that was reported.

`downgrade` deletes the messages about receivers; the record of changes is not concerned.

Revision ID: 0140
Revises: 0139
Create Date: 2026-11-30
"""

from alembic import op

revision = "0140"
down_revision: str | None = "0139"
branch_labels = None
depends_on = None

UPGRADE = (  # one by one: a plant may lie on a node of Citus
    "ALTER TABLE receiver ADD COLUMN failing_since TIMESTAMP WITH TIME ZONE",
    "ALTER TABLE receiver ADD COLUMN failure TEXT",
    "ALTER TABLE receiver ADD COLUMN reported JSONB DEFAULT '{}' NOT NULL",
    """
    UPDATE receiver SET failing_since = now(), failure = (
        SELECT answer FROM delivery WHERE receiver_id = receiver.id AND state = 'failed' ORDER BY id DESC LIMIT 1
    ) WHERE failures > 0
    """,
    "ALTER TABLE delivery ADD COLUMN receivers JSONB DEFAULT '[]' NOT NULL",
    "ALTER TABLE delivery DROP CONSTRAINT delivery_about_check",
    """
    ALTER TABLE delivery
    ADD CONSTRAINT delivery_about_check CHECK (about IN ('alarms', 'changes', 'test', 'shift', 'receivers'))
    """,
)
DOWNGRADE = (
    "DELETE FROM delivery WHERE about = 'receivers'",
    "ALTER TABLE delivery DROP CONSTRAINT delivery_about_check",
    """
    ALTER TABLE delivery
    ADD CONSTRAINT delivery_about_check CHECK (about IN ('alarms', 'changes', 'test', 'shift'))
    """,
    "ALTER TABLE delivery DROP COLUMN receivers",
    "ALTER TABLE receiver DROP COLUMN reported",
    "ALTER TABLE receiver DROP COLUMN failure",
    "ALTER TABLE receiver DROP COLUMN failing_since",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
