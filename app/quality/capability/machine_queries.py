"""Machine performance of the newest run of parts that nothing was changed in. Never writes. Lengths in mm."""

from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from app.core.spc import machine_performance as core
from app.core.spc.machine_performance import RUN, MachinePerformance
from app.core.spc.quoting import or_refused
from app.core.spc.refusal import Floats, Refused
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.quality.baselines.series_queries import read
from app.quality.capability.queries import Singles, Study, moment

LOOKED_AT = 5000
"""The newest readings among which a run is looked for."""


@dataclass(frozen=True, slots=True)
class Run:
    """A run of parts: deviations and their sequences, and the readings in between that a person excluded, or probe faults."""

    sequence: NDArray[np.int64]
    values: Floats
    first_at: datetime
    last_at: datetime
    left_out: int
    result: MachinePerformance | Refused


def newest_run(session: Session, study: Study, length: int = RUN, window: Window | None = None) -> Run | Refused:
    """The newest run of N parts between which no correction came into effect, no tool was changed and nothing was set.

    Of the last 5000 readings of the window, else of all, by the limits of the study; a `Refused` says how long the longest run
    among them is.
    """
    current = study.current
    if window is None:
        window = statistics.window_of(session, current.characteristic, last=LOOKED_AT)
    window = replace(window, first=max(window.first, window.last - LOOKED_AT + 1))
    found = read(session, current, Singles(current.parameters.factor, "deviation"), window)
    series, at = found.series, found.measured_at
    effects = statistics.history_of(session, current.characteristic, window, ("compensated", "parameters_version"))
    here = np.isin(effects["sequence"], series.sequence)
    changed = series.begins.copy()
    for name in ("compensated", "parameters_version"):
        values = np.nan_to_num(effects[name][here], nan=-1.0)
        changed[1:] |= values[1:] != values[:-1]
    try:
        place = core.newest_run(changed, length)
    except Refused as refused:
        return refused
    sequence, values = series.sequence[place], series.values[place]
    result = or_refused(
        lambda: core.machine_performance(
            values, study.limits, side=study.natural_limit.side, confidence=study.confidence
        )
    )
    left_out = int(sequence[-1] - sequence[0]) + 1 - len(sequence)
    return Run(sequence, values, moment(at[place][0]), moment(at[place][-1]), left_out, result)
