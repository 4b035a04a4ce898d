"""Zone limits and the border rules: they live here and nowhere else, for numbers, arrays and SQL (domain §3).

Six bands lie symmetrically about the target, distinguished by the size of the deviation alone:

======================  ==========================  ============================================
zone                    holds while                 a value exactly on the outer limit
======================  ==========================  ============================================
zero                    ``|D| <= R33``              belongs to it
average                 ``|D| <= R34``              belongs to it
full                    ``|D| <= R35/2``            belongs to it (a part on the limit is good)
oversize / undersize    ``|D| < R37``               belongs to *wear* (R37 is "reached")
wear                    ``|D| < R36``               belongs to *probe_fault* (R36 is "reached")
probe_fault             beyond
======================  ==========================  ============================================

Where the target is a natural limit (`app.core.natural_limit`), R35 takes the place of R35/2, and what lies beyond it is no measurement.

Lengths are mm. They are compared in whole nanometres, so that 0.010 is 0.010 whatever binary
fractions it went through.
"""

from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, overload

from app.core.natural_limit import half_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from app.core.decision.step import Rules

    Floats = NDArray[np.float64]
    Whole = NDArray[np.int64] | int


class Zone(StrEnum):
    """The band that a deviation falls into, from the target outward."""

    ZERO = "zero"
    AVERAGE = "average"
    FULL = "full"
    OVERSIZE = "oversize"
    UNDERSIZE = "undersize"
    WEAR = "wear"
    PROBE_FAULT = "probe_fault"


ZONES = tuple(Zone)
ZERO, AVERAGE, FULL, OVERSIZE, UNDERSIZE, WEAR, FAULT = range(len(ZONES))
"""The zones as columns and compiled loops hold them: places in `ZONES`."""


def nanometres(length: float) -> int:
    """Round a length in mm to whole nanometres, the resolution of every comparison with a limit.

    >>> nanometres(0.1 + 0.2) == nanometres(0.3)
    True
    """
    return round(length * 1_000_000.0)


def in_nanometres(lengths: "Floats") -> "Floats":
    """Round an array of lengths in mm as `nanometres` does; NaN stays NaN."""
    return (lengths * 1_000_000.0).round()


def nanometres_sql(length: str) -> str:
    """Return the SQL that rounds a double precision expression in mm as `nanometres` does."""
    return f"round(({length}) * 1000000)"


@overload
def within(size: int, limit: int) -> bool: ...
@overload
def within(size: "Floats", limit: "Whole") -> "NDArray[np.bool_]": ...
def within(size: Any, limit: Any) -> Any:
    """Return whether a size in nm, of either sign, lies within R33, R34 or R35/2: a value on the limit does."""
    return abs(size) <= limit


@overload
def reaches(size: int, limit: int) -> bool: ...
@overload
def reaches(size: "Floats", limit: "Whole") -> "NDArray[np.bool_]": ...
def reaches(size: Any, limit: Any) -> Any:
    """Return whether a size in nm, of either sign, reaches R37 or R36: a value on the limit does."""
    return abs(size) >= limit


def within_sql(length: str, limit: str) -> str:
    """Return `within` as SQL. length: double precision, mm; limit: nm."""
    return f"abs({nanometres_sql(length)}) <= {limit}"


class HasLimits(Protocol):
    """Source of `Limits.of`: the five limits of a characteristic, in mm."""

    @property
    def zero_range(self) -> float: ...  # R33
    @property
    def averaging_limit(self) -> float: ...  # R34
    @property
    def tolerance_width(self) -> float: ...  # R35
    @property
    def wear_limit(self) -> float: ...  # R37
    @property
    def confidence_limit(self) -> float: ...  # R36


class Limits(NamedTuple):
    """The outer borders of the bands, in whole nanometres, from the target outward."""

    zero_range: int  # R33
    averaging: int  # R34
    tolerance: int  # R35/2; R35 from a natural limit
    wear: int  # R37
    confidence: int  # R36

    @classmethod
    def of(cls, parameters: HasLimits) -> "Limits":
        """Take the limits out of a parameter set."""
        return cls(
            nanometres(parameters.zero_range),
            nanometres(parameters.averaging_limit),
            nanometres(half_of(parameters)),
            nanometres(parameters.wear_limit),
            nanometres(parameters.confidence_limit),
        )


def beyond_natural(size: int, side: int, zero_range: int) -> bool:
    """Return whether a size in nm lies beyond a natural limit by more than R33, the scatter of measuring. side: of `NaturalLimit`."""
    return side * size > zero_range


def zone_of(deviation: float, limits: "Limits | Rules") -> int:
    """Return the place in `ZONES` of the band that a deviation (mm) falls into."""
    size = nanometres(deviation)
    if within(size, limits.zero_range):
        return ZERO
    if within(size, limits.averaging):
        return AVERAGE
    if within(size, limits.tolerance):
        return FULL
    if not reaches(size, limits.wear):
        return OVERSIZE if deviation > 0 else UNDERSIZE
    return FAULT if reaches(size, limits.confidence) else WEAR


def classify(deviation: float, limits: Limits) -> Zone:
    """Return the band that a deviation (mm) falls into.

    >>> limits = Limits(1_000, 5_300, 8_000, 300_000, 1_000_000)
    >>> classify(0.008, limits), classify(-0.0080004, limits), classify(0.300, limits)
    (<Zone.FULL: 'full'>, <Zone.FULL: 'full'>, <Zone.WEAR: 'wear'>)
    >>> classify(-0.009, limits)
    <Zone.UNDERSIZE: 'undersize'>
    """
    return ZONES[zone_of(deviation, limits)]


def within_tolerance(deviation: float, limits: "Limits | Rules") -> bool:
    """Return whether a part with this deviation (mm) is good: a value on the limit is."""
    return within(nanometres(deviation), limits.tolerance)
