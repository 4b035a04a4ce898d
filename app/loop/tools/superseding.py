"""Superseding of corrections that were computed for an earlier offset."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from app.loop.tables.machines import Machine
from app.loop.tables.tools import Correction
from app.loop.tools import queries


def supersede(
    session: Session, machine: Machine, number: int, now: datetime, who: str | None, reason: str
) -> Sequence[Correction]:
    """Supersede all open corrections of this tool. who: None for the program, whose reason is then a code of `wording`."""
    fallen = queries.open_corrections(session, machine, number)
    for correction in fallen:
        correction.status, correction.reason = "superseded", reason
        correction.decided_at, correction.decided_by = now, who
    session.flush()
    return fallen
