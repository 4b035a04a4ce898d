"""Tables pasted from a spreadsheet or a file: tabs, semicolons or commas; decimal comma or point; thousands.

What a lone sign means is told by the whole table: where a cell holds both, the last one in it is the decimal sign for all
cells; else a comma or point that stands once in a cell is a decimal sign, and one that stands several times parts thousands.
Blanks and apostrophes inside a number part thousands. µm and mm behind a number are not read: values are mm throughout.
"""

import csv
import io
import re
from collections.abc import Sequence
from math import isfinite

from app.web.i18n import _

MOST_CHARACTERS = 400_000
_SPACES = re.compile("[\\s\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}'\N{RIGHT SINGLE QUOTATION MARK}]")
_PLAIN = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?")


class Unreadable(ValueError):
    """A cell that is no number; `row` and `column` count from 1."""

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
        found = [[cell.strip() for cell in row] for row in rows]
    except csv.Error:  # a quotation mark that is never closed: take the lines as they are
        found = [[cell.strip() for cell in line.split(_delimiter(text))] for line in text.split("\n")]
    found = [row for row in found if any(row)]
    while found and all(not row[-1] for row in found) and len(found[0]) > 1:
        found = [row[:-1] for row in found]
    return found


def _delimiter(text: str) -> str:
    if "\t" in text:
        return "\t"
    if ";" in text:
        return ";"
    lines = [line for line in text.split("\n") if line.strip()]
    if "," in text and ("." in text or any(line.count(",") > 1 or ", " in line for line in lines)):
        return ","
    return "\t"


def decimal_of(cells: Sequence[Sequence[str]]) -> str | None:
    """The decimal sign that the table tells of; None where each cell tells for itself.

    >>> decimal_of([["1.234,5"]]), decimal_of([["1,234.5"]]), decimal_of([["40,002", "40.001"]])
    (',', '.', None)
    """
    for row in cells:
        for cell in row:
            if "," in cell and "." in cell:
                return "," if cell.rfind(",") > cell.rfind(".") else "."
    return None


def number(text: str, decimal: str | None = None) -> float | None:
    """The number in a cell; None where it is none.

    >>> number("40,002"), number("1 234,5"), number("1.234,5", ","), number("1,234,567"), number("−0.5"), number("nan")
    (40.002, 1234.5, 1234.5, 1234567.0, -0.5, None)
    """
    cleaned = _SPACES.sub("", text.replace("\N{MINUS SIGN}", "-"))
    if len(cleaned) > 60 or not cleaned.isascii():
        return None
    for sign in ",.":
        if (decimal is not None and sign != decimal) or (decimal is None and cleaned.count(sign) > 1):
            groups = cleaned.split(sign)
            if any(not re.match(r"\d{3}(\D|$)", group) for group in groups[1:]):
                return None  # thousands come by threes
            cleaned = "".join(groups)
    cleaned = cleaned.replace(",", ".")
    if not _PLAIN.fullmatch(cleaned):
        return None
    value = float(cleaned)
    return value if isfinite(value) else None


def numbers(cells: Sequence[Sequence[str]]) -> list[list[float | None]]:
    """Every cell as a number, None where it is empty. Raises `Unreadable` that names the first cell that is none."""
    decimal = decimal_of(cells)
    made = []
    for at, row in enumerate(cells, 1):
        values: list[float | None] = []
        for place, cell in enumerate(row, 1):
            value = number(cell, decimal) if cell.strip() else None
            if cell.strip() and value is None:
                raise Unreadable(at, place, _("“{text}” is no number").format(text=cell[:30]))
            values.append(value)
        made.append(values)
    return made


def is_heading(row: Sequence[str]) -> bool:
    """A first line that holds no number at all."""
    return all(number(cell) is None for cell in row)
