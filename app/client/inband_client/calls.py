"""Every call as a value: what is sent, how the answer is read, and if it may be sent again. Pure."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from itertools import islice
from typing import Any, Generic, NamedTuple, TypeVar
from urllib.parse import quote

from inband_client.errors import ProblemError, WrongField
from inband_client.values import (
    Batch,
    Correction,
    Decision,
    Reading,
    StoredReading,
    Unreadable,
    new_key,
    read,
)

Answer = TypeVar("Answer", covariant=True)  # noqa: PLC0105 - the word for it
Item = TypeVar("Item")
ReadingLike = Reading | Mapping[str, Any]
REPEATABLE = frozenset({"GET", "PUT", "PATCH", "DELETE"})
LARGEST_CHUNK = 10_000  # readings; the server takes no more at once
LARGEST_PAGE = 1000


@dataclass(frozen=True, slots=True)
class Call(Generic[Answer]):
    """One call of the API. path: below ``/api/v1``. read: makes the answer out of JSON; raises `Unreadable`.

    repeat: sending it again is harmless even if it was carried out before.
    """

    method: str
    path: str
    read: Callable[[Any], Answer]
    query: Mapping[str, Any] = field(default_factory=dict)
    json: Any = None
    repeat: bool = True

    def __str__(self) -> str:
        """Method and path, for messages."""
        return f"{self.method} {self.path}"


def as_it_is(document: Any) -> Any:
    """The JSON of the answer."""
    return document


def call(method: str, path: str, json: Any = None, *, query: Mapping[str, Any], repeat: bool | None) -> Call[Any]:
    """Any call of the REST contract. repeat: None for what the method promises."""
    given = {name: plain(value) for name, value in query.items() if value is not None}
    if repeat is None:
        repeat = method in REPEATABLE
    return Call(method, f"/{path.lstrip('/')}", as_it_is, given, plain(json), repeat)


def push(reading: ReadingLike | None, named: Mapping[str, Any]) -> Call[Decision]:
    """One reading."""
    if (reading is None) == (not named):
        raise TypeError("push() takes one reading, or its fields by name: push(characteristic=…, measured=…)")
    return Call("POST", "/readings", lambda document: read(Decision, document), json=_written(reading or named))


def push_many(readings: Iterable[ReadingLike], chunk: int, *, decisions: bool) -> Iterator[tuple[int, Call[Batch]]]:
    """Many readings in the given order, a chunk at a time; with each, how many came before it."""
    if not 1 <= chunk <= LARGEST_CHUNK:
        raise ValueError(f"chunk is {chunk}; the server takes 1 to {LARGEST_CHUNK:,} readings at once.")
    waiting, before = iter(readings), 0
    query = {"decisions": "true"} if decisions else {}
    while part := [_written(reading) for reading in islice(waiting, chunk)]:
        yield before, Call("POST", "/readings/batch", lambda document: read(Batch, document), query, part)
        before += len(part)


NOTHING = Batch(stored=0, repeated=0)


def counted_on(error: ProblemError, before: int) -> ProblemError:
    """The same error of a chunk, with positions that count from the first reading of all."""
    error.errors = tuple(WrongField(_moved(field, before), message) for field, message in error.errors)
    return error


def _moved(name: str, before: int) -> str:
    number, bracket, rest = name.removeprefix("[").partition("]")
    return f"[{int(number) + before}]{rest}" if name.startswith("[") and bracket and number.isdigit() else name


def confirm(
    machine: str, number: int, offset_after: float | None, applied_at: datetime | str | None, mapping: str | None
) -> Call[Correction]:
    """A correction is in the offset."""
    body = {"offset_after": offset_after, "applied_at": applied_at, "mapping": mapping}
    return Call("POST", _correction(machine, number, "applied"), _correction_read, json=_given(body))


def reject(machine: str, number: int, reason: str) -> Call[Correction]:
    """A correction will not be applied."""
    return Call("POST", _correction(machine, number, "rejected"), _correction_read, json={"reason": reason})


def heartbeat(machine: str, state: Mapping[str, Any]) -> Call[dict[str, Any]]:
    """The program beside a machine is alive."""
    return Call("POST", f"/machines/{_part(machine)}/heartbeat", _object, json=_given(state))


def report_offset(machine: str, tool_memory: int, offset: float, *, none_applied: bool) -> Call[dict[str, Any]]:
    """The offset that the control holds."""
    path = f"/machines/{_part(machine)}/tools/{int(tool_memory)}/reported"
    return Call("POST", path, _object, json={"offset": offset, "none_applied": none_applied})


def report_fault(machine: str, kind: str, text: str | None, *, active: bool) -> Call[dict[str, Any]]:
    """A fault of the machine itself, or its end."""
    body = {"kind": kind, "text": text, "active": active}
    return Call("POST", f"/machines/{_part(machine)}/faults", _object, json=_given(body))


# --- lists


class Page(NamedTuple, Generic[Item]):
    """A part of a list. next: where the following one begins; None after the last."""

    items: list[Item]
    next: Any


def pages(path: str, query: Mapping[str, Any], make: Callable[[Any], Item] = as_it_is) -> Call[Page[Item]]:
    """The first page of a list, whose items are made so."""

    def page(document: Any) -> Page[Item]:
        found = _object(document)
        if not isinstance(found.get("items"), list):
            raise Unreadable("It is not a page of a list: it has no items.")
        return Page([make(item) for item in found["items"]], found.get("next"))

    return replace(call("GET", path, query={"limit": LARGEST_PAGE} | dict(query), repeat=True), read=page)


def next_page(this: Call[Page[Item]], page: Page[Item]) -> Call[Page[Item]] | None:
    """The page after this one."""
    return None if page.next is None else replace(this, query={**this.query, "after": page.next})


def readings(query: Mapping[str, Any]) -> Call[Page[StoredReading]]:
    """The first page of stored readings. query: `start` and `end` in place of from and to, which Python keeps for itself."""
    words = {"start": "from", "end": "to"}
    query = {words.get(name, name): value for name, value in query.items()}
    return pages("/readings", query, lambda item: read(StoredReading, item))


def pending(machine: str) -> Call[Page[Correction]]:
    """The first page of what a machine has to apply."""
    return pages(f"/machines/{_part(machine)}/corrections", {"status": "pending"}, _correction_read)


# --- in words of JSON


def plain(value: Any) -> Any:
    """JSON of a value: times become text, tuples become lists. Raises `ValueError` for a time without an offset."""
    if isinstance(value, datetime):
        if value.tzinfo is None:
            raise ValueError(
                f"{value} has no offset: which moment that is, depends on the place. Use datetime.now(UTC)."
            )
        return value.isoformat()
    if isinstance(value, Mapping):
        return {name: plain(inner) for name, inner in value.items()}
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        return [plain(inner) for inner in value]
    return value


def _given(body: Mapping[str, Any]) -> dict[str, Any]:
    return {name: plain(value) for name, value in body.items() if value is not None}


def _written(reading: ReadingLike) -> dict[str, Any]:
    if isinstance(reading, Reading):
        reading = {each.name: getattr(reading, each.name) for each in fields(reading)}
    body = _given(reading)
    if body.get("first_move_triggered") is False:
        del body["first_move_triggered"]
    return body if "key" in body else body | {"key": new_key()}


def _part(text: str) -> str:
    return quote(str(text), safe="")


def _correction(machine: str, number: int, verb: str) -> str:
    return f"/corrections/{_part(machine)}/{int(number)}/{verb}"


def _correction_read(document: Any) -> Correction:
    return read(Correction, document)


def _object(document: Any) -> dict[str, Any]:
    if not isinstance(document, dict):
        raise Unreadable("It is not an object.")
    return document
