"""Measuring 1 in n parts: the risk of it, and the largest n that keeps to a risk.

Of n parts one is measured. Part j after it (j = 1 … n - 1) is not measured, and the offset follows none of them, so the mean drifts
away by wear, taken towards the nearer limit. The share of all parts that are out of tolerance and go out unmeasured is::

    risk(n) = 1/n Σ P(out | mean ± (j + (k - 1) (n - 1)) w, σ)  +  r (n - 1) / 2

k: the weighting factor R29. A correction by the running average removes about 1/k of the deviation, so the offset stays behind the wear
by (k - 1) parts where every part is measured, which the mean has already, and by (k - 1) n where 1 in n is. Deviations beyond R34
are corrected in full and stay behind by less: the risk errs to the safe side.
P: the normal distribution, the worse of the two signs. w: wear per part, the upper end of its interval. r: sudden events per part (a
chipped edge, a slipped part), after which on average (n - 1) / 2 parts go out before the next measurement (Duncan 1956, J. Am.
Stat. Assoc. 51, 228: the process shifts at random between two samples). Of k events in N readings r = (k + 1/2) / (N + 1), the
posterior mean of Jeffreys' prior: none in a thousand readings is no proof that none comes.

Fewer than every part are measured only where the process is well known, stable and capable (`Hindrance`). Lengths are mm.
"""

from enum import StrEnum
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from app.core.spc.capability import Limits
from app.core.spc.refusal import Floats

CHOICES = (1, 2, 3, 4, 5, 8, 10, 15, 20, 25, 50, 100)
"""Intervals that are proposed."""
CAPABLE = 1.33
"""The least lower end of the interval of the index that is quoted."""
FEWEST = 100  # readings
USUAL_PPM = 1_000.0


class Hindrance(StrEnum):
    """The reason why every part is to be measured."""

    FEW_READINGS = "few_readings"
    UNSTABLE = "unstable"
    OPEN_SIGNAL = "open_signal"
    NOT_CAPABLE = "not_capable"
    WEAR_UNKNOWN = "wear_unknown"


class Process(NamedTuple):
    """All that is known of a process. mean, sigma: of the deviations; wear: per part, at most, None: not known.

    jumps: runs of readings out of tolerance; stable: None where too little is known; signals: that are open; index_low: the lower
    end of the interval of the capability index that is quoted, None where none may be.
    """

    limits: Limits
    mean: float
    sigma: float
    wear: float | None
    readings: int
    jumps: int
    stable: bool | None
    signals: int
    index_low: float | None
    weighting: float = 1.0


class Risk(NamedTuple):
    """Parts per million that would go out of tolerance unmeasured when 1 in `every` is measured."""

    every: int
    ppm: float


class Proposal(NamedTuple):
    """The interval that is proposed, why it is not larger, and the risk of each choice."""

    every: int
    hindrances: tuple[Hindrance, ...]
    risks: tuple[Risk, ...]

    @property
    def ppm(self) -> float:
        """The risk of the interval that is proposed."""
        return next(risk.ppm for risk in self.risks if risk.every == self.every)


def hindrances(process: Process) -> tuple[Hindrance, ...]:
    """Everything that forbids to measure fewer parts."""
    found = {
        Hindrance.FEW_READINGS: process.readings < FEWEST,
        Hindrance.UNSTABLE: process.stable is not True,
        Hindrance.OPEN_SIGNAL: process.signals > 0,
        Hindrance.NOT_CAPABLE: process.index_low is None or process.index_low < CAPABLE,
        Hindrance.WEAR_UNKNOWN: process.wear is None,
    }
    return tuple(name for name, holds in found.items() if holds)


def risk(process: Process, every: int) -> float:
    """Parts per million that go out of tolerance unmeasured; it never falls where fewer parts are measured, nor with R29.

    >>> process = Process(Limits(-6.0, 6.0), 0.0, 1.0, 0.1, 10_000, 0, True, 0, 1.9)
    >>> [round(risk(process, every), 1) for every in (1, 2, 10, 50)]
    [0.0, 25.0, 225.0, 16341.7]
    >>> round(risk(process._replace(weighting=3.0), 10), 1)
    374.2
    """
    behind = (process.weighting - 1) * (every - 1)
    drift = (process.wear or 0.0) * (np.arange(1, every, dtype=np.float64) + behind)
    sudden = (process.jumps + 0.5) / (process.readings + 1)
    drifting = float(np.maximum(_out(process, drift), _out(process, -drift)).sum()) / every
    return min(1.0, drifting + sudden * (every - 1) / 2) * 1e6


def _out(process: Process, drift: Floats) -> Floats:
    """Probability to be out of tolerance with the mean so far off."""
    mean, limits, sigma = process.mean + drift, process.limits, max(process.sigma, 1e-12)
    below = 0.0 if limits.lower is None else ndtr((limits.lower - mean) / sigma)
    above = 0.0 if limits.upper is None else ndtr((mean - limits.upper) / sigma)
    return np.asarray(below + above + np.zeros_like(drift))


def proposal(process: Process, most_ppm: float = USUAL_PPM) -> Proposal:
    """The largest interval whose risk is at most `most_ppm`; every part of a process that is not known well, stable and capable."""
    against = hindrances(process)
    risks = tuple(Risk(every, risk(process, every)) for every in CHOICES)
    every = 1 if against else max(each.every for each in risks if each.ppm <= most_ppm or each.every == 1)
    return Proposal(every, against, risks)


def saved(every: int, seconds: float, parts: int = 1_000) -> float:
    """Seconds of measuring that are saved in N parts. seconds: that one measurement takes.

    >>> saved(5, 12.0)
    9600.0
    """
    return seconds * parts * (1 - 1 / every)
