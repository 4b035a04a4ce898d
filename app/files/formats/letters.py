"""The encoding of a text in single bytes, by its headings and letters. What looks like East Asia is asked about, not guessed."""

import re
from functools import cache
from typing import NamedTuple

from app.files.formats.column_names import NAMES, key_of

_SIGNS_OF_ALL = "°ºª±µ²³×·–—„“”‚‘’…€§«»\N{NO-BREAK SPACE}"
_LATIN = "äöüÄÖÜß" + _SIGNS_OF_ALL
# The common letters of German and French, of Serbian and Slovene, and of Cyrillic; rare ones would only confuse.
LETTERS = {
    "cp1252": _LATIN + "Øøéàç",
    "cp1250": _LATIN + "čćšžđČĆŠŽĐ",
    "iso-8859-2": _LATIN + "čćšžđČĆŠŽĐ",
    "cp1251": "аеионрстлвкмдпузбјљњжчцшћђАВДИКМНОПРСТ" + _SIGNS_OF_ALL,
    "iso-8859-5": "аеионрстлвкмдпузбјљњжчцшћђАВДИКМНОПРСТ",
}
MOST_LINES = 500
FEWEST = 2  # letters of two bytes
CAPITALS = 32  # bytes among which the capitals of a script lie
_BEYOND = re.compile(r"[^\x00-\x7f]")
_TWO_SCRIPTS = re.compile(r"[A-Za-z](?=[\u0400-\u04ff])|[\u0400-\u04ff](?=[A-Za-z])")


class _Asian(NamedTuple):
    """An encoding in which a letter is two bytes: all such pairs, and those of common letters."""

    pair: bytes
    common: bytes


TO_NAME = {
    "cp932": _Asian(
        rb"[\x81-\x9f\xe0-\xef][\x40-\x7e\x80-\xfc]|[\xa1-\xdf]", rb"[\x81-\x83\x88-\x97].|\x98[\x40-\x72]"
    ),
    "gb18030": _Asian(rb"[\x81-\xfe][\x40-\x7e\x80-\xfe]", rb"[\xa1\xa3\xb0-\xd7][\xa1-\xfe]"),
    "big5": _Asian(rb"[\xa1-\xf9][\x40-\x7e\xa1-\xfe]", rb"[\xa1-\xc6]."),
    "cp949": _Asian(rb"[\x81-\xfe][\x41-\x5a\x61-\x7a\x81-\xfe]", rb"[\xa1-\xa3\xb0-\xc8][\xa1-\xfe]"),
}
"""They are named, never guessed."""


def guessed(content: bytes) -> tuple[str, bool]:
    """The encoding whose letters fit best, and whether they are letters of Europe rather than of East Asia."""
    lines = b"\n".join([line for line in content.splitlines() if not line.isascii()][:MOST_LINES])
    texts = {name: lines.decode(name, "replace") for name in LETTERS}
    best = max(LETTERS, key=lambda name: _fit(texts[name], LETTERS[name]))
    usual = all(sign in LETTERS[best] for sign in _BEYOND.findall(texts[best]))
    return best, usual or _known(texts[best]) > 0 or not any(_is_asian(lines, each) for each in TO_NAME.values())


def _fit(text: str, letters: str) -> int:
    """Letters that its languages have, less those that they do not have; a heading that is known tells most, two scripts in a word against it."""
    fitting = sum(1 if sign in letters else -1 for sign in _BEYOND.findall(text))
    return fitting + 3 * _known(text) - 2 * len(_TWO_SCRIPTS.findall(text))


def _known(text: str) -> int:
    cells = (cell for cell in re.split(r"[;,\t|\r\n]", text) if not cell.isascii())
    return sum(key_of(cell) in _headings() for cell in cells)


@cache
def _headings() -> frozenset[str]:
    return frozenset(key_of(name) for names in NAMES.values() for name in names)


def _is_asian(content: bytes, encoding: _Asian) -> bool:
    """Tell if all bytes beyond ASCII are pairs, nearly all of common letters, and few of them touch a Latin letter.

    Words in capitals of Cyrillic or Greek are such pairs too; their bytes lie close together.
    """
    pairs = re.findall(encoding.pair, content)
    left = re.sub(encoding.pair, b"", content)
    if len(pairs) < FEWEST or not left.isascii():
        return False
    beyond = [byte for byte in content if byte > 0x7F]
    if max(beyond) - min(beyond) < CAPITALS:
        return False
    common = sum(re.fullmatch(encoding.common, pair) is not None for pair in pairs)
    runs = re.findall(rb"(?<![A-Za-z])(?:" + encoding.pair + rb")++(?![A-Za-z])", content)
    alone = sum(len(re.findall(encoding.pair, run)) for run in runs)
    return 5 * common >= 4 * len(pairs) and 2 * alone > len(pairs)
