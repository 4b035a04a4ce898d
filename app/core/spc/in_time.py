"""Behaviour of a process in time: the time-dependent distribution models A1 to D of ISO 22514-2, chosen by tests.

Readings are looked at in subgroups of neighbours, because what changes with time changes between them, not inside. The
eight models say whether the mean stays (constant), wanders (random) or is driven (systematic: wear, saw-tooth of corrections),
and whether the scatter stays::

    model  mean                     scatter    short-term      all readings
    A1     constant                 constant   normal          normal
    A2     constant                 constant   one mode        one mode
    B      constant                 changes    normal          one mode
    C1     random                   constant   normal          normal
    C2     random                   constant   normal          one mode
    C3     systematic               constant   any shape       any shape
    C4     systematic and random    constant   any shape       any shape
    D      moves                    changes    any shape       any shape

Tests, each at 1 % (`ALPHA`): the mean moves if one-way analysis of variance between the subgroups says so; it moves
systematically if their means follow a line (F), or each other (von Neumann's ratio); beside the line it moves at random as well
if the line leaves more than scatter explains (F for lack of fit; then the line is tested against what it leaves). The scatter changes if the Brown-Forsythe test over
blocks of differences of neighbours says so: differences know nothing of a moving mean; the mean is then tested with each
block divided by its own scatter. Normal or not: `normality`.

Sources: ISO 22514-2:2017, table 1; Draper and Smith, Applied regression analysis (1998), section 2.1 (lack of fit); M. B.
Brown and A. B. Forsythe, J. Am. Stat. Assoc. 69 (1974) 364; J. von Neumann, Ann. Math. Stat. 12 (1941) 367, with the
moments of L. C. Young, ibid. 293.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import nan, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtrc, ndtr

from app.core.spc.capability import looks_normal
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.variation import varies

ALPHA = 0.01
SIZE = 5
"""Readings in a subgroup (ISO 22514-2 and its relatives take 5)."""
FEWEST = 50
"""Ten subgroups; with fewer it cannot be determined whether something moves."""
ENOUGH = 125
"""Twenty-five subgroups of five are asked for."""
MOST_SUBGROUPS = 200
"""Of longer runs this many subgroups, evenly spread: with more of them what does not matter becomes significant."""
BLOCKS = 10
"""In this many pieces of time the scatter is compared."""


class Model(StrEnum):
    """The time-dependent distribution models of ISO 22514-2."""

    A1 = "A1"
    A2 = "A2"
    B = "B"
    C1 = "C1"
    C2 = "C2"
    C3 = "C3"
    C4 = "C4"
    D = "D"

    @property
    def steady(self) -> bool:
        """Mean and scatter stay: only then is there a capability (Cp, Cpk) beside the performance (Pp, Ppk)."""
        return self in {Model.A1, Model.A2}

    @property
    def normal(self) -> bool:
        """All readings together are normal: 6 s holds 99.73 % of them; of the others the percentiles do."""
        return self in {Model.A1, Model.C1}


class Location(StrEnum):
    """Behaviour of the mean."""

    CONSTANT = "constant"
    RANDOM = "random"
    SYSTEMATIC = "systematic"
    BOTH = "both"


class Test(NamedTuple):
    """A statistic with its p-value, and the degrees of freedom of an F test (0 where it is none)."""

    statistic: float
    p_value: float
    freedom: int = 0
    freedom_error: int = 0

    @property
    def significant(self) -> bool:
        """True if chance no longer explains it."""
        return self.p_value < ALPHA


@dataclass(frozen=True, slots=True)
class InTime:
    """The model with what it was chosen by.

    slope: of the line through the subgroup means, per reading. normal_within: of the readings less their subgroup's mean;
    normal_overall: of all. share_between: share of the variance that lies between the subgroups. spread: longer runs were
    looked at in `subgroups` subgroups evenly spread. few: less than ISO 22514-2 asks for.
    """

    model: Model
    location: Location
    scatter_changes: bool
    normal_within: bool
    normal_overall: bool
    readings: int
    subgroups: int
    size: int
    share_between: float
    slope: float
    between: Test
    line: Test
    beside_line: Test
    successive: Test
    scatter: Test
    spread: bool
    few: bool


def in_time(values: ArrayLike) -> InTime:
    """Choose the model. Raises `Refused` for fewer than 50 readings, or readings without variation.

    >>> found = in_time(np.sin(np.arange(100.0) ** 2) + np.arange(100) / 20)
    >>> found.model.value, found.location.value, found.scatter_changes
    ('C3', 'systematic', False)
    """
    x = checked(values, at_least=FEWEST)
    many = len(x) // SIZE
    if many > MOST_SUBGROUPS:
        starts = np.linspace(0, len(x) - SIZE, MOST_SUBGROUPS).round().astype(np.int64)
    else:
        starts = np.arange(many) * SIZE
    groups = x[starts[:, None] + np.arange(SIZE)]
    within = groups - groups.mean(axis=1, keepdims=True)
    if not varies(float(within.std()), x):
        raise Refused(Reason.NO_VARIATION)
    parts = decompose(list(groups), starts + (SIZE - 1) / 2)
    scatter = brown_forsythe(_differences(groups))
    even = _evened(groups) if scatter.significant else groups  # unequal scatter alone would make means look moving
    tested = decompose(list(even), starts + (SIZE - 1) / 2)
    following = successive(even.mean(axis=1))
    line = tested.line_over_rest if tested.beside_line.significant else tested.line
    location = _location(tested, line, following)
    # Residuals of subgroups of five are a little less than normal readings scatter; that is no matter of shape.
    normal_within, normal_overall = looks_normal(within.reshape(-1)), looks_normal(x)
    spread_within = parts.within / (groups.size - len(groups))
    spread_between = max(0.0, (parts.between / (len(groups) - 1) - spread_within) / SIZE)
    return InTime(
        model=_model(location, scatter.significant, normal_within, normal_overall),
        location=location,
        scatter_changes=scatter.significant,
        normal_within=normal_within,
        normal_overall=normal_overall,
        readings=len(x),
        subgroups=len(groups),
        size=SIZE,
        share_between=spread_between / (spread_between + spread_within),
        slope=parts.slope,
        between=tested.means,
        line=line,
        beside_line=tested.beside_line,
        successive=following,
        scatter=scatter,
        spread=many > MOST_SUBGROUPS,
        few=len(x) < ENOUGH,
    )


class Parts(NamedTuple):
    """Sums of squares between groups, of the line through their means, beside it, and within groups, with their tests."""

    between: float
    regression: float
    lack_of_fit: float
    within: float
    slope: float
    means: Test
    line: Test
    beside_line: Test
    line_over_rest: Test


def decompose(groups: Sequence[ArrayLike], at: ArrayLike) -> Parts:
    """One-way analysis of variance, the sum of squares between taken apart into a line over `at` and what lies beside it.

    F = (SS/df) / (SS_within/df_within): between with k - 1, line with 1, lack of fit with k - 2 degrees of freedom. The line
    is tested against lack of fit as well: means that wander follow some line more than scatter inside allows.

    >>> parts = decompose([[1.0, 2.0], [2.0, 3.0], [6.0, 7.0]], [0, 1, 2])
    >>> parts.between, parts.regression, parts.lack_of_fit, parts.within, parts.slope
    (28.0, 25.0, 3.0, 1.5, 2.5)
    """
    arrays = [np.asarray(group, dtype=np.float64) for group in groups]
    sizes = np.array([len(group) for group in arrays])
    k, n = len(sizes), int(sizes.sum())
    if k < 3 or n <= k or not sizes.all():
        raise Refused(Reason.TOO_FEW_SUBGROUPS, have=int((sizes > 0).sum()), needed=3)
    values, first = checked(np.concatenate(arrays)), np.cumsum(sizes) - sizes
    # Around the middle of all, so that a large common offset costs no digits.
    values = values - float(values.mean())
    means = np.add.reduceat(values, first) / sizes
    left = values - np.repeat(means, sizes)
    within = float(left @ left)
    means -= float(sizes @ means) / n
    between = float(sizes @ means**2)
    reach = float(np.abs(values).max())
    places = np.asarray(at, dtype=np.float64)
    off = places - float(sizes @ places) / n
    squares = float(sizes @ off**2)
    slope = float(sizes @ (off * means)) / squares if squares > 0 else 0.0
    regression = min(between, slope * slope * squares)
    return Parts(
        between=between,
        regression=regression,
        lack_of_fit=between - regression,
        within=within,
        slope=slope,
        means=f_test(between, k - 1, within, n - k, reach),
        line=f_test(regression, 1, within, n - k, reach),
        beside_line=f_test(between - regression, k - 2, within, n - k, reach),
        line_over_rest=f_test(regression, 1, between - regression, k - 2, reach),
    )


def f_test(squares: float, freedom: int, error: float, freedom_error: int, reach: float) -> Test:
    """F of two sums of squares with their degrees of freedom; not a number without scatter. reach: the largest of the values."""
    if freedom <= 0 or not (error > 0 and varies(sqrt(error / freedom_error), reach)):
        return Test(nan, nan, freedom, freedom_error)
    ratio = (squares / freedom) / (error / freedom_error)
    return Test(ratio, float(fdtrc(freedom, freedom_error, ratio)), freedom, freedom_error)


def brown_forsythe(groups: Sequence[ArrayLike]) -> Test:
    """Test if groups have the same standard deviation: analysis of variance of the distances from the median of each group.

    >>> test = brown_forsythe([[1.0, 2.0, 3.0, 4.0], [1.0, 5.0, 9.0, 13.0]])
    >>> round(test.statistic, 4), (test.freedom, test.freedom_error)
    (6.3529, (1, 6))
    """
    arrays = [checked(group) for group in groups]
    away = [np.abs(group - np.median(group)) for group in arrays]
    n, k = sum(len(group) for group in away), len(away)
    if k < 2 or n <= k:
        raise Refused(Reason.TOO_FEW_SUBGROUPS, have=k, needed=2)
    grand = float(sum(group.sum() for group in away)) / n
    between = sum(len(group) * (float(group.mean()) - grand) ** 2 for group in away)
    within = sum(float(((group - group.mean()) ** 2).sum()) for group in away)
    return f_test(between, k - 1, within, n - k, max(float(np.abs(group).max()) for group in arrays))


def successive(values: ArrayLike) -> Test:
    """Test if values follow each other: von Neumann's C = 1 - sum (x_i+1 - x_i)^2 / (2 sum (x - mean)^2), 0 by chance.

    Its standard error is sqrt((n - 2)/(n^2 - 1)) (Young 1941); one-sided: only values that are near to their neighbours
    count, as those of a drift or a saw-tooth are.

    >>> test = successive([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    >>> round(test.statistic, 4), round(test.p_value, 4)
    (0.8571, 0.0056)
    """
    x = checked(values, at_least=4)
    left = x - x.mean()
    squares = float(left @ left)
    if not varies(sqrt(squares / len(x)), x):
        return Test(nan, nan)
    n, steps = len(x), np.diff(x)
    c = 1 - float(steps @ steps) / (2 * squares)
    return Test(c, float(ndtr(-c / sqrt((n - 2) / (n * n - 1)))))


def _differences(groups: Floats) -> list[Floats]:
    """Differences of neighbours that share no reading, in blocks of time."""
    pairs = groups[:, 1 : SIZE - SIZE % 2 : 2] - groups[:, 0 : SIZE - SIZE % 2 : 2]
    return [block.reshape(-1) for block in np.array_split(pairs, min(BLOCKS, len(groups) // 2))]


def _evened(groups: Floats) -> Floats:
    """Distances from the mean of all, weighted by scatter, each block of time divided by its own scatter."""
    blocks = np.array_split(groups, min(BLOCKS, len(groups) // 2))
    least = 0.01 * float(groups.std())  # a block whose readings are rounded to one value weighs no more than that
    scale = np.repeat([max(sqrt(float(b.var(axis=1, ddof=1).mean())), least) for b in blocks], [len(b) for b in blocks])
    weights = scale**-2.0
    mean = float(weights @ groups.mean(axis=1)) / float(weights.sum())
    return np.asarray((groups - mean) / scale[:, None])


def _location(parts: Parts, line: Test, following: Test) -> Location:
    """Behaviour of the mean. A line is seen before the analysis of variance sees it, so it counts by itself."""
    if not (parts.means.significant or line.significant):
        return Location.CONSTANT
    if not (line.significant or following.significant):
        return Location.RANDOM
    return Location.BOTH if parts.beside_line.significant else Location.SYSTEMATIC


def _model(location: Location, scatter_changes: bool, normal_within: bool, normal_overall: bool) -> Model:
    if scatter_changes:
        return Model.B if location is Location.CONSTANT else Model.D
    match location:
        case Location.CONSTANT:
            return Model.A1 if normal_overall and normal_within else Model.A2
        case Location.RANDOM:
            return Model.C1 if normal_overall else Model.C2
        case Location.SYSTEMATIC:
            return Model.C3
        case Location.BOTH:
            return Model.C4
