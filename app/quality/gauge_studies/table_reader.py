"""Tables pasted from a spreadsheet or a file: tabs, semicolons or commas; decimal comma or point.

Numbers are read as everywhere (`core.number_text`): a comma or a point is the decimal sign, and a cell with a blank inside or
with separators of thousands is refused. Sizes in another unit than mm, as the heading, the row or the cell says it, become mm.
"""

import csv
import io
from collections.abc import Collection, Sequence
from typing import NamedTuple

from app.core.number_text import number_or_none
from app.files.formats.cell_values import Unreadable as WrongUnit
from app.files.formats.column_names import NAMES, key_of
from app.files.formats.number_with_unit import agreed_unit, in_mm, number_and_unit
from app.files.formats.units import LENGTHS, UnknownUnit, beside, unit_in
from app.language.formatting import as_typed
from app.language.i18n import _

MOST_CHARACTERS = 400_000
_PARTS = {*map(key_of, NAMES["part"]), "parts", "teile", "delovi", "kosi", "sample"}
_SIZES = {*map(key_of, NAMES["measured"]), "measurements", "response", "messung", "messwerte"}
_OPERATORS = {
    "operator",
    "operators",
    "appraiser",
    "appraisers",
    "inspector",
    "prufer",
    "bediener",
    "operater",
    "operateri",
    "merilac",
    "meritelj",
    "оператор",
    "контролер",
    "оператер",
    "мерилац",
}


class Unreadable(ValueError):
    """A cell that is not a number; `row` and `column` count from 1."""

    def __init__(self, row: int, column: int, message: str) -> None:
        super().__init__(message)
        self.row, self.column = row, column


def cells_of(text: str) -> list[list[str]]:
    r"""The rows of a pasted table, empty ones left out.

    >>> cells_of("A\tB\n1,5\t2,5\n"), cells_of("40.001; 40.002"), cells_of("1,5\n1,6")
    ([['A', 'B'], ['1,5', '2,5']], [['40.001', '40.002']], [['1,5'], ['1,6']])
    """
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    rows = csv.reader(io.StringIO(text), delimiter=_delimiter(text))
    try:
        table = [[cell.strip() for cell in row] for row in rows]
    except csv.Error:  # a quotation mark that is never closed: take the lines as they are
        table = [[cell.strip() for cell in line.split(_delimiter(text))] for line in text.split("\n")]
    table = [row for row in table if any(row)]
    empty = min((next(at for at, cell in enumerate(reversed(row)) if cell) for row in table), default=0)
    return [row[: len(row) - empty] for row in table]


def _delimiter(text: str) -> str:
    if "\t" in text:
        return "\t"
    if ";" in text:
        return ";"
    lines = [line for line in text.split("\n") if line.strip()]
    if "," in text and ("." in text or any(line.count(",") > 1 or ", " in line for line in lines)):
        return ","
    return "\t"


def number(text: str) -> float | None:
    """The number in a cell; None where it is none.

    >>> number("40,002"), number("−0.5"), number("1 234,5"), number("1.234,5"), number("nan")
    (40.002, -0.5, None, None, None)
    """
    return number_or_none(text) if len(text) <= 60 else None


def numbers(cells: Sequence[Sequence[str]]) -> list[list[float | None]]:
    """Every cell as a number, None where it is empty. Raises `Unreadable` that names the first cell that is none."""
    table = []
    for at, row in enumerate(cells, 1):
        values: list[float | None] = []
        for place, cell in enumerate(row, 1):
            value = number(cell) if cell.strip() else None
            if cell.strip() and value is None:
                raise Unreadable(at, place, _("“{text}” is not a number").format(text=cell[:30]))
            values.append(value)
        table.append(values)
    return table


def sizes_in_mm(
    heading: Sequence[str] | None, body: Sequence[Sequence[str]], sizes: Sequence[int] | None = None
) -> list[list[str]]:
    """The rows of a table with sizes in mm. sizes: their places, where a column may hold the unit of each row.

    Raises `Unreadable` for a unit that is not known, or two that contradict each other; row 0 is the heading.

    >>> sizes_in_mm(["Part", "A [inch]"], [["1", "0.5"]]), sizes_in_mm(None, [["12.5 µm"]])
    ([['1', '12.7']], [['0.0125']])
    """
    units: dict[int, str | None] = {}
    for place, name in enumerate(heading or ()):
        if any(number(number_and_unit(row[place])[0]) is not None for row in body if place < len(row)):
            try:
                units[place] = unit_in(name)
            except UnknownUnit as error:
                words = _("the heading names the unit {word}, which is no length that is known ({known})")
                raise Unreadable(0, place + 1, words.format(word=error.word, known=", ".join(LENGTHS))) from None
    converted = []
    for at, row in enumerate(body, 1):
        said = beside(dict(zip(heading or (), row, strict=False)), "unit") if sizes else None
        cells = []
        for place, cell in enumerate(row):
            size, behind = number_and_unit(cell)
            value = number(size) if not sizes or place in sizes else None
            try:
                unit = None if value is None else agreed_unit(units.get(place), said, behind)
            except WrongUnit as error:
                raise Unreadable(at, place + 1, _("“{text}” {reason}").format(text=cell[:30], reason=error)) from None
            cells.append(cell if unit is None else as_typed(in_mm(value, unit)))
        converted.append(cells)
    return converted


class Long(NamedTuple):
    """The columns of a table with one row a reading: places of part, operator and sizes."""

    part: int
    operator: int
    sizes: tuple[int, ...]


def long_columns(heading: Sequence[str]) -> Long | None:
    """The columns of such a table by their names in five languages; None where part or operator is none of them.

    >>> long_columns(["RunOrder", "Parts", "Operators", "Measurement"]), long_columns(["Operator", "Part", "M1", "M2"])
    (Long(part=1, operator=2, sizes=(3,)), Long(part=1, operator=0, sizes=(2, 3)))
    """
    names = [key_of(each) for each in heading]

    def place(words: Collection[str]) -> int | None:
        return next((at for at, name in enumerate(names) if name in words), None)

    part, operator, size = place(_PARTS), place(_OPERATORS), place(_SIZES)
    if part is None or operator is None:
        return None
    others = tuple(
        at for at, name in enumerate(heading) if at not in {part, operator} and beside({name: ""}, "unit") is None
    )
    sizes = others if size is None else (size,)
    return Long(part, operator, sizes) if sizes else None


def is_heading(row: Sequence[str]) -> bool:
    """A first line that holds no number at all."""
    return all(number(cell) is None for cell in row)
