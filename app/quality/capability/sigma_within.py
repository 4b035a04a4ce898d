"""Sigma within by choice: from neighbours, or pooled inside the readings of one part, one shift, one nest or spindle. Never writes."""

import numpy as np
from sqlalchemy.orm import Session

from app.core.spc.refusal import Floats, Reason, Refused
from app.core.spc.shewhart import FEWEST_SUBGROUPS
from app.core.spc.spread import Sigma, pooled, subgroups
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries.queries import History, Window
from app.quality.baselines.series_queries import begin_of_runs, labels_of
from app.quality.capability.kinds import SigmaBy


def sigma_within(
    session: Session, current: CurrentCharacteristic, window: Window, counted: History, values: Floats, by: SigmaBy
) -> Sigma | None:
    """The pooled sigma inside the subgroups of these readings, as charts of subgroups form them; None of neighbours.

    Raises `Refused` for fewer than 20 subgroups of two readings or more.
    """
    if by is SigmaBy.NEIGHBOURS:
        return None
    labels = labels_of(session, current, window, counted["sequence"], counted["measured_at"], by.value)
    starts = np.flatnonzero(begin_of_runs(labels))
    sizes = np.diff(np.append(starts, len(labels)))
    telling = int((sizes > 1).sum())
    if telling < FEWEST_SUBGROUPS:
        raise Refused(Reason.TOO_FEW_SUBGROUPS, have=telling, needed=FEWEST_SUBGROUPS)
    return pooled(subgroups(values, sizes))
