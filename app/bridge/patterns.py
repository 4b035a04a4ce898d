"""Regular expressions of a configuration that find readings in lines: fields are named groups, and no line takes for ever."""

from collections.abc import Sequence
from typing import Final

import regex

from app.bridge.fields import FIELDS

LONGEST_LINE: Final = 10_000
LONGEST_SEARCH: Final = 0.5  # s for one line: an expression such as (a+)+b takes years for some


class TooSlow(ValueError):
    """An expression that takes too long on a line; the words say what to do."""


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
        """The fields of the readings in a line. Raises `TooSlow`."""
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
                found.append(self.held | groups)
            else:
                self.held |= groups
        return found
