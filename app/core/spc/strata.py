"""Strata: the same readings apart by nest, order, operator …, each with its own numbers, and a fair test if they differ.

A process drifts: tools wear, corrections act, shifts warm up. Two orders made one after the other nearly always have other means,
and an analysis of variance of all readings would blame the order. So neighbours alone are compared: readings in blocks of ten, of
which each loses its mean and its slope, and what is left is tested for the strata (analysis of covariance of incomplete blocks,
F adjusted for them). Nests come in turn while the tool wears: without the slope, the wear within a block would be theirs.
Between two blocks a reading is passed over, so that blocks begin at another nest each time and a line is not confused with a
row of nests. Only a block with readings of several strata tells anything; strata that never met as neighbours cannot be known
from the time that lies between them, and then there is no answer.

Source: D. C. Montgomery, Design and Analysis of Experiments (2017), sections 4.4, intrablock analysis, and 15.3, covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.core.spc.capability import Index, Limits, capability
from app.core.spc.in_time import Test, f_test
from app.core.spc.quoting import or_refused
from app.core.spc.refusal import Floats, Refused, checked

BLOCK = 10
"""Neighbours that are compared; within so few, what drifts is a line."""
STRIDE = BLOCK + 1
"""Readings from one block to the next: prime, so that nests in turn begin elsewhere in each block (but for 11 of them)."""
FEWEST_BLOCKS = 5
"""A stratum that is in fewer blocks is left out of the test, and blocks of two that have met in fewer."""
MOST_BLOCKS = 2_000
"""Of more blocks this many, evenly spread: with more of them what does not matter becomes significant."""
STEP = 9.0
"""Times the median variance that a step inside a block may explain, three standard deviations: of good blocks 1 in 70 goes."""
ROUNDING = 1e-9  # of the largest eigenvalue: no direction in which strata could be separated


class NoAnswer(StrEnum):
    """Reason why it cannot be determined whether strata differ."""

    ONE = "one"  # stratum
    APART = "apart"  # made one after the other
    NO_VARIATION = "no_variation"


@dataclass(frozen=True, slots=True)
class Stratum:
    """One of the strata; mm. sigma None of a single reading; ppk a `Refused` where there is none."""

    name: str
    readings: int
    mean: float
    sigma: float | None
    ppk: Index | Refused


@dataclass(frozen=True, slots=True)
class Difference:
    """The answer of the test. apart: how far the furthest two lie from each other, drift taken out, mm; None where not all were neighbours.

    strata, blocks: that could be compared.
    """

    test: Test
    apart: float | None
    strata: int
    blocks: int


def strata(
    values: Floats, labels: NDArray[np.int64], names: Sequence[str], limits: Limits, confidence: float
) -> list[Stratum]:
    """The numbers of each stratum that has readings; labels: the place of each reading's name, less than 0 for none.

    >>> of = strata(np.array([1.0, 3.0, 9.0]), np.array([0, 0, -1]), ["A", "B"], Limits(-9.0, 9.0), 0.95)
    >>> [(each.name, each.readings, each.mean) for each in of]
    [('A', 2, 2.0)]
    """
    found = []
    for at, name in enumerate(names):
        of = values[labels == at]
        if len(of):
            spread = float(of.std(ddof=1)) if len(of) > 1 else None
            found.append(Stratum(name, len(of), float(of.mean()), spread, _ppk(of, limits, confidence)))
    return found


def _ppk(values: Floats, limits: Limits, confidence: float) -> Index | Refused:
    result = or_refused(lambda: capability(values, limits, confidence=confidence))
    return result if isinstance(result, Refused) else result.ppk


def differ(values: ArrayLike, labels: NDArray[np.int64]) -> Difference | NoAnswer:
    """Test if strata differ in their mean, neighbours against neighbours; readings without one (label below 0) do not count.

    >>> drift, nest = np.arange(220) / 10, np.arange(220) % 2
    >>> found = differ(drift + 3 * nest + np.sin(np.arange(220.0) ** 2), nest)
    >>> found.test.significant, round(found.apart)
    (True, 3)
    >>> differ(drift, np.arange(220) // 110)
    <NoAnswer.APART: 'apart'>
    """
    x, label = checked(values, 0), np.asarray(labels)
    if len(np.unique(label[label >= 0])) < 2:
        return NoAnswer.ONE
    many = len(x) // STRIDE
    blocks = x[: many * STRIDE].reshape(many, STRIDE)[:, :BLOCK]
    of = label[: many * STRIDE].reshape(many, STRIDE)[:, :BLOCK]
    mixed = np.flatnonzero(((of >= 0) & (of != of.max(axis=1, keepdims=True))).any(axis=1))
    if len(mixed) > MOST_BLOCKS:
        mixed = mixed[np.linspace(0, len(mixed) - 1, MOST_BLOCKS).round().astype(np.int64)]
    blocks, of = blocks[mixed], of[mixed]
    known = np.unique(of[of >= 0])
    belongs = (of[:, :, None] == known).astype(np.float64)
    belongs = belongs[:, :, belongs.any(axis=1).sum(axis=0) >= FEWEST_BLOCKS]
    here = belongs.any(axis=1).astype(np.float64)
    met = here.T @ here
    seldom = here @ ((met > 0) & (met < FEWEST_BLOCKS)) * here  # such as the block in which one order follows the other
    blocks, belongs = blocks[~seldom.any(axis=1)], belongs[~seldom.any(axis=1)]
    belongs = belongs[:, :, belongs.any(axis=(0, 1))]
    if belongs.shape[2] < 2:
        return NoAnswer.APART
    weight = belongs.sum(axis=2)
    left, freedom = _without_line(blocks, weight)
    steady = _steady(left, weight, freedom)
    if steady.sum() < FEWEST_BLOCKS:
        return NoAnswer.APART
    blocks, belongs, weight, left = blocks[steady], belongs[steady], weight[steady], left[steady]
    sums = (belongs * left[:, :, None]).sum(axis=(0, 1))
    shifted = np.stack([_without_line(belongs[:, :, at], weight)[0] for at in range(belongs.shape[2])], axis=2)
    matrix = np.einsum("bri,brj->ij", shifted, shifted)
    size, vectors = np.linalg.eigh(matrix)
    some = size > ROUNDING * max(1.0, float(size[-1]))
    rank = int(some.sum())
    if not rank:
        return NoAnswer.APART
    effects = vectors[:, some] @ ((vectors[:, some].T @ sums) / size[some])
    between = float(sums @ effects)
    within = max(0.0, float((left**2).sum()) - between)
    test = f_test(between, rank, within, int(freedom[steady].sum()) - rank, float(np.abs(blocks).max()))
    if not np.isfinite(test.p_value):
        return NoAnswer.NO_VARIATION
    apart = float(effects.max() - effects.min()) if rank == len(effects) - 1 else None
    return Difference(test, apart, len(effects), len(blocks))


def _without_line(values: Floats, weight: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Residuals of a straight line through each block, 0 where the weight is 0; and their degrees of freedom."""
    count = np.maximum(weight.sum(axis=1), 1.0)[:, None]
    place = np.arange(BLOCK) - (weight * np.arange(BLOCK)).sum(axis=1)[:, None] / count
    off = values - (weight * values).sum(axis=1)[:, None] / count
    squares = (weight * place**2).sum(axis=1)[:, None]
    slope = (weight * place * off).sum(axis=1)[:, None] / np.where(squares > 0, squares, 1.0)
    return (off - slope * place) * weight, np.maximum(0, weight.sum(axis=1) - 2).astype(np.int64)


def _steady(left: Floats, weight: Floats, freedom: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Blocks without a step inside, such as a tool change, which is no line: none explains far more than scatter would."""
    free = freedom > 0
    if not free.any():
        return free
    usual = float(np.median((left[free] ** 2).sum(axis=1) / freedom[free]))
    most = np.zeros(len(left))
    for place in range(1, BLOCK):
        step, _freedom = _without_line(
            np.broadcast_to(np.arange(BLOCK) >= place, left.shape).astype(np.float64), weight
        )
        squares = (step**2).sum(axis=1)
        explained = (step * left).sum(axis=1) ** 2 / np.where(squares > ROUNDING, squares, 1.0)
        most = np.maximum(most, np.where(squares > ROUNDING, explained, 0.0))
    return np.asarray(free & (most <= STEP * usual))
