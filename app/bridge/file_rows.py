"""The rows of a table or of NDJSON by their columns, and what is wrong with one, in the order of the file."""

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

from app.bridge.fields import EVERY, FIELDS
from app.bridge.json_text import read_json
from app.core.number_text import number_or_none
from app.files.formats import delimited
from app.files.formats.file_times import only_days, times_unnamed
from app.files.formats.headings import TOP, Heading, as_wide, heading, is_labelled, is_reading, others
from app.files.formats.number_with_unit import number_and_unit
from app.files.formats.repeats import Remark, Repeats
from app.files.formats.units import LENGTHS, is_unit_column, unit_above, unit_in


class Fault(NamedTuple):
    """Something for which a file cannot be taken: line where it is known, field or column, and the reason with what to do.

    value: as it is written, where the reason is about one.
    """

    line: int | None
    field: str
    reason: str
    value: str = ""

    def __str__(self) -> str:
        """Line, field, value, reason."""
        where = ", ".join(([f"line {self.line}"] if self.line else []) + ([self.field] if self.field else []))
        words = f"{self.value!r} {self.reason}" if self.value else self.reason
        return f"{where}: {words}" if where else words


def reasons(faults: Iterable[Fault]) -> list[str]:
    """Sentences on faults, each reason once with its first lines and their count; those of the whole file come first."""
    whole, lines = dict[str, None](), Repeats()
    for fault in faults:
        if fault.line:
            lines.add(Remark(fault.line, fault.field, fault.value, fault.reason))
        else:
            whole[str(fault)] = None
    return [*whole, *lines.sentences()]


Found = Mapping[str, Any] | Fault | Remark
"""A row by its columns, or a remark on it."""


class Table(NamedTuple):
    """The form of a table. delimiter: None is found out. columns: those that are wanted. names: of other columns that count.

    complete: its last line has an end. sheet: of a workbook, as text; what is beside the table is no part of it.
    """

    encoding: str
    delimiter: str | None
    columns: Collection[str]
    names: Collection[str]
    complete: bool = True
    sheet: bool = False


def csv_rows(path: Path, table: Table) -> Iterator[tuple[int, Found]]:
    """The rows of a table."""
    try:
        delimiter = table.delimiter or delimited.delimiter_of(path, table.encoding)
        rows = delimited.rows(path, table.encoding, delimiter)
        top = list(islice(rows, TOP))
        if not top:
            return
        found = _heading(top, table)
        if reason := _in_doubt(found, top, table):
            yield found.line, Fault(found.line, "", reason)
            return
        line, names, _units, end = found
        used = {part for column in table.columns for part in parts_of(column, names)}
        counted = {name for name in names if name in used or name in table.names or is_unit_column(name)}
        for name in sorted(name for name in counted if names.count(name) > 1):
            yield line, Fault(line, name, "is the name of several columns; give each its own.")
        wanted = used - set(names)
        for name in sorted(wanted):
            yield line, Fault(line, name, f"is no column of this file; it has {', '.join(filter(None, names))}.")
        if wanted:
            return
        below = chain((row for row in top if row.line > max(line, end)), rows)
        for row in _as_wide(below, len(names), delimiter, table):
            if isinstance(row, delimited.Unusable):
                yield row.line or 0, Fault(row.line, "", str(row))
            elif line and tuple(cell.strip() for cell in row.cells) == names:
                yield row.line, Remark(row.line, "", "", "is the heading again; passed over")
            else:
                yield row.line, dict(zip(names, row.cells, strict=False))
    except UnicodeError:
        yield 0, Fault(None, "", f"This is not {table.encoding} text: name the encoding of the file.")


def units_of(path: Path, table: Table) -> Callable[[str], str | None]:
    """The unit of length of each column: in its name, in a row below it, or in the lines above the table. It raises `UnknownUnit`."""
    try:
        delimiter = table.delimiter or delimited.delimiter_of(path, table.encoding)
        top = list(islice(delimited.rows(path, table.encoding, delimiter), TOP))
    except (UnicodeError, delimited.Unusable):
        top = []  # said of the rows
    line, names, units, _end = _heading(top, table) if top else Heading(0, ())
    titles = [row.cells for row in top if row.line < line]
    below = dict(zip(names, units, strict=False))
    return lambda column: unit_in(column) or below.get(column) or unit_above(titles)


class UnnamedTimes(NamedTuple):
    """The column of times that the configuration does not name, if there is one, and what is said of it, by line."""

    column: dict[str, str]
    said: list[tuple[int, Found]]


def unnamed_times(columns: Mapping[str, str], table: Sequence[tuple[int, Found]], pattern: str | None) -> UnnamedTimes:
    """The only column that holds times, where none is configured: none is there under its name, or that one holds days alone.

    A fault where several may be it; a remark on numbers that may be times.
    """
    rows = [row for _line, row in table if isinstance(row, Mapping)]
    named = columns.get("measured_at", "")
    days = [str(cell_of(row, named) or "") for row in rows] if any(has(row, named) for row in rows) else []
    if days and not only_days(days, pattern):
        return UnnamedTimes({}, [])
    names = dict.fromkeys(name for row in rows for name in row if name)
    used = {part for column in columns.values() for part in parts_of(column, names)}
    cells = {name: [str(row.get(name) or "") for row in rows] for name in names if name not in used}
    sure, doubtful, counted = times_unnamed(cells, pattern, days)
    too = _named_too(columns, names)
    if doubtful:
        reason = "hold dates, and columns.measured_at names none of them: name the one that is meant, or none, which means now"
        if days:
            reason = f"hold times, and {named} holds days alone: name the one that is meant, or {named}, which means midnight"
        fault = Fault(
            None,
            ", ".join(doubtful),
            f'{reason}: columns.measured_at = "{doubtful[0]}", or "{named if days else ""}"{too}.',
        )
        return UnnamedTimes({}, [(0, fault)])
    line = table[0][0] if table else 0
    if counted:
        name, form = next(iter(counted.items()))
        said = f'columns.measured_at = "{name}"' + (f' and times = "{form}"' if form else "")
        words = f'may be times, and columns.measured_at names none, which means now: set {said}, or columns.measured_at = ""{too}'
        return UnnamedTimes({}, [(line, Remark(line, name, "", words))])
    other = f'columns.measured_at = "{named if days else ""}"'
    words = f"holds dates and times and is taken for the time of measuring; if it is not, set {other}{too}"
    return (
        UnnamedTimes({"measured_at": sure}, [(line, Remark(line, sure, "", words))]) if sure else UnnamedTimes({}, [])
    )


def _named_too(columns: Mapping[str, str], names: Collection[str]) -> str:
    """The other columns to configure beside one, where none is so far: then no field is found by its name any more."""
    if any(field != column for field, column in columns.items()) or len(columns) < len(FIELDS):
        return ""
    others = [f'columns.{field} = "{field}"' for field in FIELDS if field in names and field != "measured_at"]
    return f"; and beside it {', '.join(others)}" if others else ""


def unit_in_doubt(word: str) -> str:
    """The reason against sizes whose header, or a line above it, names a unit that cannot be taken."""
    return (
        f"the header, or a line above it, names the unit {word}: it cannot be determined of which sizes, or it is no length that is known "
        f"({', '.join(LENGTHS)}). Name the unit in the header of the column, or set unit under the machine's folder."
    )


def labels_of(fields: Mapping[str, Any], row: Mapping[str, Any]) -> list[Any]:
    """The cells of a row that name its part, or would in any other row: the first one, and those of part and time."""
    first = next((value for value in row.values() if value is not None and str(value).strip()), None)
    sizes = (fields.get("measured"), fields.get("characteristic"))
    named = [fields.get("part"), fields.get("measured_at"), *filter(is_labelled, [fields.get("measured")])]
    a_shift = any(named) and len(str(first).strip()) == 1 and first not in named  # S and N are shifts as well
    return named if first in sizes or a_shift else [*named, first]


def parts_of(column: str, names: Collection[str]) -> list[str]:
    """The columns that a wanted one is made of: itself, or such as Date and Time of `Date+Time`.

    >>> parts_of("Date+Time", ["Date", "Time"]), parts_of("C+", ["C+", "D"])
    (['Date', 'Time'], ['C+'])
    """
    return [column] if column in names or "+" not in column else [part.strip() for part in column.split("+")]


def cell_of(row: Mapping[str, Any], column: str) -> Any:
    """The cell of a row in a column, or those that it is made of with a blank between them; None where it has none of them."""
    parts = parts_of(column, row)
    if len(parts) == 1:
        return row.get(column)
    cells = [str(row[part]).strip() for part in parts if row.get(part) is not None]
    return " ".join(filter(None, cells)) if cells else None


def has(row: Mapping[str, Any], column: str) -> bool:
    """Tell if a row has a column, or one of those that it is made of."""
    return column != "" and any(part in row for part in parts_of(column, row))


def _heading(top: Sequence[delimited.Row], table: Table) -> Heading:
    """The names of the columns: where an import finds them; else in the first row that has all that are wanted.

    Of a table without a heading, whose columns are wanted by their places, these are the names, and the line is 0.
    """
    found = heading(top, ragged=table.sheet) or Heading(top[0].line, ())
    near = others(top, found, named=True)
    plain = [Heading(row.line, tuple(cell.strip().lstrip("\ufeff") for cell in row.cells)) for row in near]
    if (wanted := _wanted(table)) and all(map(str.isdigit, wanted)):
        bare = is_reading(found, top)
        if bare or (bare is None and not _has_all(found.names, table.columns)):
            return Heading(0, tuple(str(at) for at in range(1, len(found.names) + 1)))
    fitting = (each for each in [found, *plain] if _has_all(each.names, table.columns))
    return next(fitting, plain[0])


def _in_doubt(found: Heading, top: Sequence[delimited.Row], table: Table) -> str:
    """The reason against a line of numbers as the heading: it is a reading, or may be one. Empty where there is no doubt."""
    wanted = _wanted(table)
    if not found.line or found.line != top[0].line:
        return ""
    bare = is_reading(found, top)
    if bare is None and wanted and all(map(str.isdigit, wanted)):
        return (
            "may name the columns, or be a reading, as the columns are wanted by numbers: let the program write names that are words, "
            "or no heading and decimals in each size."
        )
    if not bare or (wanted & {*found.names}):
        return ""
    cells = ", ".join(f'"{at}" ({name})' for at, name in enumerate(found.names, 1) if name)
    return (
        f"holds values, so the table has no heading: name its columns by their places, here {cells}, such as "
        f'columns.measured = "{_place_of_a_size(found.names)}", with characteristics."*" for one that no column names.'
    )


def _place_of_a_size(cells: Sequence[str]) -> int:
    """The place of the first size with decimals; else of the first cell that is a number."""
    numbers = [
        (text.isdigit(), at)
        for at, cell in enumerate(cells, 1)
        if number_or_none(text := number_and_unit(cell)[0]) is not None
    ]
    return min(numbers, default=(False, 1))[1]


def _wanted(table: Table) -> set[str]:
    """The columns that are named: those of fields, else characteristics."""
    columns = {part.strip() for column in table.columns for part in column.split("+")}
    return columns or {name for name in table.names if name not in {*FIELDS, EVERY}}


def _has_all(names: Sequence[str], columns: Collection[str]) -> bool:
    return all(part in names for column in columns for part in parts_of(column, names))


def _as_wide(
    rows: Iterable[delimited.Row], width: int, delimiter: str, table: Table
) -> Iterator[delimited.Row | delimited.Unusable]:
    if table.sheet:
        return (as_wide(row, width) for row in rows)
    return delimited.even(rows, width, delimiter, complete=table.complete)


def ndjson_rows(lines: Iterable[str]) -> Iterator[tuple[int, Found]]:
    """The objects of NDJSON."""
    for number, line in enumerate(lines, 1):
        if not line.strip().lstrip("\ufeff"):
            continue
        try:
            content = read_json(line.lstrip("\ufeff"))
        except json.JSONDecodeError as error:
            yield number, Fault(number, "", f"is no JSON ({error}): one object stands in each line.")
            continue
        except ValueError as error:
            yield number, Fault(number, "", f"{error}.")
            continue
        if isinstance(content, dict):
            yield number, content
        else:
            yield number, Fault(number, "", "is JSON but no object: each line is one {…}.")
