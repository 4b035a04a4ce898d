"""Reports of PC-DMIS as text: a block for each dimension, with a heading of its own, as the rows of one table."""

import re
from collections.abc import Iterable, Iterator, Sequence

FEATURE, UNIT, SERIAL = "Feature", "Unit", "Serial number"
_ANGLES = {"A", "PA"}  # axes in degrees, whatever the unit of the block is
_BLOCK = re.compile(r"[ \t]*DIM[ \t]+(\S+?)[ \t]*=", re.IGNORECASE)
_UNITS = re.compile(r"\bUNITS[ \t]*=[ \t]*(\w+)", re.IGNORECASE)
_HEADING = re.compile(r"[ \t]*AX[ \t].*\bMEAS\b", re.IGNORECASE)
_SERIAL = re.compile(r"[ \t]*SER(?:IAL)? NUMBER[ \t]*:(.*)", re.IGNORECASE)
_ROW = re.compile(r"[ \t]*([A-Z]{1,2}\d?)(?=[ \t]+(?:[+-]?[\d.]|MMC|LMC|RFS))")
_WORDS = {"MMC", "LMC", "RFS"}  # in place of a nominal size
_CELL = re.compile(r"(?<!\S)(?:[+-]?(?:\d++(?:[.,]\d++)?|[.,]\d++)|MMC|LMC|RFS)(?=\s|<|$)")


def is_report(beginning: str) -> bool:
    """Tell of a text that begins with such a report.

    >>> is_report("DIM LOC1= LOCATION OF CIRCLE CIR1  UNITS=MM\\nAX  NOMINAL  MEAS\\nX  25.000  25.012\\n")
    True
    """
    lines = iter(beginning.splitlines())
    return any(map(_BLOCK.match, lines)) and any(map(_HEADING.match, lines))  # first a block, then its heading


def columns_of(lines: Iterable[str]) -> list[str]:
    """The columns of all blocks, those of the first one first."""
    found: dict[str, None] = {}
    serial = False
    for line in lines:
        if _HEADING.match(line):
            found |= dict.fromkeys(line.split())
        serial = serial or _SERIAL.match(line) is not None
    return [FEATURE, *found, UNIT, *([SERIAL] if serial else [])]


def table(lines: Iterable[str], columns: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
    """The heading once and each row of a block with its dimension, unit and serial number, by their lines."""
    feature = unit = serial = ""
    heading: list[tuple[str, int]] = []
    begun = False
    for number, tabbed in enumerate(lines, 1):
        line = tabbed.expandtabs()
        if block := _BLOCK.match(line):
            feature, unit, heading = block[1], "", []
        if named := _SERIAL.match(line):
            serial = named[1].strip()
        elif _HEADING.match(line):
            heading = [(match[0], match.end()) for match in re.finditer(r"\S+", line)]
            if not begun:
                yield number, list(columns)
            begun = True
        elif heading and (row := _ROW.match(line)):
            cells = _cells(line, heading[1:]) | {FEATURE: feature, heading[0][0]: row[1], SERIAL: serial}
            cells[UNIT] = "deg" if row[1].upper() in _ANGLES else unit
            yield number, [cells.get(column, "") for column in columns]
        elif not heading and (said := _UNITS.search(line)):
            unit = said[1]


def _cells(line: str, heading: Sequence[tuple[str, int]]) -> dict[str, str]:
    """The cells of a row by their columns: all are there, or each ends where its name ends.

    Where neither holds, all of them with a question mark are the measured one, which is then no number.
    """
    found = [(match[0], match.end()) for match in _CELL.finditer(line)]
    if len(found) == len(heading):
        pairs = [(name, text) for (name, _end), (text, _at) in zip(heading, found, strict=True)]
    elif {at for _text, at in found} <= (ends := {end: name for name, end in heading}).keys():
        pairs = [(ends[at], text) for text, at in found]
    else:
        pairs = [("MEAS", " ".join(text for text, _at in found) + " ?")]
    return {name: "" if text in _WORDS else text for name, text in pairs}
