"""Constants of control charts, computed: d2, d3 and c4 for any subgroup size, and the factors that follow from them.

All are properties of n independent values from a normal distribution with sigma = 1: of their range W (d2 = E W,
d3 = its standard deviation) and of their sample standard deviation S (c4 = E S). Source of the definitions and of the
tables they reproduce: ASTM E2587, tables of factors; Montgomery, Introduction to Statistical Quality Control,
appendix VI.
"""

from dataclasses import dataclass
from functools import cache
from math import exp, lgamma, log, sqrt

import numpy as np
from scipy.special import log_ndtr, ndtr

from app.core.spc.refusal import Floats

NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)
LARGE = 10_000
"""Subgroups larger than this are integrated to `FARTHER`: nobody plans them, but a pause may be long in coming."""
FAR, FARTHER = 9.0, 12.0  # sigma; beyond lies 1e-19 and 2e-33 of the distribution


def _check(n: int) -> None:
    if n < 2:
        raise ValueError(f"a subgroup has at least 2 values, not {n}")


@cache
def _moments_of_range(n: int) -> tuple[float, float]:
    """E W and E W^2 of the range of n values.

    E W = integral of P(max > x) - P(min > x); E W^2 = 2 * integral over w of w * P(W > w), with
    P(W <= w) = n * integral of phi(x) * (Phi(x + w) - Phi(x))^(n - 1). Gauss-Legendre with 400 nodes each, for any n: d2
    and d3 are right to 1e-9 up to a thousand million values. Powers are taken by logarithms of what lies outside, or the
    sixteenth digit of Phi would count n times.
    """
    _check(n)
    far = FAR if n <= LARGE else FARTHER
    x, w = far * NODES, far * (NODES + 1)
    first = far * float(WEIGHTS @ (1 - np.exp(n * log_ndtr(-x)) - np.exp(n * log_ndtr(x))))
    second = far * float(WEIGHTS @ (2 * w * (1 - range_at_most(w, n))))
    return first, second


def range_at_most(w: Floats, n: int) -> Floats:
    """P(W <= w) of the range W of n values, w >= 0 in sigma."""
    if n <= LARGE:
        far, x = FAR, FAR * NODES
    else:  # the smallest of several is never above the mean
        far, x = FARTHER / 2, FARTHER / 2 * (NODES - 1)
    density = np.exp(-x * x / 2) / sqrt(2 * np.pi)
    outside = np.minimum(ndtr(x) + ndtr(-x - w[:, None]), 1 - 1e-16)
    chance: Floats = n * far * (np.exp((n - 1) * np.log1p(-outside)) @ (WEIGHTS * density))
    return chance


def d2(n: int) -> float:
    """Mean range of n values, in sigma.

    >>> round(d2(2), 6), round(d2(5), 3), round(d2(25), 3)
    (1.128379, 2.326, 3.931)
    """
    return _moments_of_range(n)[0]


def d3(n: int) -> float:
    """Standard deviation of the range of n values, in sigma.

    >>> round(d3(2), 4), round(d3(5), 4)
    (0.8525, 0.8641)
    """
    first, second = _moments_of_range(n)
    return sqrt(second - first * first)


def c4(n: int) -> float:
    """Mean of the sample standard deviation of n values, in sigma: sqrt(2/(n-1)) Gamma(n/2) / Gamma((n-1)/2).

    >>> round(c4(5), 4), round(c4(25), 4)
    (0.94, 0.9896)
    """
    _check(n)
    if n > 1000:  # where two large logarithms would cancel, the series is exact
        return 1 - 1 / (4 * n) - 7 / (32 * n**2) - 19 / (128 * n**3)
    return exp(0.5 * log(2 / (n - 1)) + lgamma(n / 2) - lgamma((n - 1) / 2))


def d2_star(n: int, groups: int) -> float:
    """Duncan's d2*: the root mean square of the mean of `groups` ranges of n values, sqrt(d2^2 + d3^2/groups).

    Gauge studies divide by it where a range comes from a few groups only (AIAG MSA, appendix C).

    >>> round(d2_star(3, 1), 5), round(d2_star(10, 1), 5)
    (1.91154, 3.17905)
    """
    return sqrt(d2(n) ** 2 + d3(n) ** 2 / groups)


@dataclass(frozen=True, slots=True)
class Factors:
    """Factors of the charts for subgroups of one size; multiplied with the mean range, mean s or sigma.

    A, A2, A3: from the centre to the limits of X-bar, by sigma, R-bar, s-bar. B3, B4: limits of s by s-bar;
    B5, B6: by sigma. D1, D2: limits of R by sigma; D3, D4: by R-bar. Lower limits are never below 0.
    """

    n: int
    d2: float
    d3: float
    c4: float
    A: float
    A2: float
    A3: float
    B3: float
    B4: float
    B5: float
    B6: float
    D1: float
    D2: float
    D3: float
    D4: float


@cache
def factors(n: int, width: float = 3.0) -> Factors:
    """The factors for subgroups of n values and limits `width` sigma away.

    >>> f = factors(5)
    >>> round(f.A2, 3), round(f.A3, 3), round(f.B4, 3), round(f.D3, 3), round(f.D4, 3)
    (0.577, 1.427, 2.089, 0.0, 2.114)
    """
    mean, deviation, unbiased = d2(n), d3(n), c4(n)
    scatter = sqrt(1 - unbiased * unbiased)
    return Factors(
        n=n,
        d2=mean,
        d3=deviation,
        c4=unbiased,
        A=width / sqrt(n),
        A2=width / (mean * sqrt(n)),
        A3=width / (unbiased * sqrt(n)),
        B3=max(0.0, 1 - width * scatter / unbiased),
        B4=1 + width * scatter / unbiased,
        B5=max(0.0, unbiased - width * scatter),
        B6=unbiased + width * scatter,
        D1=max(0.0, mean - width * deviation),
        D2=mean + width * deviation,
        D3=max(0.0, 1 - width * deviation / mean),
        D4=1 + width * deviation / mean,
    )
