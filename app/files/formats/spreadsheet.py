"""Sheets of XLSX files as text: a line for each row, cells parted by tabulators, numbers with a point, times as ISO 8601.

openpyxl reads row by row, so that a long sheet needs no more memory than a short one.
"""

import errno
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, date, datetime, time, timedelta
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile, ZipFile

from app.files.formats.cell_values import Unreadable
from app.files.formats.delimited import Unusable
from app.files.formats.units import length_unit, like_a_unit
from app.language.i18n import _

ENDINGS = {".xlsx", ".xlsm"}
MOST_BYTES = 500_000_000  # of the parts of the file when unpacked: about ten million cells, a minute's work
MOST_SHEETS = 100
MOST_ROWS = 1_048_576  # of a sheet, as Excel has them
MOST_COLUMNS = 2_000
NO_RESULT = "#FORMULA?"
"""A formula whose result the file does not hold, as programs write them that do not calculate."""
ERRORS = {NO_RESULT, "#DIV/0!", "#N/A", "#NAME?", "#NULL!", "#NUM!", "#REF!", "#VALUE!", "#SPILL!", "#CALC!"}
_BROKEN = (
    KeyError, ValueError, TypeError, AttributeError, IndexError, ArithmeticError, SyntaxError, EOFError, RuntimeError,
    OSError, BadZipFile, zlib.error,
)  # fmt: skip
"""Errors of openpyxl, and of what it calls, on files that are no workbooks."""
_OF_THE_DISK = {errno.EFBIG, errno.ENOSPC, errno.EDQUOT}
_LITERAL = re.compile(r'"([^"]*)"|\\(.)')  # in a number format
_OWN_FORMATS = 164  # formats of a workbook's own are counted from here on
_PERCENT = {9, 10}  # formats that need no code
_PLAIN = str.maketrans({"\t": " ", "\r": " ", "\n": " "})
Spend = Callable[[int], None]


def texts(path: Path, folder: Path, stem: str, spend: Spend = lambda _bytes: None) -> dict[str, Path]:
    """Write each sheet that holds something as `stem.1.data`, `stem.2.data` … in the folder; their files by name of the sheet.

    Hidden sheets come last.

    spend: is called with bytes before they are written. Raises `Unusable` for what is no workbook, or holds nothing.
    """
    try:
        from openpyxl import load_workbook
    except ModuleNotFoundError:
        raise Unusable(
            _("Workbooks need openpyxl, which is not installed here: install it, or save the sheet as CSV.")
        ) from None
    _refuse_large(path)
    try:
        with path.open("rb") as file:
            book = load_workbook(file, read_only=True, data_only=True, keep_links=False)
            _refuse_many(book.worksheets)
            written = {
                sheet.title: _write(sheet, folder / f"{stem}.{number}.data", spend)
                for number, sheet in enumerate(sorted(book.worksheets, key=_is_hidden), 1)
            }
    except Unusable:
        raise
    except _BROKEN as error:
        if isinstance(error, OSError) and error.errno in _OF_THE_DISK:
            raise
        raise Unusable(_("This workbook cannot be read: {error}.").format(error=str(error)[:200])) from None
    found = {name: file for name, file in written.items() if file is not None}
    if not found:
        raise Unusable(_("The workbook holds no cells."))
    return found


@contextmanager
def text_of(
    path: Path, sheet: str | None, write: Callable[[Path, Path, str], dict[str, Path]] = texts
) -> Iterator[Path]:
    """A sheet of the workbook as a file of text while it is needed: the named one, else the first that holds something.

    write: `texts`, or a call of it in a process of its own. Raises `Unusable`, also for a sheet that is not there.
    """
    with TemporaryDirectory() as folder:
        found = write(path, Path(folder), "sheet")
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
    except (BadZipFile, ValueError, OSError):
        raise Unusable(
            _("This is not an XLSX workbook. Save the sheet as XLSX or CSV; the older XLS is not read.")
        ) from None
    if size > MOST_BYTES:
        raise Unusable(_("The workbook is too large. Save the sheet as CSV."))


def _is_hidden(sheet: Any) -> bool:
    return bool(sheet.sheet_state != "visible")


def _refuse_many(sheets: Sequence[Any]) -> None:
    if len(sheets) > MOST_SHEETS:
        raise Unusable(
            _("The workbook has {count} sheets; at most {most} are read. Save the one you need as CSV.").format(
                count=len(sheets), most=MOST_SHEETS
            )
        )


@cache
def _parser() -> Any:
    """The parser of a sheet, which says of a formula that it has no result (an empty text is one)."""
    from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser

    class Parser(WorkSheetParser):
        def parse_cell(self, element: Any) -> dict[str, Any]:
            cell: dict[str, Any] = super().parse_cell(element)
            if cell["value"] in {None, ""} and element.get("t") != "str" and element.find(FORMULA_TAG) is not None:
                cell["value"] = NO_RESULT
            return cell

    return Parser


def _write(sheet: Any, target: Path, spend: Spend) -> Path | None:
    """The rows of a sheet, the number of a line being that of its row; None where no cell is filled.

    A row ends with its last filled cell: what the file says of its width is often that of a formatted column.
    """
    book, last, filled, units = sheet.parent, 0, False, _Units()
    with sheet._get_source() as source, target.open("wb") as file:  # noqa: SLF001 - openpyxl reads it no other way
        parser = _parser()(
            source,
            sheet._shared_strings,  # noqa: SLF001
            data_only=True,
            epoch=book.epoch,
            date_formats=book._date_formats,  # noqa: SLF001
            timedelta_formats=book._timedelta_formats,  # noqa: SLF001
        )
        for number, cells in parser.parse():
            if number > MOST_ROWS:
                raise Unusable(
                    _("Row {number} of sheet {sheet}: a sheet of Excel ends with row {most}. Save it as CSV.").format(
                        number=number, sheet=repr(sheet.title[:40]), most=f"{MOST_ROWS:,}"
                    )
                )
            if number <= last:
                continue
            line = _line({cell["column"] - 1: _text(cell["value"]) + units(book, cell) for cell in cells})
            filled = filled or bool(line)
            content = b"\n" * (number - last - 1) + line.encode() + b"\n"
            spend(len(content))
            file.write(content)
            last = number
    if not filled:
        target.unlink()
        return None
    return target


class _Units:
    """Units that number formats show behind their numbers, such as ``0.0000" in"`` or ``0%``; none for mm, as numbers are."""

    def __init__(self) -> None:
        self._of_styles: dict[int, str] = {}

    def __call__(self, book: Any, cell: Mapping[str, Any]) -> str:
        """The unit behind a cell, with a blank."""
        value, style = cell["value"], cell["style_id"]
        if not style or isinstance(value, bool) or not isinstance(value, int | float):
            return ""
        if style not in self._of_styles:
            number = book._cell_styles[style].numFmtId  # noqa: SLF001 - openpyxl tells it no other way
            own = number - _OWN_FORMATS
            code = book._number_formats[own] if own >= 0 else "%" * (number in _PERCENT)  # noqa: SLF001
            word = unit_shown(code)
            self._of_styles[style] = f" {word}" if word and length_unit(word) != "mm" else ""
        return self._of_styles[style]


def unit_shown(code: str) -> str:
    """The unit that a number format shows behind the number, of length or not; an empty text where it shows none.

    >>> unit_shown('0.000"mm"'), unit_shown('0.0\\\\"'), unit_shown("0.00%"), unit_shown('0.0"°"'), unit_shown('"Ø"0.000" ok"')
    ('mm', '"', '%', '°', '')
    >>> unit_shown('0.0" 1/1000"'), unit_shown('0.0" furlong"')
    ('1/1000', 'furlong')
    """
    code = code.partition(";")[0]
    bare = _LITERAL.sub(lambda literal: " " * len(literal[0]), code)
    behind = code[max(bare.rfind(sign) for sign in "0#?") + 1 :]
    word = "".join(quoted or escaped for quoted, escaped in _LITERAL.findall(behind)).strip()
    if "%" in _LITERAL.sub("", behind):
        return "%"
    scaled = "10" in word and any(sign in "/x×*^" for sign in word)
    return word if scaled or length_unit(word) or like_a_unit(word) else ""


def refuse_error(text: str) -> None:
    """Raises `Unreadable` for a cell of a workbook that has no result."""
    if text == NO_RESULT:
        raise Unreadable(
            _("is a formula without a result in the file; open the workbook in a spreadsheet program and save it")
        )
    if text in ERRORS:
        raise Unreadable(_("is an error of the workbook; correct or clear the cell"))


def decimal_in(text: str) -> str:
    """The decimal sign of a size in a workbook: its numbers have a point, and a text with a comma can be read in one way only.

    >>> decimal_in("40,002"), decimal_in("40.002"), decimal_in("1.040,002")
    (',', '.', '.')
    """
    return "," if "," in text and "." not in text else "."


def _line(cells: Mapping[int, str]) -> str:
    width = max((place + 1 for place, text in cells.items() if text and place < MOST_COLUMNS), default=0)
    return "\t".join(_quoted(cells.get(place, "")) for place in range(width))


def _quoted(text: str) -> str:
    """A cell as it is, but in quotation marks where it begins with one, such as the sign of inches."""
    return '"' + text.replace('"', '""') + '"' if text.startswith('"') else text


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
