"""Browsers as receivers of notifications.

`downgrade` deletes those receivers and their deliveries; the record of changes keeps who had them.

Revision ID: 0138
Revises: 0137
Create Date: 2026-11-29
"""

from alembic import op

revision = "0138"
down_revision: str | None = "0137"
branch_labels = None
depends_on = None

UPGRADE = (  # one by one: a plant may lie on a node of Citus
    "ALTER TABLE delivery ADD COLUMN words TEXT",
    "ALTER TABLE receiver DROP CONSTRAINT receiver_means_check",
    """
    ALTER TABLE receiver
    ADD CONSTRAINT receiver_means_check CHECK (means IN ('mail', 'webhook', 'apprise', 'browser'))
    """,
    "DROP INDEX receiver_person_key",
    """
    CREATE UNIQUE INDEX receiver_person_key ON receiver (person_id, means)
    WHERE person_id IS NOT NULL AND deleted_at IS NULL
    """,
)
DOWNGRADE = (
    "DELETE FROM announced WHERE receiver_id IN (SELECT id FROM receiver WHERE means = 'browser')",
    "DELETE FROM delivery WHERE receiver_id IN (SELECT id FROM receiver WHERE means = 'browser')",
    "DELETE FROM receiver WHERE means = 'browser'",
    "DROP INDEX receiver_person_key",
    """
    CREATE UNIQUE INDEX receiver_person_key ON receiver (person_id)
    WHERE person_id IS NOT NULL AND deleted_at IS NULL
    """,
    "ALTER TABLE receiver DROP CONSTRAINT receiver_means_check",
    """
    ALTER TABLE receiver
    ADD CONSTRAINT receiver_means_check CHECK (means IN ('mail', 'webhook', 'apprise'))
    """,
    "ALTER TABLE delivery DROP COLUMN words",
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
