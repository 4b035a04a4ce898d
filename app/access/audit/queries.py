"""Reading the record of changes."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.access.audit.tables import AuditEntry
from app.db.text import holds_words


def entries(
    session: Session,
    *,
    subject: str | None = None,
    actor: str | None = None,
    text: str | None = None,
    person: int | None = None,
    key: int | None = None,
    before: int | None = None,
    limit: int = 100,
) -> Sequence[AuditEntry]:
    """The newest first. ``person`` and ``key``: by their numbers. ``subject`` takes what lies below it too: `tool/lathe-1` has `tool/lathe-1/3`.

    ``text``: words that stand anywhere in who, what or why.
    """
    query = select(AuditEntry).order_by(AuditEntry.id.desc()).limit(limit)
    if subject:
        below = subject.rstrip("/") + "/"
        query = query.where((AuditEntry.subject == subject) | AuditEntry.subject.startswith(below, autoescape=True))
    if actor:
        query = query.where(AuditEntry.actor == actor)
    if text:
        places = (AuditEntry.actor, AuditEntry.action, AuditEntry.subject, AuditEntry.why)
        query = query.where(*holds_words(text, *places))
    if person is not None:
        query = query.where(AuditEntry.person_id == person)
    if key is not None:
        query = query.where(AuditEntry.key_id == key)
    if before is not None:
        query = query.where(AuditEntry.id < before)
    return session.scalars(query).all()
