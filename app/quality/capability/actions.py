"""The periodic job that works out the index of each characteristic, so that the overview need not.

An index is not what readings are decided by: no machine is locked for it, and what the writer has in memory stays true.
"""

from datetime import UTC, datetime

from sqlalchemy import delete
from sqlalchemy.orm import Session

from app.core.spc.quoting import RULE
from app.jobs.actions import PeriodicJob, Unit
from app.quality.capability.tables import CapabilityVerdict
from app.quality.capability.verdict_queries import DUE_AFTER, DUE_SHARE, is_older, states, verdicts_of
from app.quality.capability.weekly import judged


def due(session: Session) -> list[Unit]:
    """Characteristics whose index is to be worked out again: of new readings, or by something else than before."""
    now = datetime.now(UTC)
    return [
        Unit(f"characteristic/{state.key}", (state.key,), state.machine_id, state.characteristic_id)
        for state, stored in states(session)
        if state.newest
        and (
            stored.newest is None
            or stored.newest.weeks is None
            or is_older(stored.newest, state, now, DUE_SHARE, DUE_AFTER)
        )
    ]


def judge(session: Session, unit: Unit) -> None:
    """Work out the index of one characteristic; the last one that could be quoted is kept beside one that may not be."""
    ((state, stored),) = states(session, unit.machine_id, unit.characteristic_id)
    newest, quotable = verdicts_of(session, state, stored.quotable)
    newest.weeks = judged(session, state, stored.newest.weeks if stored.newest else None, RULE)
    session.merge(newest)
    if newest.quotable or quotable is None:
        session.execute(
            delete(CapabilityVerdict).where(
                CapabilityVerdict.machine_id == state.machine_id,
                CapabilityVerdict.characteristic_id == state.characteristic_id,
                CapabilityVerdict.quotable != newest.quotable,
            )
        )
    elif quotable is not stored.quotable:
        session.merge(quotable)


JOB = PeriodicJob("capability_verdicts", due, judge)
