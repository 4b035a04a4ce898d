"""The series that are compared: a characteristic and a run of its readings each. Never writes."""

from datetime import UTC, datetime
from enum import StrEnum
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.period import Period
from app.errors import Invalid
from app.language.i18n import _
from app.language.times import MINUTES, local, written
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.tables.characteristics import ParametersVersion
from app.loop.tables.readings import Reading
from app.loop.tools.lives_queries import Life, lives
from app.web.choice import Choice
from app.web.fields import HISTORY_BEGINS

MOST = 12  # series on a page
MOST_EACH = 4  # versions or tools of one characteristic


class SeriesBy(StrEnum):
    """Difference between the series of one characteristic."""

    CHARACTERISTIC = "characteristic"  # nothing: one series each
    VERSION = "version"
    TOOL = "tool"
    PERIOD = "period"


class Compared(NamedTuple):
    """One series: its name, and the readings of a characteristic."""

    name: str
    current: CurrentCharacteristic
    window: Window


def compared(session: Session, keys: list[str], by: SeriesBy, choice: Choice) -> list[Compared]:
    """The series, the older ones of a characteristic first. Raises `NotFound`, and `Invalid` for more than fit on a page."""
    found: list[Compared] = []
    for key in dict.fromkeys(keys):
        current = characteristics.characteristic_named(session, key)
        found += {
            SeriesBy.CHARACTERISTIC: _alone,
            SeriesBy.VERSION: _by_version,
            SeriesBy.TOOL: _by_tool,
            SeriesBy.PERIOD: _by_period,
        }[by](session, current, choice)
    if len(found) > MOST:
        raise Invalid.at("of", _("{n} series are too many; compare {most} at most").format(n=len(found), most=MOST))
    return found


def _alone(session: Session, current: CurrentCharacteristic, choice: Choice) -> list[Compared]:
    window = statistics.window_of(session, current.characteristic, **choice._asdict())
    return [Compared(current.characteristic.name, current, window)]


def _by_version(session: Session, current: CurrentCharacteristic, _choice: Choice) -> list[Compared]:
    """The last versions of the parameters by which readings were judged, each with all of these."""
    newest = statistics.window_of(session, current.characteristic).newest
    found: list[Compared] = []
    last = newest
    for version in characteristics.versions(session, current.characteristic):
        first = _first_judged_by(session, version, newest)
        if first <= last:
            name = _("{name}, version {n}").format(name=current.characteristic.name, n=version.version)
            found.append(Compared(name, current, Window(first, last, newest)))
            last = first - 1
        if len(found) == MOST_EACH:
            break
    return found[::-1]


def _first_judged_by(session: Session, version: ParametersVersion, newest: int) -> int:
    """Number of the first reading judged by this version or a later one; by halves, for versions only ever follow."""
    low, high = 1, newest + 1
    while low < high:
        middle = (low + high) // 2
        by = session.scalar(
            select(Reading.parameters_version).where(
                Reading.machine_id == version.machine_id,
                Reading.characteristic_id == version.characteristic_id,
                Reading.sequence == middle,
            )
        )
        low, high = (low, middle) if by is None or by >= version.version else (middle + 1, high)
    return low


def _by_tool(session: Session, current: CurrentCharacteristic, _choice: Choice) -> list[Compared]:
    """The last tools in its location, each from tool change to tool change."""
    number = current.parameters.tool_memory
    if not number:
        return []
    return [
        Compared(
            f"{current.characteristic.name}, {_life(life)}",
            current,
            statistics.window_of(session, current.characteristic, period=Period(life.began_at, life.ended_at)),
        )
        for life in lives(session, current.machine, number).lives[:MOST_EACH][::-1]
    ]


def _life(life: Life) -> str:
    if life.began_at is None:
        return _("first tool") if life.ended_at else _("tool")
    return _("tool of {since}").format(since=written(life.began_at, MINUTES))


def begin_before(start: datetime, end: datetime) -> datetime:
    """The beginning of the period before; by the clock of the plant, so that before a day lies a day when the clocks change."""
    try:
        return local(start) - (local(end) - local(start))
    except OverflowError:  # the calendar does not go so far, and readings go less far
        return HISTORY_BEGINS


def _by_period(session: Session, current: CurrentCharacteristic, choice: Choice) -> list[Compared]:
    """The period and the one before it: as long by the clock, or as many readings."""
    now = statistics.window_of(session, current.characteristic, **choice._asdict())
    start = choice.period.start
    if start is not None:
        begin = begin_before(start, choice.period.end or datetime.now(UTC))
        before = statistics.window_of(session, current.characteristic, period=Period(begin, start))
    else:
        through = now.first - 1
        before = Window(max(1, through - now.count + 1), through, now.newest)
    name = current.characteristic.name
    return [Compared(_("{name}, before").format(name=name), current, before), Compared(name, current, now)]
