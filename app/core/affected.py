"""Parts that an alarm concerns: those since the last one that was certainly good, to the next one that is.

A part is *certainly good* when it was measured, every measurement of it that counts lies in tolerance, by the guard of the
measuring uncertainty where one is given, with the tool that is asked about, not changed since, and no fault of the probe casts
doubt on it (`verdict_of`). Between two parts of one edge that are certainly good nothing is doubted; so a part is affected when no
certainly good one lies between it and a reading behind the alarm, in the order of cutting, on the same edge. What is itself
certainly good is never affected.

Parts without a reading are known by their names alone: by the numbers missing between two of them (`names_between`).
"""

import re
from collections.abc import Hashable, Iterable, Sequence
from itertools import groupby
from typing import NamedTuple

from app.core.decision.limits import nanometres
from app.core.natural_limit import Tolerance

MOST_NAMED = 200  # parts between two readings that are named one by one
_NUMBERED = re.compile(r"(.*?)([0-9]{1,15})")


class Cut(NamedTuple):
    """One reading. at: when its part was cut, or was measured where that is not known; any numbers of one clock.

    number: of the reading, by arrival. life: the edge that cut it. good: its verdict, None where it says nothing of the part.
    behind: whether it is behind the alarm. part, order: their names.
    """

    number: int
    at: float
    life: Hashable
    good: bool | None
    behind: bool = False
    part: str | None = None
    order: str | None = None


class AffectedPart(NamedTuple):
    """A part by its readings, in the order of their arrival. again: the number of a later reading that bears the same name."""

    numbers: tuple[int, ...]
    part: str | None = None
    order: str | None = None
    again: int | None = None


class Stretch(NamedTuple):
    """Affected parts of one edge in the order of cutting, between two that are certainly good.

    since, until: readings of those two; None where there is none on this edge, yet.
    """

    life: Hashable
    since: int | None
    parts: tuple[AffectedPart, ...]
    until: int | None


class _Part(NamedTuple):
    cuts: tuple[Cut, ...]
    good: bool
    witness: bool

    @property
    def numbers(self) -> tuple[int, ...]:
        return tuple(sorted(cut.number for cut in self.cuts if cut.number))

    @property
    def behind(self) -> bool:
        return any(cut.behind for cut in self.cuts)


def verdict_of(
    deviation: float,
    tolerance: Tolerance,
    guard: float = 0.0,
    *,
    doubted: bool = False,
    rejected: bool = False,
    by_hand: bool | None = None,
) -> bool | None:
    """The verdict of a reading on its part: good, not good, or None where it says nothing. Lengths in mm.

    guard: expanded measuring uncertainty, by which the tolerance is narrowed. doubted: excluded, or under a fault of the
    probe. rejected: by the acceptance n of m. by_hand: what a person found on the part, which counts before the probe's value.

    >>> limits = Tolerance(-0.008, 0.008)
    >>> verdict_of(0.008, limits), verdict_of(0.008, limits, 0.001), verdict_of(0.0, limits, doubted=True)
    (True, False, None)
    >>> verdict_of(0.0, limits, by_hand=False), verdict_of(0.0, limits, doubted=True, by_hand=True)
    (False, True)
    """
    if by_hand is not None:
        return by_hand
    if doubted:
        return None
    return not rejected and in_tolerance(deviation, tolerance, guard)


def in_tolerance(deviation: float, tolerance: Tolerance, guard: float = 0.0) -> bool:
    """Tell if a deviation (mm) keeps the guard (mm) from each limit; on the border it does."""
    return nanometres(tolerance.room(deviation)) >= nanometres(guard)


def stretches(cuts: Iterable[Cut]) -> list[Stretch]:
    """The affected parts of an alarm, edge by edge. A cut with the number 0 is a moment of the alarm without a reading.

    Readings of one name that follow each other are of one part. One that comes again later on the same edge may be the old part
    measured again, so it is no evidence about its neighbours.

    >>> cuts = [Cut(1, 1, "a", True), Cut(2, 2, "a", None), Cut(3, 3, "a", False, True), Cut(4, 4, "a", True)]
    >>> [(each.since, [part.numbers for part in each.parts], each.until) for each in stretches(cuts)]
    [(1, [(2,), (3,)], 4)]
    """
    lives: dict[Hashable, list[Cut]] = {}
    for cut in sorted(cuts, key=lambda each: (each.at, each.number)):
        lives.setdefault(cut.life, []).append(cut)
    found = []
    for life, of_life in lives.items():
        if any(cut.behind for cut in of_life):
            found += _of_life(life, _parts(of_life))
    return found


def _parts(cuts: Sequence[Cut]) -> list[_Part]:
    parts: list[_Part] = []
    seen: set[tuple[str | None, str]] = set()

    def name_of(cut: Cut) -> Hashable:
        return (cut.order, cut.part) if cut.part is not None else (None, None, cut.number)

    for _name, group in groupby(cuts, name_of):
        own = tuple(group)
        verdicts = [cut.good for cut in own if cut.good is not None]
        good = bool(verdicts) and all(verdicts)
        part = own[0].part
        again = part is not None and (own[0].order, part) in seen
        if part is not None:
            seen.add((own[0].order, part))
        parts.append(_Part(own, good, good and not again))
    return parts


def _of_life(life: Hashable, parts: Sequence[_Part]) -> list[Stretch]:
    later: dict[tuple[str | None, str], int] = {}
    again: list[int | None] = []
    for part in reversed(parts):
        name = part.cuts[0].part
        key = (part.cuts[0].order, name) if name is not None else None
        again.append(later.get(key) if key else None)
        if key and part.numbers:
            later[key] = part.numbers[-1]
    again.reverse()
    found, since, begin = [], None, 0
    ends = [*(place for place, part in enumerate(parts) if part.witness), len(parts)]
    for end in ends:
        between = range(begin, end)
        if any(parts[at].behind and not parts[at].good for at in between):
            listed = tuple(
                AffectedPart(parts[at].numbers, parts[at].cuts[0].part, parts[at].cuts[0].order, again[at])
                for at in between
                if not parts[at].good and parts[at].numbers
            )
            until = parts[end].numbers[-1] if end < len(parts) else None
            found.append(Stretch(life, since, listed, until))
        if end < len(parts):
            since, begin = parts[end].numbers[-1], end + 1
    return found


def names_between(before: str | None, after: str | None) -> tuple[str, ...] | int | None:
    """Names of the parts between two, by the numbers that they end in; their count where they are very many; None where the
    names do not tell.

    >>> names_between("SN-0098", "SN-0101"), names_between("7", "8"), names_between("A7", "B9"), names_between(None, "8")
    (('SN-0099', 'SN-0100'), (), None, None)
    >>> names_between("P1", "P1001"), names_between("P9", "P2")
    (999, None)
    """
    first, last = (_NUMBERED.fullmatch(name) if name is not None else None for name in (before, after))
    if first is None or last is None or first[1] != last[1]:
        return None
    low, high, width = int(first[2]), int(last[2]), len(first[2])
    if high <= low:
        return None
    count = high - low - 1
    if count > MOST_NAMED:
        return count
    return tuple(f"{first[1]}{number:0{width}}" for number in range(low + 1, high))
