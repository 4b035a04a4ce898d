"""The cells of a file as the fields of readings, or what is wrong with each: line, column, reason.

It is read once, for however many columns. Imports little: files of others are read here in a process of their own.
"""

import hashlib
import json
import pickle  # of our own values, between two processes of ours
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple
from zoneinfo import ZoneInfo

from app.files.formats import cell_values, delimited, spreadsheet
from app.files.formats.cell_values import Unreadable, same_number
from app.files.formats.column_names import TEMPERATURES
from app.files.formats.delimited import Row, Unusable
from app.files.formats.headings import is_labelled, is_summary
from app.files.formats.number_with_unit import agreed_unit, in_mm, number_and_unit
from app.files.formats.units import unit_of_name
from app.language.i18n import _
from app.loop.readings.importing.columns import DRAWN, ORIGIN, VERDICT
from app.loop.readings.importing.layout import (
    NO_DIGIT,
    Layout,
    Wishes,
    look,
    named_in,
    rows_of,
    text_of,
    written,
)
from app.loop.readings.origin import Origin

MOST_FLAWS = 200
SHOWN = 60  # characters of a wrong value
SHOWN_LINES = 12
SHOWN_CELL = 40
AT_ONCE = 20_000  # items in memory before they are put down
_NO_READING = {"characteristic", *DRAWN, *VERDICT}
"""Columns that are no field of a reading."""


class Flaw(NamedTuple):
    """The error of a line."""

    line: int
    column: str
    value: str
    reason: str

    def __str__(self) -> str:
        where = _("line {line}").format(line=self.line) + (f", {self.column}" if self.column else "")
        return f"{where}: {f'{self.value!r} ' if self.value else ''}{self.reason}"


class Passed(NamedTuple):
    """A line that is no reading and no error either, and why."""

    line: int
    reason: str


class Item(NamedTuple):
    """The fields of a reading. place: of its layout among those that are asked for. number: of its line."""

    place: int
    number: int
    fields: "dict[str, Any] | Flaw | Passed"


class Looked(NamedTuple):
    """A file that was looked at: how it is read, and its first lines as they are in it, by number."""

    layout: Layout
    first: list[tuple[int, list[str]]]


def looked(path: Path, wishes: Wishes, name: str) -> Looked:
    """Look at a file. Raises `Invalid`."""
    layout = look(path, wishes, name, complete=False)
    return Looked(layout, list(islice(_first(path, layout), SHOWN_LINES)))


def put_down(
    path: Path, layouts: Sequence[Layout], folder: Path, most: int | None, spend: Callable[[int], None]
) -> None:
    """Write the items of each layout, of the first `most` lines, into a file of the folder; `taken` reads it."""
    waiting: dict[int, list[tuple[int, Any]]] = {}
    count = 0
    for item in _until(items(path, layouts), most):
        waiting.setdefault(item.place, []).append(item[1:])
        count += 1
        if count >= AT_ONCE:
            _write(waiting, folder, spend)
            count = 0
    _write(waiting, folder, spend)


def _until(found: Iterator[Item], most: int | None) -> Iterator[Item]:
    lines, last = 0, -1
    for item in found:
        lines += item.number != last
        last = item.number
        if most is not None and lines > most:
            return
        yield item


def _write(waiting: dict[int, list[tuple[int, Any]]], folder: Path, spend: Callable[[int], None]) -> None:
    for place, pairs in waiting.items():
        content = pickle.dumps(pairs)
        spend(len(content))
        with (folder / str(place)).open("ab") as file:
            file.write(content)
    waiting.clear()


def taken(path: Path) -> Iterator[tuple[int, "dict[str, Any] | Flaw | Passed"]]:
    """The items of one layout that were put down, by the numbers of their lines."""
    if not path.exists():
        return
    with path.open("rb") as file:
        while True:
            try:
                yield from pickle.load(file)  # noqa: S301 - see above
            except EOFError:
                return


def fingerprint(path: Path) -> str:
    """Names the content of a file: the same content has the same, whatever the file is called."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:20]


def items(path: Path, layouts: Sequence[Layout]) -> Iterator[Item]:
    """Every line that is not empty, for each of these layouts, which differ in nothing but columns and units."""
    return _csv(path, layouts) if layouts[0].is_table else _json(path, layouts)


def _first(path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    try:
        if layout.is_table:
            for row in delimited.rows(path, layout.encoding, layout.delimiter):
                if row.line != layout.header_line:  # lines above it too, so that people see which line is the header
                    yield row.line, [_short(cell) for cell in row.cells]
        else:
            for number, value in objects(path, layout.kind):
                known = value if isinstance(value, dict) else {}
                yield number, [_short(known.get(name)) for name in layout.header]
    except Unusable as error:
        yield error.line or 0, [_("cannot be read")]


def _short(value: object) -> str:
    text = "" if value is None else str(value).strip()
    return text if len(text) <= SHOWN_CELL else f"{text[:SHOWN_CELL]}…"


def shown(value: Any) -> str:
    text = "" if value is None else value if isinstance(value, str) else str(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def _csv(path: Path, layouts: Sequence[Layout]) -> Iterator[Item]:
    readers, nominal = [_readers(layout) for layout in layouts], dict[str, tuple[int, str]]()
    of_names = _of_names(layouts)
    try:
        for row in rows_of(path, layouts[0]):
            if isinstance(row, Unusable):
                flaw = Flaw(row.line or 0, "", "", str(row))
                yield from (Item(place, flaw.line, flaw) for place in range(len(layouts)))
                continue
            if tuple(cell.strip() for cell in row.cells) == layouts[0].header:
                passed = Passed(row.line, _("is the heading again"))
                yield from (Item(place, row.line, passed) for place in range(len(layouts)))
                continue
            if label := next(filter(is_summary, _labels(row.cells, layouts[0])), None):
                words = _(
                    "holds limits or statistics, no part: name the first or the last line of readings (--first-line, --last-line)"
                )
                flaw = Flaw(row.line, "", shown(label), words)
                yield from (Item(place, row.line, flaw) for place in range(len(layouts)))
                continue
            name = named_in(row.cells, layouts[0])
            if not (places := of_names.get(name, of_names.get("", ()))):
                yield Item(0, row.line, _stranger(row.line, name))
                continue
            other = _other_nominal(row.line, row.cells, layouts[0], nominal)
            for place in places:
                if other is not None:
                    yield Item(place, row.line, other)
                    continue
                yield from (Item(place, row.line, found) for found in _of_row(row, layouts[place], readers[place]))
    except Unusable as error:
        line = error.line or 0
        yield from (Item(place, line, Flaw(line, "", "", str(error))) for place in range(len(layouts)))


def _labels(cells: Sequence[str], layout: Layout) -> list[str]:
    """The cells of a row that name its part, or would in any other row: the first one, and those of part and time."""
    sizes = {place for name in ("measured", "characteristic") for place in layout.columns.get(name, ())}
    first = next((place for place, cell in enumerate(cells) if cell.strip()), 0)
    of_part = {*layout.columns.get("part", ()), *layout.columns.get("measured_at", ())} - sizes
    named = [cells[place].strip() for place in of_part]
    named += [cells[place] for place in layout.columns.get("measured", ()) if is_labelled(cells[place])]
    if first in sizes | of_part or (any(named) and len(cells[first].strip()) == 1):
        return named  # S and N are shifts as well
    return [*named, cells[first].strip()]


def _of_names(layouts: Sequence[Layout]) -> dict[str, list[int]]:
    """The places of the layouts by the one name whose rows each reads; those without one, which read all rows, by an empty one."""
    found: dict[str, list[int]] = {}
    for place, layout in enumerate(layouts):
        found.setdefault(layout.only, []).append(place)
    return found


def _stranger(line: int, name: str) -> Passed:
    """A row of a characteristic that is not read."""
    return Passed(line, _("is of {name}, which is not chosen").format(name=repr(name)))


def _other_nominal(line: int, cells: Sequence[Any], layout: Layout, first: dict[str, tuple[int, str]]) -> Flaw | None:
    """The flaw of a row with another nominal size than the first row of its name has: it is another characteristic.

    first: line and nominal size by name; those of this row are added.
    """
    said = " ".join(written(cells[place]) for place in layout.nominal)
    if not said:
        return None
    name = named_in(cells, layout) if "characteristic" in layout.columns else ""
    before, nominal = first.setdefault(name, (line, said))
    if same_number(said, nominal):
        return None
    words = _(
        "is another nominal size than line {first} has{name}: two characteristics of one name? Name the columns that "
        "distinguish them (--map characteristic=Feature+Axis); if the drawing was changed, --map nominal="
    )
    column = "+".join(layout.header[place] for place in layout.nominal)
    return Flaw(line, column, shown(said), words.format(first=before, name=f" ({shown(name)})" if name else ""))


def _of_row(row: Row, layout: Layout, readers: Sequence["_Reader"]) -> Iterator["dict[str, Any] | Flaw | Passed"]:
    size = " ".join(row.cells[place] for place in layout.columns.get("measured", ())).strip()
    if layout.skips_blank and not size:
        return
    if layout.missing and _is_missing(size, layout):
        yield Passed(row.line, _("has no size: its mark says that it is missing"))
        return
    values: dict[str, Any] = {}
    if unfit := _unfit(*(text_of(row, layout.columns.get(name, ())) for name in VERDICT)):
        yield Passed(row.line, unfit)
        return
    flawed, behind = False, ""
    for name, places, read in readers:
        text = size = " ".join(row.cells[place] for place in places).strip()
        if name == "measured":
            size, behind = number_and_unit(text)
        try:
            if layout.kind == "sheet":
                spreadsheet.refuse_error(text)
            value = read(size)
            if value is not None or not (text and name == "measured_at"):  # a default of programs is no time
                values[name] = value
        except Unreadable as error:
            flawed = True
            yield Flaw(row.line, layout.named(name), shown(text), str(error))
    if not flawed:
        yield _in_mm(values, layout, row.line, behind, named_in(row.cells, layout))


def _unfit(code: Any, excluded: Any) -> str | None:
    """The reason for which a reading that Inband wrote counted for nothing there; None for any other."""
    if code in {"touch_fault", "first_move_triggered"}:
        return _("its touches could not be believed where it was exported")
    return _("was excluded where it was exported") if excluded else None


def _in_mm(
    values: dict[str, Any], layout: Layout, line: int, behind: str = "", name: str = ""
) -> "dict[str, Any] | Flaw":
    """The fields of a reading with its sizes in mm, and with its origin. behind: the unit behind the size in its cell.

    name: of the characteristic, in a row that says of which one it is.
    """
    said = values.pop("unit", None)
    try:
        unit = agreed_unit(
            layout.said_unit, said, behind, unit_of_name(name, layout.said_unit or said or behind or None)
        )
    except Unreadable as error:
        column = layout.named("unit") if said else layout.named("measured")
        reason = str(error)
        if said:
            reason += _("; if this column holds no units, say so: --map unit=")
        return Flaw(line, column, "", reason)
    sizes = {name: in_mm(values[name], unit) for name in ("measured", "touches") if name in values}
    return _with_origin(_with_temperatures(values | sizes))


def _with_temperatures(values: dict[str, Any]) -> dict[str, Any]:
    """The same with the temperatures of its columns in its context."""
    stated = {name: values.pop(name) for name in TEMPERATURES if name in values}
    stated = {name: value for name, value in stated.items() if value is not None}
    context = values.get("context")
    if stated and (context is None or isinstance(context, dict)):
        values["context"] = stated | (context or {})
    return values


def _with_origin(values: dict[str, Any]) -> dict[str, Any]:
    """The same with the origin of a reading that Inband wrote in place of its columns."""
    sequence, received_at, measured = (*map(values.pop, ORIGIN, (None, None)), values.get("measured"))
    number = int(sequence) if str(sequence).isascii() and str(sequence).isdigit() else 0
    if 0 < number < 1 << 40 and isinstance(received_at, datetime) and isinstance(measured, int | float):
        values["origin"] = Origin(number, received_at, float(measured))
    return values


def _is_missing(size: str, layout: Layout) -> bool:
    if size == spreadsheet.NO_RESULT:  # it is not known what it would be
        return False
    return size in layout.missing or (NO_DIGIT in layout.missing and not any(map(str.isdigit, size)))


_Reader = tuple[str, tuple[int, ...], Callable[[str], Any]]


def _readers(layout: Layout) -> list[_Reader]:
    decimal, zone, pattern = layout.decimal, layout.zone, layout.time_format

    def length(text: str) -> float:
        return cell_values.number(text, spreadsheet.decimal_in(text) if layout.kind == "sheet" else decimal)

    def time(text: str) -> datetime | None:
        return layout.times.moment(text, zone, pattern)

    def whole(text: str) -> int | None:
        if text and not (text.isascii() and text.isdigit()):
            raise Unreadable(_("is not the number of a correction"))
        return int(text) if text else None

    kinds: dict[str, Callable[[str], Any]] = {
        "measured": length,
        "measured_at": time,
        "machined_at": lambda text: time(text) if text else None,
        "correction_in_effect": whole,
        "received_at": lambda text: _or_none(text, zone),
        "touches": _touches,
        "context": _context,
    } | dict.fromkeys(TEMPERATURES, lambda text: length(text) if text else None)
    columns = ((name, places) for name, places in layout.columns.items() if name not in _NO_READING)
    return [(name, places, kinds.get(name, lambda text: text or None)) for name, places in columns]


def _or_none(text: str, zone: ZoneInfo | None) -> datetime | None:
    """A time that Inband wrote; of a file that a person has changed, none."""
    try:
        return cell_values.moment(text, zone)
    except Unreadable:
        return None


def _touches(text: str) -> Any:
    try:
        return json.loads(text) if text else None
    except (ValueError, RecursionError):
        raise Unreadable(_("is not a list of touches such as [[39.998, 39.9982]]")) from None


def _context(text: str) -> Any:
    try:
        return json.loads(text) if text else None
    except (ValueError, RecursionError):
        raise Unreadable(_("is not an object such as {example}").format(example='{"order": "A-77"}')) from None


def _json(path: Path, layouts: Sequence[Layout]) -> Iterator[Item]:
    nominal: dict[str, tuple[int, str]] = {}
    of_names = _of_names(layouts)
    for number, value in objects(path, layouts[0].kind):
        cells = [value.get(name) for name in layouts[0].header] if isinstance(value, dict) else []
        name = named_in(cells, layouts[0]) if cells else ""
        if not (places := of_names.get(name, of_names.get("", ())) if cells else range(len(layouts))):
            yield Item(0, number, _stranger(number, name))
            continue
        other = _other_nominal(number, cells, layouts[0], nominal) if cells else None
        for place in places:
            if other is not None:
                yield Item(place, number, other)
                continue
            yield from (Item(place, number, found) for found in _of_object(number, value, layouts[place]))


def _of_object(number: int, value: Any, layout: Layout) -> Iterator["dict[str, Any] | Flaw | Passed"]:
    if isinstance(value, Flaw):
        yield value
        return
    if not isinstance(value, dict):
        yield Flaw(number, "", shown(value), _("is not a JSON object with the fields of a reading"))
        return
    values = {
        name: value.get(layout.header[places[0]])
        for name, places in layout.columns.items()
        if name not in _NO_READING and value.get(layout.header[places[0]]) is not None
    }
    if unfit := _unfit(*(value.get(name) if name in layout.columns else None for name in VERDICT)):
        yield Passed(number, unfit)
        return
    for name in ("part", "key"):
        if isinstance(values.get(name), int) and not isinstance(values[name], bool):
            values[name] = str(values[name])
    flaws = list(_converted(values, layout, number))
    yield from flaws
    if not flaws:
        yield _in_mm(values, layout, number, name=named_in([value.get(each) for each in layout.header], layout))


def objects(path: Path, kind: str) -> Iterator[tuple[int, Any]]:
    """Yield the content of each line of a file of JSON objects, or in each place of a JSON list."""
    if kind == "list":
        yield from enumerate(json.loads(path.read_text("utf-8-sig")), start=1)
        return
    number = 0
    try:
        with path.open(encoding="utf-8-sig") as file:
            for number, line in enumerate(file, start=1):
                if not line.strip():
                    continue
                try:
                    yield number, json.loads(line)
                except (ValueError, RecursionError) as error:
                    yield number, Flaw(number, "", shown(line.strip()), _("is not JSON: {error}").format(error=error))
    except UnicodeDecodeError:
        yield number + 1, Flaw(number + 1, "", "", _("JSON files are UTF-8 text; this is not."))


def _converted(values: dict[str, Any], layout: Layout, number: int) -> Iterator[Flaw]:
    """Bring times to their zone; what is of the wrong kind is reported with the other fields."""
    if isinstance(values.get("received_at"), str):
        values["received_at"] = _or_none(values["received_at"], layout.zone)
    for name in ("measured_at", "machined_at"):
        if isinstance(values.get(name), int | float) and not isinstance(values[name], bool):
            values[name] = str(values[name])  # a count, as in a table
        if isinstance(values.get(name), str):
            try:
                at = layout.times.moment(values[name], layout.zone, layout.time_format)
                if at is None and values.pop(name).strip():
                    continue
                values[name] = at
            except Unreadable as error:
                yield Flaw(number, layout.named(name), shown(values[name]), str(error))
