"""Limits to begin with, from the tolerance and the usual values of the measuring cycles (domain §2).

They are a beginning: a gauge study or the last readings say better what the machine scatters by, the page *What if* what pays.
"""

from typing import NamedTuple

SMALLEST_ZERO = 0.001  # mm; the cycles' manual prints it in its examples
SHARE_OF_HALF = 0.1  # of the half tolerance: a measuring system may use up so much of it
WEAR = 0.3
CONFIDENCE = 1.0


class SuggestedLimits(NamedTuple):
    """R33, R37 and R36, mm; R34 is a third of the tolerance unless it is said."""

    zero_range: float
    wear_limit: float
    confidence_limit: float


def suggested_limits(half: float, floor: float = 0.0) -> SuggestedLimits:
    """Suggest limits. half: distance from the target to the tolerance limits, mm; floor: uncertainty of the signal path, mm.

    They hold the order R33 < R34 <= R35/2 <= R37 <= R36 with R34 two thirds of the half tolerance.

    >>> suggested_limits(0.008)
    SuggestedLimits(zero_range=0.001, wear_limit=0.3, confidence_limit=1.0)
    >>> suggested_limits(0.1), suggested_limits(0.0012).zero_range, suggested_limits(2.0).wear_limit
    (SuggestedLimits(zero_range=0.01, wear_limit=0.3, confidence_limit=1.0), 0.0004, 2.0)
    """
    zero = min(max(SMALLEST_ZERO, floor, half * SHARE_OF_HALF), half / 3)
    wear = max(WEAR, half)
    return SuggestedLimits(round(zero, 6), round(wear, 6), round(max(CONFIDENCE, wear), 6))
