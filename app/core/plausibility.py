"""A jump that neither wear nor scatter explains: a wrong part, a wrong tool, a chip on the stylus.

Readings of a closed loop jump with every correction, so they are looked at with the corrections taken out again: what
remains is the course that wear and heat would have taken, and that has no jumps. The level is where this course is expected
to go on: an exponentially weighted average with lambda = 1/2 (Roberts 1959), because it must follow wear and heat at once
and need not filter, with one reading weighed against a limit of several standard deviations.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import sqrt
from statistics import fmean, median

from app.core.zones import nanometres

WEIGHT = 0.5  # lambda: of the newest reading in the level
SIGMAS = 6.0  # of the scatter that a plausible jump may have
D4 = 0.954  # median moving range of two readings over their standard deviation (Shewhart's d4 for n = 2)
FEWEST = 10  # readings from which a jump may be suggested


def uncorrected(deviation: float, compensated: float, factor: float) -> float:
    """What the deviation would be without the corrections in effect when the part was cut, mm: D + compensated / factor.

    An offset correction of `a` changes the size by -a / factor, so taking it out adds a / factor.

    >>> uncorrected(0.002, -0.006, factor=-1)
    0.008
    >>> uncorrected(0.002, 0.003, factor=0.5)
    0.008
    """
    return round(deviation + compensated / factor, 9) + 0.0


def is_jump(now: float, level: float | None, allowed: float) -> bool:
    """Whether a reading lies further from the level than can be; ``allowed`` itself can. Without a level nothing is a jump.

    >>> is_jump(0.021, 0.001, allowed=0.02), is_jump(0.0211, 0.001, allowed=0.02), is_jump(5.0, None, allowed=0.02)
    (False, True, False)
    """
    return level is not None and abs(nanometres(now - level)) > nanometres(allowed)


def moved(level: float | None, now: float) -> float:
    """The level after a plausible reading: level + (reading - level) / 2, from the first reading on.

    >>> moved(None, 0.004), moved(0.004, 0.006)
    (0.004, 0.005)
    """
    return now if level is None else level + WEIGHT * (now - level)


def suggested_jump(readings: Sequence[float]) -> float | None:
    """A setting that scatter and wear as they were do not reach, mm; None for fewer than ten readings, or without any.

    readings: the course without corrections (`uncorrected`), oldest first, mm.

    6 sigma sqrt(1 + lambda / (2 - lambda)) + \\|w\\| / lambda with lambda = 1/2. sigma: the median moving range over d4 = 0.954,
    which one chip among the readings does not move; the root: the level scatters, too; the rest: how far the level lags behind
    a wear of w per part, the step between the means of the first and the second half. Rounded up to a tenth of a micrometre.

    >>> suggested_jump([0.0, 0.001] * 8)
    0.0073
    """
    if len(readings) < FEWEST:
        return None
    sigma = median(abs(later - earlier) for earlier, later in pairwise(readings)) / D4
    half = len(readings) // 2
    wear = (fmean(readings[-half:]) - fmean(readings[:half])) / (len(readings) - half)
    allowed = SIGMAS * sigma * sqrt(1 + WEIGHT / (2 - WEIGHT)) + abs(wear) / WEIGHT
    return -(-nanometres(allowed) // 100) / 10_000 or None
