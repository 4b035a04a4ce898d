"""Entry of the causes of signals."""

from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.quality.chart_signals import queries
from app.quality.chart_signals.queries import SignalRow
from app.quality.chart_signals.wording import Cause


def explain(session: Session, number: int, cause: Cause, comment: str, caller: Caller) -> SignalRow:
    """Store the cause of a signal; a later one replaces it, and the record of changes keeps both. Raises `NotFound`."""
    row = queries.signal(session, number)
    signal = row.signal
    before = None if signal.explained_at is None else {"cause": signal.cause, "comment": signal.comment}
    signal.explained_at, signal.explained_by = datetime.now(UTC), caller.name
    signal.cause, signal.comment = cause.value, comment
    session.flush()
    record(
        session,
        caller.name,
        "signal explained",
        f"signal/{number}",
        before,
        {"cause": cause.value, "comment": comment, "characteristic": row.characteristic.key},
        comment,
    )
    publish(
        session,
        {
            "kind": "signal",
            "machine": row.machine.key,
            "characteristic": row.characteristic.key,
            "id": number,
        },
    )
    return queries.signal(session, number)
