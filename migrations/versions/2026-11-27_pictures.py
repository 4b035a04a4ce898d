"""Pictures at the steps of reaction plans, and photos at alarms.

`downgrade` loses them; the record of changes keeps who sent which.

Revision ID: 0132
Revises: 0131
Create Date: 2026-11-27
"""

from alembic import op

revision = "0132"
down_revision: str | None = "0131"
branch_labels = None
depends_on = None

UPGRADE = (
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
    "CREATE SEQUENCE alarm_photo_id AS bigint",
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
    CREATE TRIGGER facts_stay BEFORE DELETE OR TRUNCATE OR UPDATE ON reaction_picture
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_loss()
    """,
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


def upgrade() -> None:
    for command in UPGRADE:
        op.execute(command)


def downgrade() -> None:
    for table in ("alarm_photo", "reaction_picture"):
        op.execute(f"DROP TABLE {table}")
    op.execute("DROP SEQUENCE alarm_photo_id")
