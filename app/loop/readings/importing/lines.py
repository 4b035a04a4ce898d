"""The lines of a file as readings, or what is wrong with each: line, column, reason."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from app.errors import Invalid
from app.files.apart import PREFIX, apart, spend
from app.files.formats.delimited import Unusable
from app.language.i18n import _
from app.loop.readings.importing.cells import Flaw, Looked, Passed, fingerprint, items, looked, put_down, shown, taken
from app.loop.readings.importing.layout import Layout, Wishes
from app.loop.readings.importing.refusals import wrong
from app.loop.readings.origin import Origin, guid_of
from app.loop.readings.schemas import ReadingIn, reading_of

MOST_HELD = 1_000  # lines in a row without a time; of more the first are readings


class Line(NamedTuple):
    """A line that can be a reading. origin: of which Inband wrote it."""

    number: int
    reading: ReadingIn
    origin: Origin | None = None


Read = Callable[[int, str], Iterator[Line | Flaw | Passed]]
"""The lines of a file by the place of a layout, as readings of a characteristic."""


def lines(
    path: Path, layout: Layout, characteristic: str, *, now: datetime | None = None
) -> Iterator[Line | Flaw | Passed]:
    """Every line that is not empty. A reading without a key of its own gets one made of the file's content and the line,
    so that importing the same file again stores nothing twice.
    """
    found = ((item.number, item.fields) for item in items(path, [layout]))
    return _readings(found, layout, characteristic, fingerprint(path), now or datetime.now(UTC))


def look_apart(path: Path, wishes: Wishes, name: str) -> Looked:
    """Look at a file of someone else, in a process of its own. Raises `Invalid`."""
    try:
        return apart(looked, path, wishes, name)
    except Unusable as error:
        raise wrong("file", str(error)) from None


@contextmanager
def read_apart(path: Path, layouts: Sequence[Layout], most: int | None = None) -> Iterator[Read]:
    """Read a file of someone else in a process of its own, its first `most` lines: here are values only.

    Raises `Invalid` at a limit.
    """
    with TemporaryDirectory(prefix=PREFIX) as name:
        folder = Path(name)
        try:
            apart(put_down, path, layouts, folder, most, spend)
        except Unusable as error:
            raise wrong("file", str(error)) from None
        yield _held(path, layouts, folder)


@contextmanager
def read_here(path: Path, layouts: Sequence[Layout]) -> Iterator[Read]:
    """Read a file in this process, once for all layouts, however long it is."""
    with TemporaryDirectory(prefix=PREFIX) as name:
        put_down(path, layouts, Path(name), None, lambda _size: None)
        yield _held(path, layouts, Path(name))


def _held(path: Path, layouts: Sequence[Layout], folder: Path) -> Read:
    mark, now = fingerprint(path), datetime.now(UTC)
    return lambda place, characteristic: _readings(
        taken(folder / str(place)), layouts[place], characteristic, mark, now
    )


def _before_a_time(
    found: Iterable[tuple[int, dict[str, Any] | Flaw | Passed]], layout: Layout
) -> Iterator[tuple[int, dict[str, Any] | Flaw | Passed]]:
    """The same; lines whose time is empty are flaws where no line below has one: they may be sums or means."""
    held: list[tuple[int, dict[str, Any]]] = []
    for number, item in found:
        if isinstance(item, dict):
            if item.get("measured_at", number) is None and len(held) < MOST_HELD:
                held.append((number, item))
                continue
            yield from held
            held.clear()
        yield number, item
    for number, _item in held:
        reason = _(
            "has no time, and no line below has one. If it is a sum or a mean, name the last line of readings (--last-line); "
            "else write its time"
        )
        yield number, Flaw(number, layout.named("measured_at"), "", reason)


def _readings(
    found: Iterable[tuple[int, dict[str, Any] | Flaw | Passed]],
    layout: Layout,
    characteristic: str,
    mark: str,
    now: datetime,
) -> Iterator[Line | Flaw | Passed]:
    for number, item in _before_a_time(found, layout):
        if isinstance(item, Flaw | Passed):
            yield item
            continue
        item["characteristic"] = characteristic
        origin: Origin | None = item.pop("origin", None)
        if item.get("touches") is not None:
            item.pop("measured", None)  # it is made of them
        if item.get("key") is None:
            item["key"] = f"inband:{guid_of(*origin[:2])}" if origin else f"file:{mark}:{number}"
        try:
            yield Line(number, reading_of(item, now), origin)
        except Invalid as refusal:
            for error in refusal.errors:
                column = layout.named(error.field.partition(".")[0]) or error.field
                yield Flaw(number, column, shown(item.get(error.field)), error.message)
