"""Regular expressions of a configuration that find readings in lines: fields are named groups, and no line takes for ever."""

import re
from collections.abc import Sequence
from typing import Final

import regex

from app.bridge.fields import FIELDS

LONGEST_LINE: Final = 10_000
_DIGITS: Final = frozenset("0123456789")
_REST: Final = re.compile(r"\d*(?:[.,]\d+)?(?:[eE][+-]?\d+)?", re.ASCII)
_REST_OF_FRACTION: Final = re.compile(r"\d*(?:[eE][+-]?\d+)?", re.ASCII)  # a comma behind 40.001 is between columns
LONGEST_SEARCH: Final = 0.5  # s for one line: an expression such as (a+)+b takes years for some


class NotFound(ValueError):
    """Expressions that cannot be trusted on a line; the words say what to do."""


class TooSlow(NotFound):
    """An expression takes too long on a line, and would on the next."""


def check_expressions(lines: Sequence[str]) -> None:
    """Refuse expressions that are none, and those without a size. Raises `ValueError`."""
    groups: set[str] = set()
    for text in lines:
        try:
            groups |= set(regex.compile(text).groupindex)
        except regex.error as error:
            raise ValueError(f"lines: {text!r} is no regular expression: {error}") from None
    for name in groups - set(FIELDS):
        raise ValueError(f"lines: the group {name!r} is no field; fields are {', '.join(FIELDS)}")
    if "measured" not in groups:
        raise ValueError("lines: one expression needs the group (?P<measured>…), the size")


class Patterns:
    """Expressions, and what holds for the lines below: the fields of lines without a size."""

    def __init__(self, lines: Sequence[str]) -> None:
        self._expressions = [regex.compile(text) for text in lines]
        self.held: dict[str, str] = {}

    def find(self, line: str) -> list[dict[str, str]]:
        """The fields of the readings in a line. Raises `NotFound`."""
        found = []
        for expression in self._expressions:
            try:
                match = expression.search(line, timeout=LONGEST_SEARCH)
            except TimeoutError:
                raise TooSlow(
                    f"The expression {expression.pattern!r} takes longer than {LONGEST_SEARCH:g} s on this line: make it simpler,"
                    " without a repetition within a repetition."
                ) from None
            if match is None:
                continue
            groups = {name: value for name, value in match.groupdict().items() if value is not None}
            if "measured" in groups:
                if number := _cut_number(match):
                    raise NotFound(
                        f"The expression {expression.pattern!r} takes {groups['measured']!r} out of {number!r}: let it take the"
                        " whole number, and what follows."
                    )
                found.append(self.held | groups)
            else:
                self.held |= groups
        return found


def _cut_number(match: regex.Match[str]) -> str:
    """The number of which the size is only a part, as 40 of 40,001 where the expression knows no comma; else an empty text.

    What another group holds, or the expression names behind the size, is meant so.
    """
    line, (begin, end) = match.string, match.span("measured")
    first, last = begin, end
    if line[begin : begin + 1] in _DIGITS and all(match.end(name) != begin for name in match.groupdict()):
        while first and line[first - 1] in _DIGITS:
            first -= 1
    if end == match.end() and line[end - 1 : end] in _DIGITS:
        fraction = not line[begin:end].lstrip("+-").isdigit()
        rest = (_REST_OF_FRACTION if fraction else _REST).match(line, end)
        last = rest.end() if rest else end
    return "" if (first, last) == (begin, end) else line[first:last]
