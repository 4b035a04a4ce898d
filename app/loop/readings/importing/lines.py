"""The lines of a file as readings, or what is wrong with each: line, column, reason."""

import hashlib
import json
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from app.errors import Invalid
from app.files.formats import cell_values, spreadsheet
from app.files.formats.cell_values import Unreadable
from app.files.formats.delimited import Unusable
from app.files.formats.units import LENGTHS
from app.language.i18n import _
from app.loop.readings.importing.layout import Layout, rows_of
from app.loop.readings.schemas import ReadingIn, reading_of

SHOWN = 60  # characters of a wrong value


class Flaw(NamedTuple):
    """The error of a line."""

    line: int
    column: str
    value: str
    reason: str

    def __str__(self) -> str:
        where = _("line {line}").format(line=self.line) + (f", {self.column}" if self.column else "")
        return f"{where}: {f'{self.value!r} ' if self.value else ''}{self.reason}"


class Line(NamedTuple):
    """A line that can be a reading."""

    number: int
    reading: ReadingIn


def fingerprint(path: Path) -> str:
    """Names the content of a file: the same content has the same, whatever the file is called."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:20]


def lines(path: Path, layout: Layout, characteristic: str, *, now: datetime | None = None) -> Iterator[Line | Flaw]:
    """Every line that is not empty. A reading without a key of its own gets one made of the file's content and the line,
    so that importing the same file again stores nothing twice.
    """
    now = now or datetime.now(UTC)
    mark = fingerprint(path)
    source = _csv(path, layout) if layout.is_table else _json(path, layout)
    for number, item in source:
        if isinstance(item, Flaw):
            yield item
            continue
        item["characteristic"] = characteristic
        if item.get("touches") is not None:
            item.pop("measured", None)  # it is made of them
        if item.get("key") is None:
            item["key"] = f"file:{mark}:{number}"
        try:
            yield Line(number, reading_of(item, now))
        except Invalid as refusal:
            for error in refusal.errors:
                column = layout.named(error.field.partition(".")[0]) or error.field
                yield Flaw(number, column, _shown(item.get(error.field)), error.message)


def _shown(value: Any) -> str:
    text = "" if value is None else value if isinstance(value, str) else str(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


Found = Iterator[tuple[int, "dict[str, Any] | Flaw"]]


def _csv(path: Path, layout: Layout) -> Found:
    readers = _readers(layout)
    width = len(layout.header)
    try:
        for row in rows_of(path, layout):
            if len(row.cells) < width or any(cell.strip() for cell in row.cells[width:]):
                yield row.line, Flaw(row.line, "", "", _width(len(row.cells), width, layout.delimiter))
                continue
            if layout.skips_blank and not any(row.cells[place].strip() for place in layout.columns["measured"]):
                continue
            values: dict[str, Any] = {}
            flaws: list[Flaw] = []
            for name, places, read in readers:
                text = " ".join(row.cells[place] for place in places).strip()
                try:
                    if layout.kind == "sheet":
                        _refuse_error(text)
                    values[name] = read(text)
                except Unreadable as error:
                    flaws.append(Flaw(row.line, layout.named(name), _shown(text), str(error)))
            if flaws:
                yield from ((row.line, flaw) for flaw in flaws)
            else:
                yield row.line, values
    except Unusable as error:
        yield error.line or 0, Flaw(error.line or 0, "", "", str(error))


def _refuse_error(text: str) -> None:
    """Raises `Unreadable` for a cell of a workbook that has no result."""
    if text == spreadsheet.NO_RESULT:
        raise Unreadable(
            _("is a formula without a result in the file; open the workbook in a spreadsheet program and save it")
        )
    if text in spreadsheet.ERRORS:
        raise Unreadable(_("is an error of the workbook; correct or clear the cell"))


def _width(cells: int, width: int, delimiter: str) -> str:
    sign = {"\t": _("tabulator"), ",": _("comma"), ";": _("semicolon")}.get(delimiter, delimiter)
    text = _("has {cells} columns, the header has {width}; the column separator is {sign}.").format(
        cells=cells, width=width, sign=sign
    )
    if delimiter == "," and cells > width:
        text += " " + _(
            "A decimal comma parts a cell too: put such numbers in quotation marks, or name another delimiter."
        )
    return text


def _readers(layout: Layout) -> list[tuple[str, tuple[int, ...], Callable[[str], Any]]]:
    scale, decimal, zone, pattern = LENGTHS[layout.unit], layout.decimal, layout.zone, layout.time_format

    def length(text: str) -> float:
        value = cell_values.number(text, decimal)
        return value if scale == 1.0 else round(value * scale, 9)

    def time(text: str) -> datetime:
        return cell_values.moment(text, zone, pattern)

    def whole(text: str) -> int | None:
        if text and not (text.isascii() and text.isdigit()):
            raise Unreadable(_("is not the number of a correction"))
        return int(text) if text else None

    kinds: dict[str, Callable[[str], Any]] = {
        "measured": length,
        "measured_at": time,
        "machined_at": lambda text: time(text) if text else None,
        "correction_in_effect": whole,
        "touches": _touches,
        "context": _context,
    }
    return [(name, places, kinds.get(name, lambda text: text or None)) for name, places in layout.columns.items()]


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


def _json(path: Path, layout: Layout) -> Found:
    for number, value in objects(path, layout.kind):
        if isinstance(value, Flaw):
            yield number, value
            continue
        if not isinstance(value, dict):
            yield number, Flaw(number, "", _shown(value), _("is not a JSON object with the fields of a reading"))
            continue
        values = {
            name: value.get(layout.header[places[0]])
            for name, places in layout.columns.items()
            if value.get(layout.header[places[0]]) is not None
        }
        flaws = list(_converted(values, layout, number))
        if flaws:
            yield from ((number, flaw) for flaw in flaws)
        else:
            yield number, values


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
                    yield number, Flaw(number, "", _shown(line.strip()), _("is not JSON: {error}").format(error=error))
    except UnicodeDecodeError:
        yield number + 1, Flaw(number + 1, "", "", _("JSON files are UTF-8 text; this is not."))


def _converted(values: dict[str, Any], layout: Layout, number: int) -> Iterator[Flaw]:
    """Bring lengths to mm and times to their zone; what is of the wrong kind is told with the other fields."""
    scale = LENGTHS[layout.unit]
    if scale != 1.0 and isinstance(values.get("measured"), int | float) and abs(values["measured"]) < 1e300:
        values["measured"] = round(values["measured"] * scale, 9)
    for name in ("measured_at", "machined_at"):
        if isinstance(values.get(name), str):
            try:
                values[name] = cell_values.moment(values[name], layout.zone, layout.time_format)
            except Unreadable as error:
                yield Flaw(number, layout.named(name), _shown(values[name]), str(error))
