"""Capability by a fitted distribution: which one fits readings that are not normal, how well, and the index that follows.

A distribution is taken if Anderson and Darling's test does not reject it (p >= `FITS`), and of those that it does not reject the
one with the smallest Bayesian information criterion (Schwarz 1978), -2 ln L + k ln n: a parameter more has to pay for itself.
Its percentiles take the place of -3 sigma, the middle and +3 sigma (ISO 22514-2, ISO 22514-4).

Nothing here is simulated, so that a number is the same each time. p of A^2 for estimated parameters: A^2 is a weighted sum of
chi-squares, its weights the eigenvalues of (min(u, v) - u v - psi(u)' I^-1 psi(v)) / sqrt(u(1 - u) v(1 - v)), with psi the
derivatives of the distribution function and I the information of a reading (M. A. Stephens, Asymptotic results for
goodness-of-fit statistics with unknown parameters, Ann. Stat. 4 (1976)); the sum by three moments (Buckley and Eagleson 1988).
Interval of the index: the delta method on its logarithm, with the same information, over all distributions that fit as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import exp, log, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaincc, ndtr, ndtri

from app.core.spc.capability import ABOVE, BELOW, ENOUGH_READINGS, Fallout, Index, Limits, observed_ppm, of_percentiles
from app.core.spc.distributions import DISTRIBUTIONS, Family, quantiles
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.resolution import must_resolve

FITS = 0.01
AS_GOOD = 3.0
"""Difference of the criterion up to which the readings hardly tell two distributions apart: odds below 5 to 1 (Kass and Raftery 1995)."""
MOST_FITTED = 5000
"""Of more readings this many, evenly taken, as for the test of normality."""
_Z, _WEIGHTS = np.polynomial.legendre.leggauss(160)
_Z = 5.5 * _Z
_U = ndtr(_Z)
_WEIGHTS = 5.5 * _WEIGHTS * np.exp(-_Z * _Z / 2) / sqrt(2 * np.pi)
"""Shares of a distribution with their weights, dense in both tails."""
_STEP = 1e-4
"""Of a parameter, for derivatives by differences."""


@dataclass(frozen=True, slots=True)
class Fit:
    """One distribution fitted to readings: its parameters, A^2 with p, and the information criterion (smaller is better)."""

    family: Family
    parameters: tuple[float, ...]
    statistic: float
    p_value: float
    criterion: float

    @property
    def fits(self) -> bool:
        """True if the test does not reject it."""
        return self.p_value >= FITS

    @property
    def named(self) -> dict[str, float]:
        """Parameters by name, lengths in the unit of the readings."""
        return dict(zip(DISTRIBUTIONS[self.family].parameters, self.parameters, strict=True))


@dataclass(frozen=True, slots=True)
class Fitted:
    """Pp and Ppk by the distribution that fits best.

    tried: every distribution that was asked, the best criterion first. beats_normal: its criterion is smaller than that of a
    normal distribution. low, median, high: its 0.135 %, 50 % and 99.865 % points; ppm: expected beyond the limits.
    side: of the natural limit that it begins at, -1 below, 1 above, 0 without.
    """

    readings: int
    fit: Fit
    tried: tuple[Fit, ...]
    beats_normal: bool
    side: int
    low: float
    median: float
    high: float
    pp: float | None
    ppk: Index
    ppm: Fallout
    ppm_observed: float


def fitted(
    values: ArrayLike, limits: Limits, *, side: int = 0, confidence: float = 0.95, minimum: int = ENOUGH_READINGS
) -> Fitted:
    """The distribution that fits the readings best, and the indices by its percentiles.

    side: of a natural limit at 0, -1 if nothing lies below it, 1 if nothing lies above it; distributions that begin there are
    asked first. Raises `Refused` for too few readings, for those that are too coarse, and where nothing fits.

    >>> rng = np.random.default_rng(1)
    >>> f = fitted(abs(rng.normal(0, 0.002, 500)), Limits(None, 0.0127), side=-1)
    >>> f.fit.family.value, round(f.ppk.value, 2), f.fit.fits
    ('half_normal', 2.48, True)
    """
    x = checked(values, at_least=max(2, minimum))
    numbers = [abs(limit) for limit in (limits.lower, limits.upper) if limit is not None]
    step = must_resolve(x, scale=max(numbers)).step
    if len(x) > MOST_FITTED:
        x = x[np.linspace(0, len(x) - 1, MOST_FITTED).round().astype(np.int64)]
    turned = -1 if side > 0 else 1
    y = _spread_over_steps(turned * x, step)
    from_zero = side != 0 and bool(y[0] >= -step)
    if from_zero:
        y = np.sort(np.maximum(np.abs(y), step * 1e-3))
    tried = sorted(
        (fit_of_family(family, y) for family, kind in DISTRIBUTIONS.items() if from_zero or not kind.from_zero),
        key=lambda fit: fit.criterion,
    )
    best = next((fit for fit in tried if fit.fits), None)
    if best is None:
        raise Refused(Reason.NO_DISTRIBUTION)
    row = np.array([best.parameters])
    low, median, high = _three(best.family, row, turned)[0].tolist()
    pp, _ppk = of_percentiles(low, median, high, limits)
    below, above = (
        0.0 if limit is None else _beyond(best.family, row, turned, limit, upper=upper) * 1e6
        for limit, upper in ((limits.lower, False), (limits.upper, True))
    )
    return Fitted(
        readings=len(x),
        fit=best,
        tried=tuple(tried),
        beats_normal=best.criterion < _normal_criterion(y),
        side=side,
        low=low,
        median=median,
        high=high,
        pp=pp,
        ppk=_over_all_as_good(tried, turned, limits, len(x), confidence),
        ppm=Fallout(below, above),
        ppm_observed=observed_ppm(limits, x),
    )


def density(found: Fitted, at: Floats) -> Floats:
    """The density of the distribution at these readings."""
    kind, row = DISTRIBUTIONS[found.fit.family], np.array([found.fit.parameters])
    y = (-1 if found.side > 0 else 1) * at
    if not kind.from_zero:
        return np.asarray(np.exp(kind.log_density(row, y[None])[0]))
    return np.where(y > 0, np.exp(kind.log_density(row, np.maximum(y, 1e-300)[None])[0]), 0.0)


def _spread_over_steps(x: Floats, step: float) -> Floats:
    """The readings in order, equal ones spread evenly over the step of the gauge: rounding makes ties, which no distribution has.

    One that has no equal stays where it is. The step is known to 12 decimals: as a grid it would move readings by the unit.
    """
    x = np.sort(x)
    groups = np.concatenate(([0], np.cumsum(np.diff(x) > step / 2)))
    counts = np.bincount(groups)[groups]
    place = np.arange(len(x)) - np.searchsorted(groups, groups)
    return np.asarray(x + ((place + 0.5) / counts - 0.5) * step)


def fit_of_family(family: Family, y: Floats) -> Fit:
    """Fit one distribution to ordered readings."""
    kind, n = DISTRIBUTIONS[family], len(y)
    row = kind.fit(y[None])
    likelihood = float(kind.log_density(row, y[None]).sum())
    share = np.clip(kind.share_below(row, y[None])[0], 1e-300, 1 - 1e-16)
    statistic = float(-n - (2 * np.arange(1, n + 1) - 1) @ (np.log(share) + np.log1p(-share[::-1])) / n)
    return Fit(
        family,
        tuple(row[0].tolist()),
        statistic,
        p_of_anderson_darling(statistic, family, row),
        -2 * likelihood + row.shape[1] * log(n),
    )


def _normal_criterion(y: Floats) -> float:
    return len(y) * (log(2 * np.pi * float(y.var())) + 1) + 2 * log(len(y))


def _derivatives(row: Floats) -> tuple[Floats, Floats]:
    """Rows of parameters a step up and a step down in each, and the steps."""
    steps = _STEP * np.maximum(np.abs(row[0]), 1e-2 * np.abs(row[0]).max())
    return np.concatenate((row + np.diag(steps), row - np.diag(steps))), 2 * steps


def _doubt(family: Family, row: Floats) -> Floats:
    """Covariance of the estimates, times the number of readings: the inverse of the information of one reading.

    A direction of which the readings say nothing – two normals that are nearly one – is left out.
    """
    kind, x = DISTRIBUTIONS[family], quantiles(family, row, _U)
    moved, steps = _derivatives(row)
    logarithms = kind.log_density(moved, np.repeat(x, len(moved), axis=0))
    scores = (logarithms[: len(steps)] - logarithms[len(steps) :]) / steps[:, None]
    information = (scores * _WEIGHTS) @ scores.T
    scale = np.sqrt(np.outer(np.diag(information), np.diag(information)))
    doubt: Floats = np.linalg.pinv(information / scale, rcond=1e-6, hermitian=True) / scale
    return doubt


def anderson_darling_weights(family: Family, row: Floats) -> Floats:
    """Weights of the chi-squares whose sum A^2 is, when all parameters are estimated from the readings."""
    kind, x = DISTRIBUTIONS[family], quantiles(family, row, _U)
    moved, steps = _derivatives(row)
    shares = kind.share_below(moved, np.repeat(x, len(moved), axis=0))
    psi = (shares[: len(steps)] - shares[len(steps) :]) / steps[:, None]
    covariance = np.minimum.outer(_U, _U) - np.outer(_U, _U) - psi.T @ _doubt(family, row) @ psi
    scale = np.sqrt(_WEIGHTS / (_U * (1 - _U)))
    return np.maximum(np.linalg.eigvalsh(covariance * np.outer(scale, scale)), 0.0)


def p_of_anderson_darling(statistic: float, family: Family, row: Floats) -> float:
    """Probability of an A^2 as large by chance, of many readings.

    >>> round(p_of_anderson_darling(1.321, Family.RAYLEIGH, np.array([[2.0]])), 3)
    0.053
    """
    weights = anderson_darling_weights(family, row)
    first, second, third = (float((weights**power).sum()) for power in (1, 2, 3))
    freedom = second**3 / third**2
    at = freedom + sqrt(freedom / second) * (statistic - first)
    return float(gammaincc(freedom / 2, max(at, 0.0) / 2))


def _three(family: Family, rows: Floats, turned: int) -> Floats:
    """X0.135, X50 and X99.865 of each row of parameters, in the readings' own direction."""
    found = turned * quantiles(family, rows, np.array([BELOW, 0.5, ABOVE]))
    return found[:, ::turned]


def _beyond(family: Family, row: Floats, turned: int, limit: float, *, upper: bool) -> float:
    """Share of the parts beyond a limit."""
    at = turned * limit
    if DISTRIBUTIONS[family].from_zero and at <= 0:
        below = 0.0
    else:
        below = float(DISTRIBUTIONS[family].share_below(row, np.array([[at]]))[0, 0])
    return 1 - below if upper == (turned > 0) else below


def _index(fit: Fit, turned: int, limits: Limits, readings: int, confidence: float) -> Index:
    row = np.array([fit.parameters])

    def ppk(rows: Floats) -> Floats:
        return np.array([of_percentiles(a, b, c, limits)[1] for a, b, c in _three(fit.family, rows, turned).tolist()])

    moved, steps = _derivatives(row)
    value, around = float(ppk(row)[0]), ppk(moved)
    slope = (around[: len(steps)] - around[len(steps) :]) / steps
    error = float(-ndtri((1 - confidence) / 2)) * sqrt(float(slope @ _doubt(fit.family, row) @ slope) / readings)
    if value <= 0:
        return Index(value, value - error, value + error, "delta")
    return Index(value, value * exp(-error / value), value * exp(error / value), "delta")


def _over_all_as_good(tried: Sequence[Fit], turned: int, limits: Limits, readings: int, confidence: float) -> Index:
    """The index by the best fit, with the interval that holds those of all fits which the readings do not tell from it.

    tried: the best criterion first; at least one is not rejected.
    """
    fits = [fit for fit in tried if fit.fits]
    as_good = [fit for fit in fits if fit.criterion <= fits[0].criterion + AS_GOOD]
    indices = [_index(fit, turned, limits, readings, confidence) for fit in as_good]
    low = min(index.low for index in indices if index.low is not None)
    high = max(index.high for index in indices if index.high is not None)
    return Index(indices[0].value, low, high, "delta")


class Choice(StrEnum):
    """Reason why a distribution was taken."""

    ALONE = "alone"
    BEST = "best"


def why(found: Fitted) -> Choice:
    """It alone was not rejected, or of several it has the best criterion."""
    return Choice.BEST if sum(fit.fits for fit in found.tried) > 1 else Choice.ALONE
