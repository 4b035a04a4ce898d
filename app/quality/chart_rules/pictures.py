"""Small pictures of what each rule looks for: points about a centre, those that make the signal marked. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart

WIDTH, HEIGHT, MARGIN = 132, 52, 6
REACH = 4.2  # sigma from the centre to the edge

# Points as z, and which of them make the signal.
PATTERNS: dict[RuleName, tuple[Sequence[float], Sequence[int]]] = {
    RuleName.NELSON_1: ([0.4, -0.9, 0.8, -0.3, 1.1, 3.6, -0.5, 0.6, -0.8], [5]),
    RuleName.NELSON_2: ([-0.8, 0.5, 1.4, 0.4, 1.7, 0.8, 0.3, 1.6, 0.9, 0.6, -0.6], range(1, 10)),
    RuleName.NELSON_3: ([0.6, -1.7, -1.1, -0.4, 0.3, 1.1, 1.8, 0.7, 1.0], range(1, 7)),
    RuleName.NELSON_4: ([0.9, -0.8, 1.1, -1.2, 0.7, -0.9, 1.3, -0.6, 0.8, -1.1, 1.2, -0.7, 0.9, -1.0], range(14)),
    RuleName.NELSON_5: ([0.3, -0.7, 0.6, 2.5, 0.9, 2.4, 0.2, -0.6, 0.4], [3, 5]),
    RuleName.NELSON_6: ([-0.6, 0.4, 1.6, 1.3, 0.5, 1.9, 1.4, -0.3, 0.2], [2, 3, 5, 6]),
    RuleName.NELSON_7: (
        [1.6, 0.3, -0.5, 0.2, -0.4, 0.5, 0.1, -0.3, 0.4, -0.6, 0.2, 0.5, -0.2, 0.3, -0.4, 0.1, -1.5],
        range(1, 16),
    ),
    RuleName.NELSON_8: ([0.4, 1.5, -1.6, -1.3, 1.8, 1.4, -1.7, 1.3, -1.5, 0.3], range(1, 9)),
    RuleName.WESTERN_4: ([-0.7, 0.6, 1.3, 0.5, 1.6, 0.9, 0.4, 1.2, 0.7, -0.5], range(1, 9)),
}
OF_CHARTS: dict[Chart, tuple[Sequence[float], Sequence[int]]] = {
    Chart.MOVING_RANGE: ([-1.2, -2.0, 0.4, -1.5, -0.3, 3.5, -1.8, -0.9, -1.4], [5]),
    Chart.EWMA: ([0.2, -0.2, 0.4, 0.8, 1.2, 1.7, 2.3, 2.8, 3.3], [8]),
    Chart.CUSUM: ([0.0, 0.2, 0.0, 0.5, 0.9, 1.5, 2.2, 2.8, 3.5], [8]),
}
ZONES: dict[RuleName, Sequence[float]] = {
    RuleName.NELSON_1: (3.0,),
    RuleName.NELSON_5: (2.0,),
    RuleName.NELSON_6: (1.0,),
    RuleName.NELSON_7: (1.0,),
    RuleName.NELSON_8: (1.0,),
}


@dataclass(frozen=True, slots=True)
class Picture:
    """Lines across, a line through the points, and the points; in the units of the drawing."""

    centre: float
    limits: tuple[float, ...]
    course: str
    points: tuple[tuple[float, float], ...]
    hits: tuple[tuple[float, float], ...]


def picture(name: RuleName, chart: Chart) -> Picture:
    """Picture of the pattern that this rule looks for."""
    like = Chart.MOVING_RANGE if chart in {Chart.RANGES, Chart.DEVIATIONS} else chart
    like = Chart.EWMA if like is Chart.MOVING_AVERAGE else like
    z, hits = OF_CHARTS.get(like, PATTERNS[name])
    step = (WIDTH - 2 * MARGIN) / (len(z) - 1)
    places = [(round(MARGIN + at * step, 1), _height(value)) for at, value in enumerate(z)]
    return Picture(
        _height(0.0),
        tuple(_height(side * limit) for limit in ZONES.get(name, ()) for side in (1, -1)),
        " ".join(f"{x:g},{y:g}" for x, y in places),
        tuple(place for at, place in enumerate(places) if at not in hits),
        tuple(places[at] for at in hits),
    )


def _height(z: float) -> float:
    return round(HEIGHT / 2 - z * HEIGHT / 2 / REACH, 1)
