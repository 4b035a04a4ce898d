"""The sampling that the newest readings of a characteristic allow. Never writes."""

from typing import NamedTuple

import numpy as np
from sqlalchemy.orm import Session

from app.core.sampling import USUAL_PPM, Process, Proposal, proposal
from app.core.spc.refusal import Refused
from app.core.wear import Fit
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.control_plan import queries as plans
from app.loop.summaries import queries as statistics
from app.quality.capability.queries import judgement_of
from app.quality.chart_signals import queries as signals
from app.quality.wear import queries as wears

USUAL = 1_000  # readings, the newest


class Sampling(NamedTuple):
    """The proposal with all that it rests on. every: the interval of the plan in force, None where parts do not count."""

    current: CurrentCharacteristic
    process: Process
    proposal: Proposal
    most_ppm: float
    every: int | None


def sampling_of(
    session: Session, current: CurrentCharacteristic, last: int = USUAL, most_ppm: float = USUAL_PPM
) -> Sampling | Refused:
    """Propose how many parts are measured, from the newest readings; refused where they carry no index at all."""
    window = statistics.window_of(session, current.characteristic, last=last)
    judged = judgement_of(session, current, window)
    indices = judged.indices
    if isinstance(indices, Refused):
        return indices
    limits, values = judged.limits, judged.values
    low = -np.inf if limits.lower is None else limits.lower
    high = np.inf if limits.upper is None else limits.upper
    out = (values < low) | (values > high)
    process = Process(
        limits,
        indices.mean,
        indices.overall.value,
        _wear(wears.wear_of(session, current, wears.life_of(session, current)).fit),
        indices.readings,
        int(out[:1].sum() + (out[1:] & ~out[:-1]).sum()),
        judged.stable,
        signals.counts(session, current.characteristic)["open"],
        judged.quoting.low,
        current.parameters.weighting_factor,
    )
    every = plans.stated(plans.plan_of(session, current)).every
    return Sampling(current, process, proposal(process, most_ppm), most_ppm, every)


def _wear(fit: Fit | None) -> float | None:
    """Wear per part at most: the end of its interval (95 %, one-sided) that is further from 0."""
    return None if fit is None else abs(fit.slope) + 1.645 * fit.slope_error
