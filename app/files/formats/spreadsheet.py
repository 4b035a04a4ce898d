"""Sheets of XLSX files as text: a line for each row, cells parted by tabulators, numbers with a point, times as ISO 8601.

openpyxl reads row by row, so that a long sheet needs no more memory than a short one.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date, datetime, time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile, ZipFile

from app.files.formats.delimited import Unusable
from app.language.i18n import _

ENDINGS = {".xlsx", ".xlsm"}
MOST_BYTES = 500_000_000  # of the parts of the file when unpacked: about ten million cells, a minute's work
MOST_COLUMNS = 2_000
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
                sheet.title: _write(sheet, folder / f"{stem}.{number}.data")
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


def _write(sheet: Any, target: Path) -> Path | None:
    """The rows of a sheet, the number of a line being that of its row; None where no cell is filled.

    Every row is as wide as the first that is filled: what the file says of its width is often that of a formatted column.
    """
    sheet.reset_dimensions()
    width = 0
    with target.open("w", encoding="utf-8", newline="") as file:
        for row in sheet.iter_rows(values_only=True):
            cells = "\t".join(map(_text, row[:MOST_COLUMNS])).rstrip("\t")
            width = width or (cells.count("\t") + 1 if cells else 0)
            file.write(cells + "\t" * (width - 1 - cells.count("\t")) + "\n")
    if not width:
        target.unlink()
        return None
    return target


def _text(value: Any) -> str:
    """A cell as CSV would have it; whole numbers without a point.

    >>> _text(39.998), _text(3.0), _text(datetime(2026, 11, 23, 6, 5)), _text(None), _text("a\\tb")
    ('39.998', '3', '2026-11-23T06:05:00', '', 'a b')
    """
    if value is None:
        return ""
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    return str(value).translate(_PLAIN)
