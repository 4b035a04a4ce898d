"""Stored readings by characteristic, machine, part, time, zone and action, oldest or newest first. Never writes.

Of one characteristic they come in the order of their numbers; of several in the order of their arrival. `from` and `to` are
times of measurement.

The index knows from when to when the readings of each block range came, not their order. So a list across characteristics
is read in windows of time, from where it begins and ever wider ones, until the page is full: see `windows`.
"""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, Literal, NamedTuple

from sqlalchemy import ColumnElement, Select, func, select, tuple_
from sqlalchemy.orm import Session

from app.core.context import Chosen
from app.core.decision.limits import Zone
from app.core.decision.step import Action
from app.core.period import ALWAYS, Period
from app.db.period import in_period
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import characteristic_named
from app.loop.readings import queries as readings
from app.loop.readings.records import Entry, Record
from app.loop.summaries.queries import in_context, window_of
from app.loop.tables.readings import Reading, Stream
from app.web.fields import EARLIEST, LARGEST_ID, LARGEST_SERIAL

Order = Literal["oldest", "newest"]
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_LATEST = (datetime(9999, 12, 31, tzinfo=UTC) - _EPOCH) // _MICROSECOND
_MOST = (_LATEST, LARGEST_SERIAL, LARGEST_SERIAL, LARGEST_ID)
FIRST_WINDOW, WIDER, WINDOWS = timedelta(minutes=1), 8, 8  # the eighth is four years wide, one more holds the rest


class Filters(NamedTuple):
    """Conditions on readings, all of which hold. entry: of this characteristic; machine_id: of this machine."""

    entry: Entry | None = None
    machine_id: int | None = None
    part: str | None = None
    period: Period = ALWAYS
    zones: Sequence[Zone] = ()
    actions: Sequence[Action] = ()
    context: Chosen = ()

    @property
    def conditions(self) -> list[ColumnElement[bool]]:
        """The conditions, but for the characteristic and the machine."""
        conditions: list[ColumnElement[bool]] = []
        if self.part is not None:
            conditions.append(Reading.part == self.part)
        if self.period.bounded:
            conditions.append(in_period(Reading.measured_at, self.period))
        if self.zones:
            conditions.append(Reading.zone.in_(self.zones))
        if self.actions:
            conditions.append(Reading.action.in_(self.actions))
        if self.context:
            conditions.append(in_context(self.context))
        return conditions


def cursor_of(record: Record, filters: Filters) -> str:
    """The cursor of the readings after this one."""
    if filters.entry is not None:
        return str(record.sequence)
    at = (record.received_at - _EPOCH) // _MICROSECOND
    return f"{at}-{record.machine_id}-{record.characteristic_id}-{record.sequence}"


def found(session: Session, filters: Filters, order: Order, after: str | None, limit: int) -> list[Record]:
    """At most `limit` readings after the cursor. Raises `Invalid` for a cursor of another list."""
    at = None if after in (None, "0") else _numbers(after or "", 1 if filters.entry is not None else 4)
    if filters.entry is not None:
        query = _of_one(session, filters.entry, filters, order, at[0] if at else None)
        return [Record(*row) for row in session.execute(query.limit(limit))]
    query = _of_several(filters, order, at)
    if filters.part is not None:  # the index finds it wherever it is
        return [Record(*row) for row in session.execute(query.limit(limit))]
    rows: list[Record] = []
    for window in windows(order, _begin(session, filters, order, at)):
        rows += [Record(*row) for row in session.execute(query.where(*window).limit(limit - len(rows)))]
        if len(rows) >= limit:
            break
    return rows


def _numbers(cursor: str, count: int) -> list[int]:
    numbers = [int(number) for number in cursor.split("-")]
    most = _MOST if count == len(_MOST) else (LARGEST_ID,)
    if len(numbers) != count or any(number > largest for number, largest in zip(numbers, most, strict=True)):
        message = _("is not the cursor of this list")
        raise Invalid(
            f"after: {message}.",
            _("Pass the `next` of the page before, with the same filters."),
            errors=[FieldError("after", message)],
        )
    return numbers


def _of_one(session: Session, entry: Entry, filters: Filters, order: Order, at: int | None) -> Select[Any]:
    """By number; a period or a context is narrowed to a run of numbers first."""
    conditions = [
        Reading.machine_id == entry.machine_id,
        Reading.characteristic_id == entry.characteristic_id,
        *filters.conditions,
    ]
    if filters.period.bounded or filters.context:
        characteristic = characteristic_named(session, entry.characteristic).characteristic
        window = window_of(session, characteristic, period=filters.period, context=filters.context)
        conditions.append(Reading.sequence.between(window.first, window.last))
    if at is not None:
        conditions.append(Reading.sequence > at if order == "oldest" else Reading.sequence < at)
    column = Reading.sequence if order == "oldest" else Reading.sequence.desc()
    return select(*readings.COLUMNS).where(*conditions).order_by(column)


def _of_several(filters: Filters, order: Order, at: Sequence[int] | None) -> Select[Any]:
    """By arrival, after the reading of the cursor."""
    place = (Reading.received_at, Reading.machine_id, Reading.characteristic_id, Reading.sequence)
    conditions = filters.conditions
    if filters.machine_id is not None:
        conditions.append(Reading.machine_id == filters.machine_id)
    if at is not None:  # the time stands by itself as well, for the index
        cursor = (_arrival(at), *at[1:])
        if order == "oldest":
            conditions += [Reading.received_at >= cursor[0], tuple_(*place) > cursor]
        else:
            conditions += [Reading.received_at <= cursor[0], tuple_(*place) < cursor]
    in_order = [column if order == "oldest" else column.desc() for column in place]
    return select(*readings.COLUMNS).where(*conditions).order_by(*in_order)


def _arrival(at: Sequence[int]) -> datetime:
    return _EPOCH + at[0] * _MICROSECOND


def _begin(session: Session, filters: Filters, order: Order, at: Sequence[int] | None) -> datetime:
    """The time about which the list begins: of the cursor or of the first reading in this order, within the period."""
    if at is not None:
        first = _arrival(at)
    else:
        first = (first_arrival if order == "oldest" else last_arrival)(session, filters.machine_id)
    bound = filters.period.start if order == "oldest" else filters.period.end
    begin = first if bound is None else (max if order == "oldest" else min)(first, bound)
    return min(max(begin, EARLIEST), datetime.now(UTC))


def last_arrival(session: Session, machine_id: int | None = None) -> datetime:
    """The time of arrival of the newest reading, of all or of a machine; now without readings. About: clocks are set."""
    query = select(func.max(Stream.last_received_at))
    if machine_id is not None:
        query = query.where(Stream.machine_id == machine_id)
    return session.scalar(query) or datetime.now(UTC)


def first_arrival(session: Session, machine_id: int | None = None) -> datetime:
    """The time of arrival of the oldest reading; as above."""
    of_stream = (Reading.machine_id == Stream.machine_id) & (Reading.characteristic_id == Stream.characteristic_id)
    query = select(func.coalesce(func.min(Reading.received_at), func.now())).select_from(Stream)
    query = query.join(Reading, of_stream & (Reading.sequence == 1))
    if machine_id is not None:
        query = query.where(Stream.machine_id == machine_id)
    return session.execute(query).scalar_one()


def windows(order: Order, begin: datetime) -> Iterator[list[ColumnElement[bool]]]:
    """Conditions on the time of arrival, one window after the other in this order: together they hold all time.

    The first window also holds whatever lies before `begin`; each is wider than the one before, so that few are needed
    where readings are rare and few readings are read in vain where they are dense.
    """
    edge, width = None, FIRST_WINDOW if order == "oldest" else -FIRST_WINDOW
    for number in range(WINDOWS + 1):
        window = []
        if edge is not None:
            window.append(Reading.received_at >= edge if order == "oldest" else Reading.received_at < edge)
        if number < WINDOWS:
            edge = (edge or begin) + width
            window.append(Reading.received_at < edge if order == "oldest" else Reading.received_at >= edge)
            width *= WIDER
        yield window


def answers(session: Session, records: Sequence[Record]) -> list[dict[str, Any]]:
    """These readings as they were answered, in their order."""
    by_place: dict[tuple[int, int], list[Record]] = {}
    for record in records:
        by_place.setdefault((record.machine_id, record.characteristic_id), []).append(record)
    answered: dict[tuple[int, int, int], dict[str, Any]] = {}
    for place, of_place in by_place.items():
        entry = readings.entry_by_id(session, *place)
        found = readings.with_at_20(session, entry, readings.answers(session, entry, of_place))
        for record, answer in zip(of_place, found, strict=True):
            answered[(*place, record.sequence)] = answer
    return [answered[record.machine_id, record.characteristic_id, record.sequence] for record in records]
