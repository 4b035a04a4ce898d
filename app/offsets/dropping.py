"""Corrections that were computed for an offset which is no more."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from app.machines.tables import Machine
from app.offsets import queries
from app.offsets.tables import Correction


def supersede(
    session: Session, machine: Machine, number: int, now: datetime, who: str | None, reason: str
) -> Sequence[Correction]:
    """All that is open for this tool falls. who: None for the system itself, whose reason is then a code of `wording`."""
    fallen = queries.open_corrections(session, machine, number)
    for correction in fallen:
        correction.status, correction.reason = "superseded", reason
        correction.decided_at, correction.decided_by = now, who
    session.flush()
    return fallen
