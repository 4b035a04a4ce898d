"""Receivers that fail: a person learns of it in the list of what waits, and by those receivers that are reached. Never writes.

One fails from `ENOUGH_FAILURES` in a row until the next message arrives. Browsers do not count: one that is closed shows nothing.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, Select, func, or_, select
from sqlalchemy.orm import Session

from app.access.queries import WITHOUT_ACCESS
from app.core import notify
from app.core.notify import ENOUGH_FAILURES
from app.language.times import plant_zone
from app.loop.notifications import queries
from app.loop.notifications.group_schemas import group_of
from app.loop.notifications.schemas import HoursIn, Rule, week
from app.loop.notifications.tables import NotificationRoute, Receiver

NOT_AGAIN = timedelta(hours=1)
"""In which a receiver that begins to fail again is not reported again to the same receiver."""
APART = timedelta(minutes=10)
"""Least time between two such messages to one receiver, however many others fail."""
IS_FAILING: ColumnElement[bool] = (
    (Receiver.failures >= ENOUGH_FAILURES)
    & (Receiver.means != "browser")
    & Receiver.deleted_at.is_(None)
    & or_(Receiver.person_id.is_(None), Receiver.person_id.not_in(WITHOUT_ACCESS))
)
COUNT: Select[int] = select(func.count(func.distinct(func.concat(Receiver.means, " ", Receiver.failure)))).where(
    IS_FAILING
)
"""Number of causes why receivers fail, as `causes` has them."""


def failing(session: Session) -> Sequence[Receiver]:
    """Receivers that fail, the longest first."""
    return session.scalars(select(Receiver).where(IS_FAILING).order_by(Receiver.failing_since, Receiver.id)).all()


def causes(rows: Iterable[Receiver]) -> list[list[Receiver]]:
    """Receivers that fail, those together to whom the same was answered: a mail server that is unreachable is one trouble."""
    found = defaultdict[tuple[str, str | None], list[Receiver]](list)
    for row in rows:
        found[row.means, row.failure].append(row)
    return list(found.values())


def to_report(
    session: Session, rows: Mapping[int, Receiver], free: set[int], same: Mapping[int, set[int]], now: datetime
) -> list[tuple[Receiver, list[Receiver]]]:
    """Receivers to be notified now that others fail, and of which.

    They are those that routes name, as far as they can be reached and neither are quiet nor away. free: those that may be tried;
    same: to each receiver those with its address.
    """
    fail = failing(session)
    if not fail:
        return []
    local = now.astimezone(plant_zone())
    groups = {row.id: group_of(row) for row in queries.groups(session)}
    stored = session.scalars(select(NotificationRoute.rule).where(NotificationRoute.enabled)).all()
    named = {
        number
        for rule in stored
        for step in Rule.model_validate(rule).value().steps
        for number in step.whom(groups, local)
    }
    found: dict[int, tuple[Receiver, list[Receiver]]] = {}
    for number in sorted(named & free & rows.keys()):
        row = rows[number]
        quiet = week(map(HoursIn.model_validate, row.quiet))
        if row.failures or not notify.Receiver(number, quiet, row.away_until).listens(now, local, urgent=False):
            continue
        news = [each for each in fail if each.id not in same[number] and _is_news(row, each, now)]
        if news and not any(now < at + APART for at in reported_at(row).values()):
            found.setdefault(min(same[number]), (row, news))  # one to each address
    return list(found.values())


def _is_news(row: Receiver, fails: Receiver, now: datetime) -> bool:
    """Tell if a receiver has yet to be notified that another one fails."""
    at = reported_at(row).get(fails.id)
    return at is None or (fails.failing_since is not None and at < min(fails.failing_since, now - NOT_AGAIN))


def reported_at(row: Receiver) -> dict[int, datetime]:
    """The times at which a receiver was notified that others fail, by their numbers."""
    return {int(number): datetime.fromisoformat(at) for number, at in row.reported.items()}
