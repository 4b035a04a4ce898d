"""Zone limits and `classify`: the border rules live here and nowhere else (domain §3).

Six bands lie symmetrically about the target, told apart by the size of the deviation alone:

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

Lengths are mm. They are compared in whole nanometres, so that 0.010 is 0.010 whatever binary
fractions it went through.
"""

from enum import StrEnum
from typing import NamedTuple, Protocol


class Zone(StrEnum):
    """The band that a deviation falls into, from the target outward."""

    ZERO = "zero"
    AVERAGE = "average"
    FULL = "full"
    OVERSIZE = "oversize"
    UNDERSIZE = "undersize"
    WEAR = "wear"
    PROBE_FAULT = "probe_fault"


def nanometres(length: float) -> int:
    """Round a length in mm to whole nanometres, the resolution of every comparison with a limit.

    >>> nanometres(0.1 + 0.2) == nanometres(0.3)
    True
    """
    return round(length * 1_000_000.0)


class HasLimits(Protocol):
    """What `Limits.of` needs: the five limits of a characteristic, in mm."""

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
    tolerance: int  # R35/2
    wear: int  # R37
    confidence: int  # R36

    @classmethod
    def of(cls, parameters: HasLimits) -> "Limits":
        """Take the limits out of a parameter set."""
        return cls(
            nanometres(parameters.zero_range),
            nanometres(parameters.averaging_limit),
            nanometres(parameters.tolerance_width / 2),
            nanometres(parameters.wear_limit),
            nanometres(parameters.confidence_limit),
        )


def classify(deviation: float, limits: Limits) -> Zone:
    """Say which band a deviation (mm) falls into.

    >>> limits = Limits(1_000, 5_300, 8_000, 300_000, 1_000_000)
    >>> classify(0.008, limits), classify(-0.0080004, limits), classify(0.300, limits)
    (<Zone.FULL: 'full'>, <Zone.FULL: 'full'>, <Zone.WEAR: 'wear'>)
    >>> classify(-0.009, limits)
    <Zone.UNDERSIZE: 'undersize'>
    """
    size = abs(nanometres(deviation))
    if size <= limits.zero_range:
        return Zone.ZERO
    if size <= limits.averaging:
        return Zone.AVERAGE
    if size <= limits.tolerance:
        return Zone.FULL
    if size < limits.wear:
        return Zone.OVERSIZE if deviation > 0 else Zone.UNDERSIZE
    if size < limits.confidence:
        return Zone.WEAR
    return Zone.PROBE_FAULT


def within_tolerance(deviation: float, limits: Limits) -> bool:
    """Whether a part with this deviation (mm) is good: a value on the limit is."""
    return abs(nanometres(deviation)) <= limits.tolerance
