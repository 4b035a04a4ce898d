"""A map of settings: what each cell of a grid of replays amounts to, where it is best, and what is as good. Lengths in mm."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import sqrt

from app.core.parameters import Parameters
from app.core.replay import Figures

NEAR = 0.05  # so much worse than the best is as good as the best
SIGMAS = 2.0  # and this many standard errors


class Criterion(StrEnum):
    """Criterion for the best cell of a map."""

    PPK = "ppk"
    REJECTS = "rejects"
    SPREAD = "spread"
    CORRECTIONS = "corrections"


@dataclass(frozen=True, slots=True)
class Region:
    """Best region of a map: the index of the best cell, None where no cell has the number, and flags of equally good ones.

    calmest: the equally good cell that corrects least; more corrections would gain nothing that can be seen.
    choice: which cells were compared at all.
    """

    best: int | None
    inside: tuple[bool, ...]
    calmest: int | None = None
    choice: tuple[bool, ...] = ()


def value_of(figures: Figures, criterion: Criterion) -> float | None:
    """The number that is looked for."""
    return {
        Criterion.PPK: figures.ppk,
        Criterion.REJECTS: float(figures.rejects),
        Criterion.SPREAD: figures.spread,
        Criterion.CORRECTIONS: float(figures.corrections),
    }[criterion]


def with_settings(
    parameters: Parameters,
    *,
    weighting_factor: float | None = None,
    zero_range: float | None = None,
    averaging_limit: float | None = None,
    factor: float | None = None,
) -> Parameters:
    """Other settings of the loop; those not given stay."""
    changes = {
        "weighting_factor": weighting_factor,
        "zero_range": zero_range,
        "averaging_limit": averaging_limit,
        "factor": factor,
    }
    return replace(parameters, **{name: value for name, value in changes.items() if value is not None})  # type: ignore[arg-type]


def in_order(parameters: Parameters) -> bool:
    """Tell if R33 < R34 <= R35/2, the part of the order of the parameters that a map varies."""
    limits = parameters.limits
    return limits.zero_range < limits.averaging <= limits.tolerance


def best_region(cells: Sequence[Figures | None], criterion: Criterion, today: Figures | None = None) -> Region:
    """The best cell, and those that cannot be distinguished from it: no worse by two standard errors of the best, or by 5 %.

    Standard errors: of a count its root; of s, s / sqrt(2 n); of Ppk, Bissell's (1990, Appl. Stat. 39, 331). Cells share the
    same parts, so they are distinguished better than that: the region is rather too wide. `today`: where the fewest corrections
    are looked for, cells that reject more or have a worse Ppk than today's are no choice: those are of a loop that sleeps.
    """
    bound = today if criterion is Criterion.CORRECTIONS else None
    values = [
        None if cell is None or (bound is not None and _worse(cell, bound)) else value_of(cell, criterion)
        for cell in cells
    ]
    known = [(value, at) for at, value in enumerate(values) if value is not None]
    if not known:
        return Region(None, (False,) * len(cells), None, (False,) * len(cells))
    sign = -1.0 if criterion is Criterion.PPK else 1.0
    value, best = min(known, key=lambda each: sign * each[0])
    figures = cells[best]
    assert figures is not None
    allowed = room(figures, criterion, value)
    inside = tuple(figure is not None and sign * (figure - value) <= allowed for figure in values)
    calmest = min(
        (at for at, holds in enumerate(inside) if holds),
        key=lambda at: (cells[at].corrections, sign * (values[at] or 0.0)),  # type: ignore[union-attr]
    )
    return Region(best, inside, calmest, tuple(value is not None for value in values))


def _worse(cell: Figures, today: Figures) -> bool:
    if cell.rejects > today.rejects:
        return True
    if cell.ppk is None or today.ppk is None:
        return False
    return cell.ppk < today.ppk - room(today, Criterion.PPK, today.ppk)


def room(figures: Figures, criterion: Criterion, value: float) -> float:
    """Largest difference of a number that counts as equally good: two standard errors, or 5 %."""
    return max(SIGMAS * _error(figures, criterion, value), NEAR * abs(value)) + 1e-12


def _error(figures: Figures, criterion: Criterion, value: float) -> float:
    count = max(2, figures.inner)
    if criterion is Criterion.PPK:
        return sqrt(1 / (9 * count) + value * value / (2 * count))
    if criterion is Criterion.SPREAD:
        return value / sqrt(2 * count)
    return sqrt(max(1.0, value))
