"""The series that are compared: a characteristic and a run of its readings each. Never writes."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from enum import StrEnum
from typing import NamedTuple

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from app.core.context import ContextField
from app.core.period import Period
from app.errors import Invalid
from app.language.formatting import as_read
from app.language.i18n import _
from app.language.times import local
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.readings.wording import field_word
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.tables.characteristics import ParametersVersion
from app.loop.tables.readings import Reading
from app.loop.tools.lives_queries import Life, lives
from app.web.choice import Choice, context_in_address
from app.web.fields import HISTORY_BEGINS
from app.web.paging import address

MOST = 12  # series on a page
MOST_EACH = 4  # versions or tools of one characteristic


class SeriesBy(StrEnum):
    """Difference between the series of one characteristic."""

    CHARACTERISTIC = "characteristic"  # nothing: one series each
    VERSION = "version"
    TOOL = "tool"
    PERIOD = "period"
    ORDER = "order"  # and what else the context of a reading says
    BATCH = "batch"
    NEST = "nest"
    SPINDLE = "spindle"
    FIXTURE = "fixture"
    OPERATOR = "operator"
    PROGRAM = "program"
    GAUGE = "gauge"

    @property
    def field(self) -> ContextField | None:
        """The field of the context that differs, if one does."""
        return ContextField(self.value) if self.value in set(ContextField) else None


class Compared(NamedTuple):
    """One series: its name, and the readings of a characteristic. began_at: of a tool, when it was changed in; of the first, the year 1900."""

    name: str
    current: CurrentCharacteristic
    window: Window
    began_at: datetime | None = None

    @property
    def href(self) -> str:
        """The page of these readings."""
        of = {"first": self.window.first, "through": self.window.last, **context_in_address(self.window.context)}
        return address(f"/characteristics/{self.current.characteristic.key}", **of)


def compared(
    session: Session, keys: list[str], by: SeriesBy, choice: Choice, tools: Sequence[datetime] = ()
) -> list[Compared]:
    """The series, the older ones of a characteristic first. tools: of the tools those that were changed in at these moments.

    Raises `NotFound`, and `Invalid` for more than fit on a page.
    """
    found: list[Compared] = []
    for key in dict.fromkeys(keys):
        current = characteristics.characteristic_named(session, key)
        if by is SeriesBy.TOOL:
            found += _by_tool(session, current, tools)
            continue
        if by.field is not None:
            found += _by_context(session, current, choice, by.field, MOST_EACH if len(set(keys)) > 1 else MOST)
            continue
        found += {
            SeriesBy.CHARACTERISTIC: _alone,
            SeriesBy.VERSION: _by_version,
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
    """Number of the first reading judged by this version or a later one; versions only ever follow."""
    of = (version.machine_id, version.characteristic_id)
    return _first_that(session, Reading.parameters_version >= version.version, *of, newest)


def _first_that(
    session: Session, holds: ColumnElement[bool], machine_id: int, characteristic_id: int, newest: int
) -> int:
    """Number of the first reading of which it holds, newest + 1 if of none; by halves, for it holds of all that follow."""
    low, high = 1, newest + 1
    while low < high:
        middle = (low + high) // 2
        found = session.scalar(
            select(holds).where(
                Reading.machine_id == machine_id,
                Reading.characteristic_id == characteristic_id,
                Reading.sequence == middle,
            )
        )
        low, high = (middle + 1, high) if found is False else (low, middle)
    return low


def tools_of(session: Session, current: CurrentCharacteristic) -> list[Compared]:
    """The tools in its location that cut readings, the present one first, each from tool change to tool change.

    A reading belongs to the tool that was in when it arrived: one that came late was cut before, and so was what came with it.
    """
    number = current.parameters.tool_memory
    if not number:
        return []
    machine_id, characteristic_id = current.machine.id, current.characteristic.id
    newest = statistics.window_of(session, current.characteristic).newest
    last, found = newest, []
    for life in lives(session, current.machine, number).lives:
        if life.ended_at is None:
            first = statistics.since_tool_change(session, current.characteristic).first
        elif life.began_at is None:
            first = 1
        else:
            first = _first_that(session, Reading.received_at >= life.began_at, machine_id, characteristic_id, newest)
        if first <= last:
            since = life.began_at and _cut_since(session, life.began_at, machine_id, characteristic_id, first)
            name = f"{current.characteristic.name}, {_life(life, since)}"
            found.append(Compared(name, current, Window(first, last, newest), life.began_at or HISTORY_BEGINS))
            last = first - 1
    return found


def _by_tool(session: Session, current: CurrentCharacteristic, chosen: Sequence[datetime]) -> list[Compared]:
    """The chosen tools; the last ones if none of them is of this location."""
    known = tools_of(session, current)
    return ([each for each in known if each.began_at in chosen] or known[:MOST_EACH])[::-1]


def _cut_since(session: Session, began_at: datetime, machine_id: int, characteristic_id: int, first: int) -> datetime:
    """The moment since when it cut: that of its first reading, where this came later than it was measured."""
    measured_at = session.scalar(
        select(Reading.measured_at).where(
            Reading.machine_id == machine_id,
            Reading.characteristic_id == characteristic_id,
            Reading.sequence == first,
        )
    )
    return min(began_at, measured_at or began_at)


def _life(life: Life, since: datetime | None) -> str:
    if since is None:
        return _("first tool") if life.ended_at else _("tool since the first reading")
    return _("tool of {since}").format(since=as_read(since, "minutes"))


def _by_context(
    session: Session, current: CurrentCharacteristic, choice: Choice, field: ContextField, most: int
) -> list[Compared]:
    """The newest orders, nests … among the chosen readings, each with its own of these, the older ones first."""
    window = statistics.window_of(session, current.characteristic, **choice._asdict())
    readings = statistics.history_of(session, current.characteristic, window, ())["sequence"]
    strata = statistics.strata_of(session, current.characteristic, field, readings)
    found = []
    for number, name in enumerate(strata.names[:most]):
        of = readings[strata.labels == number]
        context = (*(each for each in choice.context if each[0] is not field), (field, name))
        words = f"{current.characteristic.name}, {field_word(field).lower()} {name}"
        span = replace(window, first=int(of[0]), last=int(of[-1]), context=context)
        found.append(Compared(words, current, span))
    if field is ContextField.NEST:
        return sorted(found, key=lambda each: int(dict(each.window.context)[field]))
    return found[::-1]


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
        before = statistics.window_of(
            session, current.characteristic, period=Period(begin, start), context=choice.context
        )
    else:
        through = now.first - 1
        before = (
            statistics.window_of(
                session, current.characteristic, last=choice.last, through=through, context=choice.context
            )
            if choice.context
            else Window(max(1, through - now.count + 1), through, now.newest)
        )
    name = current.characteristic.name
    return [Compared(_("{name}, before").format(name=name), current, before), Compared(name, current, now)]
