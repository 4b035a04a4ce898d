"""Over-correction (hunting) of a loop: the corrections that scatter alone causes, and settings that prevent them.

A correction that answers to scatter moves a process that was right, and the next one moves it back: the offset hunts, and
parts scatter more than with no loop at all (Deming's funnel, rule 2; Grubbs 1954 and MacGregor 1988 on over-adjustment). The mark of hunting
are corrections that take the one before back. Wear asks for corrections of one sign.

**What scatter alone causes** (`corrections_by_scatter`) is worked out for the rules as they are (`app.core.decision.decide`), not by rules
of thumb. Readings are decided on the deviation with every correction issued so far counted in, so the pipeline drops out::

    y = mu + e,    e normal with the scatter's standard deviation,
    y <= R33 in size: M follows; <= R34: M follows, and if |M| > R33 M is corrected; beyond: y is corrected,
    a correction by s makes mu into mu - s and M into 0.

From correction to correction mu is a Markov chain; between two of them M is one. Both are solved on a grid of cells
(Brook and Evans 1972, Biometrika 59, 539). It depends on R33 / scatter, R34 / scatter and k alone.

**The test**: reversals in a run of readings against `TOLERABLE` of them. Reversals come in pairs, so their number is
taken as a negative binomial of `DISPERSION` times the variance of a Poisson one, which tests hold against simulation. Lengths are mm.
"""

from collections.abc import Callable, Sequence
from enum import StrEnum
from functools import lru_cache
from math import ceil, inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, ndtr

Values = NDArray[np.float64]

LONGEST, FEWEST = 200, 20  # readings that are looked at
TOLERABLE = 0.1  # reversals per reading: more of them is hunting
DISPERSION = 1.5  # simulated: 0.75 to 1.45, the more the less M is averaged
ALARM = 0.001  # so rarely TOLERABLE hunting alone looks like more of it
GOAL = 0.01  # of the readings scatter alone may correct with what is suggested
LARGEST_K = 10.0
ROUND_K, ROUND_R33 = 0.5, 0.0001  # suggestions are made in such steps


class LoopVerdict(StrEnum):
    """Verdict on a loop."""

    UNKNOWN = "unknown"  # too few readings
    QUIET = "quiet"
    HUNTING = "hunting"  # it runs after its scatter
    SWINGING = "swinging"  # more than its scatter explains


class ScatterCorrections(NamedTuple):
    """Corrections that scatter alone causes: all per reading, those per reading that reverse the previous one, and the
    mean size error that one removes (in standard deviations of the scatter, or mm).

    excess: by what share the parts scatter more than with no correction at all.
    """

    corrections: float
    reversals: float
    size: float
    excess: float


class Settings(NamedTuple):
    """Settings of a loop, mm. memory: whether there is a running average (R11); without, M is 0 before each reading."""

    zero_range: float
    averaging_limit: float
    weighting_factor: float
    memory: bool = True


class Remedy(NamedTuple):
    """The least change of one setting for which scatter alone corrects no more than `GOAL`; None where there is none.

    averaging_limit: where single readings beyond R34 are the trouble and neither helps by itself, the least R34, and the
    R33 to go with it.
    floor: R33 is not below this, mm: the position uncertainty of the signal path.
    """

    weighting_factor: float | None
    zero_range: float | None
    averaging_limit: float | None
    floor: float


class Hunting(NamedTuple):
    """The verdict on a run of readings. Sizes are size errors removed, mm; expected: by scatter alone, over the run."""

    state: LoopVerdict
    readings: int
    scatter: float
    corrections: int
    reversals: int
    mean_size: float | None
    expected: ScatterCorrections | None
    probability: float
    remedy: Remedy | None


def corrections_by_scatter(settings: Settings, scatter: float) -> ScatterCorrections:
    """Corrections that scatter of this standard deviation (mm) alone causes with these settings; `size` in mm.

    >>> found = corrections_by_scatter(Settings(zero_range=0.0, averaging_limit=1.0, weighting_factor=1), scatter=0.001)
    >>> round(found.corrections, 3), round(found.reversals, 2), round(found.excess, 1)  # after every reading: y_i = e_i - e_i-1
    (1.0, 0.67, 0.4)
    """
    if scatter <= 0:
        return ScatterCorrections(0.0, 0.0, 0.0, 0.0)
    memory = settings.memory and settings.weighting_factor > 1
    expected = _corrections_by_scatter(
        round(min(settings.zero_range / scatter, FARTHEST - 0.5), 3),
        round(min(settings.averaging_limit / scatter, FARTHEST), 3),
        round(settings.weighting_factor, 3),
        memory,
    )
    return expected._replace(size=expected.size * scatter)


def least_remedy(settings: Settings, scatter: float, floor: float = 0.0) -> Remedy:
    """The least k at this R33, and the least R33 at this k, that stop over-correction (see `Remedy`).

    >>> least_remedy(Settings(0.001, 0.01, 1.0), 0.001).zero_range
    0.0037
    """
    k = None
    if settings.weighting_factor < LARGEST_K:
        k = _lowest(
            lambda step: (
                corrections_by_scatter(settings._replace(weighting_factor=step * ROUND_K), scatter).corrections <= GOAL
            ),
            ceil(settings.weighting_factor / ROUND_K),
            int(LARGEST_K / ROUND_K),
        )
    r33, r34 = _least_r33(settings, scatter, floor), None
    if k is None and r33 is None:
        first = ceil(settings.averaging_limit / ROUND_R33)
        wider = _lowest(
            lambda step: _least_r33(settings._replace(averaging_limit=step * ROUND_R33), scatter, floor) is not None,
            first,
            first + ceil((floor + 6 * scatter) / ROUND_R33),
        )
        if wider is not None:
            r34 = round(wider * ROUND_R33, 9)
            r33 = _least_r33(settings._replace(averaging_limit=r34), scatter, floor)
    return Remedy(None if k is None else k * ROUND_K, r33, r34, floor)


def _least_r33(settings: Settings, scatter: float, floor: float) -> float | None:
    """The least R33 below R34 with which scatter alone corrects no more than `GOAL`, mm."""
    step_count = _lowest(
        lambda step: (
            corrections_by_scatter(settings._replace(zero_range=step * ROUND_R33), scatter).corrections <= GOAL
        ),
        ceil(max(floor, settings.zero_range) / ROUND_R33 - 1e-6),
        ceil(settings.averaging_limit / ROUND_R33 - 1e-6) - 1,
    )
    return None if step_count is None else round(step_count * ROUND_R33, 9)


def judge(sizes: Sequence[float], readings: int, scatter: float, settings: Settings, *, floor: float = 0.0) -> Hunting:
    """Judge if a loop over-corrects. sizes: the size errors (mm) that the corrections of these readings remove, in order.

    >>> swing = judge([0.002, -0.003] * 20, 60, 0.001, Settings(0.0, 0.005, 1.0))
    >>> swing.state, swing.reversals, swing.remedy.zero_range
    (<LoopVerdict.HUNTING: 'hunting'>, 39, 0.0037)
    """
    signs = np.sign([size for size in sizes if size])
    reversals = int((signs[1:] != signs[:-1]).sum())
    mean_size = float(np.abs(sizes).mean()) if len(sizes) else None
    if readings < FEWEST or scatter <= 0:
        return Hunting(LoopVerdict.UNKNOWN, readings, scatter, len(sizes), reversals, mean_size, None, 1.0, None)
    expected = corrections_by_scatter(settings, scatter)
    probability = _at_least(reversals, TOLERABLE * readings)
    state, remedy = LoopVerdict.QUIET, None
    if probability < ALARM:
        unexplained = _at_least(reversals, expected.reversals * readings) < ALARM
        state = LoopVerdict.SWINGING if unexplained else LoopVerdict.HUNTING
        remedy = None if unexplained else least_remedy(settings, scatter, floor)
    return Hunting(state, readings, scatter, len(sizes), reversals, mean_size, expected, probability, remedy)


def _at_least(count: int, mean: float) -> float:
    """The probability of N or more, of a negative binomial with this mean and `DISPERSION` times its variance.

    With n = mean / (`DISPERSION` - 1) and p = 1 / `DISPERSION` it is the incomplete beta function I(1 - p; count, n).
    """
    if count <= 0:
        return 1.0
    return float(betainc(count, max(mean, 1e-9) / (DISPERSION - 1), 1 - 1 / DISPERSION))


def _lowest(holds: Callable[[int], bool], low: int, high: int) -> int | None:
    """The lowest number from low to high for which it holds, which it does from there on; None if it holds for none."""
    if low > high or not holds(high):
        return None
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle + 1, high)
    return low


CELLS = 21  # of M, within R33
PLACES = 81  # of mu
REACH = 5.0  # standard deviations that mu may lie off
FARTHEST = 6.0  # standard deviations: scatter reaches a limit that lies further out once in a billion readings


@lru_cache(maxsize=4096)
def _corrections_by_scatter(r33: float, r34: float, k: float, memory: bool) -> ScatterCorrections:
    """`corrections_by_scatter`, everything in standard deviations of the scatter."""
    edges = np.linspace(-REACH, REACH, PLACES + 1)
    place = (edges[1:] + edges[:-1]) / 2  # of mu
    if memory and r33 > 0:
        bounds = np.linspace(-r33, r33, CELLS + 1)
        cell = (bounds[1:] + bounds[:-1]) / 2  # of M
    else:  # M is 0 before every reading
        bounds, cell = np.array([-r33, r33]), np.zeros(1)

    # No correction: M moves from one cell into another, the reading within R34. Readings within R33 never correct.
    mu, before = place[:, None, None], cell[None, :, None]
    low, high = (before + k * (bound[None, None, :] - before) for bound in (bounds[:-1], bounds[1:]))
    stay = _between(np.maximum(low, -r34), np.minimum(high, r34), mu)
    # How often M is in each cell until a correction is made, beginning with 0.
    begin = np.zeros(len(cell))
    begin[len(cell) // 2] = 1.0
    system = np.eye(len(cell))[None] - np.swapaxes(stay, 1, 2)
    visits = np.linalg.solve(system, np.broadcast_to(begin[:, None], (PLACES, len(cell), 1)))[:, :, 0]
    waiting = visits.sum(axis=1)

    # A correction by s takes mu to mu - s: where to, for both signs of s.
    ends = np.concatenate(([-inf], edges[1:-1], [inf]))
    smallest, largest = place[:, None] - ends[None, 1:], place[:, None] - ends[None, :-1]
    leave = []
    for positive in (False, True):
        inner = (np.maximum(smallest, r33), largest) if positive else (smallest, np.minimum(largest, -r33))
        low, high = (before + k * (side[:, None, :] - before) for side in inner)
        averaged = _between(np.maximum(low, -r34), np.minimum(high, r34), mu)
        outer = (np.maximum(smallest, r34), largest) if positive else (smallest, np.minimum(largest, -r34))
        full = _between(outer[0], outer[1], place[:, None])
        leave.append(np.einsum("mc,mcd->md", visits, averaged) + waiting[:, None] * full)
    down, up = leave
    chain = down + up
    chain /= chain.sum(axis=1, keepdims=True)
    often = _stationary(chain)
    up_next = up.sum(axis=1) / (up + down).sum(axis=1)
    after_up, after_down = (
        often @ (up / (up + down).sum(axis=1, keepdims=True)),
        often @ (down / (up + down).sum(axis=1, keepdims=True)),
    )
    readings = float(often @ waiting)
    size = float(often @ (chain * np.abs(place[:, None] - place[None, :])).sum(axis=1))
    reversals = float(after_up @ (1 - up_next) + after_down @ up_next)
    variance = float((often * waiting) @ place**2) / readings
    return ScatterCorrections(1 / readings, reversals / readings, size, sqrt(1 + variance) - 1)


def _between(low: Values, high: Values, mu: Values) -> Values:
    """The probability that a reading lies from low to high, 0 where high is below low."""
    return np.asarray(np.maximum(0.0, ndtr(high - mu) - ndtr(low - mu)))


def _stationary(chain: Values) -> Values:
    """Stationary distribution of a Markov chain: the long-run share of each state."""
    count = len(chain)
    system = np.vstack((chain.T - np.eye(count), np.ones(count)))
    shares, *_rest = np.linalg.lstsq(system, np.concatenate((np.zeros(count), [1.0])), rcond=None)
    often = np.maximum(shares, 0.0)
    return np.asarray(often / often.sum())
