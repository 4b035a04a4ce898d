"""Strata: the same readings apart by nest, order, operator …, each with its own numbers, and a fair test if they differ.

A process drifts: tools wear, corrections act, shifts warm up. Two orders made one after the other nearly always have other means,
and an analysis of variance of all readings would blame the order. So neighbours alone are compared: readings in blocks of ten, what a
block has in common is taken out, and what is left is tested for the strata (analysis of variance of incomplete blocks, F
adjusted for blocks). Only a block with readings of several strata tells anything; strata that never met as neighbours cannot be known
from the time that lies between them, and then there is no answer.

Source: D. C. Montgomery, Design and Analysis of Experiments (2017), section 4.4, intrablock analysis.
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
"""Neighbours that are compared; what drifts within so few is small."""
FEWEST_BLOCKS = 5
"""A stratum that has met others in fewer blocks is left out of the test."""
MOST_BLOCKS = 2_000
"""Of more blocks this many, evenly spread: with more of them what does not matter becomes significant."""


class NoAnswer(StrEnum):
    """Reason why nobody can say if strata differ."""

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

    >>> drift, nest = np.arange(200) / 10, np.arange(200) % 2
    >>> found = differ(drift + 3 * nest + np.sin(np.arange(200.0) ** 2), nest)
    >>> found.test.significant, round(found.apart)
    (True, 3)
    >>> differ(drift, np.arange(200) // 100)
    <NoAnswer.APART: 'apart'>
    """
    counted = np.asarray(labels) >= 0
    x, label = checked(values)[counted], np.asarray(labels)[counted]
    if len(np.unique(label)) < 2:
        return NoAnswer.ONE
    many = len(x) // BLOCK
    blocks, of = x[: many * BLOCK].reshape(many, BLOCK), label[: many * BLOCK].reshape(many, BLOCK)
    mixed = np.flatnonzero((of != of[:, :1]).any(axis=1))
    if len(mixed) > MOST_BLOCKS:
        mixed = mixed[np.linspace(0, len(mixed) - 1, MOST_BLOCKS).round().astype(np.int64)]
    blocks, of = blocks[mixed], of[mixed]
    known, place = np.unique(of, return_inverse=True)
    place = place.reshape(of.shape)
    counts = (place[:, :, None] == np.arange(len(known))).sum(axis=1)
    enough = (counts > 0).sum(axis=0) >= FEWEST_BLOCKS
    counts = counts[:, enough].astype(np.float64)
    size = counts.sum(axis=1)
    counts, size = counts[size > 0], size[size > 0]
    if enough.sum() < 2 or len(counts) < FEWEST_BLOCKS:
        return NoAnswer.APART
    weight = enough[place].astype(np.float64)
    here = weight.sum(axis=1) > 0
    blocks, place, weight = blocks[here], place[here], weight[here]
    left = (blocks - ((blocks * weight).sum(axis=1) / size)[:, None]) * weight
    sums = np.bincount(place.reshape(-1), weights=left.reshape(-1), minlength=len(known))[enough]
    matrix = np.diag(counts.sum(axis=0)) - counts.T @ (counts / size[:, None])
    rank = int(np.linalg.matrix_rank(matrix, hermitian=True))
    if not rank:
        return NoAnswer.APART
    effects = np.linalg.pinv(matrix, hermitian=True) @ sums
    between = float(sums @ effects)
    within = max(0.0, float((left**2).sum()) - between)
    freedom = int(weight.sum()) - len(blocks) - rank
    test = f_test(between, rank, within, freedom, float(np.abs(blocks).max()))
    if not np.isfinite(test.p_value):
        return NoAnswer.NO_VARIATION
    apart = float(effects.max() - effects.min()) if rank == len(effects) - 1 else None
    return Difference(test, apart, len(effects), len(blocks))
