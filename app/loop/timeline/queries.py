"""Events of a machine or of a characteristic, put on its charts. Never writes."""

from bisect import bisect_right
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from html import escape
from math import ceil, floor
from typing import NamedTuple

from sqlalchemy import ColumnElement, and_, or_, select, true
from sqlalchemy.orm import Session

from app.charts import Chart
from app.core.period import Period
from app.db.period import in_period
from app.language.formatting import grouped
from app.language.i18n import _
from app.loop.alarms.kinds import kind_named
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.notes.queries import on_charts_of
from app.loop.notes.wording import beginning, in_lines
from app.loop.tables.alarms import Alarm
from app.loop.tables.calibration import CalibrationRecord
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.notes import Note
from app.loop.tables.readings import Reading, Stream
from app.loop.tables.tools import ToolEvent
from app.loop.timeline.figures import CALIBRATION, MANUAL_EDIT, NOTE, PARAMETERS, TOOL_CHANGE, Event, span_of, with_lane

MOST = 1_000  # events of each kind, the newest
MOST_MOMENTS = 600  # readings whose moments say between which of them an event lies: more than marks have room


def with_events(
    session: Session,
    current: CurrentCharacteristic,
    chart: Chart,
    width: int = 1240,
    *,
    lines: bool = True,
    over: tuple[int, int] | None = None,
) -> Chart:
    """A chart over the readings of a characteristic with the events of the characteristic above it.

    width: in pixels, about. lines: upward at what a person changed; without them where the chart draws its own. over: numbers of
    the first and the last reading of a chart over time.
    """
    span = span_of(chart)
    if span is None:
        return chart
    if over is not None:
        events = events_over_time(session, current, *over)
    else:
        events = events_by_reading(session, current, ceil(span[0]), floor(span[1]))
    return with_lane(chart, events, width, lines=lines)


def with_events_of_machine(
    session: Session,
    machine: Machine,
    chart: Chart,
    width: int = 1240,
    *,
    tool: int | None = None,
    place: tuple[str, int] | None = None,
    without: Collection[str] = (),
) -> Chart:
    """A chart over time with the events of the machine above it: alarms, calibrations, tool changes, notes.

    width: in pixels, about. tool: only of this one. place: memory and location that the chart is about; alarms that name
    another one are there. without: kinds that the chart draws itself.
    """
    span = span_of(chart)
    if span is None:
        return chart
    period = _period(span)
    happened = [
        *_alarms(session, machine, _of_place(place) if tool is None else Alarm.tool_memory == tool, period),
        *(_calibrations(session, machine, true(), period) if tool is None else ()),
        *_tool_events(session, machine, true() if tool is None else ToolEvent.number == tool, period),
        *_notes(
            session, machine, true() if tool is None else Note.characteristic_id.is_(None), in_period(Note.at, period)
        ),
    ]
    events = [each.event for each in happened if each.event.kind not in without]
    return with_lane(chart, events, width, lines=False)


def _of_place(place: tuple[str, int] | None) -> ColumnElement[bool]:
    """Alarms that name no location of a memory, or this one."""
    if place is None:
        return true()
    memory = Alarm.data["memory"].astext
    return or_(memory.is_(None), and_(memory == place[0], Alarm.data["location"].astext == str(place[1])))


def _period(span: tuple[float, float]) -> Period:
    return Period.through(*(datetime.fromtimestamp(end, UTC) for end in span))


def events_over_time(session: Session, current: CurrentCharacteristic, first: int, last: int) -> list[Event]:
    """Events of a characteristic, of its tool and of its empirical value over these readings, each at its moment.

    Where readings came late, from a bridge that was offline or from a file, the server knew of an event long after the parts had
    been measured: it stands at the reading that it belongs to.
    """
    placed = _placed(session, current, first, last)
    measured = {one.sequence: one.measured_at for one in _moments(session, current, {each.reading for each in placed})}
    return [replace(each.event, at=measured.get(each.reading or 0) or each.late or each.event.at) for each in placed]


def events_by_reading(session: Session, current: CurrentCharacteristic, first: int, last: int) -> list[Event]:
    """The same at the numbers of readings: an alarm at the one that raised it, all else at the first that came after it.

    What came after the newest reading is at the number that the next one will have. Of very many readings the place is
    exact to as much as a chart can show.
    """
    return [replace(each.event, at=each.reading or each.next) for each in _placed(session, current, first, last)]


class _Placed(NamedTuple):
    """An event among readings. reading: the one that it belongs to, if it names one; next: the first that came after it.

    late: when that was measured, if it was measured before the server knew of the event.
    """

    event: Event
    reading: int | None
    next: int
    late: datetime | None


def _placed(session: Session, current: CurrentCharacteristic, first: int, last: int) -> list[_Placed]:
    newest = session.scalar(
        select(Stream.sequence).where(
            Stream.machine_id == current.machine.id, Stream.characteristic_id == current.characteristic.id
        )
    )
    first, last = max(1, first), min(last, newest or 0)
    stride = max(1, -(-(last - first + 1) // MOST_MOMENTS))
    moments = _moments(session, current, {*range(first, last, stride), last})
    if last < first or not moments:
        return []
    before, after = _moments(session, current, {first - 1}), _moments(session, current, {last + 1})
    period = Period((before or moments)[0].received_at, after[0].received_at if after else None)
    arrivals = [one.received_at for one in moments]
    happened = _of_characteristic(session, current, period, (first, last))
    placed = []
    if max(Counter(each.event.is_alarm or each.event.kind for each in happened).values(), default=0) >= MOST:
        words = _("of each kind of event the newest {n}").format(n=grouped(MOST))
        placed.append(_Placed(Event(moments[0].measured_at, NOTE, words), None, first, None))
    for event, sequence, arrived in happened:
        place = bisect_right(arrivals, arrived)
        coming = moments[place] if place < len(moments) else None
        at = sequence or (coming.sequence if coming else None if after else last + 1)
        if at is None or not first <= at <= last + 1:
            continue
        past = moments[place - 1 : place] if place else before
        # Where the next one is older than the one before, a person has imported the past: the event is none of it.
        in_order = coming is not None and (not past or past[0].measured_at <= coming.measured_at)
        late = coming.measured_at if coming and in_order and event.at == arrived > coming.measured_at else None
        placed.append(_Placed(event, sequence, at, late))
    return placed


class _Moment(NamedTuple):
    sequence: int
    received_at: datetime
    measured_at: datetime


def _moments(session: Session, current: CurrentCharacteristic, sequences: Collection[int | None]) -> list[_Moment]:
    """Moments of these readings, ascending."""
    asked = [sequence for sequence in sequences if sequence]
    if not asked:
        return []
    rows = session.execute(
        select(Reading.sequence, Reading.received_at, Reading.measured_at)
        .where(
            Reading.machine_id == current.machine.id,
            Reading.characteristic_id == current.characteristic.id,
            Reading.sequence.in_(asked),
        )
        .order_by(Reading.sequence)
    )
    return [_Moment(*row) for row in rows]


class _Happened(NamedTuple):
    """An event at its moment. sequence: the reading that it belongs to, if it has one; arrived: as this server knew of it."""

    event: Event
    sequence: int | None
    arrived: datetime


def _of_characteristic(
    session: Session, current: CurrentCharacteristic, period: Period, numbers: tuple[int, int]
) -> list[_Happened]:
    """Everything of the period. numbers: of the first and last reading; notes about one of them are found by its number."""
    noted = or_(Note.sequence.is_(None) & in_period(Note.at, period), Note.sequence.between(*numbers))
    machine, parameters = current.machine, current.parameters
    concerned = or_(
        Alarm.characteristic_id == current.characteristic.id,
        Alarm.characteristic_id.is_(None)
        & (_of_place(("average", parameters.average_memory)) | (Alarm.data["memory"].astext == "tool"))
        & (Alarm.tool_memory.is_(None) | (Alarm.tool_memory == parameters.tool_memory)),
    )
    place = (CalibrationRecord.memory == "average") & (CalibrationRecord.location == parameters.average_memory)
    return [
        *_alarms(session, machine, concerned, period, current.characteristic),
        *(_calibrations(session, machine, place, period) if parameters.average_memory else ()),
        *(_tool_events(session, machine, ToolEvent.number == parameters.tool_memory, period)),
        *_versions(session, current, period),
        *_notes(session, machine, on_charts_of(current.characteristic.id), noted),
    ]


def _alarms(
    session: Session,
    machine: Machine,
    concerned: ColumnElement[bool],
    period: Period,
    characteristic: Characteristic | None = None,
) -> Iterator[_Happened]:
    """Alarms. characteristic: those of it lead to the reading that raised them."""
    rows = session.execute(
        select(Alarm.id, Alarm.kind, Alarm.raised_at, Alarm.acknowledged_at, Alarm.characteristic_id, Alarm.sequence)
        .where(Alarm.machine_id == machine.id, concerned, in_period(Alarm.raised_at, period))
        .order_by(Alarm.id.desc())
        .limit(MOST)
    )
    for number, kind, raised_at, acknowledged_at, of, reading in rows:
        sequence = reading if characteristic is not None and of == characteristic.id else None
        link = f"/characteristics/{characteristic.key}/readings/{sequence}" if characteristic and sequence else None
        event = Event(raised_at, kind, kind_named(kind).word(), link or f"/alarms/{number}", acknowledged_at is None)
        yield _Happened(event, sequence, raised_at)


def _calibrations(
    session: Session, machine: Machine, concerned: ColumnElement[bool], period: Period
) -> Iterator[_Happened]:
    record = CalibrationRecord
    rows = session.execute(
        select(record.number, record.memory, record.location, record.calibrated_at, record.received_at)
        .where(record.machine_id == machine.id, concerned, in_period(record.received_at, period))
        .order_by(record.number.desc())
        .limit(MOST)
    )
    for number, memory, location, at, received_at in rows:
        text = _("Calibration {n}").format(n=number)
        link = f"/calibration/{machine.key}/{'averages' if memory == 'average' else 'probes'}/{location}/{number}"
        yield _Happened(Event(at, CALIBRATION, text, link), None, received_at)


def _tool_events(
    session: Session, machine: Machine, concerned: ColumnElement[bool], period: Period
) -> Iterator[_Happened]:
    words = {"change": (TOOL_CHANGE, _("T{number} changed")), "edit": (MANUAL_EDIT, _("T{number} offset edited"))}
    rows = session.execute(
        select(ToolEvent.number, ToolEvent.kind, ToolEvent.at)
        .where(
            ToolEvent.machine_id == machine.id,
            ToolEvent.kind != "correction",
            concerned,
            in_period(ToolEvent.at, period),
        )
        .order_by(ToolEvent.id.desc())
        .limit(MOST)
    )
    for number, changed, at in rows:
        kind, text = words[changed]
        link = f"/machines/{machine.key}/tools?tool={number}#tool"
        yield _Happened(Event(at, kind, text.format(number=number), link), None, at)


def _versions(session: Session, current: CurrentCharacteristic, period: Period) -> Iterator[_Happened]:
    """Versions of the parameters, without the first: with it the characteristic began."""
    version = ParametersVersion
    rows = session.execute(
        select(version.version, version.created_at)
        .where(
            version.machine_id == current.machine.id,
            version.characteristic_id == current.characteristic.id,
            version.version > 1,
            in_period(version.created_at, period),
        )
        .order_by(version.version.desc())
        .limit(MOST)
    )
    for number, at in rows:
        text = _("Parameters version {n}").format(n=number)
        yield _Happened(
            Event(at, PARAMETERS, text, f"/characteristics/{current.characteristic.key}#versions"), None, at
        )


def _notes(
    session: Session, machine: Machine, concerned: ColumnElement[bool], noted: ColumnElement[bool]
) -> Iterator[_Happened]:
    rows = session.execute(
        select(Note.id, Note.text, Note.written_by, Note.at, Note.sequence)
        .where(Note.machine_id == machine.id, Note.withdrawn_at.is_(None), concerned, noted)
        .order_by(Note.id.desc())
        .limit(MOST)
    )
    for number, words, author, at, sequence in rows:
        more = f"{in_lines(words)}<br>{escape(author)}"
        yield _Happened(Event(at, NOTE, escape(beginning(words)), f"/notes/{number}", more=more), sequence, at)
