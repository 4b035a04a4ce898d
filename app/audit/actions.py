"""Writing the record of changes."""

from typing import Any

from sqlalchemy import insert, null
from sqlalchemy.orm import Session

from app.audit.tables import AuditEntry


def record(
    session: Session,
    actor: str,
    action: str,
    subject: str,
    before: dict[str, Any] | None = None,
    after: dict[str, Any] | None = None,
    why: str | None = None,
) -> None:
    """Note that somebody changed something, in the transaction that changes it.

    ``action`` is a short verb phrase (`characteristic changed`), ``subject`` names what was changed as `kind/key`
    (`characteristic/shaft-d40`, `tool/lathe-1/3`). Secrets and passwords are never part of before and after.
    """
    session.execute(
        insert(AuditEntry).values(
            actor=actor,
            action=action,
            subject=subject,
            before=null() if before is None else before,
            after=null() if after is None else after,
            why=why or None,
        )
    )
