"""Machine performance (ISO 22514-3): Pm and Pmk of one run of parts, cut one after the other with nothing changed.

Pm = (upper - lower)/(6 s), Pmk = the nearer limit by 3 s, s the standard deviation of the run; of a run that is not normal by the
percentiles of the distribution that fits (ISO 22514-2). It is of the machine alone: no correction, no tool change, no setting by
hand lies in the run. Formerly Cm and Cmk.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.core.spc.capability import Index, Limits, capability
from app.core.spc.fitting import Fitted
from app.core.spc.outliers import far_off
from app.core.spc.quoting import fit_if_needed
from app.core.spc.refusal import Reason, Refused, checked

RUN = 50
"""Parts of a run at least (ISO 22514-3, where 100 are better)."""


@dataclass(frozen=True, slots=True)
class MachinePerformance:
    """Pm (None without both limits) and Pmk of a run. by_fit: the distribution that they are by, None for the normal one.

    far: places in the run of readings that lie far from all others; no index is of such a run.
    """

    readings: int
    mean: float
    sigma: float
    pm: Index | None
    pmk: Index | None
    by_fit: Fitted | None
    far: tuple[int, ...]


def machine_performance(
    values: ArrayLike, limits: Limits, *, side: int = 0, confidence: float = 0.95
) -> MachinePerformance:
    """Pm and Pmk of a run of 50 readings and more. side: of a natural limit, as for `fitting.fitted`.

    Raises `Refused` for fewer, for readings that do not vary or are too coarse, and where no distribution fits.

    >>> run = machine_performance(np.random.default_rng(1).normal(1, 2, 50), Limits(-10, 10))
    >>> round(run.pm.value, 2), round(run.pmk.value, 2)
    (1.87, 1.7)
    """
    x = checked(values, at_least=RUN)
    found = capability(x, limits, confidence=confidence)
    far = tuple(np.flatnonzero(far_off(x)).tolist())
    if far:
        return MachinePerformance(len(x), found.mean, found.overall.value, None, None, None, far)
    by_fit = fit_if_needed(x, limits, found, side=side, confidence=confidence, minimum=RUN)
    if isinstance(by_fit, Refused):
        raise by_fit
    pm, pmk = found.pp, found.ppk
    if by_fit is not None:
        pm, pmk = None if by_fit.pp is None else Index(by_fit.pp, None, None, None), by_fit.ppk
    return MachinePerformance(len(x), found.mean, found.overall.value, pm, pmk, by_fit, far)


def newest_run(changed: NDArray[np.bool_], length: int) -> slice:
    """The newest N readings, one after the other, with nothing changed before any of them but the first.

    changed: of each reading whether something was changed before it. Raises `Refused` with the longest run that there is.

    >>> newest_run(np.array([True, False, False, True, False, False, False, True]), 3)
    slice(4, 7, None)
    """
    edges = np.concatenate((np.flatnonzero(changed), [len(changed)]))
    starts = np.concatenate(([0], edges)) if len(edges) and edges[0] else edges
    lengths = np.diff(starts)
    long = np.flatnonzero(lengths >= length)
    if not len(long):
        raise Refused(Reason.TOO_FEW_READINGS, have=int(lengths.max(initial=0)), needed=length)
    end = int(starts[long[-1] + 1])
    return slice(end - length, end)
