"""How the deviations are spread, and how the sizes went over time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from app.core.zones import HasLimits
from app.web.i18n import _
from app.web.numbers import mm, um
from app.web.theme import ZONE_SYMBOLS, Palette, ThemeName, date_axis, layout, palette, zone_colour, zone_name

BARS_PER_SIDE = 15  # whole bars between target and tolerance limit, so that the limits fall between bars
REACH = 1.4  # the histogram ends at so many times the tolerance; what lies further out is in the two end bars
FEW = 4  # readings in the longest bar up to which they are counted by ones: there are no half readings


@dataclass(frozen=True)
class RunPoint:
    """One measured size (mm) and when."""

    sequence: int
    at: datetime
    measured: float
    zone: str
    excluded: bool = False
    link: str | None = None


def histogram_edges(limits: HasLimits) -> list[float]:
    """The edges (mm) between the bars, ascending; bars 0 and n are open to the outside (as width_bucket counts them)."""
    half = max(limits.tolerance_width / 2, 1e-6)
    reach = round(BARS_PER_SIDE * REACH)
    return [half * i / BARS_PER_SIDE for i in range(-reach, reach + 1)]


def histogram_counts(deviations: Iterable[float], limits: HasLimits) -> list[int]:
    """How many deviations (mm) fall into each bar; one more than there are edges. A value on an edge is in the upper bar,
    but on the tolerance limit itself it is good, so it counts inside.
    """
    edges = histogram_edges(limits)
    half = edges[round(BARS_PER_SIDE * REACH) + BARS_PER_SIDE]
    counts = [0] * (len(edges) + 1)
    for deviation in deviations:
        inside = deviation - 1e-9 if abs(deviation - half) < 5e-7 else deviation
        counts[bisect_right(edges, inside)] += 1
    return counts


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
    points: Sequence[RunPoint], limits: HasLimits, *, target: float, theme: ThemeName = "light"
) -> dict[str, Any]:
    """Measured sizes (mm) over time, with target and tolerance."""
    colours = palette(theme)
    half = limits.tolerance_width / 2
    return {
        "data": [
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": _("Measured size"),
                "meta": "run",
                "x": [point.at.isoformat() for point in points],
                "y": [point.measured for point in points],
                "line": {"width": 1, "color": colours.faint},
                "marker": {
                    "symbol": [ZONE_SYMBOLS.get(p.zone, "circle") + ("-open" if p.excluded else "") for p in points],
                    "size": [6 if p.zone in ("zero", "average", "full") else 10 for p in points],
                    "color": [zone_colour(p.zone, colours) for p in points],
                },
                "customdata": [point.link for point in points],
                "text": [
                    f"<b>{_('Reading {n}').format(n=p.sequence)}</b><br>{mm(p.measured)} · {zone_name(p.zone)}"
                    for p in points
                ],
                "hovertemplate": "%{text}<extra></extra>",
            }
        ],
        "layout": layout(
            theme,
            margin={"l": 92, "r": 110},
            xaxis=date_axis(),
            yaxis={"tickformat": ".4f", "nticks": 6},
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
            + ([] if points else [_nothing(colours)]),
        ),
    }


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
