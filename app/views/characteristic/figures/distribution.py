"""Histogram of the deviations, and chart of the sizes over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.decision.limits import HasLimits, Limits, in_nanometres
from app.language.i18n import _
from app.language.numbers import um
from app.language.times import on_axis
from app.views.characteristic.figures.scale import TrueScale
from app.views.characteristic.figures.sizes import SizeAxis, size_lines
from app.web.theme import ZONE_SYMBOLS, Palette, ThemeName, date_axis, layout, palette, zone_colour, zone_name

Floats = NDArray[np.float64]

BARS_PER_SIDE = 15  # whole bars between target and tolerance limit, so that the limits fall between bars
REACH = 1.4  # the histogram ends at so many times the tolerance; what lies further out is in the two end bars
WHOLE_BARS = round(BARS_PER_SIDE * REACH)  # on each side of the target
FEW = 4  # readings in the longest bar up to which they are counted by ones: there are no half readings


@dataclass(frozen=True)
class RunPoint:
    """One reading and when; mm. size: corrected by the empirical value of then; measured: as the machine sent it."""

    sequence: int
    at: datetime
    deviation: float
    zone: str
    excluded: bool = False
    link: str | None = None
    size: float | None = None
    measured: float | None = None


def histogram_edges(limits: HasLimits) -> list[float]:
    """The edges (mm) between the bars, ascending; bars 0 and n are open to the outside (as width_bucket counts them)."""
    half = max(Limits.of(limits).tolerance, 1)
    return [half * i / BARS_PER_SIDE / 1e6 for i in range(-WHOLE_BARS, WHOLE_BARS + 1)]


def counting_edges(limits: HasLimits) -> list[float]:
    """The edges as deviations in whole nanometres are counted by. A value on an edge is in the upper bar, but on the
    tolerance limit itself it is good, so it counts inside.
    """
    half = max(Limits.of(limits).tolerance, 1)
    edges = [half * i / BARS_PER_SIDE for i in range(-WHOLE_BARS, WHOLE_BARS + 1)]
    edges[WHOLE_BARS + BARS_PER_SIDE] += 0.5
    return edges


def histogram_counts(deviations: Sequence[float] | Floats, limits: HasLimits) -> list[int]:
    """Number of deviations (mm) in each bar; one bar more than there are edges."""
    edges = counting_edges(limits)
    bars = np.searchsorted(edges, in_nanometres(np.asarray(deviations, np.float64)), side="right")
    return [int(count) for count in np.bincount(bars, minlength=len(edges) + 1)]


def histogram_figure(counts: Sequence[int], limits: HasLimits, *, theme: ThemeName = "light") -> dict[str, Any]:
    """The spread, lying beside the zone chart: deviation upward (µm), bars to the right; the limits drawn in."""
    colours = palette(theme)
    edges = [edge * 1000 for edge in histogram_edges(limits)]
    width = edges[1] - edges[0]
    centres = [edges[0] - width / 2, *(edge + width / 2 for edge in edges)]
    half = limits.tolerance_width * 500
    total = sum(counts)
    names = [_("{low} to {high} µm").format(low=f"{c - width / 2:+.1f}", high=f"{c + width / 2:+.1f}") for c in centres]
    names[0], names[-1] = (
        _("below {low} µm").format(low=f"{edges[0]:+.1f}"),
        _("above {high} µm").format(high=f"{edges[-1]:+.1f}"),
    )
    extent = edges[-1] + width
    lines = [
        {
            "type": "line",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "y0": sign * limit,
            "y1": sign * limit,
            "line": {"color": colour, "width": thickness, "dash": dash},
        }
        for limit, colour, thickness, dash in (
            (half, colours.ink, 1.75, "solid"),
            (limits.averaging_limit * 1000, colours.faint, 1, "solid"),
            (limits.zero_range * 1000, colours.faint, 1, "solid"),
            (0.0, colours.quiet, 1, "4px,4px"),
        )
        for sign in ((1, -1) if limit else (1,))
        if limit <= extent
    ]
    return {
        "data": [
            {
                "type": "bar",
                "orientation": "h",
                "name": _("Readings"),
                "meta": "histogram",
                "x": list(counts),
                "y": centres,
                "width": width * 0.9,
                "marker": {
                    "color": [colours.attention if abs(c) > half else colours.steady for c in centres],
                    "line": {"width": 0},
                },
                "text": [
                    f"<b>{name}</b><br>"
                    + _("{n} readings, {share}").format(n=count, share=f"{count / total:.1%}" if total else "–")
                    for name, count in zip(names, counts, strict=True)
                ],
                "textposition": "none",
                "hovertemplate": "%{text}<extra></extra>",
            }
        ],
        "layout": layout(
            theme,
            bargap=0,
            xaxis={"rangemode": "tozero", "tickformat": "d", "showgrid": True, "fixedrange": True}
            | ({"nticks": 4} if max(counts) > FEW else {"dtick": 1})
            | _title(_("Readings"), colours),
            yaxis={
                "range": [-extent, extent],
                "fixedrange": True,
                "showgrid": False,
                "tickmode": "array",
                "tickvals": [-half, 0, half],
                "ticktext": [um(-half / 1000).replace("\xa0µm", ""), "0", um(half / 1000).replace("\xa0µm", "")],
            }
            | _title(_("Deviation, µm"), colours),
            shapes=lines,
            annotations=[] if total else [_nothing(colours)],
        ),
    }


def run_figure(
    points: Sequence[RunPoint], limits: HasLimits, *, sizes: SizeAxis, theme: ThemeName = "light"
) -> dict[str, Any]:
    """Corrected sizes (mm) over time, with target and tolerance as the drawing has them.

    What lies far outside the tolerance stands at the edge with its deviation: one probe fault would press all else into a line.
    """
    colours = palette(theme)
    half, target = limits.tolerance_width / 2, sizes.target
    scale = TrueScale.of(limits, [point.deviation for point in points])
    reach = scale.extent / 1000
    return {
        "data": [
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": _("Size"),
                "meta": "run",
                "x": [on_axis(point.at) for point in points],
                "y": [round(target + scale.position(point.deviation) / 1000, 9) for point in points],
                "line": {"width": 1, "color": colours.faint},
                "marker": {
                    "symbol": [ZONE_SYMBOLS.get(p.zone, "circle") + ("-open" if p.excluded else "") for p in points],
                    "size": [6 if p.zone in ("zero", "average", "full") else 10 for p in points],
                    "color": [zone_colour(p.zone, colours) for p in points],
                },
                "customdata": [point.link for point in points],
                "text": [
                    "<br>".join(
                        (
                            f"<b>{_('Reading {n}').format(n=p.sequence)}</b>",
                            f"{um(p.deviation)} · {zone_name(p.zone)}",
                            *size_lines(p.size, p.measured),
                        )
                    )
                    for p in points
                ],
                "hovertemplate": "%{text}<extra></extra>",
            }
        ],
        "layout": layout(
            theme,
            margin={"l": 92, "r": 110},
            xaxis=date_axis(),
            yaxis={"tickformat": ".4f", "nticks": 6, "range": [target - 1.08 * reach, target + 1.08 * reach]}
            | _title(sizes.title, colours),
            shapes=[
                {
                    "type": "line",
                    "layer": "below",
                    "xref": "paper",
                    "x0": 0,
                    "x1": 1,
                    "y0": y,
                    "y1": y,
                    "line": {"color": colour, "width": width, "dash": dash},
                }
                for y, colour, width, dash in (
                    (target + half, colours.ink, 1.75, "solid"),
                    (target - half, colours.ink, 1.75, "solid"),
                    (target, colours.quiet, 1, "4px,4px"),
                )
            ],
            annotations=[
                {
                    "xref": "paper",
                    "x": 1,
                    "xanchor": "left",
                    "xshift": 8,
                    "y": y,
                    "yanchor": "middle",
                    "text": f"{y:.4f}",
                    "showarrow": False,
                    "font": {"size": 12, "color": colours.quiet},
                }
                for y in (target + half, target, target - half)
            ]
            + _at_the_edge(points, scale, target, colours)
            + ([] if points else [_nothing(colours)]),
        ),
    }


def _at_the_edge(points: Sequence[RunPoint], scale: TrueScale, target: float, colours: Palette) -> list[dict[str, Any]]:
    """The deviations of the readings that are drawn at the edge, the newest first, as many as there is room for."""
    apart = (points[-1].at - points[0].at) / 12 if points else timedelta()
    labelled: list[RunPoint] = []
    for point in reversed(points):
        if not scale.fits(point.deviation) and (not labelled or labelled[-1].at - point.at > apart):
            labelled.append(point)
    return [
        {
            "x": on_axis(point.at),
            "y": target + scale.position(point.deviation) / 1000,
            "yshift": -14 if point.deviation > 0 else 14,
            "text": f"<b>{um(point.deviation, 0)}</b>",
            "showarrow": False,
            "font": {"size": 12, "color": zone_colour(point.zone, colours)},
        }
        for point in labelled
    ]


def _title(text: str, colours: Palette) -> dict[str, Any]:
    return {"title": {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 6}}


def _nothing(colours: Palette) -> dict[str, Any]:
    return {
        "xref": "paper",
        "yref": "paper",
        "x": 0.5,
        "y": 0.5,
        "text": f"<b>{_('No readings yet')}</b>",
        "showarrow": False,
        "font": {"size": 15, "color": colours.quiet},
    }
