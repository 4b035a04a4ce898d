"""Parts that stay out of tolerance in spite of corrections in full: whatever the cause, the next part would be scrap as well.

A correction in full brings the next part to the target, unless factor, offset register or unit is wrong, another characteristic of the
tool takes it back, the control does not use the offset, or the tool wears by the tolerance from part to part. `app.core.opposite_effect` and
`app.core.overshoot` say which it is where the sizes can tell; here it is the outcome alone that counts. Looking back from the newest
part, all are out of tolerance; `IN_VAIN` of them are so with everything counted in that was on its way to them, and each of these asked
for a correction in full: the newest does so now, and gets none, for `app.loop.readings.writer.correction_guards` then pauses the tool.

A process that scatters over more than its tolerance comes to as many by chance, because each correction answers its scatter
(docs/reference/gain.md says how often). Lengths are mm.
"""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from app.core.decision.limits import Limits, nanometres, within_tolerance
from app.core.decision.step import Rules

IN_VAIN = 5
"""Parts that ask for a correction in full before the tool is paused; the one of the last is not issued."""


class Judged(NamedTuple):
    """A part: its deviation, the same with what was outstanding counted in, and if a correction was issued for it, or would be now."""

    deviation: float
    decided: float
    corrected: bool


class StillOut(NamedTuple):
    """Parts in a row that are out of tolerance, and how many corrections in full were issued for them before the newest."""

    parts: int
    corrected: int


def still_out(parts: Sequence[Judged], limits: Limits | Rules, farthest: float = inf) -> StillOut | None:
    """The parts in a row that are out of tolerance, if `IN_VAIN` of them ask for a correction in full; else None.

    parts: the newest since the tool change, edit or resume, in order; the last one asks for a correction now. farthest: the largest
    deviation that the largest step (`max_step`) takes back in full, mm.

    >>> limits = Limits(1000, 5000, 8000, 25000, 50000)
    >>> swinging = [Judged(d, d, True) for d in (0.009, -0.0085, 0.009, -0.009, 0.0095)]
    >>> still_out(swinging, limits), still_out(swinging[1:], limits)
    (StillOut(parts=5, corrected=4), None)
    >>> still_out([Judged(0.009, 0.009, True), *[Judged(0.009, 0.0, False)] * 20], limits) is None  # all but one were on the way
    True
    """
    asked = list[bool]()
    for part in reversed(parts):
        if within_tolerance(part.deviation, limits):
            break
        far_off = not within_tolerance(part.decided, limits)
        asked.append(part.corrected and far_off and nanometres(abs(part.decided)) <= farthest * 1e6)
    return StillOut(len(asked), sum(asked[1:])) if sum(asked) >= IN_VAIN else None
