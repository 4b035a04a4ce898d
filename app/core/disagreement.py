"""Two characteristics of one tool that ask for opposite corrections: one offset cannot bring both to their targets.

Each reading is decided with all corrections of its tool counted in, so the characteristic that is measured last takes back what the
one before has just asked for, part after part. Each of them corrects in one direction only, so neither seems to hunt
(`app.core.hunting`), and the first stays as far off as they disagree. Causes: a target or an empirical value that is wrong, a factor
of the wrong sign, another tool or edge that cuts one of them.

**The test**: in the newest corrections of the tool each of the two has asked `FEWEST` times or more, always in its own direction; they
came in turn; and each mean is `SURE` standard errors from 0 (a t statistic). Wear asks for corrections of one sign. Scatter asks for
either from both, and an offset that hunts is taken back by whichever is measured next: 2 of 48,000 simulated lives are taken for a
disagreement (tests/core/test_disagreement.py). Lengths are mm of offset.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import sqrt
from statistics import fmean, stdev
from typing import NamedTuple

LONGEST = 30  # corrections of a tool that are looked at
FEWEST = 6  # of each of the two
SURE = 5.0
LEAST_SPREAD = 1e-6  # mm: corrections that are all alike are known no better than this


class Asked(NamedTuple):
    """A correction: the characteristic that asked for it, and its amount, mm of offset."""

    characteristic: int
    amount: float


class Disagreement(NamedTuple):
    """The two characteristics, that with the negative amounts first; what each asks for on average (mm of offset); how often."""

    down: int
    up: int
    mean_down: float
    mean_up: float
    times: int


def disagreement(asked: Sequence[Asked]) -> Disagreement | None:
    """The two characteristics that take each other's corrections back, or None. asked: the newest corrections of a tool, in order.

    >>> disagreement([Asked(1, -0.02), Asked(2, 0.02)] * 6)
    Disagreement(down=1, up=2, mean_down=-0.02, mean_up=0.02, times=6)
    >>> disagreement([Asked(1, -0.004), Asked(2, -0.002)] * 6) is None
    True
    """
    amounts: dict[int, list[float]] = {}
    for characteristic, amount in asked[-LONGEST:]:
        amounts.setdefault(characteristic, []).append(amount)
    sure = {each: fmean(of) for each, of in amounts.items() if len(of) >= FEWEST and _one_direction(of)}
    down, up = min(sure, key=sure.__getitem__, default=0), max(sure, key=sure.__getitem__, default=0)
    if not sure or not sure[down] < 0 < sure[up]:
        return None
    of_both = [each.characteristic for each in asked[-LONGEST:] if each.characteristic in {down, up}]
    turns = sum(one != other for one, other in pairwise(of_both))
    if turns < 2 * FEWEST - 1:
        return None
    return Disagreement(down, up, sure[down], sure[up], min(len(amounts[down]), len(amounts[up])))


def _one_direction(amounts: Sequence[float]) -> bool:
    """Tell if all have one sign, and their mean is surely not 0."""
    if min(amounts) < 0 < max(amounts):
        return False
    return abs(fmean(amounts)) > SURE * max(stdev(amounts), LEAST_SPREAD) / sqrt(len(amounts))
