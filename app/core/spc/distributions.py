"""Distributions of readings that are not normal, fitted by maximum likelihood: many sets of readings at once, row by row.

=============  ==========  ============================================================================
half normal    scale       form about a perfect one: |N(0, scale)|
folded normal  mean, scale |N(mean, scale)|
Rayleigh       scale       distance of a point whose two coordinates scatter alike: run-out, position
lognormal      median, s   s of the logarithm: what grows by factors
Weibull        shape,scale what the worst of many places decides
two normals    share, ...  two states that take turns: a corrected process, two spindles
=============  ==========  ============================================================================

All but the last begin at a natural limit, which is 0 here. Sources: N. L. Johnson, S. Kotz and N. Balakrishnan, Continuous
univariate distributions (1994), chapters 13, 14, 18 and 21; F. C. Leone et al., The folded normal distribution,
Technometrics 3 (1961); A. P. Dempster et al., Maximum likelihood from incomplete data via the EM algorithm, J. R. Stat. Soc. B 39 (1977).
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import ndtr, ndtri

from app.core.spc.mixture import binned, fitted_two_normals
from app.core.spc.refusal import Floats

ROUNDS, SETTLED = (
    400,
    1e-6,
)  # of what is solved step by step: at most, and until nothing moves by this share of the spread


class Family(StrEnum):
    """Kind of distribution."""

    HALF_NORMAL = "half_normal"
    FOLDED_NORMAL = "folded_normal"
    RAYLEIGH = "rayleigh"
    LOGNORMAL = "lognormal"
    WEIBULL = "weibull"
    TWO_NORMALS = "two_normals"


@dataclass(frozen=True, slots=True)
class Distribution:
    """A kind: its fit, density, shares and quantiles. Parameters are rows (sets, parameters), readings rows (sets, readings).

    from_zero: it has no readings below 0.
    """

    parameters: tuple[str, ...]
    from_zero: bool
    fit: Callable[[Floats], Floats]
    log_density: Callable[[Floats, Floats], Floats]
    share_below: Callable[[Floats, Floats], Floats]
    quantile: Callable[[Floats, Floats], Floats]


def quantiles(family: Family, parameters: Floats, shares: Floats) -> Floats:
    """Quantiles of each set of parameters, (sets, shares).

    >>> quantiles(Family.RAYLEIGH, np.array([[1.0]]), np.array([0.5])).round(4).tolist()
    [[1.1774]]
    """
    return DISTRIBUTIONS[family].quantile(parameters, np.broadcast_to(shares, (len(parameters), len(shares))))


def _column(parameters: Floats, at: int) -> Floats:
    return parameters[:, at : at + 1]


def _root_mean_square(x: Floats) -> Floats:
    return np.asarray(np.sqrt((x * x).mean(axis=1, keepdims=True)))


def _fit_lognormal(x: Floats) -> Floats:
    logarithms = np.log(x)
    return np.stack((np.exp(logarithms.mean(axis=1)), logarithms.std(axis=1)), axis=1)


def _fit_weibull(x: Floats) -> Floats:
    """Newton's method for the shape: sum x^k ln x / sum x^k - 1/k = mean ln x (Johnson et al., eq. 21.62)."""
    logarithms = np.log(x / x.max(axis=1, keepdims=True))
    mean = logarithms.mean(axis=1)
    shape = 1.2 / logarithms.std(axis=1)
    for _round in range(50):
        powers = np.exp(shape[:, None] * logarithms)
        total, first = powers.sum(axis=1), (powers * logarithms).sum(axis=1)
        second = (powers * logarithms * logarithms).sum(axis=1)
        away = first / total - 1 / shape - mean
        step = away / (second / total - (first / total) ** 2 + 1 / shape**2)
        shape = np.maximum(shape - step, shape / 4)
        if np.abs(step / shape).max() < 1e-10:
            break
    scale = np.exp(np.log(np.exp(shape[:, None] * logarithms).mean(axis=1)) / shape) * x.max(axis=1)
    return np.stack((shape, scale), axis=1)


def _fit_folded(x: Floats) -> Floats:
    """EM over the sign that was lost; mean^2 + scale^2 is the mean square of the readings."""
    centres, weights = binned(x)
    square = (x * x).mean(axis=1, keepdims=True)
    mean = 0.8 * np.sqrt(square)
    for _round in range(ROUNDS):
        signs = np.tanh(mean * centres / (square - mean * mean))
        moved = (weights * centres * signs).sum(axis=1, keepdims=True)
        settled = np.abs(moved - mean).max() < SETTLED * float(np.sqrt(square.max()))
        mean = np.minimum(moved, np.sqrt(square) * (1 - 1e-9))
        if settled:
            break
    return np.concatenate((mean, np.sqrt(square - mean * mean)), axis=1)


LOG_ROOT = 0.5 * np.log(2 * np.pi)


def _log_normal_density(z: Floats) -> Floats:
    return np.asarray(-0.5 * z * z - LOG_ROOT)


def _log_folded(parameters: Floats, x: Floats) -> Floats:
    mean, scale = _column(parameters, 0), _column(parameters, 1)
    return np.logaddexp(_log_normal_density((x - mean) / scale), _log_normal_density((x + mean) / scale)) - np.log(
        scale
    )


def _log_lognormal(parameters: Floats, x: Floats) -> Floats:
    median, s = _column(parameters, 0), _column(parameters, 1)
    logarithms = np.log(x)
    return _log_normal_density((logarithms - np.log(median)) / s) - np.log(s) - logarithms


def _log_weibull(parameters: Floats, x: Floats) -> Floats:
    shape, scale = _column(parameters, 0), _column(parameters, 1)
    logarithms = np.log(x / scale)
    return np.asarray(np.log(shape / scale) + (shape - 1) * logarithms - np.exp(shape * logarithms))


def _log_two_normals(parameters: Floats, x: Floats) -> Floats:
    share, first, second, narrow, wide = (_column(parameters, at) for at in range(5))
    one = np.log(share / narrow) + _log_normal_density((x - first) / narrow)
    return np.logaddexp(one, np.log((1 - share) / wide) + _log_normal_density((x - second) / wide))


def _below_two_normals(parameters: Floats, x: Floats) -> Floats:
    share, first, second, narrow, wide = (_column(parameters, at) for at in range(5))
    return np.asarray(share * ndtr((x - first) / narrow) + (1 - share) * ndtr((x - second) / wide))


def _below_folded(parameters: Floats, x: Floats) -> Floats:
    mean, scale = _column(parameters, 0), _column(parameters, 1)
    return np.asarray(ndtr((x - mean) / scale) - ndtr((-x - mean) / scale))


def _halved(
    below: Callable[[Floats, Floats], Floats], parameters: Floats, shares: Floats, low: Floats, high: Floats
) -> Floats:
    """The quantile by halving an interval that holds it."""
    low, high = np.broadcast_to(low, shares.shape).copy(), np.broadcast_to(high, shares.shape).copy()
    for _round in range(60):
        middle = (low + high) / 2
        under = below(parameters, middle) < shares
        low, high = np.where(under, middle, low), np.where(under, high, middle)
    return np.asarray((low + high) / 2)


def _quantile_folded(parameters: Floats, shares: Floats) -> Floats:
    mean, scale = _column(parameters, 0), _column(parameters, 1)
    return _halved(_below_folded, parameters, shares, 0 * mean, mean + 12 * scale)


def _quantile_two_normals(parameters: Floats, shares: Floats) -> Floats:
    _share, first, second, narrow, wide = (_column(parameters, at) for at in range(5))
    low = np.minimum(first - 12 * narrow, second - 12 * wide)
    return _halved(_below_two_normals, parameters, shares, low, np.maximum(first + 12 * narrow, second + 12 * wide))


DISTRIBUTIONS = {
    Family.HALF_NORMAL: Distribution(
        ("scale",),
        True,
        _root_mean_square,
        lambda p, x: np.asarray(np.log(2 / p) + _log_normal_density(x / p)),
        lambda p, x: np.asarray(1 - 2 * ndtr(-x / p)),
        lambda p, shares: np.asarray(p * ndtri((1 + shares) / 2)),
    ),
    Family.FOLDED_NORMAL: Distribution(
        ("mean", "scale"), True, _fit_folded, _log_folded, _below_folded, _quantile_folded
    ),
    Family.RAYLEIGH: Distribution(
        ("scale",),
        True,
        lambda x: np.asarray(_root_mean_square(x) / np.sqrt(2)),
        lambda p, x: np.asarray(np.log(np.maximum(x, 1e-300)) - 2 * np.log(p) - x * x / (2 * p * p)),
        lambda p, x: np.asarray(-np.expm1(-x * x / (2 * p * p))),
        lambda p, shares: np.asarray(p * np.sqrt(-2 * np.log1p(-shares))),
    ),
    Family.LOGNORMAL: Distribution(
        ("median", "s"),
        True,
        _fit_lognormal,
        _log_lognormal,
        lambda p, x: np.asarray(ndtr(np.log(x / _column(p, 0)) / _column(p, 1))),
        lambda p, shares: np.asarray(_column(p, 0) * np.exp(_column(p, 1) * ndtri(shares))),
    ),
    Family.WEIBULL: Distribution(
        ("shape", "scale"),
        True,
        _fit_weibull,
        _log_weibull,
        lambda p, x: np.asarray(-np.expm1(-((x / _column(p, 1)) ** _column(p, 0)))),
        lambda p, shares: np.asarray(_column(p, 1) * (-np.log1p(-shares)) ** (1 / _column(p, 0))),
    ),
    Family.TWO_NORMALS: Distribution(
        ("share", "first_mean", "second_mean", "first_sigma", "second_sigma"),
        False,
        fitted_two_normals,
        _log_two_normals,
        _below_two_normals,
        _quantile_two_normals,
    ),
}
"""By kind, in the order in which equals are tried."""
