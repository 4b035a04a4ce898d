"""One reading of a file: what it means, wherever its line stands, and the order of those of a file in time."""

import json
import re
from collections.abc import Mapping
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any, Final, NamedTuple, cast

TIMES: Final = ("measured_at", "machined_at")
STEPS_BACK: Final = 2
"""In time, from line to line: a file has its newest line first."""
_TO_THE_SECOND: Final = re.compile(r"\d:\d\d:\d\d|\d{9}")  # a time of day, or seconds since 1970


class Entry(NamedTuple):
    """One reading: its line, the characteristic as the file names it, and what `POST /readings` takes, without the key."""

    line: int
    name: str
    body: dict[str, Any]
    key: str


def to_the_second(time: object) -> bool:
    """Tell if a time is written so: of two readings of one size that have the same day or minute one would be lost."""
    return time.second > 0 if isinstance(time, datetime) else _TO_THE_SECOND.search(str(time)) is not None


def meant(body: Mapping[str, Any]) -> str:
    """The meaning of a reading that has a time: where it stands, a remark beside it and the number of its row may change."""
    said = [moment_of(body, (name,)) for name in TIMES]
    return json.dumps([body["characteristic"], float(body["measured"]), body.get("part"), *map(str, said)])


def moment_of(body: Mapping[str, Any], names: tuple[str, ...] = TIMES) -> datetime | None:
    return next((datetime.fromisoformat(body[name]).astimezone(UTC) for name in names if name in body), None)


def oldest_first(entries: list[Entry]) -> list[Entry]:
    """The readings in their order, but by their times where the newest of each characteristic stands first.

    One step back alone says nothing: it is a late reading.
    """
    times: dict[str, list[datetime]] = {}
    for entry in entries:
        if (at := moment_of(entry.body)) is None:
            return entries
        times.setdefault(entry.body["characteristic"], []).append(at)
    pairs = [pair for each in times.values() for pair in pairwise(each)]
    if any(one < two for one, two in pairs) or sum(one > two for one, two in pairs) < STEPS_BACK:
        return entries
    upwards = entries[::-1]  # like times stay in this order
    return sorted(upwards, key=lambda entry: cast("datetime", moment_of(entry.body)))
