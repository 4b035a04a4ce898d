"""Fonts of the PDF: FiraGO for Latin, Cyrillic, Greek, Hebrew, Arabic; the reader's own font for Chinese and Japanese.

Letters that none of them has are shown as □: a report is never refused for a name. Right-to-left words are in their
order; Arabic letters are not joined.
"""

import io
import unicodedata
from functools import cache
from html import escape
from itertools import groupby
from threading import Lock

import pymupdf_fonts
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.cidfonts import UnicodeCIDFont
from reportlab.pdfbase.ttfonts import TTFont

REGULAR, BOLD, CHINESE = "FiraGO", "FiraGO-Bold", "STSong-Light"
MISSING = "□"
ALIKE = str.maketrans({"\N{NARROW NO-BREAK SPACE}": "\N{NO-BREAK SPACE}", "\N{FIGURE SPACE}": "\N{NO-BREAK SPACE}"})
_registering = Lock()


@cache
def _known() -> frozenset[int]:
    """Make the fonts known to ReportLab, once per process; the characters that FiraGO has."""
    with _registering:
        regular, bold = (
            TTFont(name, io.BytesIO(pymupdf_fonts.fontbuffers[buffer]()))  # type: ignore[no-untyped-call]
            for name, buffer in ((REGULAR, "figo"), (BOLD, "figbo"))
        )
        for font in (regular, bold, UnicodeCIDFont(CHINESE)):
            pdfmetrics.registerFont(font)
        pdfmetrics.registerFontFamily(REGULAR, normal=REGULAR, bold=BOLD, italic=REGULAR, boldItalic=BOLD)
    return frozenset(regular.face.charToGlyph)


def fonts() -> tuple[str, str]:
    """The regular and the bold font, known to ReportLab from now on."""
    _known()
    return REGULAR, BOLD


def runs(text: str) -> list[tuple[str, bool]]:
    """The text in pieces, each with whether it takes the Chinese font; what nobody can show has become □.

    >>> runs("Ø40 h6 轴")
    [('Ø40 h6 ', False), ('轴', True)]
    """
    known = _known()
    letters = [(letter, _kind(letter, known)) for letter in visual(text.translate(ALIKE))]
    return [
        ("".join(MISSING if kind is None else letter for letter, kind in piece), is_chinese)
        for is_chinese, piece in groupby(letters, key=lambda letter: letter[1] is True)
    ]


def _kind(letter: str, known: frozenset[int]) -> bool | None:
    if ord(letter) in known or letter in "\n\t":
        return False
    if unicodedata.east_asian_width(letter) in {"W", "F"} and ord(letter) < 0x10000:
        try:
            letter.encode("gb2312")
        except UnicodeEncodeError:
            return None
        return True
    return None


def markup(text: str) -> str:
    """For a paragraph: escaped, line ends kept, every piece in a font that has its letters."""
    return "".join(
        f'<font name="{CHINESE}">{escape(piece)}</font>' if chinese else escape(piece).replace("\n", "<br/>")
        for piece, chinese in runs(text)
    )


def visual(text: str) -> str:
    """Right-to-left words in the order in which they are drawn, numbers in them left as they are.

    >>> visual("שלום A1") == "םולש A1"
    True
    """
    if not any(unicodedata.bidirectional(letter) in {"R", "AL"} for letter in text):
        return text
    pieces = ["".join(piece) for _right, piece in groupby(text, key=_runs_left)]
    return "".join(piece[::-1] if _runs_left(piece[0]) else piece for piece in pieces)


def _runs_left(letter: str) -> bool:
    return unicodedata.bidirectional(letter) in {"R", "AL", "NSM"}


def width_of(text: str, size: float, *, bold: bool = False) -> float:
    """Width of a line, points."""
    font = BOLD if bold else REGULAR
    return sum(pdfmetrics.stringWidth(piece, CHINESE if chinese else font, size) for piece, chinese in runs(text))
