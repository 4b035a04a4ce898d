"""Notes that people write at a machine or at a characteristic.

`downgrade` loses the notes; the record of changes keeps their words.

Revision ID: 0108
Revises: 0107
Create Date: 2026-11-23
"""

from alembic import op

revision = "0108"
down_revision: str | None = "0107"
branch_labels = None
depends_on = None

UPGRADE = (
    "CREATE SEQUENCE note_id AS bigint",  # one by one: a plant may lie on a node of Citus
    """
    CREATE TABLE note (
        machine_id INTEGER NOT NULL,
        id BIGINT DEFAULT nextval('note_id') NOT NULL,
        characteristic_id INTEGER,
        sequence BIGINT,
        at timestamptz NOT NULL,
        text TEXT NOT NULL,
        key TEXT,
        written_at timestamptz DEFAULT now() NOT NULL,
        written_by TEXT NOT NULL,
        person_id INTEGER,
        key_id INTEGER,
        withdrawn_at timestamptz,
        withdrawn_by TEXT,
        withdrawn_why TEXT,
        CONSTRAINT note_pkey PRIMARY KEY (machine_id, id),
        CONSTRAINT note_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id),
        CONSTRAINT note_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id)
    )
    """,
    "CREATE INDEX note_id_key ON note (id)",
    "CREATE INDEX note_at_idx ON note (machine_id, at)",
    "CREATE UNIQUE INDEX note_key_key ON note (machine_id, key) WHERE key IS NOT NULL",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF machine_id, id, characteristic_id, sequence, at, text, key, written_at, written_by, person_id, key_id ON note
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER closed_stays BEFORE UPDATE ON note FOR EACH ROW WHEN (OLD.withdrawn_at IS NOT NULL)
        EXECUTE FUNCTION refuse_loss()
    """,
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    op.execute("DROP TABLE note")
    op.execute("DROP SEQUENCE note_id")
