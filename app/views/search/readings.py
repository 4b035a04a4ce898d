"""Stored readings by characteristic, machine, part, time, zone and action, oldest or newest first. Never writes.

Of one characteristic they come in the order of their numbers; of several in the order of their arrival. `from` and `to` are
times of measurement. A reading is received at the earliest `AHEAD` before its clock says that it was measured.
"""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, Literal, NamedTuple

from sqlalchemy import ColumnElement, Select, and_, lateral, select, tuple_
from sqlalchemy.orm import Session, aliased

from app.core.decision.limits import Zone
from app.core.decision.step import Action
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import characteristic_named
from app.loop.readings import queries as readings
from app.loop.readings.records import Entry, Record
from app.loop.summaries.queries import window_of
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading
from app.web.fields import AHEAD, LARGEST_ID, LARGEST_SERIAL

Order = Literal["oldest", "newest"]
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_LATEST = (datetime(9999, 12, 31, tzinfo=UTC) - _EPOCH) // _MICROSECOND
_MOST = (_LATEST, LARGEST_SERIAL, LARGEST_SERIAL, LARGEST_ID)


class Filters(NamedTuple):
    """Conditions on readings, all of which hold. entry: of this characteristic; machine_id: of this machine."""

    entry: Entry | None = None
    machine_id: int | None = None
    part: str | None = None
    start: datetime | None = None
    end: datetime | None = None
    zones: Sequence[Zone] = ()
    actions: Sequence[Action] = ()

    def on(self, reading: type[Reading]) -> list[ColumnElement[bool]]:
        """The conditions, but for the characteristic and the machine."""
        conditions: list[ColumnElement[bool]] = []
        if self.part is not None:
            conditions.append(reading.part == self.part)
        if self.start is not None:
            conditions.append(reading.measured_at >= self.start)
        if self.end is not None:
            conditions.append(reading.measured_at <= self.end)
        if self.zones:
            conditions.append(reading.zone.in_(self.zones))
        if self.actions:
            conditions.append(reading.action.in_(self.actions))
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
    elif filters.part is not None:
        query = _of_part(filters, order, at)
    else:
        query = _of_machines(filters, order, at, limit)
    return [Record(*row) for row in session.execute(query.limit(limit))]


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
    """By number; a period is narrowed to a run of numbers first."""
    conditions = [
        Reading.machine_id == entry.machine_id,
        Reading.characteristic_id == entry.characteristic_id,
        *filters.on(Reading),
    ]
    if filters.start is not None or filters.end is not None:
        characteristic = characteristic_named(session, entry.characteristic).characteristic
        window = window_of(session, characteristic, start=filters.start, end=filters.end)
        conditions.append(Reading.sequence.between(window.first, window.last))
    if at is not None:
        conditions.append(Reading.sequence > at if order == "oldest" else Reading.sequence < at)
    column = Reading.sequence if order == "oldest" else Reading.sequence.desc()
    return select(*readings.COLUMNS).where(*conditions).order_by(column)


def _of_part(filters: Filters, order: Order, at: Sequence[int] | None) -> Select[Any]:
    conditions = [*filters.on(Reading), *_beyond(Reading, order, at)]
    if filters.machine_id is not None:
        conditions.append(Reading.machine_id == filters.machine_id)
    return select(*readings.COLUMNS).where(*conditions).order_by(*_in_order(Reading, order))


def _of_machines(filters: Filters, order: Order, at: Sequence[int] | None, limit: int) -> Select[Any]:
    """The first of each machine by arrival, and of them all the first: each machine's come out of its index in order."""
    inner = aliased(Reading)
    conditions = [inner.machine_id == Machine.id, *filters.on(inner), *_beyond(inner, order, at)]
    if filters.start is not None:
        conditions.append(inner.received_at >= filters.start - AHEAD)
    of_machine = select(inner).where(and_(*conditions)).order_by(*_in_order(inner, order)).limit(limit)
    reading = aliased(Reading, lateral(of_machine))
    columns = [getattr(reading, name) for name in Record._fields]
    query = select(*columns).select_from(Machine).join(reading, Machine.id == reading.machine_id)
    if filters.machine_id is not None:
        query = query.where(Machine.id == filters.machine_id)
    return query.order_by(*_in_order(reading, order))


def _place(reading: type[Reading]) -> tuple[Any, ...]:
    return reading.received_at, reading.machine_id, reading.characteristic_id, reading.sequence


def _in_order(reading: type[Reading], order: Order) -> list[Any]:
    return [column if order == "oldest" else column.desc() for column in _place(reading)]


def _beyond(reading: type[Reading], order: Order, at: Sequence[int] | None) -> list[ColumnElement[bool]]:
    """After the reading of the cursor. The time stands by itself as well, for the index."""
    if at is None:
        return []
    moment, *numbers = at
    received_at = _EPOCH + moment * _MICROSECOND
    place, cursor = tuple_(*_place(reading)), (received_at, *numbers)
    if order == "oldest":
        return [reading.received_at >= received_at, place > cursor]
    return [reading.received_at <= received_at, place < cursor]


def answers(session: Session, records: Sequence[Record]) -> list[dict[str, Any]]:
    """These readings as they were answered, in their order."""
    by_place: dict[tuple[int, int], list[Record]] = {}
    for record in records:
        by_place.setdefault((record.machine_id, record.characteristic_id), []).append(record)
    answered: dict[tuple[int, int, int], dict[str, Any]] = {}
    for place, of_place in by_place.items():
        entry = readings.entry_by_id(session, *place)
        for record, answer in zip(of_place, readings.answers(session, entry, of_place), strict=True):
            answered[(*place, record.sequence)] = answer
    return [answered[record.machine_id, record.characteristic_id, record.sequence] for record in records]
