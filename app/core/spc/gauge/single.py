"""One reference measured again and again: type 1 study (Cg, Cgk) and bias."""

from dataclasses import dataclass
from math import sqrt

from numpy.typing import ArrayLike
from scipy.special import stdtr, stdtrit

from app.core.spc.refusal import Reason, Refused, checked
from app.core.spc.spread import mean_of, overall

FEWEST_REPEATS = 10
"""Below it neither number is given; 25 are asked for at least, 50 are usual (VDA 5, section 5.2)."""
ENOUGH_REPEATS = 25


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
        """Whether the interval leaves 0 out."""
        return self.low > 0 or self.high < 0


def bias(values: ArrayLike, reference: float, *, confidence: float = 0.95, minimum: int = 2) -> Bias:
    """Independent sample method: t = bias / (s / sqrt(n)) with n - 1 degrees of freedom.

    >>> b = bias([5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1, 6.2, 5.6, 6.0], 6.0)
    >>> round(b.mean, 4), round(b.repeatability, 4), round(b.low, 4), round(b.high, 4)
    (6.0067, 0.212, -0.1107, 0.1241)
    """
    x = checked(values, at_least=max(2, minimum))
    sigma = overall(x).value
    if not sigma > 0:
        raise Refused(Reason.NO_VARIATION)
    off = mean_of(x) - reference
    error = sigma / sqrt(len(x))
    reach = float(stdtrit(len(x) - 1, (1 + confidence) / 2)) * error
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

    resolved: the resolution is no coarser than 5 % of the tolerance; None where it was not given.
    """

    bias: Bias
    tolerance: float
    cg: float
    cgk: float
    share: float
    spread: float
    resolved: bool | None
    few: bool

    def capable(self, least: float = 1.33) -> bool:
        """Whether both are large enough; 1.33 is what is usually asked for."""
        return self.cg >= least and self.cgk >= least


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

    T: width of the tolerance; share 20 % and 6 s as in VDA 5 and Minitab (4 s: ask for `spread=4`).

    >>> found = type_one([10.00, 10.01, 9.99, 10.01, 10.00, 9.99, 10.00, 10.01, 10.00, 9.99], 10.0, 0.3)
    >>> round(found.cg, 3), round(found.cgk, 3)
    (1.225, 1.225)
    """
    if not tolerance > 0:
        raise Refused(Reason.LIMITS_CROSSED)
    found = bias(values, reference, minimum=minimum)
    return TypeOne(
        bias=found,
        tolerance=tolerance,
        cg=share * tolerance / (spread * found.repeatability),
        cgk=(share * tolerance / 2 - abs(found.bias)) / (spread * found.repeatability / 2),
        share=share,
        spread=spread,
        resolved=None if resolution is None else resolution <= 0.05 * tolerance,
        few=found.readings < ENOUGH_REPEATS,
    )
