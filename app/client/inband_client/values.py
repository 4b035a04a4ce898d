"""Values that go to the server and come back from it. Lengths in mm, times with an offset.

What comes back is read tolerantly: fields that this version does not know lie in `extra`, so a newer server is no error.
"""

import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from datetime import datetime
from functools import cache
from typing import Any, TypedDict, TypeVar, Union, get_args, get_origin, get_type_hints
from uuid import uuid4

Value = TypeVar("Value")


def new_key() -> str:
    """A key that no other reading has."""
    return uuid4().hex


class ReadingFields(TypedDict, total=False):
    """The fields of a `Reading`, by name."""

    characteristic: str
    measured: float | None
    touches: Iterable[Iterable[float]] | None
    measured_at: datetime | str | None
    machined_at: datetime | str | None
    part: str | None
    key: str
    correction_in_effect: int | None
    first_move_triggered: bool
    context: Mapping[str, Any] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One reading to be pushed.

    touches: in place of `measured`, one list per point, each with its repeats; None for a touch that is missing. key: names this measurement for ever; one is
    made if you give none, so pushing the same object twice stores it once. correction_in_effect: number of the last
    correction that was in the offset when the part was **cut**, 0 for none yet; machined_at may say it by time.
    first_move_triggered: the probe triggered on its first move, where there should have been air. context: order, batch, nest,
    operator, events, process and more, as the contract names them.
    """

    characteristic: str
    measured: float | None = None
    touches: Iterable[Iterable[float | None] | None] | None = None
    measured_at: datetime | str | None = None
    machined_at: datetime | str | None = None
    part: str | None = None
    key: str = field(default_factory=new_key)
    correction_in_effect: int | None = None
    first_move_triggered: bool = False
    context: Mapping[str, Any] | None = None


class Unreadable(ValueError):
    """A document is not what it should be; the text says where."""


def read(kind: type[Value], document: Any) -> Value:
    """Make a value out of a JSON object. Raises `Unreadable` for one that lacks what the value cannot be without."""
    if not isinstance(document, dict):
        raise Unreadable(f"{kind.__name__} is {_named(document)} and not an object")
    make: Any = kind
    known: dict[str, Any] = {}
    extra: dict[str, Any] = {}
    readers = _readers(make)
    for name, value in document.items():
        if name in readers:
            try:
                known[name] = readers[name](value)
            except Unreadable as error:
                raise Unreadable(f"{kind.__name__}.{name}: {error}") from None
        else:
            extra[name] = value
    required = (each for each in fields(make) if each.default is each.default_factory)  # neither: both are MISSING
    if missing := [each.name for each in required if each.name not in known]:
        raise Unreadable(f"{kind.__name__} lacks {', '.join(missing)}")
    made: Value = make(**known, extra=extra)
    return made


Reader = Callable[[Any], Any]


@cache
def _readers(kind: type[Any]) -> Mapping[str, Reader]:
    hints = get_type_hints(kind)
    return {each.name: _reader(hints[each.name]) for each in fields(kind) if each.name != "extra"}


def _reader(hint: Any) -> Reader:
    """Return what makes a value of this type out of JSON; the types are those of the fields below, no others."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in {Union, types.UnionType}:  # always `… | None`
        (other,) = (each for each in inner if each is not type(None))
        some = _reader(other)
        return lambda value: None if value is None else some(value)
    if origin is tuple:
        item = _reader(inner[0])
        return lambda value: tuple(item(each) for each in _of(list)(value))
    if hint is datetime:
        return _moment
    if hint is float:
        return lambda value: float(_of(int, float)(value))
    if hint in {int, str, bool}:
        return _of(hint)
    if origin is Mapping:
        return _of(dict)
    return lambda value: read(hint, value)


def _of(*kinds: type[Any]) -> Reader:
    def same(value: Any) -> Any:
        if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
            raise Unreadable(f"{_named(value)} stands where {kinds[-1].__name__} is expected")
        return value

    return same


def _moment(value: Any) -> datetime:
    try:
        return datetime.fromisoformat(value)
    except (TypeError, ValueError):
        raise Unreadable(f"{_named(value)} stands where a time is expected") from None


def _named(value: Any) -> str:
    return repr(value) if len(repr(value)) < 60 else type(value).__name__


@dataclass(frozen=True, slots=True, kw_only=True)
class Reason:
    """The reason of a decision. code: for programs. text: for people. notes: codes of what else was considered."""

    code: str
    text: str = ""
    notes: tuple[str, ...] = ()
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """An alarm that a reading raised, or repeated while it was active."""

    id: int
    kind: str
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """A change of a tool offset; that of a `Decision` has the first four fields only.

    number: counts per machine, confirm it by this. tool_memory: R10. amount: add this to the offset, mm.
    status: `pending`: apply it; `held`, `awaiting_approval`: a person decides first; `applied`, `rejected`, `superseded`.
    offset_expected: the offset once this one and the pending ones before it are applied; of open ones only.
    """

    number: int
    tool_memory: int
    amount: float
    status: str
    machine: str | None = None
    characteristic: str | None = None
    sequence: int | None = None
    size_error: float | None = None
    created_at: datetime | None = None
    offset_expected: float | None = None
    applied_at: datetime | None = None
    applied_by: str | None = None
    offset_after: float | None = None
    decided_at: datetime | None = None
    decided_by: str | None = None
    status_reason: str | None = None
    superseded_by: int | None = None
    fetched_at: datetime | None = None
    fetched_by: str | None = None
    reason: Reason | None = None
    note: str | None = None
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The answer to a reading, given when it is stored durably.

    action: `none`; `correct`: apply `correction` if its status is `pending`; `hold`: a person decides; `stop`: stop the
    machine. zone: `zero`, `average`, `full`, `oversize`, `undersize`, `wear`, `probe_fault`. deviation: raw; decided_deviation:
    what it would have been with the corrections that were `outstanding` when the part was cut. measure_next: by the control plan
    the part to measure next, counted from this one, 1: the next part; None: no plan counts parts, or the reading is late.
    """

    characteristic: str
    sequence: int
    measured: float
    deviation: float
    zone: str
    action: str
    reason: Reason
    key: str | None = None
    part: str | None = None
    measured_at: datetime | None = None
    received_at: datetime | None = None
    late: bool = False
    size: float | None = None
    decided_deviation: float | None = None
    outstanding: tuple[int, ...] = ()
    results: Mapping[str, Any] | None = None
    average_before: float | None = None
    average_after: float | None = None
    correction: Correction | None = None
    alarms: tuple[Alarm, ...] = ()
    parameters_version: int | None = None
    measure_next: int | None = None
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredReading(Decision):
    """A reading as it was stored and decided. excluded: by whom, when and why it was taken out of the statistics."""

    excluded: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Readings pushed together. repeated: how many had come before. zones: counts of the new ones.

    decisions: one per reading in the same order, if asked for.
    """

    stored: int
    repeated: int
    zones: Mapping[str, int] = field(default_factory=dict)
    corrections: int = 0
    alarms: int = 0
    items: tuple[Decision, ...] | None = None
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """One per reading, in the same order; none if they were not asked for."""
        return self.items or ()

    def __add__(self, other: "Batch") -> "Batch":
        """Both, one after the other."""
        names = [*self.zones, *(name for name in other.zones if name not in self.zones)]
        return Batch(
            stored=self.stored + other.stored,
            repeated=self.repeated + other.repeated,
            zones={name: self.zones.get(name, 0) + other.zones.get(name, 0) for name in names},
            corrections=self.corrections + other.corrections,
            alarms=self.alarms + other.alarms,
            items=self.decisions + other.decisions,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """A live event: it says what changed, not how; look the thing up.

    kind: `reading`, `correction`, `alarm`, `tool` …; `hello`: you are connected, and hear from now on; `resync`: more was
    missed than the server keeps, load again what you show. event_id: resume after this.
    """

    kind: str
    event_id: int | None = None
    machine: str | None = None
    characteristic: str | None = None
    sequence: int | None = None
    tool: int | None = None
    number: int | None = None
    id: int | None = None
    status: str | None = None
    alarm: str | None = None
    state: str | None = None
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)
