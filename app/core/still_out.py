"""Parts that stay out of tolerance in spite of corrections in full: whatever the cause, the next part would be scrap as well.

A correction in full brings the next part to the target, unless factor, offset register or unit is wrong, another characteristic of the
tool takes it back, the control does not use the offset, or the tool wears by the tolerance from part to part. `app.core.opposite_effect` and
`app.core.overshoot` say which it is where the sizes can tell; here it is the outcome alone that counts. Looking back from the newest
part, all are out of tolerance; `MOST` of them are so with everything counted in that was on its way to them, and for each of these
a correction in full went out, or would now.

A process that scatters over more than its tolerance comes to as many by chance, because each correction answers its scatter
(docs/reference/gain.md says how often). Lengths are mm.
"""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from app.core.decision.limits import Limits, nanometres, within_tolerance
from app.core.decision.step import Rules

MOST = 5


class Judged(NamedTuple):
    """A part: its deviation, the same with what was outstanding counted in, and if a correction went out for it, or would now."""

    deviation: float
    decided: float
    corrected: bool


class StillOut(NamedTuple):
    """Parts in a row that are out of tolerance, and for how many of them a correction in full went out."""

    parts: int
    corrected: int


def still_out(parts: Sequence[Judged], limits: Limits | Rules, farthest: float = inf) -> StillOut | None:
    """The parts in a row that are out of tolerance, if `MOST` corrections in full have not brought them back; else None.

    parts: the newest since the tool change, edit or resume, in order; the last one asks for a correction now. farthest: the largest
    deviation that the largest step (`max_step`) takes back in full, mm.

    >>> limits = Limits(1000, 5000, 8000, 25000, 50000)
    >>> swinging = [Judged(d, d, True) for d in (0.009, -0.0085, 0.009, -0.009, 0.0095)]
    >>> still_out(swinging, limits), still_out(swinging[1:], limits)
    (StillOut(parts=5, corrected=5), None)
    >>> still_out([Judged(0.009, 0.009, True), *[Judged(0.009, 0.0, False)] * 20], limits) is None  # all but one were on the way
    True
    """
    out = corrected = 0
    for part in reversed(parts):
        if within_tolerance(part.deviation, limits):
            break
        out += 1
        asks = not within_tolerance(part.decided, limits) and nanometres(abs(part.decided)) <= farthest * 1e6
        corrected += asks and part.corrected
    return StillOut(out, corrected) if corrected >= MOST else None
