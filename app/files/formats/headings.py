"""Headings of tables: below titles, in lines of their own, with cells that are merged across and downwards."""

from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

from app.files.formats import delimited
from app.files.formats.delimited import Row

TOP = 50  # rows in which the heading is looked for


class Heading(NamedTuple):
    """The line of a heading, the last one where it has several, and the names of the columns."""

    line: int
    names: tuple[str, ...]


def heading(top: Sequence[Row], said: int | None = None, *, ragged: bool = False) -> Heading | None:
    """The heading among the first rows; None where the line that a person has `said` is none of them.

    A name that is missing in its line is taken from the lines above, as cells that are merged downwards have it. Where names
    are there twice, the group above them is said too, as cells that are merged across have it. ragged: rows may be shorter
    than the table is wide.

    >>> rows = [Row(1, ["Time", "Lathe 1", "", "Lathe 2", ""]), Row(2, ["", "D35", "D40", "D35", "D41"])]
    >>> heading([*rows, Row(3, ["6:05", "35.001", "40.002", "35.003", "41"])]).names
    ('Time', 'Lathe 1 D35', 'D40', 'Lathe 2 D35', 'D41')
    """
    last = _last_head(top) if said is None else next((at for at, row in enumerate(top) if row.line == said), None)
    if last is None:
        return None
    width = max(len(row.cells) for row in top) if ragged else len(top[last].cells)
    names, *above = ([cell.strip() for cell in as_wide(row, width).cells] for row in reversed(top[: last + 1]))
    groups = [cells for cells in above if len(list(filter(None, cells))) > 1]  # a single cell is a title
    for cells in groups:
        names = [name or upper for name, upper in zip(names, cells, strict=True)]
    if groups:
        across = accumulate(groups[0], _or_before)
        names = [
            f"{group} {name}".strip() if name and names.count(name) > 1 else name
            for group, name in zip(across, names, strict=True)
        ]
    return Heading(top[last].line, tuple(name.removeprefix("\ufeff") for name in names))


def as_wide(row: Row, width: int) -> Row:
    """A row with so many cells: cut off, or filled up with empty ones."""
    return row._replace(cells=row.cells[:width] + [""] * (width - len(row.cells)))


def _or_before(before: str, cell: str) -> str:
    return cell or before


def _last_head(top: Sequence[Row]) -> int:
    """The place of the heading among the first rows: the first one, unless columns below it are named only further down."""
    body = next((at for at, row in enumerate(top) if any(map(delimited.is_value, row.cells))), 0)
    wanted, named = _filled(top[body]), set[int]()
    best, most = 0, 0
    for at, row in enumerate(top[:body]):
        named |= _filled(row)
        if len(wanted & named) > most:
            best, most = at, len(wanted & named)
    return best


def _filled(row: Row) -> set[int]:
    return {place for place, cell in enumerate(row.cells) if cell.strip()}
