"""The preview of an import: the first lines as they are and as they are read, and what is wrong."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from app.db.engine import Database
from app.errors import InbandError
from app.loop.readings.importing.actions import import_readings
from app.loop.readings.importing.cells import MOST_FLAWS, Flaw, Looked, Passed
from app.loop.readings.importing.history import Flawed, Summary
from app.loop.readings.importing.lines import Line, read_apart

TRIED_WHOLE = 5_000_000  # bytes: a longer file is only begun before it is imported
CHECKED_LINES = 20_000


class PreviewLine(NamedTuple):
    """One line: its cells as they are in the file, and what was made of them."""

    number: int
    cells: list[str]
    reading: Line | None
    flaws: list[Flaw]


class Preview(NamedTuple):
    """checked: the number of lines that were looked at, None for all of them."""

    shown: list[PreviewLine]
    summary: Summary | None
    flaws: list[Flaw]
    flaw_count: int
    trouble: InbandError | None
    checked: int | None


def preview(database: Database, characteristic: str, path: Path, looked: Looked) -> Preview:
    """Look at the file as the import will, and store nothing. Raises `Invalid` at a limit of reading."""
    layout = looked.layout
    if not layout.complete:
        return Preview(first_lines(looked), None, [], 0, None, None)
    try:
        layout.refuse_question()
    except InbandError as question:
        return Preview(first_lines(looked), None, [], 0, question, None)
    checked = CHECKED_LINES if path.stat().st_size > TRIED_WHOLE else None
    with read_apart(path, [layout], checked) as read:
        shown = _shown(looked.first, read(0, characteristic))
        if checked is not None:
            flaws = [line for line in read(0, characteristic) if isinstance(line, Flaw)]
            return Preview(shown, None, flaws[:MOST_FLAWS], len(flaws), None, checked)
        try:
            summary = import_readings(database, characteristic, path, layout, actor="", dry_run=True, read=read)
        except Flawed as refusal:
            return Preview(shown, None, refusal.flaws, refusal.count, None, None)
        except InbandError as trouble:
            return Preview(shown, None, [], 0, trouble, None)
    return Preview(shown, summary, [], 0, None, None)


def first_lines(looked: Looked) -> list[PreviewLine]:
    """The first lines as they are in the file."""
    return [PreviewLine(number, cells, None, []) for number, cells in looked.first]


def _shown(first: Sequence[tuple[int, list[str]]], found: Iterator[Line | Flaw | Passed]) -> list[PreviewLine]:
    read: dict[int, Line] = {}
    flaws: dict[int, list[Flaw]] = {}
    last = max((number for number, _cells in first), default=0)
    for line in found:
        number = line.number if isinstance(line, Line) else line.line
        if number > last:
            break
        if isinstance(line, Line):
            read[number] = line
        elif isinstance(line, Flaw):
            flaws.setdefault(number, []).append(line)
    return [PreviewLine(number, cells, read.get(number), flaws.get(number, [])) for number, cells in first]
