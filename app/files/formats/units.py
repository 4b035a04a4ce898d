"""Units of length, as files and headers of columns name them: one table for every door, so that no size becomes a silent mm."""

import re
from typing import Final, Literal, get_args

Unit = Literal["mm", "um", "nm", "cm", "m", "inch", "mil", "tenth", "uin"]
LENGTHS: Final[dict[str, float]] = {
    "mm": 1.0,
    "um": 1e-3,
    "nm": 1e-6,
    "cm": 10.0,
    "m": 1000.0,
    "inch": 25.4,
    "mil": 25.4e-3,
    "tenth": 25.4e-4,
    "uin": 25.4e-6,
}
"""Millimetres in each unit. A mil or thou is 0.001 inch, a machinist's tenth 0.0001 inch."""
assert tuple(LENGTHS) == get_args(Unit)

_WORDS: Final[dict[str, str]] = {
    word: unit
    for unit, words in {
        "mm": "mm millimeter millimeters millimetre millimetres millimetri мм миллиметр 毫米",
        "um": "µm um mikrometer micrometer micrometers micrometre micrometres micron microns mikron mkm мкм микрон",
        "nm": "nm nanometer nanometre",
        "cm": "cm centimeter centimetre zentimeter см",
        "m": "m meter metre м",
        "inch": "in inch inches zoll дюйм \" ''",
        "mil": "mil mils thou thous",
        "tenth": "tenth tenths",
        "uin": "µin uin µinch uinch microinch microinches",
    }.items()
    for word in words.split()
}
_ONLY_AS_WRITTEN: Final = {"nm": {"nm"}, "m": {"m"}, "mm": {"mm", "MM"}}
"""Units whose other cases are something else: Nm is a torque, M a million, Mm a million metres."""
_BRACKETS: Final = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)|<([^<>]*)>")
_AT_END: Final = re.compile(r"[_ ](mm|MM|[uµμ]m|inch)$")
_NO_UNITS: Final = (
    {*"xyzabcuvwijkrdln", "id", "max", "min", "avg", "mean", "med", "std", "ist", "soll", "act", "nom", "dia", "abs", "rel"}
    | {"dev", "ok", "nok", "raw", "ref"}
)  # fmt: skip
"""Words in round brackets that say which size it is, and in no unit."""


def length_unit(word: str) -> str | None:
    """The unit of length that a word names, one of `LENGTHS`; None where it names another or nothing.

    >>> length_unit("[MM]"), length_unit("μm"), length_unit("thou"), length_unit("Nm"), length_unit("°")
    ('mm', 'um', 'mil', None, None)
    """
    word = word.strip(" []()<>\t").replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    folded = word.lower()
    as_written = _ONLY_AS_WRITTEN.get(folded)
    return None if as_written is not None and word not in as_written else _WORDS.get(folded)


class UnknownUnit(Exception):
    """A header names a unit that is none of length, or not known. `word`: as it is written."""

    def __init__(self, word: str) -> None:
        super().__init__(word)
        self.word = word


def unit_in(header: str) -> str | None:
    """The unit that the name of a column carries, in brackets or as its last word. Raises `UnknownUnit`.

    What is in square brackets is a unit, unless it holds a digit; in round ones if it is short and no usual word.

    >>> unit_in("Wert [µm]"), unit_in("размер (мкм)"), unit_in("D40_mm"), unit_in("D (X)"), unit_in("measured")
    ('um', 'um', 'mm', None, None)
    >>> unit_in("Run-out [furlong]")
    Traceback (most recent call last):
        ...
    app.files.formats.units.UnknownUnit: furlong
    """
    unknown = None
    for square, round_, angle in _BRACKETS.findall(header):
        word = (square or round_ or angle).strip()
        if unit := length_unit(word):
            return unit
        if _like_a_unit(word, least_doubt=bool(square)):
            unknown = unknown or word
    if unknown is not None:
        raise UnknownUnit(unknown)
    return length_unit(match[1]) if (match := _AT_END.search(header)) else None


def _like_a_unit(word: str, *, least_doubt: bool) -> bool:
    if not word or any(sign.isdigit() for sign in word) or len(word.split()) > 1:
        return False
    return least_doubt or (len(word) <= 4 and word.lower() not in _NO_UNITS)
