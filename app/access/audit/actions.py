"""Writing the record of changes."""

from typing import Any

from sqlalchemy.orm import Session

from app.access.audit.entry_actions import NOBODY, Acting, acting, write
from app.db.engine import Database, driver_connection

__all__ = ["NOBODY", "Acting", "acts", "record"]


def acts(person_id: int | None, key_id: int | None, device_id: int | None = None) -> None:
    """Say who acts from now on in this request, and at which station device."""
    acting.set(Acting(person_id, key_id, device_id))


def record(
    session: Session,
    actor: str,
    action: str,
    subject: str,
    before: dict[str, Any] | None = None,
    after: dict[str, Any] | None = None,
    why: str | None = None,
    *,
    by: Acting | None = None,
) -> None:
    """Record a change, in the transaction that makes it.

    ``action`` is a short verb phrase (`characteristic changed`), ``subject`` names what was changed as `kind/key`
    (`characteristic/shaft-d40`, `tool/lathe-1/3`). Secrets and passwords are never part of before and after. ``by``: whose
    name ``actor`` is; without it, the sender of this request.
    """
    database: Database | None = session.info.get("database")
    if database is not None and database.copy_of is not None:  # what was only read has no transaction to be noted in
        with database.copy_of.begin() as own:
            write(driver_connection(own), actor, action, subject, before, after, why, by=by)
        return
    write(driver_connection(session), actor, action, subject, before, after, why, by=by)
