"""Sheets of XLSX files as text: a line for each row, cells parted by tabulators, numbers with a point, times as ISO 8601.

openpyxl reads row by row, so that a long sheet needs no more memory than a short one.
"""

import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from datetime import UTC, date, datetime, time, timedelta
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile, ZipFile

from app.files.formats.delimited import Unusable
from app.language.i18n import _

ENDINGS = {".xlsx", ".xlsm"}
MOST_BYTES = 500_000_000  # of the parts of the file when unpacked: about ten million cells, a minute's work
MOST_COLUMNS = 2_000
NO_RESULT = "#FORMULA?"
"""A formula whose result the file does not hold, as programs write them that do not calculate."""
ERRORS = {NO_RESULT, "#DIV/0!", "#N/A", "#NAME?", "#NULL!", "#NUM!", "#REF!", "#VALUE!", "#SPILL!", "#CALC!"}
# A formula without a result, and not one whose result is an empty text; and the place of its cell.
_UNCALCULATED = re.compile(
    rb'<c (?![^>]*\bt="str")(?=[^>]*\br="([A-Z]{1,3}\d{1,7})")[^>]*>\s*<f(?:[^>]*/>|[^>]*>[^<]*</f>)\s*(?:<v\s*/>|<v>\s*</v>)?\s*</c>'
)
CHUNK = 1_000_000  # bytes
_PLAIN = str.maketrans({"\t": " ", "\r": " ", "\n": " "})


def texts(path: Path, folder: Path, stem: str) -> dict[str, Path]:
    """Write each sheet that holds something as `stem.1.data`, `stem.2.data` … in the folder; their files by name of the sheet.

    Raises `Unusable` for what is no workbook, or holds nothing.
    """
    from openpyxl import load_workbook

    _refuse_large(path)
    try:
        with path.open("rb") as file:
            book = load_workbook(file, read_only=True, data_only=True)
            written = {
                sheet.title: _write(sheet, folder / f"{stem}.{number}.data", _uncalculated(path, sheet))
                for number, sheet in enumerate(book.worksheets, 1)
            }
    except (KeyError, ValueError, TypeError, AttributeError, OSError, SyntaxError, BadZipFile) as error:
        raise Unusable(_("This workbook cannot be read: {error}.").format(error=str(error)[:200])) from None
    found = {name: file for name, file in written.items() if file is not None}
    if not found:
        raise Unusable(_("The workbook holds no cells."))
    return found


@contextmanager
def text_of(path: Path, sheet: str | None) -> Iterator[Path]:
    """A sheet of the workbook as a file of text while it is needed: the named one, else the first that holds something.

    Raises `Unusable`, also for a sheet that is not there.
    """
    with TemporaryDirectory() as folder:
        found = texts(path, Path(folder), "sheet")
        if sheet is not None and sheet not in found:
            there = ", ".join(found)
            raise Unusable(
                _("There is no sheet {name} with cells; there are: {there}.").format(name=repr(sheet), there=there)
            )
        yield found[sheet] if sheet is not None else next(iter(found.values()))


def _refuse_large(path: Path) -> None:
    try:
        with ZipFile(path) as parts:
            size = sum(part.file_size for part in parts.infolist())
    except (BadZipFile, OSError):
        raise Unusable(
            _("This is not an XLSX workbook. Save the sheet as XLSX or CSV; the older XLS is not read.")
        ) from None
    if size > MOST_BYTES:
        raise Unusable(_("The workbook is too large. Save the sheet as CSV."))


def _uncalculated(path: Path, sheet: Any) -> set[str]:
    """The cells of a sheet whose formula has no result in the file, as `D2`."""
    found: set[str] = set()
    with ZipFile(path) as parts, parts.open(sheet._worksheet_path) as part:  # noqa: SLF001 - openpyxl does not tell it otherwise
        rest = b""
        while chunk := part.read(CHUNK):
            rest += chunk
            if b"<f" in rest:
                found.update(match[1].decode() for match in _UNCALCULATED.finditer(rest))
            rest = rest[max(rest.rfind(b"<c "), 0) :][-CHUNK:]
    return found


def _write(sheet: Any, target: Path, uncalculated: Collection[str]) -> Path | None:
    """The rows of a sheet, the number of a line being that of its row; None where no cell is filled.

    A row ends with its last filled cell: what the file says of its width is often that of a formatted column.
    """
    sheet.reset_dimensions()
    filled = False
    with target.open("w", encoding="utf-8", newline="") as file:
        for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
            cells = list(map(_text, row[:MOST_COLUMNS]))
            if uncalculated:
                for place, cell in enumerate(cells):
                    if not cell and f"{_letters(place)}{number}" in uncalculated:
                        cells[place] = NO_RESULT
            line = "\t".join(cells).rstrip("\t")
            filled = filled or bool(line)
            file.write(line + "\n")
    if not filled:
        target.unlink()
        return None
    return target


@cache
def _letters(place: int) -> str:
    """The name of a column.

    >>> _letters(0), _letters(25), _letters(26), _letters(702)
    ('A', 'Z', 'AA', 'AAA')
    """
    return (_letters(place // 26 - 1) if place >= 26 else "") + chr(ord("A") + place % 26)


def _text(value: Any) -> str:
    """A cell as CSV would have it; whole numbers without a point, days without a time.

    >>> _text(39.998), _text(3.0), _text(datetime(2026, 11, 23, 6, 5)), _text(None), _text("a\\tb")
    ('39.998', '3', '2026-11-23T06:05:00', '', 'a b')
    """
    if value is None:
        return ""
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, timedelta) and timedelta(0) <= value < timedelta(
        days=1
    ):  # of the day, in a format for durations
        value = (datetime(1, 1, 1, tzinfo=UTC) + value).time()
    if isinstance(value, datetime) and value.time() == time():
        value = value.date()
    if isinstance(value, date | time):
        return value.isoformat()
    return str(value).translate(_PLAIN)
