"""The index of each of the last weeks, kept beside the verdict by the periodic job. Lengths in mm."""

from collections.abc import Mapping, Sequence
from datetime import UTC, date, datetime, time, timedelta
from typing import TYPE_CHECKING, Any

from sqlalchemy import text
from sqlalchemy.orm import Session

from app.core.period import Period
from app.errors import Invalid
from app.language.times import local, plant_zone
from app.loop.characteristics.queries import CurrentCharacteristic, characteristic_named
from app.loop.summaries import queries as statistics
from app.loop.timeline.figures import TOOL_CHANGE
from app.loop.timeline.queries import events_over_time
from app.quality.capability.kinds import WEEKS, Week
from app.quality.capability.queries import judgement_of

if TYPE_CHECKING:
    from app.quality.capability.verdict_queries import State

SHARE, AFTER = 0.05, timedelta(hours=1)
"""Weeks are judged again after this share of new readings among those of the newest week, or after so long with any."""

_TOUCHED = """
SELECT DISTINCT CAST(date_trunc('week', measured_at AT TIME ZONE :zone) AS date) FROM reading
WHERE machine_id = :machine AND characteristic_id = :characteristic AND sequence > :newest AND measured_at >= :begin
"""


def weeks_of(stored: Mapping[str, Any] | None) -> list[Week]:
    """The weeks that were stored, the oldest first."""
    weeks = (stored or {}).get("weeks", {})
    return [Week(date.fromisoformat(day), *weeks[day]) for day in sorted(weeks)]


def judged(session: Session, state: "State", before: Mapping[str, Any] | None, rule: int) -> dict[str, Any]:
    """Judge the weeks in which readings have come since, all of them where the rule or the excluded readings have changed."""
    now = datetime.now(UTC)
    monday = local(now).date() - timedelta(days=local(now).weekday())
    all_weeks = [monday - timedelta(weeks=ago) for ago in range(WEEKS)]
    current = characteristic_named(session, state.key)
    depends = [rule, state.excluded]
    known: dict[str, Any] = {}
    wanted = all_weeks
    if before is not None and before["depends"] == depends:
        known = {day: row for day, row in before["weeks"].items() if date.fromisoformat(day) >= all_weeks[-1]}
        new, newest_week = state.newest - before["newest"], max(known.values(), key=lambda row: row[0], default=[0])
        if new <= SHARE * newest_week[0] and now - datetime.fromisoformat(before["at"]) < AFTER:
            return dict(before)
        wanted = [week for week in _touched(session, state, before["newest"], all_weeks[-1]) if week in all_weeks]
    for week in wanted:
        row = _row(session, current, week)
        if row is not None:
            known[week.isoformat()] = row
    return {"at": now.isoformat(), "newest": state.newest, "depends": depends, "weeks": known}


def tool_changes(session: Session, current: CurrentCharacteristic, weeks: Sequence[Week]) -> list[datetime]:
    """Moments at which the tool was changed since the first of these weeks, by the readings that it cut."""
    if not weeks:
        return []
    window = statistics.window_of(session, current.characteristic, period=Period(_begin(weeks[0].begins), None))
    events = events_over_time(session, current, window.first, window.last) if window.count else []
    return [event.at for event in events if event.kind == TOOL_CHANGE and isinstance(event.at, datetime)]


def _begin(week: date) -> datetime:
    return datetime.combine(week, time(), plant_zone())


def _touched(session: Session, state: "State", newest: int, first: date) -> list[date]:
    places = {"machine": state.machine_id, "characteristic": state.characteristic_id, "newest": newest}
    rows = session.execute(text(_TOUCHED), places | {"zone": plant_zone().key, "begin": _begin(first)})
    return [day for (day,) in rows]


def _row(session: Session, current: CurrentCharacteristic, week: date) -> list[Any] | None:
    period = Period(_begin(week), _begin(week + timedelta(weeks=1)))
    window = statistics.window_of(session, current.characteristic, period=period)
    if not window.count:
        return None
    try:
        judgement = judgement_of(session, current, window)
    except Invalid:  # more readings than are judged at once
        return None
    if not len(judgement.values):
        return None
    quoting = judgement.quoting
    return [len(judgement.values), quoting.value, quoting.low, quoting.high]
