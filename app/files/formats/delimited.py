"""CSV and its relatives: encodings, byte order marks, delimiters, decimal signs. Reads line by line, however long the file."""

import codecs
import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, TextIO

from app.files.formats import dimension_blocks, letters
from app.language.i18n import _

DELIMITERS = (";", "\t", ",", "|")
BLANKS = "  "
"""In place of a sign: two blanks or more part the cells, as printed tables have it. An empty cell cannot be seen there."""
ENCODINGS = (
    "utf-8",
    "utf-8-sig",
    "utf-16",
    "utf-16-le",
    "utf-16-be",
    "cp1250",
    "cp1251",
    "cp1252",
    "iso-8859-2",
    "iso-8859-5",
    "cp1253",
    "cp1254",
    "cp1257",
    "cp850",
    "cp852",
    "cp866",
    "koi8-r",
    "iso-8859-7",
    "mac_roman",
    "cp932",
    "gb18030",
    "big5",
    "cp949",
)
END = "END"  # alone in a row: so CALYPSO closes its tables
SAMPLE = 64 * 1024
AT_ONCE = 30  # lines that are compared
LOOKED_AT = 1_000_000  # bytes from which an encoding is guessed
_IN_QUOTES = str.maketrans(";\t,|\r\n", "  .   ")  # signs that part nothing there; a comma may be of a number
_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
# Full-width signs too, which some spreadsheets take for the plain ones. A sign behind another delimiter begins a cell where
# the spreadsheet of another country parts the line there; a plain number does no harm there.
_SIGNS = "=+@\N{FULLWIDTH EQUALS SIGN}\N{FULLWIDTH PLUS SIGN}\N{FULLWIDTH HYPHEN-MINUS}\N{FULLWIDTH COMMERCIAL AT}-"
_NUMBER = r"[+-]\d+(\.\d+)?([eE][+-]?\d+)?([];,\t|\r\n]|$)"
_DANGEROUS = re.compile(rf"^(?=\s*[{_SIGNS}]|[\t\r\n])|(?<=[;,\t|\r\n])(?=[{_SIGNS}])(?!{_NUMBER})")


class Unusable(ValueError):
    """A file, or the rest of it, that cannot be read as a table; `line` where it is known."""

    def __init__(self, message: str, line: int | None = None) -> None:
        super().__init__(message)
        self.line = line


class Row(NamedTuple):
    """The cells of one row, and the line of the file where it begins."""

    line: int
    cells: list[str]


def encoding_of(path: Path) -> str:
    """Encoding by the byte order mark; else UTF-8 if the beginning is, else the one whose letters fit best."""
    with path.open("rb") as file:
        start = file.read(LOOKED_AT)
    for mark, name in _MARKS:
        if start.startswith(mark):
            return name
    if b"\0" in start:  # UTF-16 without its mark: of plain letters each has a zero before or behind it
        return "utf-16-be" if start[0::2].count(0) > start[1::2].count(0) else "utf-16-le"
    return letters_of(path)


def letters_of(path: Path) -> str:
    """Encoding of a text in single bytes: UTF-8 if the beginning is, else the one whose letters fit best.

    Raises `Unusable` for letters of East Asia: those are not guessed.
    """
    with path.open("rb") as file:
        start = file.read(LOOKED_AT)
    try:
        codecs.getincrementaldecoder("utf-8")().decode(start)
    except UnicodeDecodeError:
        name, european = letters.guessed(start)
        if not european:
            raise Unusable(not_european()) from None
        return name
    return "utf-8"


def samples(path: Path) -> list[tuple[str, list[str]]]:
    """The first lines with letters beyond ASCII in each encoding, for a person to see which one is right."""
    with path.open("rb") as file:
        start = file.read(LOOKED_AT)
    beginning = [line for line in start.splitlines() if line.strip()][:200]
    telling = ([line for line in beginning if any(byte > 0x7F for byte in line)] or beginning)[:3]
    return [
        (name, [line.decode(name, "replace")[:120] for line in telling])
        for name in ("utf-8", *letters.LETTERS, *letters.TO_NAME)
    ]


def open_text(path: Path, encoding: str) -> TextIO:
    """The file as text; line ends stay as they are, as the csv module wants it."""
    return path.open(encoding=encoding, newline="")


def delimiter_of(path: Path, encoding: str) -> str:
    """The sign that parts the cells of the first lines most evenly; a comma when none does."""
    sample = _beginning(path, encoding)
    if announced := re.match(r"sep=(.)\r?\n", sample):  # spreadsheets write this
        return announced[1]
    unquoted = re.sub(r'"(?:[^"]|"")*"', lambda quoted: quoted[0][1:-1].translate(_IN_QUOTES), sample)
    lines = [line for line in unquoted.splitlines() if line.strip()]
    lines = [line for line in lines if not line.lstrip().startswith("#")] or lines
    if len(sample) == SAMPLE and len(lines) > 1:
        lines = lines[:-1]  # cut off in the middle, perhaps
    if lines and all(_is_number(line) or not any(sign in line for sign in DELIMITERS) for line in lines):
        return ";"  # one column: a comma is of a number
    first = None
    for begin in range(0, len(lines), AT_ONCE):  # a long preamble above the table has no values between them
        some = lines[begin : begin + AT_ONCE]
        best = _evenest(some)
        if best and any(is_value(cell) for line in some for cell in line.split(best)[1:]):
            return best
        first = first or best
    if first:
        return first
    best = max(DELIMITERS, key=lines[0].count) if lines else ","
    return best if lines and best in lines[0] else ","


def _evenest(lines: Sequence[str]) -> str | None:
    for first in range(len(lines)):  # titles above the table have none of them
        evenness = {sign: min(line.count(sign) for line in lines[first:]) for sign in DELIMITERS}
        best = max(DELIMITERS, key=lambda sign: evenness[sign])
        if best == "," and not any(map(_COMMA_OF_CELLS.search, lines[first:])):
            best = next((sign for sign in _BESIDE_COMMAS if evenness[sign]), best)
        if evenness[best]:
            return best
    return None


def _beginning(path: Path, encoding: str) -> str:
    with open_text(path, encoding) as file:
        try:
            return file.read(SAMPLE)
        except UnicodeError:
            raise Unusable(_not_text(encoding)) from None


def rows(path: Path, encoding: str, delimiter: str) -> Iterator[Row]:
    """Every row that is not empty, the header first; comments (`#`) above it are passed over. Raises `Unusable` where it
    cannot go on. The blocks of a report are one table.
    """
    if dimension_blocks.is_report(_beginning(path, encoding)):
        with open_text(path, encoding) as file:
            columns = dimension_blocks.columns_of(_decoded(file, encoding))
        with open_text(path, encoding) as file:
            yield from (Row(*row) for row in dimension_blocks.table(_decoded(file, encoding), columns))
        return
    every = _rows(path, encoding, delimiter)
    comment: Row | None = None
    for row in every:
        if comment is not None and _is_header(comment, row):
            yield comment
        comment = None
        if row.cells[0].lstrip().startswith("#"):
            comment = row
            continue
        yield row
        break
    if comment is not None:
        yield comment
    yield from every


def even(rows: Iterable[Row], width: int, delimiter: str, *, complete: bool = True) -> Iterator[Row | Unusable]:
    """Each row as wide as the header: cells that are missing or left over at its end are empty.

    complete: the file ends with the end of a line. An error in its place is a row with more cells that are filled, and a
    last one without an end that is shorter than all above it: there the file was cut off.
    """
    fewest, last = width, None
    for row in rows:
        if last is not None:
            fewest = min(fewest, len(last.cells))
            yield _even(last, width, delimiter)
        last = row
    if last is None:
        return
    if not complete and len(last.cells) < fewest:
        words = _(
            "has {cells} cells, lines above have {width}, and has no end: the file is cut off here; take the whole one"
        )
        yield Unusable(words.format(cells=len(last.cells), width=fewest), last.line)
    else:
        yield _even(last, width, delimiter)


def _even(row: Row, width: int, delimiter: str) -> Row | Unusable:
    if delimiter == BLANKS and len(row.cells) != width:
        words = _(
            "has {cells} cells between blanks, the header has {width}: it cannot be determined which of them is empty"
        )
        return Unusable(words.format(cells=len(row.cells), width=width), row.line)
    if any(cell.strip() for cell in row.cells[width:]):
        return Unusable(_too_wide(len(row.cells), width, delimiter), row.line)
    return Row(row.line, row.cells[:width] + [""] * (width - len(row.cells)))


def _too_wide(cells: int, width: int, delimiter: str) -> str:
    sign = {"\t": _("tabulator"), ",": _("comma"), ";": _("semicolon")}.get(delimiter, delimiter)
    text = _("has {cells} columns, the header has {width}; the column separator is {sign}.").format(
        cells=cells, width=width, sign=sign
    )
    if delimiter == ",":
        text += " " + _(
            "A decimal comma parts a cell too: put such numbers in quotation marks, or name another delimiter."
        )
    return text


def is_complete(path: Path) -> bool:
    """Tell if the file ends with the end of a line, in whatever encoding."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 4))
        return file.read().rstrip(b"\0")[-1:] in {b"\n", b"\r", b"\x1a"}


def is_value(cell: str) -> bool:
    """Tell if a cell holds a number, a date or a time, as the cells below a header do."""
    return _is_number(cell) or re.match(r"\s*(\d{1,4}[-./]\s?\d{1,2}[-./]\s?\d{1,4}|\d{1,2}:\d{2})", cell) is not None


def _is_header(first: Row, below: Row) -> bool:
    """Return whether a row that begins with # names the columns below it: as many cells as there, and numbers among those."""
    return len(first.cells) == len(below.cells) > 1 and any(_is_number(cell) for cell in below.cells)


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"\s*[+\-\N{MINUS SIGN}]?(?:\d+(?:[.,]\d+)?|[.,]\d+)\s*", cell) is not None


def _rows(path: Path, encoding: str, delimiter: str) -> Iterator[Row]:
    with open_text(path, encoding) as file:
        if delimiter == BLANKS:
            for line, text in enumerate(_decoded(file, encoding), 1):
                if text.strip():
                    yield Row(line, re.split(r" *\t *| {2,}", text.strip()))
            return
        reader = csv.reader(_decoded(file, encoding), delimiter=delimiter, strict=True)
        while True:
            line = reader.line_num + 1
            try:
                cells = next(reader)
            except StopIteration:
                return
            except csv.Error as error:
                raise Unusable(_why(str(error)), line) from None
            if line == 1 and cells and cells[0].startswith("sep="):
                continue
            if (filled := [cell.strip() for cell in cells if cell.strip()]) and filled != [END]:
                yield Row(line, cells)


def _decoded(file: TextIO, encoding: str) -> Iterator[str]:
    line = 1
    try:
        for text in file:
            yield text
            line += 1
    except UnicodeError:
        raise Unusable(_not_text(encoding), line) from None


def _not_text(encoding: str) -> str:
    return _(
        "This is not {encoding} text. Name the file's encoding: cp1250 for Serbian (Latin), Slovene and other Central "
        "European Windows files, cp1251 for Cyrillic, cp1252 for Western European."
    ).format(encoding=encoding.upper())


def not_european() -> str:
    """The refusal of letters that are not guessed."""
    return _(
        "The letters look like those of East Asia, and which ones they are is not guessed. Name the encoding (--encoding, in a "
        "bridge encoding): cp932 for Japanese, gb18030 for Chinese, big5 for Chinese of Taiwan, cp949 for Korean."
    )


def _why(error: str) -> str:
    if "unexpected end" in error:
        return _("A quotation mark is opened here and never closed.")
    if "field larger" in error:
        return _("A cell is longer than 128 kB; perhaps a quotation mark is opened here and never closed.")
    if "expected after" in error:
        return _("After a closing quotation mark the next cell must begin; double a quotation mark inside a cell.")
    return _("This line cannot be taken apart: {error}.").format(error=error)


def decimal_of(cells: Iterable[str]) -> str:
    """The decimal sign of these cells; a point when they do not tell."""
    commas = points = 0
    for cell in cells:
        commas += bool(re.fullmatch(r"\s*[+\-\N{MINUS SIGN}]?\d*,\d+(?:[eE][+-]?\d+)?\s*", cell))
        points += bool(re.fullmatch(r"\s*[+\-\N{MINUS SIGN}]?\d*\.\d+(?:[eE][+-]?\d+)?\s*", cell))
    return "," if commas > points else "."


_COMMA_OF_CELLS = re.compile(r"(?<!\d),|,(?!\d)")
_BESIDE_COMMAS = (";", "\t", "|")
"""Delimiters of lines in which all commas are of numbers."""
_LIKE_THOUSANDS = re.compile(r"[+\-\N{MINUS SIGN}]?[1-9]\d{0,2}[.,]\d{3}")


def like_thousands(cells: Iterable[str], *, sheet: bool = False) -> str:
    """The first number in which a sign may part thousands, where none of the others tells; empty if there is none.

    sheet: of a workbook, whose numbers have a point and no 0 at the end: others are texts.

    >>> like_thousands(["980", "1.250"]), like_thousands(["1.250", "0.980"]), like_thousands(["1.25"])
    ('1.250', '', '')
    """
    signed = [cell.strip() for cell in cells if "." in cell or "," in cell]
    numbers = [cell for cell in signed if _is_number(cell) and (not sheet or "," in cell or cell.endswith("0"))]
    return numbers[0] if numbers and all(map(_LIKE_THOUSANDS.fullmatch, numbers)) else ""


def thousands_in_doubt(number: str, unit: str, *, sheet: bool = False) -> str:
    """The question about such a number in a unit in which either may be meant."""
    words = _(
        "{number} {unit} may be {small} or {large}: say how decimals are written (--decimal, in a bridge decimal); separators of "
        "thousands have to be removed"
    )
    if sheet:
        words = _("{number} {unit} is a text that may be {small} or {large}: make it a number in the workbook")
    whole, part = re.split("[.,]", number)
    return words.format(number=number, unit=unit, small=f"{whole}.{part}", large=f"{whole}{part}")


def defused(text: str) -> str:
    """A text cell that no spreadsheet takes for a formula.

    >>> defused("=HYPERLINK(1)"), defused("SN-812")
    ("'=HYPERLINK(1)", 'SN-812')
    >>> defused("chip;=1+1"), defused("40 h6; −3 µm, -2")
    ("chip;'=1+1", '40 h6; −3 µm, -2')
    """
    return _DANGEROUS.sub("'", text)
