"""One reference measured again and again: type 1 study (Cg, Cgk) and bias."""

from dataclasses import dataclass
from math import sqrt

from numpy.typing import ArrayLike
from scipy.special import stdtr

from app.core.spc.refusal import Reason, Refused, checked
from app.core.spc.resolution import resolution_of
from app.core.spc.spread import mean_of, overall, t_quantile
from app.core.spc.variation import varies

FEWEST_REPEATS = 10
"""Below it neither number is given; 25 are asked for at least, 50 are usual (VDA 5, section 5.2)."""
ENOUGH_REPEATS = 25
FEWEST_VALUES, MOST_EQUAL = 3, 0.8
"""Fewer different values, or a larger share of equal ones, and the step of the gauge hides its scatter: with a resolution of 5 %
of the tolerance and Cg = 1.33 a step is two sigma wide, so three values, the most frequent with 68 %, are to be expected."""


@dataclass(frozen=True, slots=True)
class Bias:
    """Mean minus reference, with the t-test against 0 and the confidence interval (AIAG MSA, chapter III section B)."""

    readings: int
    mean: float
    bias: float
    repeatability: float
    standard_error: float
    t: float
    p_value: float
    low: float
    high: float

    @property
    def significant(self) -> bool:
        """True if the interval leaves 0 out."""
        return self.low > 0 or self.high < 0


def bias(values: ArrayLike, reference: float, *, confidence: float = 0.95, minimum: int = 2) -> Bias:
    """Independent sample method: t = bias / (s / sqrt(n)) with n - 1 degrees of freedom.

    >>> b = bias([5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1, 6.2, 5.6, 6.0], 6.0)
    >>> round(b.mean, 4), round(b.repeatability, 4), round(b.low, 4), round(b.high, 4)
    (6.0067, 0.212, -0.1107, 0.1241)
    """
    x = checked(values, at_least=max(2, minimum))
    sigma = overall(x).value
    if not varies(sigma, x, reference):
        raise Refused(Reason.NO_VARIATION)
    off = mean_of(x) - reference
    error = sigma / sqrt(len(x))
    reach = t_quantile(len(x) - 1, confidence) * error
    return Bias(
        readings=len(x),
        mean=mean_of(x),
        bias=off,
        repeatability=sigma,
        standard_error=error,
        t=off / error,
        p_value=float(2 * stdtr(len(x) - 1, -abs(off / error))),
        low=off - reach,
        high=off + reach,
    )


@dataclass(frozen=True, slots=True)
class TypeOne:
    """Cg: the share of the tolerance that repeatability may take, in spreads; Cgk: less what bias takes of it.

    resolution: as it was given, else the step between the values. resolved: it is no coarser than 5 % of the tolerance.
    """

    bias: Bias
    tolerance: float
    cg: float
    cgk: float
    share: float
    spread: float
    resolution: float
    resolved: bool
    few: bool

    def capable(self, least: float = 1.33) -> bool:
        """True if both are large enough, and the resolution is; 1.33 is what is usually asked for."""
        return self.cg >= least and self.cgk >= least and self.resolved


def type_one(
    values: ArrayLike,
    reference: float,
    tolerance: float,
    *,
    share: float = 0.2,
    spread: float = 6.0,
    resolution: float | None = None,
    minimum: int = FEWEST_REPEATS,
) -> TypeOne:
    """Cg = share T / (spread s), Cgk = (share T/2 - |bias|) / (spread s/2).

    T: width of the tolerance; share 20 % and 6 s as in VDA 5 and Minitab (4 s: ask for `spread=4`). Raises `Refused` for
    values that do not vary, or take too few different values to tell of a scatter.

    >>> found = type_one([10.00, 10.01, 9.99, 10.01, 10.00, 9.99, 10.00, 10.01, 10.00, 9.99], 10.0, 0.3)
    >>> round(found.cg, 3), round(found.cgk, 3)
    (1.225, 1.225)
    """
    if not tolerance > 0:
        raise Refused(Reason.LIMITS_CROSSED)
    result = bias(values, reference, minimum=minimum)
    seen = resolution_of(values)
    if seen.distinct < FEWEST_VALUES or seen.most > MOST_EQUAL * result.readings:
        raise Refused(Reason.UNRESOLVED, have=seen.distinct, needed=FEWEST_VALUES)
    step = seen.step if resolution is None else resolution
    return TypeOne(
        bias=result,
        tolerance=tolerance,
        cg=share * tolerance / (spread * result.repeatability),
        cgk=(share * tolerance / 2 - abs(result.bias)) / (spread * result.repeatability / 2),
        share=share,
        spread=spread,
        resolution=step,
        resolved=step <= 0.05 * tolerance,
        few=result.readings < ENOUGH_REPEATS,
    )
