"""Refusals and warnings of statistics. Codes; the sentences are worded at the edge."""

from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class Reason(StrEnum):
    """Reason why there is no result."""

    TOO_FEW_READINGS = "too_few_readings"
    TOO_FEW_SUBGROUPS = "too_few_subgroups"
    NO_VARIATION = "no_variation"
    UNRESOLVED = "unresolved"
    NOT_FINITE = "not_finite"
    NO_LIMITS = "no_limits"
    LIMITS_CROSSED = "limits_crossed"
    INCOMPLETE_STUDY = "incomplete_study"
    BEYOND_RANGE = "beyond_range"
    NO_DISTRIBUTION = "no_distribution"


class Refused(ValueError):
    """A statistic that the readings do not carry. `have` and `needed` count what there is too little of."""

    def __init__(self, reason: Reason, *, have: int = 0, needed: int = 0, what: str = "") -> None:
        """Say why, and where something is missing how much there is and how much it takes."""
        super().__init__(
            f"{reason.value}: {what}" if what else f"{reason.value}: {have} of {needed}" if needed else reason.value
        )
        self.reason, self.have, self.needed, self.what = reason, have, needed, what

    @property
    def missing(self) -> int:
        """Number of values that are missing."""
        return max(0, self.needed - self.have)


def checked(values: ArrayLike, at_least: int = 1) -> Floats:
    """Readings as one row of finite numbers. Raises `Refused` for too few of them or any that is not a number."""
    array = np.ascontiguousarray(values, dtype=np.float64).reshape(-1)
    if len(array) < at_least:
        raise Refused(Reason.TOO_FEW_READINGS, have=len(array), needed=at_least)
    if not np.isfinite(array).all():
        raise Refused(Reason.NOT_FINITE)
    return array
