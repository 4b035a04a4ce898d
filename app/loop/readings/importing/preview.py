"""The preview of an import: the first lines as they are and as they are read, and what is wrong."""

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from app.db.engine import Database
from app.errors import InbandError
from app.files.formats import delimited
from app.language.i18n import _
from app.loop.readings.importing.actions import import_readings
from app.loop.readings.importing.history import MOST_FLAWS, Flawed, Summary
from app.loop.readings.importing.layout import Layout
from app.loop.readings.importing.lines import Flaw, Line, lines, objects

SHOWN_LINES = 12
SHOWN_CELL = 40
TRIED_WHOLE = 5_000_000  # bytes: a longer file is only begun before it is imported
CHECKED_LINES = 20_000


class PreviewLine(NamedTuple):
    """One line: its cells as they stand in the file, and what was made of them."""

    number: int
    cells: list[str]
    reading: Line | None
    flaws: list[Flaw]


class Preview(NamedTuple):
    """checked: so many lines were looked at, None for all of them."""

    shown: list[PreviewLine]
    summary: Summary | None
    flaws: list[Flaw]
    flaw_count: int
    trouble: InbandError | None
    checked: int | None


def preview(database: Database, characteristic: str, path: Path, layout: Layout) -> Preview:
    """Look at the file as the import will, and store nothing."""
    shown = list(_shown(path, layout, characteristic))
    if not layout.complete:
        return Preview(shown, None, [], 0, None, None)
    if path.stat().st_size > TRIED_WHOLE:
        parsed_lines = islice(lines(path, layout, characteristic), CHECKED_LINES)
        flaws = [line for line in parsed_lines if isinstance(line, Flaw)]
        return Preview(shown, None, flaws[:MOST_FLAWS], len(flaws), None, CHECKED_LINES)
    try:
        summary = import_readings(database, characteristic, path, layout, actor="", dry_run=True)
    except Flawed as refusal:
        return Preview(shown, None, refusal.flaws, refusal.count, None, None)
    except InbandError as trouble:
        return Preview(shown, None, [], 0, trouble, None)
    return Preview(shown, summary, [], 0, None, None)


def first_lines(path: Path, layout: Layout) -> list[PreviewLine]:
    """The first lines as they stand in the file."""
    return [PreviewLine(number, cells, None, []) for number, cells in islice(_cells(path, layout), SHOWN_LINES)]


def _shown(path: Path, layout: Layout, characteristic: str) -> Iterator[PreviewLine]:
    raw = dict(islice(_cells(path, layout), SHOWN_LINES))
    read: dict[int, Line] = {}
    flaws: dict[int, list[Flaw]] = {}
    if layout.complete:
        last = max(raw, default=0)
        for line in lines(path, layout, characteristic):
            number = line.number if isinstance(line, Line) else line.line
            if number > last:
                break
            if isinstance(line, Line):
                read[number] = line
            else:
                flaws.setdefault(number, []).append(line)
    for number, cells in raw.items():
        yield PreviewLine(number, cells, read.get(number), flaws.get(number, []))


def _cells(path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    try:
        if layout.is_table:
            for row in delimited.rows(path, layout.encoding, layout.delimiter):
                if row.line != layout.header_line:  # lines above it too, so that people see which line is the header
                    yield row.line, [_short(cell) for cell in row.cells]
        else:
            for number, value in objects(path, layout.kind):
                known = value if isinstance(value, dict) else {}
                yield number, [_short(known.get(name)) for name in layout.header]
    except delimited.Unusable as error:
        yield error.line or 0, [_("cannot be read")]


def _short(value: object) -> str:
    text = "" if value is None else str(value).strip()
    return text if len(text) <= SHOWN_CELL else f"{text[:SHOWN_CELL]}…"
