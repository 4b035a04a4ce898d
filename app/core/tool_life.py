"""Use of a planned tool life: by parts cut, or by wear life, the sum of the corrections of the tool.

A closed loop takes the wear out of the size and puts it into the offset: the sum of the corrections since the tool was
changed is the wear it has seen, and an edge is worn out when that reaches what it bears (VB max of the insert, as the
corrections show it). Lengths are mm.
"""

from collections.abc import Sequence
from math import floor
from statistics import median
from typing import Literal, NamedTuple

from app.core.decision.limits import nanometres


class LifePlan(NamedTuple):
    """Planned life of an edge; None where nothing is planned.

    parts: parts cut. total: magnitude of the sum of corrections, mm.
    """

    parts: int | None = None
    total: float | None = None


class LifeUse(NamedTuple):
    """Used share of a plan.

    share: of the planned life, 1 is all of it; of the two the greater. left: parts until it is worn out, at the rate of wear
    so far where the sum decides; None without a plan, or while nothing is known of the rate.
    spent: the limit that was reached, `parts` before `total`.
    """

    share: float | None
    left: int | None
    spent: Literal["parts", "total"] | None


def use_of(plan: LifePlan, parts: int, total: float) -> LifeUse:
    """Use of a tool's planned life. parts: cut so far; total: sum of its corrections, mm.

    share = max(parts / planned parts, \\|total\\| / planned total); left = planned parts - parts, or
    (planned total - \\|total\\|) / (\\|total\\| / parts), whichever is less, and not below 0.

    >>> use_of(LifePlan(parts=400), 300, 0.0)
    LifeUse(share=0.75, left=100, spent=None)
    >>> use_of(LifePlan(parts=400, total=0.05), 100, -0.04)
    LifeUse(share=0.8, left=25, spent=None)
    >>> use_of(LifePlan(total=0.05), 120, 0.05).spent
    'total'
    """
    shares: list[float] = []
    lefts: list[int] = []
    spent: Literal["parts", "total"] | None = None
    worn = abs(nanometres(total))
    if plan.total is not None:
        planned = nanometres(plan.total)
        shares.append(worn / planned)
        if worn >= planned:
            spent = "total"
            lefts.append(0)
        elif parts > 0 and worn > 0:
            lefts.append(floor((planned - worn) * parts / worn))
    if plan.parts is not None:
        shares.append(parts / plan.parts)
        lefts.append(max(0, plan.parts - parts))
        if parts >= plan.parts:
            spent = "parts"
    return LifeUse(max(shares, default=None), min(lefts, default=None), spent)


def usual_life(parts: Sequence[int]) -> float | None:
    """The median of the parts that edges before have cut; None before the first has gone out.

    The median, because one edge that chipped after five parts says nothing about how long the others last.

    >>> usual_life([510, 7, 498, 520])
    504.0
    """
    return float(median(parts)) if parts else None
