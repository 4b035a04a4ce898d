"""Parts that stay out of tolerance although each was corrected for: whatever the cause, going on makes the next one scrap as well.

A correction in full brings the next part to the target, unless factor, offset register or unit is wrong, another characteristic of the
tool takes it back, the control does not use the offset, or the tool wears by the tolerance from part to part. `app.core.gain` and
`app.core.overshoot` say which it is where the sizes can tell; here it is the outcome alone that counts. Looking back from the newest
part, all are out of tolerance; `MOST` of them are so with everything counted in that was on its way to them, so each of these asked
for a correction in full, and all but the last got it.

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
    """A part: its deviation, the same with what was outstanding counted in, and if a correction went out for it."""

    deviation: float
    decided: float
    corrected: bool


def parts_still_out(parts: Sequence[Judged], limits: Limits | Rules, farthest: float = inf) -> int:
    """The number of parts in a row that are out of tolerance, if `MOST` corrections in full have not brought them back; else 0.

    parts: the newest since the tool change, edit or resume, in order; the last one asks for a correction now. farthest: the largest
    deviation that the largest step (`max_step`) takes back in full, mm.

    >>> limits = Limits(1000, 5000, 8000, 25000, 50000)
    >>> swinging = [Judged(d, d, True) for d in (0.009, -0.0085, 0.009, -0.009, 0.0095)]
    >>> parts_still_out(swinging, limits), parts_still_out(swinging[1:], limits)
    (5, 0)
    >>> parts_still_out([Judged(0.009, 0.009, True), *[Judged(0.009, 0.0, False)] * 20], limits)  # all but one were on the way
    0
    """
    out = corrections = 0
    for place, part in enumerate(reversed(parts)):
        if within_tolerance(part.deviation, limits):
            break
        out += 1
        asks = not within_tolerance(part.decided, limits) and nanometres(abs(part.decided)) <= farthest * 1e6
        corrections += asks and (part.corrected or place == 0)
    return out if corrections >= MOST else 0
