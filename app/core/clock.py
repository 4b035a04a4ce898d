"""A clock that is behind: what it states lies as long before its receipt, reading after reading.

What a network kept back comes in a bunch, each reading less late than the one before; what a file holds lies as far back as it lies.
A clock that is wrong is wrong by the same, whatever the pace of the machine. So does a buffer that each part goes through at an even pace:
when a part was *cut* may lie as long before, truly, and only when it was *measured* may not.

One reading says it for certain that names a correction which was issued after its part was cut, by the clock in question: no buffer
makes that true. Either the clock is behind or the number is not that of the part. Times are s.
"""

from collections.abc import Sequence

FEWEST = 5  # readings in a row
# A gauge may write when it began, a file be fetched each five minutes: each reading then lies as many minutes before, and truly.
LEAST = 900.0
EVEN = 60.0  # by how much two of them may differ: clocks that tell the minute
SPAN = 4.0  # times that, and longer, they take to arrive: one by one
DIFFER = 60.0  # by how much two clocks may differ that are right


def constant_lag(received: Sequence[float], stated: Sequence[float]) -> float | None:
    """By how much the newest readings all lie before their receipt; None unless by as much. stated: by the clock in question.

    >>> constant_lag([0, 60, 125, 180, 240], [-7200, -7141, -7075, -7021, -6960])
    7200
    >>> constant_lag([0, 60, 125, 180, 240], [-1, 58, 125, 179, 239]) is None  # the clock is right
    True
    >>> constant_lag([0, 1, 2, 3, 4], [-7200, -7140, -7075, -7020, -6960]) is None  # a bunch
    True
    """
    received, stated = received[-FEWEST:], stated[-FEWEST:]
    if len(received) < FEWEST:
        return None
    lags = sorted(at - then for at, then in zip(received, stated, strict=True))
    uneven, took = lags[-1] - lags[0], max(received) - min(received)
    if lags[0] < LEAST or uneven > min(EVEN, took / SPAN) or took <= 0:
        return None
    return lags[FEWEST // 2]


def explained(lag: float, answered: float) -> bool:
    """Tell if an answer about a lag explains this one: parts that are as long on their way, to within what may be read as even.

    More by `LEAST` is another fault: a clock that went wrong since. A clock that jumps by as much shows in each lag to within `EVEN`.

    >>> explained(7200, answered=7200), explained(7260, answered=7200), explained(600, answered=7200), explained(8100, answered=7200)
    (True, True, True, False)
    """
    return lag - answered < LEAST - EVEN


def behind_by(stated: float, not_before: float) -> float | None:
    """By how much, at least, a clock is behind that states this time for what cannot have been earlier; None where it may be right.

    >>> behind_by(-7200, not_before=0), behind_by(-59, not_before=0)
    (7200, None)
    """
    least = not_before - stated
    return least if least > DIFFER else None
