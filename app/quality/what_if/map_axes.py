"""The settings that a map shows unless a person names others: round values of k and R33, today's among them. mm."""

from bisect import bisect_left
from collections.abc import Sequence

from app.core.decision.limits import nanometres
from app.core.parameters import Parameters

STEPS = 20
FACTORS = (1, 1.25, 1.5, 1.75, 2, 2.5, 3, 3.5, 4, 4.5, 5, 6, 7, 8, 9, 10, 12, 14, 17, 20)
ROUND = (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8)
SHARES = (1 / 3, 1 / 2, 2 / 3, 5 / 6, 1.0)


def weighting_factors(today: Parameters) -> list[float]:
    """K from 1 to 20, today's in the place of the nearest."""
    return _with([float(k) for k in FACTORS], today.weighting_factor)


def zero_ranges(today: Parameters, averaging_limit: float) -> list[float]:
    """R33 from 0 up to R34 in round steps, today's in the place of the nearest.

    >>> p = Parameters(target=10, tolerance_width=0.016, zero_range=0.0011, averaging_limit=0.0053, wear_limit=0.3,
    ...                confidence_limit=1.0)
    >>> [round(1000 * r33, 2) for r33 in zero_ranges(p, 0.0053)][:8]
    [0.0, 0.3, 0.6, 0.9, 1.1, 1.5, 1.8, 2.1]
    """
    step = rounded_up(max(averaging_limit, 1e-6) / STEPS)
    steps = [round(at * step, 9) for at in range(STEPS + 1) if at * step <= averaging_limit + 1e-9]
    return _with(steps, today.zero_range)


def averaging_limits(today: Parameters) -> list[float]:
    """R34 to choose from: thirds, halves and sixths of R35/2, and today's."""
    half = today.half
    return sorted({*(round(nanometres(share * half) / 1e6, 9) for share in SHARES), today.averaging_limit})


def rounded_up(value: float) -> float:
    """One of `ROUND` times a power of ten, nothing below.

    >>> rounded_up(0.000265), rounded_up(0.0011)
    (0.0003, 0.0015)
    """
    power = 1e-9
    while power * 10 <= value * (1 + 1e-9):
        power *= 10
    return round(next(step * power for step in (*ROUND, 10) if step * power >= value * (1 - 1e-9)), 12)


def _with(values: list[float], today: float) -> list[float]:
    """These values, ascending, with today's in the place of the one next to it; in addition where it lies outside."""
    if any(nanometres(value * 1000) == nanometres(today * 1000) for value in values):
        return values
    if today > values[-1]:
        return [*values, today]
    at = bisect_left(values, today)
    nearest = at if at == 0 or values[at] - today <= today - values[at - 1] else at - 1
    # The ends stay: 0 and R34 say where the map begins and ends.
    nearest = min(max(nearest, 1), len(values) - 2) if len(values) > 2 else nearest
    return sorted([*values[:nearest], today, *values[nearest + 1 :]])


def coarser(values: Sequence[float], today: float) -> list[float]:
    """Every second value, and today's, which stays on the map.

    >>> coarser([1.0, 1.5, 2.0, 2.5, 3.0], 2.5)
    [1.0, 2.0, 2.5, 3.0]
    """
    return sorted({*values[::2], *(value for value in values if nanometres(value * 1000) == nanometres(today * 1000))})


def place(values: Sequence[float], value: float) -> int | None:
    """Index of a value, to the picometre; None if it is not there."""
    places = [at for at, entry in enumerate(values) if nanometres(entry * 1000) == nanometres(value * 1000)]
    return places[0] if places else None
