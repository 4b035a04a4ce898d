"""Numbers as people type, paste and print them, read the same way at every door.

The minus may be any sign that texts are printed with, and the decimal sign a point or a comma. A blank inside a number,
behind its sign too, makes it no number: of a scanned ``0. 001`` or ``- 0.016`` it is not known what was there, and ``40 001`` was
40.001 as likely as forty thousand.
Separators of thousands are refused for the same reason, and named. Nothing is guessed.
"""

import re
from enum import StrEnum
from math import isfinite

MINUS_SIGNS = "\N{MINUS SIGN}\N{EN DASH}\N{FIGURE DASH}\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{SMALL HYPHEN-MINUS}\N{FULLWIDTH HYPHEN-MINUS}"
BLANKS = "\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{THIN SPACE}\N{FIGURE SPACE}\N{EN SPACE}\N{EM SPACE}\N{HAIR SPACE}\N{IDEOGRAPHIC SPACE}"
_PLAIN = str.maketrans(dict.fromkeys(MINUS_SIGNS, "-") | dict.fromkeys(BLANKS, " "))
_NUMBER = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d{1,4})?", re.ASCII)
_BLANK_INSIDE = re.compile(r"[\d.,+-]\s+[\d.,]", re.ASCII)
_ONLY_NUMBER = re.compile(r"[+-]?[\d.,\s'\N{RIGHT SINGLE QUOTATION MARK}]+(?:[eE][+-]?\d+)?", re.ASCII)
LONGEST = 400


class NumberFault(StrEnum):
    """Reasons why a text is not a number."""

    EMPTY = "empty"
    BLANK = "blank"
    THOUSANDS = "thousands"
    DECIMAL = "decimal"  # the other decimal sign than the one that was said
    TOO_LARGE = "too_large"
    BRACKETS = "brackets"  # a reference dimension, or below 0
    BOUND = "bound"  # below or above what the gauge shows
    NOT_A_NUMBER = "not_a_number"


class NotANumber(ValueError):
    """A text that is not a number; ``fault`` says why."""

    def __init__(self, fault: NumberFault) -> None:
        super().__init__(fault.value)
        self.fault = fault


def plain(text: str) -> str:
    """The same text with an ordinary minus sign and ordinary blanks, none of them around it.

    >>> plain(" −0.016\u00a0")
    '-0.016'
    """
    return text.translate(_PLAIN).strip()


def has_printed_minus(text: str) -> bool:
    """Tell of a minus sign that no control takes."""
    return any(character in MINUS_SIGNS for character in text)


def read_number(text: str, decimal: str | None = None) -> float:
    """Read a finite number; ``decimal`` is the only decimal sign that counts, or None for either.

    >>> read_number("0,0053"), read_number("−0.016"), read_number("39.998", ".")
    (0.0053, -0.016, 39.998)

    Raises `NotANumber`.
    """
    number = plain(text)
    if not number:
        raise NotANumber(NumberFault.EMPTY)
    if len(number) > LONGEST or not _NUMBER.fullmatch(number):
        raise NotANumber(_fault(number))
    if decimal is not None and ("." if decimal == "," else ",") in number:
        raise NotANumber(NumberFault.DECIMAL)
    value = float(number.replace(",", "."))
    if not isfinite(value):
        raise NotANumber(NumberFault.TOO_LARGE)
    return value + 0.0


def number_or_none(text: str, decimal: str | None = None) -> float | None:
    """The number that a text is, None where it is none.

    >>> number_or_none("40,002"), number_or_none("1 234"), number_or_none("1.234,5"), number_or_none("nan")
    (40.002, None, None, None)
    """
    try:
        return read_number(text, decimal)
    except NotANumber:
        return None


_BROKEN = re.compile(r"\d\.[^\S\n]+\d", re.ASCII)


def has_broken_number(row: str) -> bool:
    """Tell of a row of numbers in which a blank is behind a decimal point, so that one number would be read as two.

    >>> has_broken_number("-X -353. 012"), has_broken_number("12.5 3.0"), has_broken_number("1, 2")
    (True, False, False)
    """
    return _BROKEN.search(plain(row)) is not None


_IN_BRACKETS = re.compile(r"\([^()\d]*\d[^()]*\)|\[[^\[\]\d]*\d[^\[\]]*\]", re.ASCII)
_BOUND = re.compile(r"(?:[<>]=?|[≤≥])\s*[+-]?[\d.,]+", re.ASCII)


def _fault(given: str) -> NumberFault:
    if len(given) > LONGEST:
        return NumberFault.NOT_A_NUMBER
    if _IN_BRACKETS.fullmatch(given):
        return NumberFault.BRACKETS
    if _BOUND.fullmatch(given):
        return NumberFault.BOUND
    if not _ONLY_NUMBER.fullmatch(given) or not any(character.isdigit() for character in given):
        return NumberFault.NOT_A_NUMBER
    if _BLANK_INSIDE.search(given):
        return NumberFault.BLANK
    thousands = re.sub(r"[eE].*", "", given).lstrip("+-")
    parted = [
        "".join(filter(str.isdigit, part)) for part in re.split(r"[.,'\N{RIGHT SINGLE QUOTATION MARK}]", thousands)
    ]
    by_threes = all(len(part) == 3 for part in parted[1:-1]) and 1 <= len(parted[0]) <= 3
    return NumberFault.THOUSANDS if by_threes else NumberFault.NOT_A_NUMBER
