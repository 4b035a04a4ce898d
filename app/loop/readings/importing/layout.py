"""Meanings of the columns of a file: by the names that people give them in English, German, Serbian, Slovene and Russian."""

import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple
from zoneinfo import ZoneInfo

from app.files.formats import cell_values, delimited, parts_across, spreadsheet
from app.files.formats.cell_values import slashed
from app.files.formats.delimited import Row, Unusable
from app.files.formats.file_times import FileTimes, only_days, times_of, times_unnamed
from app.files.formats.headings import TOP, as_wide, heading, is_reading, is_summary, others
from app.files.formats.number_with_unit import number_and_unit
from app.files.formats.units import LENGTHS, UnknownUnit, length_unit, unit_above
from app.language.i18n import _
from app.loop.readings.importing.columns import DRAWN, by_places, column_unit, columns_of, fits, guesses_of, nominal_of
from app.loop.readings.importing.refusals import (
    LONGEST_NAME,
    heading_or_reading,
    long_name,
    refuse_no_table,
    refuse_wide,
    wrong,
)
from app.loop.readings.importing.times_wording import in_doubt, on_times

NO_DIGIT = "*"
MOST_NAMES = 1_000
DIAMETERS = frozenset({"prumer", "priemer"})
"""Words for a mean that are those for a diameter as well: Czech, Slovak."""


@dataclass(frozen=True)
class Wishes:
    """Choices of a person about a file. What is None (or not mapped) is recognised from the file."""

    mapping: Mapping[str, str] = field(default_factory=dict)  # field -> column, by name or number
    delimiter: str | None = None
    decimal: str | None = None
    unit: str | None = None
    timezone: str | None = None
    time_format: str | None = None
    encoding: str | None = None
    header_line: int | None = None
    first_line: int | None = None  # of readings
    last_line: int | None = None
    missing: frozenset[str] = frozenset()  # marks in place of a size that is missing; NO_DIGIT for all without a digit


class Drawn(NamedTuple):
    """A characteristic as the first of its rows describes it, each field as it is written. other: a line that says otherwise."""

    line: int
    nominal: str
    upper: str
    lower: str
    natural_limit: str
    unit: str
    other: int = 0


@dataclass(frozen=True)
class Layout:
    """The layout by which a file is read."""

    kind: str  # csv, sheet (of a workbook, as text), lines (one JSON object per line) or list (one JSON list)
    header: tuple[str, ...]
    columns: Mapping[str, tuple[int, ...]]  # field -> places in the header; a date and a time may be two
    encoding: str = "utf-8"
    letters: str = ""  # the first cell by which a person sees if a guessed encoding is right
    delimiter: str = ","
    decimal: str = "."
    said_unit: str | None = None  # of the column of sizes, by a person or its header; a row or a cell may say its own
    units: tuple[
        str | None, ...
    ] = ()  # of columns whose header says none: in a row below it, or in the lines above the table
    doubt: str = ""  # a unit that the lines above the table name, and do not say of what
    questions: tuple[tuple[str, str], ...] = ()  # what only a person can answer: the choice, and the sentence
    takes_times: bool = False  # of a column whose name does not say that it holds them
    days: str = ""  # the column whose name says so, and that holds days alone
    thousands: Mapping[int, str] = field(default_factory=dict)  # a number whose sign may part thousands, by its column
    nominal: tuple[int, ...] = ()  # of the nominal size, which is one for all rows of a characteristic
    zone: ZoneInfo | None = None
    time_format: str | None = None
    header_line: int = 1
    first_line: int = 2  # from here on lines are readings
    last_line: int | None = None  # below are sums and means
    missing: frozenset[str] = frozenset()
    times: FileTimes = FileTimes()  # noqa: RUF009 - a tuple
    drawn: Mapping[str, Drawn] = field(
        default_factory=dict
    )  # where each row says of which characteristic it is, by name
    only: str = ""  # the one of them that is read
    parts: tuple[str, ...] = ()  # columns that are parts, where each row is a characteristic
    skips_blank: bool = False  # a row without the measured value says nothing: another column of a wide sheet has one

    @property
    def unit(self) -> str:
        """Unit of sizes whose row and cell name none."""
        return self.said_unit or "mm"

    @property
    def is_table(self) -> bool:
        """Tell if its lines are rows of cells."""
        return self.kind in {"csv", "sheet"}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of characteristics, where each row says of which one it is."""
        return tuple(self.drawn)

    @property
    def complete(self) -> bool:
        """Tell if the column of the measured values is known."""
        return "measured" in self.columns or "touches" in self.columns

    @property
    def turned(self) -> str:
        """A sentence on a table that is the other way round: characteristics downward, parts across. Empty for any other."""
        return "" if self.complete or not self.parts else parts_across.sentence(self.parts)

    @property
    def subjects(self) -> tuple[str, ...]:
        """Names that characteristics may be chosen for: those in the rows, else those of the columns."""
        return self.names or self.header

    def refuse_doubt(self) -> None:
        """Refuse to take sizes of an uncertain unit for millimetres. Raises `Invalid`."""
        if self.doubt:
            words = _("The lines above the table name the unit {unit}, and it cannot be determined of which numbers.")
            what = _("Say in which unit the numbers of the table are: {units}.").format(units=", ".join(LENGTHS))
            raise wrong("unit", f"{words.format(unit=self.doubt)} {what}")

    def refuse_thousands(self, place: int, unit: str | None) -> None:
        """Refuse numbers of a small unit that may be a thousand times as large: 1.250 µm of a German file. Raises `Invalid`."""
        if place in self.thousands and LENGTHS[unit or "mm"] < 1:
            sheet = self.kind == "sheet"
            raise wrong("decimal", delimited.thousands_in_doubt(self.thousands[place], unit or "mm", sheet=sheet))

    def refuse_question(self) -> None:
        """Refuse what only a person can answer, before anything is stored. Raises `Invalid`."""
        for question in self.questions:
            raise wrong(*question)

    @property
    def on_times(self) -> str:
        """A sentence on times that are there under another name, or nowhere. Empty where a name or a person says them, or is asked."""
        if "measured_at" in dict(self.questions):
            return ""
        return on_times(self.named("measured_at"), self.days, taken=self.takes_times)

    def of_one(self, key: str, name: str) -> "Layout":
        """The layout for one characteristic: of a table with rows of several, its own rows. Raises `Invalid`."""
        if len(self.names) < 2:
            return self
        wanted = {cell_values.folded(key), cell_values.folded(name)}
        own = [each for each in self.names if cell_values.folded(each) in wanted]
        if len(own) == 1:
            return replace(self, only=own[0])
        raise wrong(
            self.named("characteristic"),
            _(
                "The rows are of {count} characteristics ({names}), and none is called {key}. Say which is which, a "
                "characteristic for each, in place of the one; or that this column names none (--map characteristic=)."
            ).format(count=len(self.names), names=", ".join(self.names[:10]), key=repr(key)),
        )

    @property
    def ignored_places(self) -> list[int]:
        """Return the places of columns that mean nothing here."""
        used = {place for places in self.columns.values() for place in places}
        return [place for place in range(len(self.header)) if place not in used]

    @property
    def ignored(self) -> list[str]:
        """Their names."""
        return [self.header[place] for place in self.ignored_places]

    def named(self, field_name: str) -> str:
        """The column that a field is read from."""
        return "+".join(self.header[place] for place in self.columns.get(field_name, ()))


def look(path: Path, wishes: Wishes, name: str | None = None, *, complete: bool = True) -> Layout:
    """Find out how a file is to be read. Raises `Invalid`, naming what must be said.

    name: what the file is called where `path` is only a copy of it; its ending says what kind it is.
    complete: refuse a file in which no column is known to hold what was measured.
    """
    try:
        zone = cell_values.zone_named(wishes.timezone) if wishes.timezone else None
    except cell_values.Unreadable as error:
        raise wrong("timezone", str(error)) from None
    if wishes.unit not in {None, *LENGTHS}:
        raise wrong("unit", _("Choose one of {units}.").format(units=", ".join(LENGTHS)))
    if wishes.decimal not in {None, ".", ","}:
        raise wrong("decimal", _("Decimals are written with a point or a comma."))
    if wishes.encoding not in {None, *delimited.ENCODINGS}:
        raise wrong("encoding", _("Choose one of {names}.").format(names=", ".join(delimited.ENCODINGS)))
    sign = wishes.delimiter
    if sign not in {None, delimited.BLANKS} and (len(sign or "") != 1 or sign in {'"', "\r", "\n"}):
        raise wrong(
            "delimiter", _("The column separator is one sign, such as ; or a tabulator, or “blanks” for several.")
        )
    ending = Path(name or path.name).suffix.lower()
    try:
        if ending in {".ndjson", ".jsonl", ".json"}:
            layout = _json_layout(path, wishes, zone, is_list=ending == ".json")
        elif ending in spreadsheet.ENDINGS:  # written as text before (app/files/formats/spreadsheet.py)
            layout = _csv_layout(path, replace(wishes, encoding="utf-8", delimiter="\t", decimal="."), zone, "sheet")
        else:
            layout = _csv_layout(path, wishes, zone)
    except Unusable as error:
        where = _("line {line}").format(line=error.line) if error.line else "file"
        raise wrong(where, str(error)) from None
    if complete:
        refuse_incomplete(layout)
    return layout


def refuse_incomplete(layout: Layout) -> None:
    """Refuse a file in which no column is known to hold what was measured, or that leaves a question. Raises `Invalid`."""
    if layout.complete:
        layout.refuse_question()
    else:
        raise wrong(
            "measured",
            layout.turned
            or _(
                "No column is recognised as the measured value. Say which it is: measured=COLUMN. The columns are: {header}."
            ).format(header=", ".join(filter(None, layout.header))),
        )


def _csv_layout(path: Path, wishes: Wishes, zone: ZoneInfo | None, kind: str = "csv") -> Layout:
    encoding = wishes.encoding or delimited.encoding_of(path)
    delimiter = wishes.delimiter or delimited.delimiter_of(path, encoding)
    rows = delimited.rows(path, encoding, delimiter)
    top = list(islice(rows, TOP))
    if not top:
        raise wrong("file", _("The file is empty."))
    refuse_no_table(top[0].cells[0])
    found = heading(top, wishes.header_line, ragged=kind == "sheet")
    if found is None:
        words = _("Line {n} is empty, or too far below to be the header of the columns.")
        raise wrong("header_line", words.format(n=wishes.header_line))
    if wishes.header_line is None and not fits(found.names, wishes.mapping):
        by_name = any(column and not column.isdigit() for column in wishes.mapping.values())
        near = (row for row in others(top, found, named=by_name) if not any(map(delimited.is_value, row.cells)))
        fitting = (row.line for row in near if fits([cell.strip() for cell in row.cells], wishes.mapping))
        found = heading(top, next(fitting, None), ragged=kind == "sheet") or found
    head, header, units, end = found
    refuse_wide(header)
    first_line = max(head + 1, end + 1, wishes.first_line or 0)
    columns = columns_of(header, wishes.mapping)
    bare: bool | None = False
    if wishes.header_line is None:
        bare = is_reading(found, top, columns.get("measured", ()), columns.get("measured_at", ()))
        if bare is None and wishes.first_line is not None:  # a person has said what it is
            bare = wishes.first_line <= head
    if bare:  # there is no heading: this line is a reading
        numbered = tuple(_("Column {n}").format(n=at) for at in range(1, len(header) + 1))
        header, columns = numbered, by_places(numbered, header, wishes.mapping)
        first_line, head, units = max(head, wishes.first_line or 0), 0, ()
    place = columns.get("measured", (0,))[0]
    # Where no column is the measured one, it may be any of them, or several.
    only = slice(place, place + 1) if "measured" in columns else slice(None)
    below = [row for row in chain(top, islice(rows, 200)) if row.line >= first_line]
    sample = [number_and_unit(cell)[0] for row in below for cell in row.cells[only]]
    above, doubt = _above([row.cells for row in top if row.line < head])
    units = tuple(unit or above for unit in units or (None,) * len(header))
    made = Layout(
        kind=kind,
        header=header,
        columns=columns,
        encoding=encoding,
        letters="" if wishes.encoding or encoding.startswith("utf") else _letters(chain(top, below)),
        delimiter=delimiter,
        decimal=wishes.decimal or delimited.decimal_of(sample),
        said_unit=(column_unit(header[place], wishes.unit) or units[place]) if "measured" in columns else wishes.unit,
        units=units,
        doubt="" if wishes.unit or "unit" in columns else doubt,
        questions=(heading_or_reading(head, header),) if bare is None else (),
        thousands={} if wishes.decimal and kind == "csv" else _thousands(below, range(len(header))[only], kind),
        nominal=nominal_of(header, columns, wishes.mapping),
        zone=zone,
        time_format=wishes.time_format,
        header_line=head,
        first_line=first_line,
        last_line=wishes.last_line,
        missing=wishes.missing,
        parts=() if "measured" in columns else parts_across.columns(header, guesses_of(header), below),
    )
    if "measured" in columns:
        for unit in _units_of(made, below):
            made.refuse_thousands(place, unit)
        if made.said_unit is None:
            made.refuse_doubt()
    named = (
        (row.line, row.cells) for row in rows_of(path, made) if isinstance(row, Row) and tuple(row.cells) != header
    )
    last = wishes.last_line or sys.maxsize
    cells = [row.cells for row in below if row.line <= last and tuple(row.cells) != header]
    made = _with_unnamed(_timed(made, _times(made, below, rows)), wishes, cells)
    if made.takes_times:
        again = delimited.rows(path, encoding, delimiter)
        made = _timed(made, _times(made, below, (row for row in again if row.line >= first_line)))
    return replace(made, drawn=_drawn(made, named))


def _letters(rows: Iterable[Row]) -> str:
    """The first cell with a letter beyond ASCII."""
    beyond = (cell.strip() for row in rows for cell in row.cells if not cell.isascii())
    return next((cell[:40] for cell in beyond if any(each.isalpha() and not each.isascii() for each in cell)), "")


def _thousands(rows: Sequence[Row], places: Iterable[int], kind: str) -> dict[int, str]:
    """A number in which a sign may part thousands for each of these columns where no number tells."""
    texts = {place: [number_and_unit(text_of(row, (place,)))[0] for row in rows] for place in places}
    found = {place: delimited.like_thousands(each, sheet=kind == "sheet") for place, each in texts.items()}
    return {place: number for place, number in found.items() if number}


def _units_of(layout: Layout, rows: Sequence[Row]) -> set[str | None]:
    """The units of the measured sizes of these rows, as far as they are known."""
    units = {layout.said_unit}
    for row in rows:
        said = (
            text_of(row, layout.columns.get("unit", ())),
            number_and_unit(text_of(row, layout.columns["measured"]))[1],
        )
        units |= {length_unit(word) for word in said if word}
    return units


def _above(titles: Sequence[Sequence[str]]) -> tuple[str | None, str]:
    """The unit that the lines above a table say for all of it; or the one that they name without saying of what."""
    try:
        return unit_above(titles), ""
    except UnknownUnit as error:
        return None, error.word


def _timed(layout: Layout, times: FileTimes) -> Layout:
    """The layout with these times; a column that holds none is none of times."""
    columns = {name: places for name, places in layout.columns.items() if name != "measured_at" or not times.nothing}
    return replace(layout, times=times, columns=columns)


def _with_unnamed(layout: Layout, wishes: Wishes, rows: Sequence[Sequence[Any]]) -> Layout:
    """The layout with the column that alone holds times, or with the question which one does, where no person says it.

    That is where no column has a known name for them, or the one that has holds days alone.
    """
    if "measured_at" in wishes.mapping:
        return layout
    named = layout.columns.get("measured_at", ())
    days = [" ".join(written(row[at]) for at in named if at < len(row)) for row in rows]
    if named and not only_days(days, wishes.time_format):
        return layout
    layout = replace(layout, days=layout.named("measured_at"))
    free = [place for place in layout.ignored_places if place not in layout.nominal]
    columns = {str(at): [written(row[at]) if at < len(row) else "" for row in rows] for at in free}
    found = times_unnamed(columns, wishes.time_format, days if named else ())
    if found.sure:
        return replace(layout, columns={**layout.columns, "measured_at": (int(found.sure),)}, takes_times=True)
    if not (question := in_doubt(found, columns, layout.header, layout.days)):
        return layout
    others = {name: places for name, places in layout.columns.items() if name != "measured_at"}
    return replace(layout, columns=others, questions=(*layout.questions, ("measured_at", question)))


def _times(layout: Layout, begin: Sequence[Row], rest: Iterator[Row]) -> FileTimes:
    """Common properties of the times of the file; of all lines only where the first ones leave something open."""
    places = layout.columns.get("measured_at", ())
    if not places:
        return FileTimes()

    def texts(rows: Iterable[Row]) -> Iterator[str]:
        return (text_of(row, places) for row in rows)

    found = times_of(texts(begin), layout.time_format)
    if found.dated and (found.order is not None or not any(slashed(text) for text in texts(begin))):
        return found
    return times_of(texts(chain(begin, rest)), layout.time_format)


def text_of(row: Row, places: Sequence[int]) -> str:
    """The cells at these places as one text; a row may be shorter than the header."""
    return " ".join(row.cells[place] for place in places if place < len(row.cells)).strip()


def _drawn(layout: Layout, rows: Iterable[tuple[int, Sequence[Any]]]) -> dict[str, Drawn]:
    """The characteristics that the rows name, in their order. rows: by their lines, cells in the order of the header."""
    found: dict[str, Drawn] = {}
    for line, cells in rows if "characteristic" in layout.columns else ():
        name = named_in(cells, layout)
        if not name:
            continue
        nominal, upper, lower, natural, unit = (
            " ".join(written(cells[at]) for at in layout.columns.get(each, ())) for each in (*DRAWN, "unit")
        )
        if not found and is_summary(name) and not nominal and cell_values.folded(name) not in DIAMETERS:
            words = _(
                "{name} holds limits or statistics: here the characteristics stand side by side, and their rows are parts. Say "
                "so (--map characteristic=), and the first line of readings (--first-line)"
            )
            where = layout.named("characteristic") + ", " + _("line {line}").format(line=line)
            raise wrong(where, words.format(name=repr(name)))
        if len(name) > LONGEST_NAME:
            raise wrong(layout.named("characteristic") + ", " + _("line {line}").format(line=line), long_name(name))
        drawn = Drawn(line, nominal, upper, lower, natural, unit)
        first = found.setdefault(name, drawn)
        if not first.other and first[1:6] != drawn[1:6]:
            found[name] = first._replace(other=line)
        if len(found) > MOST_NAMES:
            column = layout.named("characteristic")
            words = _("The column names more than {most} characteristics; part the file.")
            raise wrong(column, words.format(most=MOST_NAMES))
    return found


def named_in(cells: Sequence[Any], layout: Layout) -> str:
    """The characteristic that a row names; empty in a table whose rows name none."""
    return " ".join(written(cells[place]) for place in layout.columns.get("characteristic", ()))


def written(cell: Any) -> str:
    """A cell as a text."""
    return "" if cell is None else str(cell).strip()


def rows_of(path: Path, layout: Layout) -> Iterator[Row | Unusable]:
    """The rows of readings, each as wide as the header, or what is wrong with one."""
    width = len(layout.header)
    last = layout.last_line or sys.maxsize
    every = delimited.rows(path, layout.encoding, layout.delimiter)
    rows = (row for row in every if layout.first_line <= row.line <= last)
    if layout.kind == "sheet":  # what is beside the table is no part of it
        return (as_wide(row, width) for row in rows)
    complete = layout.last_line is not None or delimited.is_complete(path)
    return delimited.even(rows, width, layout.delimiter, complete=complete)


def _json_layout(path: Path, wishes: Wishes, zone: ZoneInfo | None, *, is_list: bool) -> Layout:
    names: dict[str, None] = {}
    values = [value for _at, value in islice(_objects(path, is_list=is_list), 200)]
    for value in values:
        names.update(dict.fromkeys(map(str, value)))
        refuse_wide(names)
    header = tuple(names)
    if not header:
        raise wrong("file", _("The file holds no JSON objects."))
    columns = columns_of(header, wishes.mapping)
    unit = column_unit(header[columns["measured"][0]] if "measured" in columns else "", wishes.unit)
    layout = Layout(
        "list" if is_list else "lines",
        header,
        columns,
        said_unit=unit,
        nominal=nominal_of(header, columns, wishes.mapping),
        zone=zone,
        time_format=wishes.time_format,
    )
    if "characteristic" in columns:
        rows = ((at, [value.get(name) for name in header]) for at, value in _objects(path, is_list=is_list))
        layout = replace(layout, drawn=_drawn(layout, rows))
    if "measured_at" in columns:
        times = _times_of(values, layout)
        if not times.dated:
            times = _times_of((value for _at, value in _objects(path, is_list=is_list)), layout)
        layout = _timed(layout, times)
    texts = [[_text(value.get(name)) for name in header] for value in values]
    layout = _with_unnamed(layout, wishes, texts)
    return _timed(layout, _times_of(values, layout)) if layout.takes_times else layout


def _times_of(values: Iterable[Mapping[str, Any]], layout: Layout) -> FileTimes:
    """Common properties of the times of these objects."""
    name = layout.named("measured_at")
    return times_of((_text(value.get(name)) for value in values), layout.time_format)


def _text(value: Any) -> str:
    """A text or a number of JSON as the text that a table would have; empty of anything else."""
    return str(value) if isinstance(value, str | int | float) and not isinstance(value, bool) else ""


def _objects(path: Path, *, is_list: bool) -> Iterator[tuple[int, dict[str, Any]]]:
    """The objects of a file by their lines or places; what is none is named when it is read."""
    try:
        if is_list:
            whole = json.loads(path.read_text("utf-8-sig"))
            yield from ((at, each) for at, each in enumerate(whole, 1) if isinstance(each, dict))
            return
        with path.open(encoding="utf-8-sig") as file:
            read = ((at, _object(line)) for at, line in enumerate(file, 1))
            yield from ((at, each) for at, each in read if isinstance(each, dict))
    except UnicodeDecodeError:
        raise Unusable(_("JSON files are UTF-8 text; this is not.")) from None
    except ValueError as error:
        raise Unusable(_("This is not JSON: {error}.").format(error=error)) from None
    except RecursionError:
        raise Unusable(_("This is nested too deeply to be readings.")) from None


def _object(line: str) -> Any:
    try:
        return json.loads(line)
    except ValueError:
        return None  # the line is named when it is read
