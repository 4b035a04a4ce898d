"""The ledger: rejects that corrections have prevented and caused, against the same parts without any correction.

Of each reading it is known whether the part was out of tolerance, and whether it would have been in the process without
corrections (`app.core.replay`, measure only). Saved are parts that would have been out and were not, spoiled those that were out
and would not have been; the net is what corrections were worth, in pieces. Late are parts that were out and would not have been with the
corrections that were issued before they were cut: what waiting for a confirmation cost.

The interval is that of batch means (Law, Simulation modeling and analysis, section 9.5): the net of `BATCHES` runs of readings in
a row scatters as it does, whatever links neighbours; it is never narrower than that of parts that turn by chance alone, of
variance saved + spoiled (McNemar 1947, Psychometrika 12, 153). A saving is claimed only where the interval to `CREDIBLE` lies above 0:
a loop that corrects noise saves a part now and then by chance.
"""

from enum import StrEnum
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.core.spc.spread import t_quantile

Flags = NDArray[np.bool_]
BATCHES, FEWEST_BATCHES, FEWEST_IN_BATCH = 20, 5, 10
LEVEL = 0.95  # of confidence, two-sided
CREDIBLE = 0.9999  # for a claim


class Worth(StrEnum):
    """Verdict on the net."""

    SAVED = "saved"
    COST = "cost"
    NEITHER = "neither"  # nothing is claimed


class Tally(NamedTuple):
    """Parts of a ledger. without, truly: out of tolerance without corrections, and as it was. half: half the interval of the net;
    sure: the same to `CREDIBLE`. None of both where there are too few readings.
    """

    readings: int = 0
    without: int = 0
    truly: int = 0
    saved: int = 0
    spoiled: int = 0
    late: int = 0
    half: float | None = None
    sure: float | None = None

    @property
    def net(self) -> int:
        """Rejects that there were less, or more where it is negative."""
        return self.saved - self.spoiled

    @property
    def low(self) -> float | None:
        """The lower end of the interval of the net."""
        return None if self.half is None else self.net - self.half

    @property
    def high(self) -> float | None:
        """The upper end."""
        return None if self.half is None else self.net + self.half

    @property
    def worth(self) -> Worth:
        """The verdict: a saving or a cost only where it is credible."""
        if self.sure is None or abs(self.net) <= self.sure:
            return Worth.NEITHER
        return Worth.SAVED if self.net > 0 else Worth.COST


def tally(without: Flags, truly: Flags, late: Flags) -> Tally:
    """The tally of readings in the order of their parts. Flags: out of tolerance without corrections, truly, and only for being late.

    >>> out, good = np.ones(200, np.bool_), np.zeros(200, np.bool_)
    >>> found = tally(out, good, good)
    >>> found.net, round(found.low, 1), found.worth.value
    (200, 170.4, 'saved')
    >>> tally(out[:40], good[:40], good[:40]).worth.value
    'neither'
    """
    net = without.astype(np.int64) - truly
    half, sure = (_half(net, level) for level in (LEVEL, CREDIBLE))
    return Tally(
        readings=len(truly),
        without=int(without.sum()),
        truly=int(truly.sum()),
        saved=int((net > 0).sum()),
        spoiled=int((net < 0).sum()),
        late=int((late & truly).sum()),
        half=half,
        sure=sure,
    )


def _half(net: NDArray[np.int64], level: float) -> float | None:
    batches = min(BATCHES, len(net) // FEWEST_IN_BATCH)
    if batches < FEWEST_BATCHES:
        return None
    sums = np.array([batch.sum() for batch in np.array_split(net, batches)], np.float64)
    deviation = max(sqrt(batches) * float(sums.std(ddof=1)), sqrt(np.abs(net).sum()))
    return t_quantile(batches - 1, level) * deviation


def together(tallies: list[Tally]) -> Tally:
    """Several in one. Their intervals add up in full, because characteristics of one part err together.

    >>> together([Tally(100, 9, 1, 8, 0, 0, 3.0, 5.0), Tally(50, 2, 0, 2, 0, 0, 1.0, 3.0)]).low
    6.0
    """
    return Tally(
        readings=sum(each.readings for each in tallies),
        without=sum(each.without for each in tallies),
        truly=sum(each.truly for each in tallies),
        saved=sum(each.saved for each in tallies),
        spoiled=sum(each.spoiled for each in tallies),
        late=sum(each.late for each in tallies),
        half=_sum([each.half for each in tallies]),
        sure=_sum([each.sure for each in tallies]),
    )


def _sum(halves: list[float | None]) -> float | None:
    known = [half for half in halves if half is not None]
    return sum(known) if known and len(known) == len(halves) else None
