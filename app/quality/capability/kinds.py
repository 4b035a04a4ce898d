"""Choices of a capability study."""

from enum import StrEnum


class SigmaBy(StrEnum):
    """Readings whose differences give sigma within."""

    NEIGHBOURS = "neighbours"
    PART = "part"
    SHIFT = "shift"
    NEST = "nest"
