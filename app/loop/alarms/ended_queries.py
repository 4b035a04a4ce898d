"""Alarms that end by themselves: what they were about is over, however that became known, and no person answered them."""

from sqlalchemy import ColumnElement, func

from app.loop.alarms.kinds import kinds
from app.loop.tables.alarms import Alarm


def codes() -> list[str]:
    """The outcomes with which alarms end by themselves: those of the kinds. No answer of a person has one of them.

    The name in `acknowledged_by` does not say it: it may be that of the bridge which reported the end, or of who calibrated.
    """
    return sorted({code for kind in kinds() for code in kind.outcomes})


def by_itself(alarm: Alarm) -> bool:
    """Tell if an alarm has ended by itself."""
    return any(each["code"] in codes() for each in (alarm.outcome or [])[:1])


def is_by_itself() -> ColumnElement[bool]:
    """As `by_itself`, of the rows of a query."""
    return func.coalesce(Alarm.outcome[0]["code"].astext.in_(codes()), False)
