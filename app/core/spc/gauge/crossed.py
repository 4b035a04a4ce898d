"""Gauge R&R, crossed: every operator measures every part the same number of times (AIAG MSA, chapter III section B).

Readings are a block of numbers, shape (parts, operators, trials). An operator may as well be a set-up, a probe or a
machine; with one of them there is no reproducibility, and the study says what repeatability and parts do.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import nan, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtrc

from app.core.spc.constants import d2, d2_star
from app.core.spc.refusal import Floats, Reason, Refused
from app.core.spc.variation import varies

POOLED_ABOVE = 0.25
"""An interaction with a larger p-value is taken for repeatability (AIAG MSA: alpha for pooling 0.25)."""
CATEGORIES = 1.41
"""ndc = 1.41 PV/GRR, cut to a whole number: how many groups of parts the gauge tells apart (AIAG; 5 are asked for)."""


class Method(StrEnum):
    """Method of evaluation."""

    ANOVA = "anova"
    AVERAGE_RANGE = "average_range"


@dataclass(frozen=True, slots=True)
class AnovaRow:
    """A line of the table of variance; f and p against what it is tested by, nan where it is not tested."""

    source: str
    freedom: int
    squares: float
    mean_square: float
    f: float
    p_value: float


@dataclass(frozen=True, slots=True)
class Study:
    """Standard deviations: equipment (repeatability), appraiser (reproducibility), interaction, both together (GRR), part, total.

    percent: of the total variation; percent_tolerance: 6 sigma as a share of the tolerance. The percentages do not add up
    to 100, their squares do. ndc: number of distinct categories. zeroed: components (`part`, `appraiser`, `interaction`)
    whose estimated variance was negative and counts as 0: the data hold less of it than chance alone would bring.
    """

    method: Method
    parts: int
    operators: int
    trials: int
    equipment: float
    appraiser: float
    interaction: float | None
    grr: float
    part: float
    total: float
    ndc: int
    table: tuple[AnovaRow, ...]
    pooled: bool
    zeroed: tuple[str, ...] = ()

    def percent(self, component: float) -> float:
        """A component as a percentage of the total variation."""
        return 100 * component / self.total

    def percent_tolerance(self, component: float, tolerance: float) -> float:
        """The 6 sigma of a component as a percentage of the tolerance width."""
        return 600 * component / tolerance


def _block(readings: ArrayLike) -> Floats:
    block: Floats = np.asarray(readings, dtype=np.float64)
    if block.ndim != 3:
        raise ValueError("readings of a crossed study have the shape (parts, operators, trials)")
    parts, operators, trials = block.shape
    for have, needed, what in ((parts, 2, "parts"), (operators, 1, "operators"), (trials, 2, "trials")):
        if have < needed:
            raise Refused(Reason.INCOMPLETE_STUDY, have=have, needed=needed, what=what)
    if not np.isfinite(block).all():
        raise Refused(Reason.INCOMPLETE_STUDY, have=int(np.isfinite(block).sum()), needed=block.size, what="readings")
    if not varies(float(np.ptp(block, axis=2).max()), block):
        # No cell knows what repeatability is: the gauge does not resolve it.
        raise Refused(Reason.NO_VARIATION, what="repeats" if varies(float(np.ptp(block)), block) else "")
    return block - float(block.mean())


def by_anova(readings: ArrayLike, *, pooled_above: float = POOLED_ABOVE) -> Study:
    """Two-way analysis of variance with random parts and operators; negative components count as 0.

    The interaction is tested against repeatability and pooled with it when its p-value is above `pooled_above`; parts and
    operators are then tested against the pooled repeatability, else against the interaction.

    >>> study = by_anova([[[1.0, 1.1], [1.1, 1.0]], [[2.0, 2.1], [2.2, 2.1]], [[3.1, 3.0], [3.0, 3.1]]])
    >>> study.pooled, round(study.equipment, 4), study.ndc
    (True, 0.0677, 20)
    """
    x = _block(readings)
    p, o, t = x.shape
    part = o * t * float((x.mean(axis=(1, 2)) ** 2).sum())
    operator = p * t * float((x.mean(axis=(0, 2)) ** 2).sum())
    cells = t * float((x.mean(axis=2) ** 2).sum())
    repeats = float(((x - x.mean(axis=2, keepdims=True)) ** 2).sum())
    both = max(0.0, cells - part - operator)
    freedom_both, freedom_repeats = (p - 1) * (o - 1), p * o * (t - 1)
    if not repeats + both > 0:
        raise Refused(Reason.NO_VARIATION)

    share = _tested(both, freedom_both, repeats, freedom_repeats)
    pooled = freedom_both == 0 or not share[1] <= pooled_above
    error, freedom_error = (repeats + both, freedom_repeats + freedom_both) if pooled else (both, freedom_both)
    repeatability = error / freedom_error if pooled else repeats / freedom_repeats
    against = error / freedom_error
    variances = {
        "part": (part / (p - 1) - against) / (o * t),
        "appraiser": (operator / (o - 1) - against) / (p * t) if o > 1 else 0.0,
        "interaction": 0.0 if pooled else (against - repeatability) / t,
    }
    sigmas = {name: sqrt(max(0.0, variance)) for name, variance in variances.items()}

    table = [AnovaRow("part", p - 1, part, part / (p - 1), *_tested(part, p - 1, error, freedom_error))]
    if o > 1:
        tested = _tested(operator, o - 1, error, freedom_error)
        table.append(AnovaRow("operator", o - 1, operator, operator / (o - 1), *tested))
        table.append(AnovaRow("interaction", freedom_both, both, both / freedom_both, *share))
    table.append(AnovaRow("repeatability", freedom_repeats, repeats, repeats / freedom_repeats, nan, nan))
    table.append(AnovaRow("total", p * o * t - 1, part + operator + both + repeats, nan, nan, nan))
    return _study(
        Method.ANOVA,
        (p, o, t),
        sqrt(repeatability),
        sigmas["appraiser"],
        None if pooled else sigmas["interaction"],
        sigmas["part"],
        tuple(table),
        tuple(name for name, variance in variances.items() if variance < 0),
    )


def by_average_and_range(readings: ArrayLike) -> Study:
    """From ranges alone: EV = R-bar/d2, AV from the range of the operators' means, PV from that of the parts' means.

    K1 = 1/d2(trials), K2 = 1/d2*(operators, 1), K3 = 1/d2*(parts, 1); up to 15 ranges K1 is made of d2* too (AIAG,
    appendix C). AV^2 = (X_diff K2)^2 - EV^2/(parts trials), not below 0. It cannot see an interaction.

    >>> study = by_average_and_range([[[1.0, 1.1], [1.1, 1.0]], [[2.0, 2.1], [2.2, 2.1]], [[3.1, 3.0], [3.0, 3.1]]])
    >>> round(study.equipment, 4), study.ndc
    (0.0847, 17)
    """
    x = _block(readings)
    p, o, t = x.shape
    groups = p * o
    divisor = d2(t) if groups > 15 else d2_star(t, groups)
    equipment = float(np.ptp(x, axis=2).mean()) / divisor
    if not equipment > 0:
        raise Refused(Reason.NO_VARIATION)
    between = float(np.ptp(x.mean(axis=(0, 2)))) / d2_star(o, 1) if o > 1 else 0.0
    left = between**2 - equipment**2 / (p * t)
    part = float(np.ptp(x.mean(axis=(1, 2)))) / d2_star(p, 1)
    zeroed = ("appraiser",) if o > 1 and left < 0 else ()
    return _study(Method.AVERAGE_RANGE, (p, o, t), equipment, sqrt(max(0.0, left)), None, part, (), zeroed)


def _tested(squares: float, freedom: int, error: float, freedom_error: int) -> tuple[float, float]:
    """F and its p-value; nan where there is nothing to test or to test by."""
    if freedom == 0 or freedom_error == 0 or not error > 0:
        return nan, nan
    ratio = (squares / freedom) / (error / freedom_error)
    return ratio, float(fdtrc(freedom, freedom_error, ratio))


def _study(
    method: Method,
    shape: tuple[int, int, int],
    equipment: float,
    appraiser: float,
    interaction: float | None,
    part: float,
    table: tuple[AnovaRow, ...],
    zeroed: tuple[str, ...],
) -> Study:
    grr = sqrt(equipment**2 + appraiser**2 + (interaction or 0.0) ** 2)
    return Study(
        method,
        *shape,
        equipment=equipment,
        appraiser=appraiser,
        interaction=interaction,
        grr=grr,
        part=part,
        total=sqrt(grr**2 + part**2),
        ndc=int(CATEGORIES * part / grr) if grr > 0 else 0,
        table=table,
        pooled=interaction is None and method is Method.ANOVA,
        zeroed=zeroed,
    )
