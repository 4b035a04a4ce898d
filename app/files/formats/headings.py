"""Headings of tables: below titles, in lines of their own, with cells that are merged across and downwards."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import accumulate, chain
from typing import NamedTuple

from app.core.number_text import number_or_none
from app.files.formats import delimited
from app.files.formats.cell_values import folded
from app.files.formats.column_names import NAMES, SUMMARIES, key_of
from app.files.formats.delimited import Row
from app.files.formats.number_with_unit import number_and_unit, number_before_unit
from app.files.formats.units import OTHER_UNITS, is_unit_column, length_unit

TOP = 500  # rows in which the heading is looked for
FIRST = 50  # of them, in which another may stand than the one that is found
_WITH_VALUE = re.compile(r"([^:=]{1,40}?) ?= ?\S.{0,40}|([^:=]{2,40}?) ?: ?\S.{0,40}")
"""A label and its value in one cell; a single letter before a colon may be the number of a part."""
TABLE = 2  # rows of values that make a table
FAR = 4  # times as large or as small is another kind of number
_WORDS = frozenset(key_of(word) for words in NAMES.values() for word in words)


class Heading(NamedTuple):
    """The line of a heading, the last one with names; the names of the columns, and units in a row below them, in line `end`."""

    line: int
    names: tuple[str, ...]
    units: tuple[str | None, ...] = ()
    end: int = 0


def heading(top: Sequence[Row], said: int | None = None, *, ragged: bool = False) -> Heading | None:
    """The heading among the first rows; None where the line that a person has `said` is none of them.

    A name that is missing in its line is taken from the lines above, as cells that are merged downwards have it. Where names
    are there twice, the group above them is said too, as cells that are merged across have it. ragged: rows may be shorter
    than the table is wide.

    >>> rows = [Row(1, ["Time", "Lathe 1", "", "Lathe 2", ""]), Row(2, ["", "D35", "D40", "D35", "D41"])]
    >>> heading([*rows, Row(3, ["6:05", "35.001", "40.002", "35.003", "41"])]).names
    ('Time', 'Lathe 1 D35', 'D40', 'Lathe 2 D35', 'D41')
    >>> heading([Row(1, ["Part", "D40"]), Row(2, ["", "[inch]"]), Row(3, ["P1", "1.57"])])
    Heading(line=1, names=('Part', 'D40'), units=(None, 'inch'), end=2)
    """
    last = _last_head(top) if said is None else next((at for at, row in enumerate(top) if row.line == said), None)
    if last is None:
        return None
    width = max(len(row.cells) for row in top[: max(FIRST, last + 2)]) if ragged else len(top[last].cells)
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
    names = [name.removeprefix("\ufeff") for name in names]
    below = as_wide(top[last + 1], width) if last + 1 < len(top) else None
    if below is None or not _are_units(names, below.cells):
        return Heading(top[last].line, tuple(names))
    return Heading(top[last].line, tuple(names), tuple(map(length_unit, below.cells)), below.line)


def others(top: Sequence[Row], found: Heading, *, named: bool = False) -> Iterator[Row]:
    """Rows that may be the heading in place of the one found: near the beginning, and none below the rows of its own table.

    Further down is another table, such as one of means. Two rows with two values or more below names make a table; a title or a
    line of a preamble is none. named: a person has named the columns of the right one, so it may be any near the beginning.

    >>> rows = [Row(1, ["Part", "D40", "D41"]), *[Row(at, ["P1", "40.01", "41.02"]) for at in (2, 3)], Row(4, ["Feature", "Value"])]
    >>> [row.line for row in others(rows, Heading(1, ("Part", "D40", "D41")))]
    [1, 2, 3]
    """
    measured = 0
    for at, row in enumerate(top):
        if row.line > found.line:
            if at >= FIRST or measured == TABLE:
                return
            beside = zip(found.names, row.cells, strict=False)
            measured += not named and sum(bool(name) and delimited.is_value(cell) for name, cell in beside) > 1
        yield row


def is_reading(
    found: Heading, top: Sequence[Row], sizes: Collection[int] = (), times: Collection[int] = ()
) -> bool | None:
    """Tell that the line which was found as the heading is a reading, so that the table has none; None where it may be either.

    sizes, times: places of the columns that hold them, where a person has said so.

    >>> def first(*lines):
    ...     rows = [Row(at, line.split(";")) for at, line in enumerate(lines, 1)]
    ...     return is_reading(heading(rows), rows)
    >>> first("40", "41", "40"), first("7;40", "8;41"), first("7;40;6:05", "8;40,1;6:06"), first("40", "40,01")
    (True, True, True, None)
    >>> first("1;2", "40,01;40,02"), first(";1;2", "D40;3;4"), first("1;2", "2;1"), first("P1;40", "P2;41"), first("Part;1", "A;2")
    (False, False, None, None, False)
    """
    names = {place: name for place, name in enumerate(found.names) if name.strip()}
    clear = {place for place, name in names.items() if _is_measured(name)}
    whole = {place: abs(number) for place, name in names.items() if (number := _whole(name)) is not None}
    if not clear and not whole:
        return False
    below = [row.cells for row in top if row.line > max(found.line, found.end)]
    columns = {
        place: [cells[place] for cells in below if place < len(cells) and cells[place].strip()] for place in names
    }
    counted = [*whole.values()] == [*range(1, len(whole) + 1)] and not clear
    if any(place in clear and number_or_none(names[place]) is None for place in times):
        return True
    if words := names.keys() - clear - whole.keys():
        return _beside_words(names, words, columns, clear, sizes, counted=counted and len(whole) > 1)
    gaps = set(range(len(found.names))) - names.keys()
    if any(place < len(cells) and cells[place].strip() for cells in below for place in gaps):
        return False if counted else True if any(":" in names[place] for place in clear) else None
    if clear:
        return True
    other = any(_is_far(number, columns[place]) for place, number in whole.items())
    if counted:
        return False if other else None
    return True if not other and all(_whole(cell) is not None for cell in chain(*columns.values())) else None


def _beside_words(
    names: Mapping[int, str],
    words: Collection[int],
    columns: Mapping[int, Sequence[str]],
    clear: Collection[int],
    sizes: Collection[int],
    *,
    counted: bool,
) -> bool | None:
    """The same of a line with words beside its numbers. words: their places. clear: those of sizes with decimals, and of times."""
    known = any(key_of(names[place]) in _WORDS for place in words)
    if any(place in clear for place in sizes):
        return None if known else True
    above = any(columns[place] and all(map(delimited.is_value, columns[place])) for place in words)
    if known or above or any(place in words for place in sizes):
        return False
    beside = (cell for place, cells in columns.items() if place not in words for cell in cells)
    return False if counted and any(_whole(cell) is None for cell in beside) else None


def _is_measured(cell: str) -> bool:
    """Tell of a size with decimals or with its unit, a date, or a time."""
    text, unit = number_and_unit(cell)
    if number_or_none(text) is None:
        return delimited.is_value(cell)
    return bool(unit) or not text.strip().lstrip("+-").isdigit()


def _whole(cell: str) -> int | None:
    text = cell.strip()
    return int(text) if re.fullmatch(r"[+-]?\d{1,15}", text, re.ASCII) else None


def _is_far(number: int, cells: Iterable[str]) -> bool:
    """Tell of a number that is of another kind than those below it, such as 1 above 40,001."""
    sizes = [abs(size) for cell in cells if (size := number_before_unit(cell)) is not None]
    return bool(sizes) and (FAR * (number + 1) < min(sizes) or number > FAR * (max(sizes) + 1))


def is_summary(label: object) -> bool:
    """Tell of the cell that names a row, or would: one of limits or statistics, which is no part.

    >>> is_summary("Mean:"), is_summary("Std. Dev."), is_summary("P-17"), is_summary(None)
    (True, True, False, False)
    >>> is_summary("Anzahl: 2"), is_summary("s = 0,002"), is_summary("N:12")
    (True, True, False)
    """
    if label is None:
        return False
    text = str(label).strip()
    with_value = _WITH_VALUE.fullmatch(text)
    return folded(with_value[1] or with_value[2] if with_value else text.rstrip(" :=")) in SUMMARIES


def is_labelled(cell: object) -> bool:
    """Tell of a cell that has a label before its value.

    >>> is_labelled("Mean: 40.002"), is_labelled("40.002 mm"), is_labelled("n")
    (True, False, False)
    """
    return _WITH_VALUE.fullmatch(str(cell).strip()) is not None


def as_wide(row: Row, width: int) -> Row:
    """A row with `width` cells: cut off, or filled up with empty ones."""
    return row._replace(cells=row.cells[:width] + [""] * (width - len(row.cells)))


def _are_units(names: Sequence[str], cells: Sequence[str]) -> bool:
    """Tell of a row that has nothing but units, one of them of length."""
    words = [(name, cell.strip(" []()")) for name, cell in zip(names, cells, strict=True) if cell.strip()]
    lengths = any(length_unit(word) for name, word in words if not is_unit_column(name))
    return lengths and all(length_unit(word) or word.lower() in OTHER_UNITS for _name, word in words)


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
