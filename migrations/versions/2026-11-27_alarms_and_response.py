"""Notifications of alarms, reaction plans with pictures, photos at alarms, and parts set aside because of one.

`downgrade` loses them; the record of changes keeps who set up which, what was answered to each alarm, who sent which picture
and who decided what about each part.

Revision ID: 0135
Revises: 0113
Create Date: 2026-11-27
"""

from alembic import op

revision = "0135"
down_revision: str | None = "0113"
branch_labels = None
depends_on = None

NUMBERED = (
    "receiver",
    "notification_route",
    "delivery",
    "reaction_plan",
    "catalogue_entry",
    "alarm_photo",
    "quarantine",
)
OF_ALARM = ("cause BIGINT", "corrective_action BIGINT", "reaction_plan BIGINT", "reaction_version INTEGER")

NOTIFICATIONS = (  # one by one: a plant may lie on a node of Citus
    """
    CREATE TABLE receiver (
        id BIGINT DEFAULT nextval('receiver_id') NOT NULL,
        name TEXT NOT NULL,
        means TEXT NOT NULL,
        address TEXT NOT NULL,
        secret TEXT,
        person_id INTEGER,
        quiet JSONB DEFAULT '[]' NOT NULL,
        away_until timestamptz,
        events JSONB DEFAULT '[]' NOT NULL,
        cursor BIGINT DEFAULT 0 NOT NULL,
        failures INTEGER DEFAULT 0 NOT NULL,
        retry_at timestamptz,
        busy_until timestamptz,
        last_at timestamptz,
        created_at timestamptz DEFAULT now() NOT NULL,
        created_by TEXT NOT NULL,
        deleted_at timestamptz,
        shift_report BOOLEAN DEFAULT false NOT NULL,
        shift_reported timestamptz,
        CONSTRAINT receiver_pkey PRIMARY KEY (id),
        CONSTRAINT receiver_person_id_fkey FOREIGN KEY (person_id) REFERENCES person (id),
        CONSTRAINT receiver_means_check CHECK (means IN ('mail', 'webhook', 'apprise'))
    ) WITH (fillfactor = 50)
    """,
    """
    CREATE UNIQUE INDEX receiver_person_key ON receiver (person_id)
        WHERE person_id IS NOT NULL AND deleted_at IS NULL
    """,
    """
    CREATE TABLE notification_route (
        id BIGINT DEFAULT nextval('notification_route_id') NOT NULL,
        name TEXT NOT NULL,
        enabled BOOLEAN DEFAULT true NOT NULL,
        rule JSONB NOT NULL,
        created_at timestamptz DEFAULT now() NOT NULL,
        created_by TEXT NOT NULL,
        CONSTRAINT notification_route_pkey PRIMARY KEY (id)
    )
    """,
    """
    CREATE TABLE announced (
        alarm_id BIGINT NOT NULL,
        receiver_id BIGINT NOT NULL,
        at timestamptz NOT NULL,
        CONSTRAINT announced_pkey PRIMARY KEY (alarm_id, receiver_id),
        CONSTRAINT announced_receiver_id_fkey FOREIGN KEY (receiver_id) REFERENCES receiver (id)
    )
    """,
    "CREATE INDEX announced_at_idx ON announced (at)",
    """
    CREATE TABLE delivery (
        id BIGINT DEFAULT nextval('delivery_id') NOT NULL,
        receiver_id BIGINT NOT NULL,
        about TEXT NOT NULL,
        subject TEXT NOT NULL,
        alarms JSONB DEFAULT '[]' NOT NULL,
        changes INTEGER DEFAULT 0 NOT NULL,
        state TEXT NOT NULL,
        asked_at timestamptz DEFAULT now() NOT NULL,
        asked_by TEXT,
        ended_at timestamptz,
        answer TEXT,
        CONSTRAINT delivery_pkey PRIMARY KEY (id),
        CONSTRAINT delivery_receiver_id_fkey FOREIGN KEY (receiver_id) REFERENCES receiver (id),
        CONSTRAINT delivery_about_check CHECK (about IN ('alarms', 'changes', 'test', 'shift')),
        CONSTRAINT delivery_state_check CHECK (state IN ('waiting', 'sending', 'delivered', 'failed', 'lost'))
    )
    """,
    "CREATE INDEX delivery_open_idx ON delivery (receiver_id) WHERE state IN ('waiting', 'sending')",
    "CREATE INDEX delivery_asked_idx ON delivery (asked_at)",
)
REACTION = (
    """
    CREATE TABLE reaction_plan (
        id BIGINT NOT NULL,
        version INTEGER NOT NULL,
        name TEXT NOT NULL,
        characteristic TEXT,
        kind TEXT,
        rule TEXT,
        steps JSONB NOT NULL,
        cause_needed BOOLEAN NOT NULL,
        action_needed BOOLEAN NOT NULL,
        receivers JSONB NOT NULL,
        ended BOOLEAN NOT NULL,
        reason TEXT NOT NULL,
        made_at timestamptz DEFAULT now() NOT NULL,
        made_by TEXT NOT NULL,
        CONSTRAINT reaction_plan_pkey PRIMARY KEY (id, version)
    )
    """,
    """
    CREATE TABLE catalogue_entry (
        id BIGINT DEFAULT nextval('catalogue_entry_id') NOT NULL,
        sort TEXT NOT NULL,
        name TEXT NOT NULL,
        made_at timestamptz DEFAULT now() NOT NULL,
        made_by TEXT NOT NULL,
        retired_at timestamptz,
        CONSTRAINT catalogue_entry_pkey PRIMARY KEY (id),
        CONSTRAINT catalogue_entry_sort_check CHECK (sort IN ('cause', 'action'))
    )
    """,
    "CREATE UNIQUE INDEX catalogue_entry_name_key ON catalogue_entry (sort, lower(name))",
    """
    CREATE TABLE reaction_picture (
        digest TEXT NOT NULL,
        media_type TEXT NOT NULL,
        width INTEGER NOT NULL,
        height INTEGER NOT NULL,
        size INTEGER NOT NULL,
        content BYTEA NOT NULL,
        made_at timestamptz DEFAULT now() NOT NULL,
        made_by TEXT NOT NULL,
        CONSTRAINT reaction_picture_pkey PRIMARY KEY (digest)
    )
    """,
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE ON reaction_plan
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE OF id, sort, name, made_at, made_by ON catalogue_entry
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE ON reaction_picture
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
)
ALARMS = (
    *(f"ALTER TABLE alarm ADD COLUMN {column}" for column in OF_ALARM),
    "CREATE INDEX alarm_raised_idx ON alarm (raised_at)",  # of one shift among those of years
    # Control plans look for the last alarm of a tool with every reading.
    "CREATE INDEX alarm_tool_idx ON alarm (machine_id, tool_memory, id) WHERE characteristic_id IS NULL",
    """
    CREATE TABLE alarm_photo (
        machine_id INTEGER NOT NULL,
        id BIGINT DEFAULT nextval('alarm_photo_id') NOT NULL,
        alarm_id BIGINT NOT NULL,
        digest TEXT NOT NULL,
        media_type TEXT NOT NULL,
        width INTEGER NOT NULL,
        height INTEGER NOT NULL,
        size INTEGER NOT NULL,
        content BYTEA,
        made_at timestamptz DEFAULT now() NOT NULL,
        made_by TEXT NOT NULL,
        removed_at timestamptz,
        removed_by TEXT,
        removed_why TEXT,
        CONSTRAINT alarm_photo_pkey PRIMARY KEY (machine_id, id),
        CONSTRAINT alarm_photo_machine_id_alarm_id_fkey FOREIGN KEY (machine_id, alarm_id) REFERENCES alarm (machine_id, id)
    )
    """,
    "CREATE UNIQUE INDEX alarm_photo_alarm_key ON alarm_photo (machine_id, alarm_id, digest)",
    """
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE
        OF machine_id, id, alarm_id, digest, media_type, width, height, size, made_at, made_by ON alarm_photo
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
    """
    CREATE TRIGGER shown_stays BEFORE UPDATE ON alarm_photo
        FOR EACH ROW WHEN (OLD.content IS NULL OR NEW.content IS NOT NULL) EXECUTE FUNCTION refuse_loss()
    """,
)
QUARANTINE = (
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
TABLES = (
    "quarantined_part", "quarantine", "alarm_photo", "reaction_picture", "catalogue_entry", "reaction_plan",
    "delivery", "announced", "notification_route", "receiver",
)  # fmt: skip
DOWNGRADE = (
    *(f"DROP TABLE {table}" for table in TABLES),
    "DROP INDEX alarm_tool_idx",
    "DROP INDEX alarm_raised_idx",
    *(f"ALTER TABLE alarm DROP COLUMN {column.partition(' ')[0]}" for column in reversed(OF_ALARM)),
    *(f"DROP SEQUENCE {table}_id" for table in NUMBERED),
)


def upgrade() -> None:
    for table in NUMBERED:
        op.execute(f"CREATE SEQUENCE {table}_id AS bigint")
    for command in NOTIFICATIONS + REACTION + ALARMS + QUARANTINE:
        op.execute(command)


def downgrade() -> None:
    for command in DOWNGRADE:
        op.execute(command)
