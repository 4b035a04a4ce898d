"""Readings that lie far from all others: they are named, never left out, and a few of them hide none."""

import numpy as np
from numpy.typing import NDArray

from app.core.spc.refusal import Floats
from app.core.spc.resolution import resolution_of
from app.core.spc.variation import varies

FAR, ALWAYS_FAR, QUARTILE, TAIL = 14.0, 50.0, 0.6745, 1.645
"""Beyond `FAR` sigma a reading is named, sigma being the wider of the middle half and the middle nine tenths; beyond `ALWAYS_FAR`
sigma of the middle half in any case. Of a normal distribution quartiles lie 0.6745, the 95 % point 1.645 sigma from the median."""
FEWEST_TO_STAND_OUT, FEWEST_FOR_A_TAIL = 8, 20


def far_off(values: Floats) -> NDArray[np.bool_]:
    """Mark the readings that lie far from all others: each side of the median has a limit, and all beyond it are marked.

    The limit is 14 sigma, and sigma is what the bulk says: the distance of the side's quartile (half the distance of both, if that
    is more) or of its 95 % point, each by that of a normal distribution. A long tail shows there and moves its limit
    outwards, to fifty sigma of the middle half at most. What lies farther out moves nothing, so a few far readings hide none,
    however they lie (Barnett and Lewis 1994, Outliers in statistical data, on masking): what is moved nearer to the middle
    without entering the bulk unmarks no other, nor do readings added evenly to the middle half, however many.

    No process of one mode brings such readings; a chip under the stylus does, a broken edge, a part of another kind. They are
    named, never left out: whether the part was so is for a person to say. docs/reference/statistics.md says how often a heavy
    tail has one by chance, and what readings added anywhere can do.

    >>> far_off(np.array([1.0, 2, 3, 4, 5, 6, 7, 8, 400])).nonzero()[0].tolist()
    [8]
    """
    far = np.zeros(len(values), np.bool_)
    if len(values) < FEWEST_TO_STAND_OUT:
        return far
    quarter, median, three = np.quantile(values, [0.25, 0.5, 0.75])
    step = 0.0
    if not varies(float(three - quarter), values):
        step = resolution_of(values).step
        if step == 0:
            return far
    for away, quartile in ((values - median, three - median), (median - values, median - quarter)):
        middle = max(float(quartile), float(three - quarter) / 2, step * QUARTILE) / QUARTILE
        tail = np.sort(away)[int(0.95 * (len(away) - 1))] / TAIL if len(away) >= FEWEST_FOR_A_TAIL else 0.0
        far |= away > min(FAR * max(middle, float(tail)), ALWAYS_FAR * middle)
    return far
