"""The rows of a table or of NDJSON by their columns, and what is wrong with one, in the order of the file."""

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from app.bridge.json_text import read_json
from app.files.formats import aqdef, delimited
from app.files.formats.repeats import Repeats

TITLES: Final = 50  # rows in which the names of the columns are looked for


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
            lines.add(aqdef.Remark(fault.line, fault.field, fault.value, fault.reason))
        else:
            whole[str(fault)] = None
    return [*whole, *lines.sentences()]


Found = Mapping[str, Any] | Fault | aqdef.Remark
"""A row by its columns, or a remark on it."""


def csv_rows(
    path: Path, encoding: str, said: str | None, columns: Mapping[str, str], *, complete: bool
) -> Iterator[tuple[int, Found]]:
    """The rows of a table. said: its delimiter, or blanks. columns: those that are wanted. complete: its last line has an end."""
    try:
        delimiter = delimited.BLANKS if said == "blanks" else said or delimited.delimiter_of(path, encoding)
        rows = delimited.rows(path, encoding, delimiter)
        header = _header(rows, set(filter(None, columns.values())))
        if header is None:
            return
        line = header.line
        names = [name.strip().lstrip("\ufeff") for name in header.cells]
        for name in sorted({name for name in names if name and names.count(name) > 1}):
            yield line, Fault(line, name, "is the name of several columns; give each its own.")
        wanted = set(filter(None, columns.values())) - set(names)
        for name in sorted(wanted):
            yield line, Fault(line, name, f"is no column of this file; it has {', '.join(names)}.")
        if wanted:
            return
        for row in delimited.even(rows, len(names), delimiter, complete=complete):
            if isinstance(row, delimited.Unusable):
                yield row.line or 0, Fault(row.line, "", str(row))
            elif [cell.strip() for cell in row.cells] == names:
                yield row.line, aqdef.Remark(row.line, "", "", "is the heading again; passed over")
            else:
                yield row.line, dict(zip(names, row.cells, strict=False))
    except UnicodeError:
        yield 0, Fault(None, "", f"This is not {encoding} text: name the encoding of the file.")


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


def _header(rows: Iterator[delimited.Row], wanted: set[str]) -> delimited.Row | None:
    """The row that names the columns: the first one, below titles the one that has all that are wanted."""
    first = next(rows, None)
    if first is None or not wanted:
        return first
    row: delimited.Row | None = first
    for _count in range(TITLES):
        if row is None or wanted <= {cell.strip().lstrip("\ufeff") for cell in row.cells}:
            return row or first
        row = next(rows, None)
    return first
