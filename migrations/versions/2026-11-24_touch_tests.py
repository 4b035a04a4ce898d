"""Touch tests of tool locations, guided at the page.

`downgrade` loses them; the record of changes keeps who asked, answered and what came of it.

Revision ID: 0110
Revises: 0109
Create Date: 2026-11-24
"""

from alembic import op

revision = "0110"
down_revision: str | None = "0109"
branch_labels = None
depends_on = None

UPGRADE = (
    "CREATE SEQUENCE touch_test_id AS bigint",  # one by one: a plant may lie on a node of Citus
    """
    CREATE TABLE touch_test (
        machine_id INTEGER NOT NULL,
        id BIGINT DEFAULT nextval('touch_test_id') NOT NULL,
        tool_memory INTEGER NOT NULL,
        amount FLOAT NOT NULL,
        asked_at timestamptz DEFAULT now() NOT NULL,
        asked_by TEXT NOT NULL,
        state TEXT NOT NULL,
        state_at timestamptz DEFAULT now() NOT NULL,
        answered_by TEXT,
        refused TEXT,
        mapping TEXT,
        place TEXT,
        unit TEXT,
        before FLOAT,
        shown_before FLOAT,
        shown_after FLOAT,
        detail TEXT,
        ended_at timestamptz,
        CONSTRAINT touch_test_pkey PRIMARY KEY (machine_id, id),
        CONSTRAINT touch_test_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
    )
    """,
    "CREATE INDEX touch_test_id_key ON touch_test (id)",
    "CREATE UNIQUE INDEX touch_test_open_key ON touch_test (machine_id) WHERE ended_at IS NULL",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF machine_id, id, tool_memory, amount, asked_at, asked_by ON touch_test
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER closed_stays BEFORE UPDATE ON touch_test FOR EACH ROW WHEN (OLD.ended_at IS NOT NULL)
        EXECUTE FUNCTION refuse_loss()
    """,
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    op.execute("DROP TABLE touch_test")
    op.execute("DROP SEQUENCE touch_test_id")
