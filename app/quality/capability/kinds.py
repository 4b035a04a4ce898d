"""Choices of a capability study."""

from datetime import date
from enum import StrEnum
from typing import NamedTuple


class SigmaBy(StrEnum):
    """Readings whose differences give sigma within."""

    NEIGHBOURS = "neighbours"
    PART = "part"
    SHIFT = "shift"
    NEST = "nest"


WEEKS = 13
"""Weeks whose index is kept."""


class Week(NamedTuple):
    """The index of the readings measured in the week that begins on this Monday; value: None where none may be quoted."""

    begins: date
    readings: int
    value: float | None
    low: float | None
    high: float | None
