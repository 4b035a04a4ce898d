"""The rows of a table or of NDJSON by their columns, and what is wrong with one, in the order of the file."""

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

from app.bridge.json_text import read_json
from app.files.formats import delimited
from app.files.formats.headings import TOP, Heading, as_wide, heading, is_labelled, others
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
        line, names, _units, end = _heading(top, table)
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
            elif tuple(cell.strip() for cell in row.cells) == names:
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


def unit_in_doubt(word: str) -> str:
    """The reason against sizes whose header, or a line above it, names a unit that cannot be taken."""
    return (
        f"the header, or a line above it, names the unit {word}: nobody can tell of which sizes, or it is no length that is known "
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
    """The names of the columns: where an import finds them; else in the first row that has all that are wanted."""
    found = heading(top, ragged=table.sheet) or Heading(top[0].line, ())
    near = others(top, found, named=True)
    plain = [Heading(row.line, tuple(cell.strip().lstrip("\ufeff") for cell in row.cells)) for row in near]
    fitting = (each for each in [found, *plain] if _has_all(each.names, table.columns))
    return next(fitting, plain[0])


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
