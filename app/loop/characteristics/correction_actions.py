"""Corrections fall where the offset or the parameters that they were computed for no longer hold."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from app.loop.tables.tools import Correction


def supersede(
    session: Session, corrections: Sequence[Correction], now: datetime, who: str | None, reason: str
) -> Sequence[Correction]:
    """Supersede these corrections. who: None for the program, whose reason is then a code of `app.loop.tools.wording`."""
    for correction in corrections:
        correction.status, correction.reason = "superseded", reason
        correction.decided_at, correction.decided_by = now, who
    session.flush()
    return corrections
