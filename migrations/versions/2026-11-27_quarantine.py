"""Parts that are set aside because of an alarm.

`downgrade` loses them; the record of changes keeps who decided what about each.

Revision ID: 0121
Revises: 0120
Create Date: 2026-11-27
"""

from alembic import op

revision = "0121"
down_revision: str | None = "0120"
branch_labels = None
depends_on = None

UPGRADE = (
    "CREATE SEQUENCE quarantine_id AS bigint",
    """
    CREATE TABLE quarantine (
        machine_id INTEGER NOT NULL,
        id BIGINT DEFAULT nextval('quarantine_id') NOT NULL,
        alarm_id BIGINT NOT NULL,
        made_at timestamptz DEFAULT now() NOT NULL,
        made_by TEXT NOT NULL,
        reason TEXT NOT NULL,
        guard DOUBLE PRECISION DEFAULT 0 NOT NULL,
        by_hand_only BOOLEAN DEFAULT false NOT NULL,
        CONSTRAINT quarantine_pkey PRIMARY KEY (machine_id, id),
        CONSTRAINT quarantine_machine_id_fkey FOREIGN KEY (machine_id) REFERENCES machine (id)
    )
    """,
    "CREATE INDEX quarantine_id_key ON quarantine (id)",
    "CREATE UNIQUE INDEX quarantine_alarm_key ON quarantine (machine_id, alarm_id)",
    """
    CREATE TABLE quarantined_part (
        machine_id INTEGER NOT NULL,
        quarantine_id BIGINT NOT NULL,
        number INTEGER NOT NULL,
        characteristic_id INTEGER NOT NULL,
        sequence BIGINT,
        part TEXT,
        part_to TEXT,
        "order" TEXT,
        cut_at timestamptz,
        tool_memory INTEGER,
        "offset" DOUBLE PRECISION,
        cut_without INTEGER[] DEFAULT '{}' NOT NULL,
        deviation DOUBLE PRECISION,
        measured DOUBLE PRECISION,
        found TEXT NOT NULL,
        status TEXT DEFAULT 'open' NOT NULL,
        decided_at timestamptz,
        decided_by TEXT,
        reason TEXT,
        remeasured DOUBLE PRECISION,
        CONSTRAINT quarantined_part_pkey PRIMARY KEY (machine_id, quarantine_id, number),
        CONSTRAINT quarantined_part_machine_id_quarantine_id_fkey FOREIGN KEY (machine_id, quarantine_id)
            REFERENCES quarantine (machine_id, id),
        CONSTRAINT quarantined_part_machine_id_characteristic_id_fkey FOREIGN KEY (machine_id, characteristic_id)
            REFERENCES characteristic (machine_id, id),
        CONSTRAINT quarantined_part_status_check CHECK (status IN ('open', 'released', 'scrapped'))
    )
    """,
    "CREATE INDEX quarantined_part_open_idx ON quarantined_part (machine_id, quarantine_id) WHERE status = 'open'",
    "CREATE INDEX quarantined_part_characteristic_idx ON quarantined_part (machine_id, characteristic_id)",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE ON quarantine
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF machine_id, quarantine_id, number, characteristic_id ON quarantined_part
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER closed_stays BEFORE UPDATE ON quarantined_part FOR EACH ROW WHEN (OLD.status <> 'open')
        EXECUTE FUNCTION refuse_loss()
    """,
)


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    op.execute("DROP TABLE quarantined_part")
    op.execute("DROP TABLE quarantine")
    op.execute("DROP SEQUENCE quarantine_id")
