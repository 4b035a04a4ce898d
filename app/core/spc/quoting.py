"""Choice of the capability index that may be quoted. One function decides; pages, reports, API and cautions take it from here.

=============  ==================================================================================================
Cpk            a stable, normal process that is resolved finely enough, of 100 readings and more
Ppk            any other process whose readings are normal
fitted         readings that are not normal, by the distribution that fits them (ISO 22514-2), of 100 and more; at a natural
               limit also where it fits better than a normal one
percentiles    those that no distribution fits, by their own percentiles, of 100 and more
none           no index was computed, a reading lies far from all others, or no distribution carries one
=============  ==================================================================================================
"""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple, TypeVar

from app.core.spc import in_time, stability
from app.core.spc.capability import (
    ENOUGH_READINGS,
    Capability,
    Caution,
    Index,
    Limits,
    PercentileCapability,
    capability,
    percentile,
)
from app.core.spc.fitting import Fitted, fitted
from app.core.spc.in_time import InTime
from app.core.spc.outliers import far_off
from app.core.spc.refusal import Floats, Refused
from app.core.spc.stability import Stability

Result = TypeVar("Result")


class Quote(StrEnum):
    """The index that may be quoted."""

    CPK = "cpk"
    PPK = "ppk"
    FITTED = "fitted"
    PERCENTILE = "percentile"
    NONE = "none"


class WhyNot(StrEnum):
    """The reason why none may be, beside those of `Refused`."""

    FAR_OFF = "far_off"
    NO_SHAPE = "no_shape"


class Quoting(NamedTuple):
    """The index with its value and interval (None where it has none), or why there is none.

    preliminary: of too few readings to stand without its interval (ISO 22514-2), or to know its outer percentiles.
    """

    quote: Quote
    value: float | None = None
    low: float | None = None
    high: float | None = None
    preliminary: bool = False
    why: str | None = None


RULE = 3
"""Number of the rule by which an index may be quoted: one more with every change of it, so that kept indices are judged again."""
FORBID_CPK = frozenset({Caution.NOT_IN_CONTROL, Caution.FEW_READINGS, Caution.COARSE})
"""Cautions beside which Cpk is not quoted: each says that the scatter from part to part is not known well enough."""


def quoting(
    indices: Capability | Refused,
    by_percentile: PercentileCapability | Refused,
    *,
    stable: bool | None,
    far: bool,
    by_fit: Fitted | Refused | None = None,
) -> Quoting:
    """Decide which index may be quoted.

    stable: of the process in time, None where too little is known. far: a reading lies far from all others, so that the
    readings are of two processes and no index describes both. by_fit: of `fit_if_needed`.
    """
    if isinstance(indices, Refused):
        return Quoting(Quote.NONE, why=indices.reason.value)
    if far:
        return Quoting(Quote.NONE, why=WhyNot.FAR_OFF.value)
    few = Caution.FEW_READINGS in indices.cautions
    if isinstance(by_fit, Fitted):
        return _of(Quote.FITTED, by_fit.ppk, few)
    if Caution.NOT_NORMAL in indices.cautions:
        if isinstance(by_percentile, Refused):
            return Quoting(Quote.NONE, why=WhyNot.NO_SHAPE.value)
        preliminary = few or Caution.FEW_FOR_PERCENTILES in by_percentile.cautions
        return _of(Quote.PERCENTILE, by_percentile.ppk, preliminary)
    if stable is True and not FORBID_CPK & set(indices.cautions):
        return _of(Quote.CPK, indices.cpk, few)
    return _of(Quote.PPK, indices.ppk, few)


def stable(control: Stability | Refused, time: InTime | Refused) -> bool | None:
    """In control by the run rules, and constant in time by ISO 22514; None where too little is known."""
    if isinstance(control, Refused):
        return None
    return control.in_control and (isinstance(time, Refused) or time.model.steady)


def quoting_of(values: Floats, limits: Limits, *, side: int = 0) -> Quoting:
    """Decide by the readings alone: statistical control is judged by limits of their own. side: of a natural limit.

    >>> import numpy as np
    >>> quoting_of(np.repeat(0.001, 50), Limits(-1.0, 1.0, 0.0)).why
    'no_variation'
    """
    result = or_refused(lambda: capability(values, limits))
    control, time = or_refused(lambda: stability.of_readings(values)), or_refused(lambda: in_time.in_time(values))
    by_percentile = or_refused(lambda: percentile(values, limits, minimum=ENOUGH_READINGS))
    by_fit = fit_if_needed(values, limits, result, side=side)
    return quoting(result, by_percentile, stable=stable(control, time), far=bool(far_off(values).any()), by_fit=by_fit)


def fit_if_needed(
    values: Floats,
    limits: Limits,
    indices: Capability | Refused,
    *,
    side: int = 0,
    confidence: float = 0.95,
    minimum: int = ENOUGH_READINGS,
) -> Fitted | Refused | None:
    """The distribution that fits, or why none does; None where the normal one does. side: of a natural limit, as for `fitted`.

    At a natural limit one that fits better than the normal one is taken though the readings look normal: of a few hundred
    readings it cannot be determined, and the normal one knows nothing of the limit.
    """
    normal = not isinstance(indices, Refused) and Caution.NOT_NORMAL not in indices.cautions
    if isinstance(indices, Refused) or (normal and side == 0):
        return None
    found = or_refused(lambda: fitted(values, limits, side=side, confidence=confidence, minimum=minimum))
    if normal and (isinstance(found, Refused) or not found.beats_normal):
        return None
    return found


def or_refused(compute: Callable[[], Result]) -> Result | Refused:
    """The result, or the refusal as a value."""
    try:
        return compute()
    except Refused as refused:
        return refused


def _of(quote: Quote, index: Index, preliminary: bool) -> Quoting:
    return Quoting(quote, index.value, index.low, index.high, preliminary)
