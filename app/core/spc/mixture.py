"""Two normal distributions in one set of readings, fitted by expectation and maximisation (EM).

A. P. Dempster, N. M. Laird and D. B. Rubin, Maximum likelihood from incomplete data via the EM algorithm, J. R. Stat. Soc. B 39
(1977). Readings come as bins with the share of readings in each, many sets at once, row by row.
"""

from math import exp, log

import numpy as np

from app.core.compiled import compiled
from app.core.spc.refusal import Floats

BINS = 128  # of the range of a set
MOST_ROUNDS, SETTLED = 300, 1e-4  # and a set is done once no mean moves by more than this share of its spread
NARROWEST = 0.05
"""A part is no narrower than this share of the spread of all: the likelihood of a part about a single reading has no bound."""
SMALLEST = 0.01
"""Nor smaller than this share of the readings."""


def fitted_two_normals(x: Floats, start: Floats | None = None) -> Floats:
    """Share of the first, means, sigmas, of each row of readings; the first has the smaller mean.

    start: parameters to begin with, (5); without them two beginnings are tried, side by side and one within the other, and the
    one of the larger likelihood is taken.
    """
    centres, weights = binned(x)
    if start is not None:
        return _ordered(_rounds(centres, weights, np.repeat(start[None], len(x), axis=0))[0])
    middle = (weights * centres).sum(axis=1)
    spread = np.sqrt((weights * (centres - middle[:, None]) ** 2).sum(axis=1))
    half = np.full_like(middle, 0.5)
    apart = np.stack((half, middle - spread, middle + spread, 0.6 * spread, 0.6 * spread), axis=1)
    within = np.stack((half, middle - 0.1 * spread, middle + 0.1 * spread, 0.5 * spread, 1.3 * spread), axis=1)
    (one, likelihood), (other, of_other) = (_rounds(centres, weights, begun) for begun in (apart, within))
    return _ordered(np.where((likelihood >= of_other)[:, None], one, other))


def binned(x: Floats) -> tuple[Floats, Floats]:
    """Mean of the readings in each bin, and their share, row by row."""
    low, high = x.min(axis=1, keepdims=True), x.max(axis=1, keepdims=True)
    width = np.maximum((high - low) / BINS, 1e-300)
    at = np.minimum(((x - low) / width).astype(np.int64), BINS - 1) + np.arange(len(x))[:, None] * BINS
    counts = np.bincount(at.ravel(), minlength=len(x) * BINS).reshape(len(x), BINS)
    sums = np.bincount(at.ravel(), x.ravel(), minlength=len(x) * BINS).reshape(len(x), BINS)
    centres = np.where(counts > 0, sums / np.maximum(counts, 1), low)
    return centres, counts / x.shape[1]


def _ordered(found: Floats) -> Floats:
    turned = np.stack((1 - found[:, 0], found[:, 2], found[:, 1], found[:, 4], found[:, 3]), axis=1)
    return np.asarray(np.where((found[:, 1] <= found[:, 2])[:, None], found, turned))


@compiled
def _rounds(centres: Floats, weights: Floats, begun: Floats) -> tuple[Floats, Floats]:
    """Parameters of each row after its rounds, and the mean logarithm of its likelihood but for a constant."""
    found, likelihoods = begun.copy(), np.zeros(len(begun))
    for row in range(len(begun)):
        share, first, second, narrow, wide = found[row]
        mean, square = 0.0, 0.0
        for at in range(centres.shape[1]):
            mean += weights[row, at] * centres[row, at]
            square += weights[row, at] * centres[row, at] ** 2
        spread = max(square - mean * mean, 1e-300) ** 0.5
        least = NARROWEST * spread
        for _round in range(MOST_ROUNDS):
            count, sum_one, squares_one, sum_two, squares_two, likelihood = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            of_one, of_two = log(share / narrow), log((1 - share) / wide)
            for at in range(centres.shape[1]):
                weight, x = weights[row, at], centres[row, at]
                if weight == 0.0:
                    continue
                one = of_one - 0.5 * ((x - first) / narrow) ** 2
                two = of_two - 0.5 * ((x - second) / wide) ** 2
                larger = max(one, two)
                first_part, second_part = exp(one - larger), exp(two - larger)
                both = first_part + second_part
                likelihood += weight * (larger + log(both))
                held = weight * first_part / both
                rest = weight - held
                count += held
                sum_one += held * (x - mean)
                squares_one += held * (x - mean) ** 2
                sum_two += rest * (x - mean)
                squares_two += rest * (x - mean) ** 2
            likelihoods[row] = likelihood
            before_first, before_second = first, second
            share = min(max(count, SMALLEST), 1 - SMALLEST)
            off_one, off_two = sum_one / share, sum_two / (1 - share)
            first, second = mean + off_one, mean + off_two
            narrow = max(max(squares_one / share - off_one * off_one, 0.0) ** 0.5, least)
            wide = max(max(squares_two / (1 - share) - off_two * off_two, 0.0) ** 0.5, least)
            if max(abs(first - before_first), abs(second - before_second)) < SETTLED * spread:
                break
        found[row] = np.array([share, first, second, narrow, wide])
    return found, likelihoods
