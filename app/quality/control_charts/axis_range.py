"""Range of the axis of a control chart, and the marks for points that lie far beyond it. Pure; µm.

One broken insert at +400 µm would press limits of ±3 µm into a line. So the axis shows the limits and what lies about them; points
beyond are at its edge as open triangles with their value, and the line to them leaves the chart.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.charts import Dots, Labels, Series
from app.core.spc.shewhart import Chart
from app.language.formatting import NO_BREAK_SPACE, signed
from app.language.i18n import _
from app.quality.control_charts.view import View

ROOM = 0.08
TOO_FAR = 4.0  # times as far as limits and most points reach
WITH_VALUES = 8  # points beyond that are labelled
CLOSE = 96  # px, the width of a label: of points closer than this the farthest is labelled, behind the last of them
LATE = (
    0.12  # of the width of the chart, and room for a label at least: nearer to its right edge none is behind its points
)
MOST = 0.04  # of the points on either side may lie beyond: a broken insert is seen on a few parts before it is changed
FEW = 8  # points of which none is far
UNSIGNED = (Chart.MOVING_RANGE, Chart.RANGES, Chart.DEVIATIONS)


def reach(view: View) -> tuple[float, float]:
    """Lowest and highest value on the axis."""
    limits = [part for part in (view.lower, view.upper, view.centre) if part is not None]
    points = [part for part in (view.points, view.below) if part is not None]
    whole = _ends([*limits, *points])
    if view.kind is Chart.CUSUM or len(view) < FEW:
        return _open(*whole)
    most = [np.quantile(part, (MOST, 1 - MOST)) for part in points]
    low, high = _ends([*limits, *most])
    if whole[1] - whole[0] <= TOO_FAR * (high - low):
        return _open(*whole)
    about = (high - low) / 2
    return _open(max(whole[0], low - about), min(whole[1], high + about))


def _ends(parts: list[Any]) -> tuple[float, float]:
    return min(float(np.min(part)) for part in parts) * 1000, max(float(np.max(part)) for part in parts) * 1000


def _open(low: float, high: float) -> tuple[float, float]:
    if not high > low:
        return low - 1, high + 1
    room = (high - low) * ROOM
    return low - room, high + room


def beyond(
    view: View, drawn: NDArray[np.int64], links: list[object], low: float, high: float, width: int
) -> list[Series]:
    """The points that the axis does not reach, at its edge. links: what each drawn point opens; width: of the chart, px."""
    values = view.points[drawn] * 1000
    far = (values > high) | (values < low)
    if not far.any():
        return []
    inset = (high - low) * 0.025
    above = values[far] > 0.5 * (low + high)
    said = [f"{value:.0f} µm" if view.kind in UNSIGNED else f"{signed(value, 0)} µm" for value in values[far].tolist()]
    x = view.last[drawn[far]]
    wide = view.last[-1] - view.first[0]
    ends = int(view.first[0]), view.last[-1] - max(0.0, LATE - CLOSE / width) * wide
    texts, before = [""] * len(said), np.zeros(len(said), dtype=np.bool_)
    for edge in (above, ~above):
        _label(texts, before, said, np.abs(values[far]), x, np.flatnonzero(edge), CLOSE / width * wide, ends)
    beside = np.where(before, "middle left", "middle right").tolist()
    return [
        Series(
            x.tolist(),
            np.where(above, high - inset, low + inset).tolist(),
            dots=Dots(
                ["triangle-up-open" if up else "triangle-down-open" for up in above.tolist()],
                12,
                "attention",
                edge="attention",
                edge_width=2,
            ),
            labels=Labels(texts, beside, "ink") if sum(map(bool, texts)) <= WITH_VALUES else None,
            meta="beyond",
            hover=[_("Reading") + f" {number}<br>{value}" for number, value in zip(x.tolist(), said, strict=True)],
            links=[links[at] for at in np.flatnonzero(far).tolist()],
        )
    ]


def _label(
    texts: list[str],
    before: NDArray[np.bool_],
    said: list[str],
    size: NDArray[np.float64],
    x: NDArray[np.int64],
    at: NDArray[np.int64],
    close: float,
    ends: tuple[float, float],
) -> None:
    """Label the points of one edge: those too close to each other share one, of the one that is farthest out.

    It stands behind the last of them where there is room, else before the first, else nowhere: the farthest choose first.
    close: the width of a label; ends: between which labels may lie.
    """
    groups = [group for group in np.split(at, np.flatnonzero(np.diff(x[at]) > close) + 1) if group.size]
    starts, stops = [x[group[0]] for group in groups], [x[group[-1]] for group in groups]
    room = [
        start - stop for start, stop in zip([*starts, ends[1]], [ends[0], *stops], strict=True)
    ]  # before each, and at the end
    for n in sorted(range(len(groups)), key=lambda n: -size[groups[n]].max()):
        group = groups[n]
        label = said[group[np.argmax(size[group])]]
        if room[n + 1] >= close:
            room[n + 1] -= close
            texts[group[-1]] = f"{NO_BREAK_SPACE}{label}"
        elif room[n] >= close or len(groups) == 1:
            room[n] -= close
            texts[group[0]], before[group[0]] = f"{label}{NO_BREAK_SPACE}", True
