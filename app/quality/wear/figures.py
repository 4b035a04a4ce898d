"""The wear curve as a chart. Pure; lengths in mm in, µm on the axis.

Dots are the wear curve, the step line is what the corrections had taken out of it when the part was cut, with the tolerance as a
band about it: the gap between dot and step is the deviation, and a dot in the band is a good part. From the newest reading
on, the line goes on into its forecast, the band stays as if nothing were corrected any more.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.core import wear
from app.core.wear import Fit, Forecast, Towards
from app.language.i18n import _
from app.language.numbers import um
from app.quality.wear.wording import parts_left, per_part, towards_name
from app.web.theme import Palette, ThemeName, layout, legend, nothing_drawn, palette

AHEAD, LEAST_AHEAD = 0.6, 20  # how far the forecast is drawn at most, in shares of what is shown; in parts
STEPS = 24  # points of a curved edge
SYMBOLS = {-1: "triangle-down", 0: "circle", 1: "triangle-up"}  # beyond the edges of the chart, drawn on them
FAR = 4  # times the tolerance: what deviates further does not stretch the chart
NARROW, LEFT = 700, 76  # px: below that width the right margin holds no label; the left margin
CHANGE_LABEL = 130  # px that the label of a tool change takes in any language
ROOM = 0.06  # above and below, in shares of the height


@dataclass(frozen=True)
class Life:
    """One edge: readings, its wear curve, what was taken out of it, and how many readings each point stands for."""

    sequence: Sequence[int]
    worn: Sequence[float]
    removed: Sequence[float]
    counts: Sequence[int]


@dataclass(frozen=True)
class WearChart:
    """Values to draw. half: of the tolerance; removed: what the corrections issued so far take out; limits lie on the wear curve.

    widening: of the interval of the forecast, see `app.core.wear.Record`.
    """

    key: str
    now: Life
    lives: Sequence[Life]
    fit: Fit | None
    forecasts: Mapping[Towards, Forecast]
    limits: Mapping[Towards, float]
    half: float
    removed: float
    corrects: bool
    widening: float = 1.0


def wear_figure(chart: WearChart, *, theme: ThemeName = "light", width: int = 1240) -> dict[str, Any]:
    """The figure as Plotly takes it."""
    colours = palette(theme)
    lives = [*chart.lives, chart.now]
    sequences = [n for life in lives for n in life.sequence]
    if not sequences:
        return nothing_drawn(theme, _("No readings of this tool yet"))
    last = sequences[-1]
    ahead = _ahead(chart, len(range(sequences[0], last)) + 1)
    near = {
        name: chart.limits[name]
        for name, forecast in chart.forecasts.items()
        if forecast.low <= ahead and not (chart.corrects and name is Towards.TOLERANCE)
    }
    heights = [
        value
        for life in lives
        for worn, removed in zip(life.worn, life.removed, strict=True)
        for value in (
            *([worn] if abs(worn - removed) <= FAR * chart.half else ()),
            removed - chart.half,
            removed + chart.half,
        )
    ]
    heights += [chart.removed - chart.half, chart.removed + chart.half, *near.values()]
    if chart.fit is not None and ahead:
        edge, wide = chart.fit.at(ahead), chart.fit.half_width(ahead, single=True)
        heights += [edge - wide, edge + wide]
    low, high = min(heights) * 1000, max(heights) * 1000
    room = (high - low) * ROOM
    data: list[dict[str, Any]] = []
    for life in lives:
        if life.sequence:
            data += _band(life, chart, colours, ahead if life is chart.now else 0)
    for life in lives:
        if life.sequence:
            data += _life(life, chart, colours, (low, high), is_now=life is chart.now)
    if chart.fit is not None:
        data += _line(chart.fit, colours, ahead, chart.widening, (low - room, high + room))
    shown = (sequences[0] - 1, last + max(ahead, 2))
    right = 20 if width < NARROW else 150
    marks = _changes(chart, colours, shown[1] - (shown[1] - shown[0]) * CHANGE_LABEL / (width - LEFT - right))
    limits = _limits(near, colours)
    return {
        "data": data,
        "layout": layout(
            theme,
            margin={"l": LEFT, "r": right, "t": 44, "b": 48},
            showlegend=True,
            legend=legend(theme, y=1.01),
            xaxis={
                "range": list(shown),
                "showgrid": False,
                "showline": True,
                "tickformat": "d",
                "nticks": 8 if width > 900 else 5,
                "title": _title(_("Reading"), colours),
            },
            yaxis={
                "range": [low - room, high + room],
                "tickformat": "+.0f" if high - low > 8 else "+.1f",
                "nticks": 7,
                "zeroline": True,
                "zerolinecolor": colours.faint,
                "title": _title(_("Wear, µm"), colours),
            },
            shapes=[*marks[0], *limits[0]],
            annotations=[*marks[1], *limits[1], *_labels(chart, colours, ahead, width)],
        ),
    }


def _ahead(chart: WearChart, shown: int) -> float:
    """Length of the forecast in the picture, in parts: to the limit that comes first, if it is near."""
    if chart.fit is None or not chart.forecasts:
        return 0.0
    coming = [
        forecast.parts
        for name, forecast in chart.forecasts.items()
        if not (chart.corrects and name is Towards.TOLERANCE)
    ]
    tolerance = chart.forecasts.get(Towards.TOLERANCE)
    nearest = min([*coming, *([tolerance.parts] if tolerance else [])], default=0.0)
    return max(float(LEAST_AHEAD), min(nearest * 1.15, AHEAD * shown))


def _band(life: Life, chart: WearChart, colours: Palette, ahead: float) -> list[dict[str, Any]]:
    """The tolerance about what was taken out."""
    x = [*life.sequence, *([life.sequence[-1] + ahead] if ahead else [])]
    centre = [*life.removed, *([chart.removed] if ahead else [])]
    if ahead:
        centre[-2] = chart.removed
    common = {
        "type": "scatter",
        "mode": "lines",
        "x": x,
        "line": {"width": 0, "shape": "hv", "color": colours.faint},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    return [
        common | {"meta": "tolerance", "y": [_um(value - chart.half) for value in centre]},
        common
        | {
            "meta": "tolerance",
            "name": _("Tolerance about it"),
            "showlegend": life is chart.now,
            "y": [_um(value + chart.half) for value in centre],
            "fill": "tonexty",
            "fillcolor": colours.bands[1],
        },
    ]


def _life(
    life: Life, chart: WearChart, colours: Palette, edges: tuple[float, float], *, is_now: bool
) -> list[dict[str, Any]]:
    traces: list[dict[str, Any]] = []
    if chart.corrects or any(life.removed):
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": _("Taken out by corrections"),
                "meta": "taken",
                "showlegend": is_now,
                "x": list(life.sequence),
                "y": [_um(value) for value in life.removed],
                "line": {"width": 2, "color": colours.correction, "shape": "hv"},
                "hoverinfo": "skip",
            }
        )
    few = len(life.sequence) <= 400
    far = [(_um(value) > edges[1]) - (_um(value) < edges[0]) for value in life.worn]
    traces.append(
        {
            "type": "scatter",
            "mode": "markers",
            "name": _("Wear curve"),
            "meta": "wear",
            "showlegend": is_now,
            "x": list(life.sequence),
            "y": [min(max(_um(value), edges[0]), edges[1]) for value in life.worn],
            "marker": {
                "size": [
                    10 if beyond else (5 if few else 4) + (count > 1)
                    for beyond, count in zip(far, life.counts, strict=True)
                ],
                "symbol": [SYMBOLS[beyond] for beyond in far],
                "color": [
                    colours.attention if beyond else colours.steady if is_now else colours.faint for beyond in far
                ],
            },
            "customdata": [f"/characteristics/{chart.key}/readings/{number}" for number in life.sequence],
            "text": [
                (
                    f"<b>{_('Reading {n}').format(n=number)}</b>"
                    if count == 1
                    else f"<b>{_('{count} readings up to {n}').format(count=count, n=number)}</b>"
                )
                + f"<br>{_('wear {worn}, of which {taken} corrected').format(worn=um(worn), taken=um(removed))}"
                + f"<br>{_('deviation {deviation}').format(deviation=um(worn - removed))}"
                for number, worn, removed, count in zip(
                    life.sequence, life.worn, life.removed, life.counts, strict=True
                )
            ],
            "hovertemplate": "%{text}<extra></extra>",
        }
    )
    return traces


def _line(
    fit: Fit, colours: Palette, ahead: float, widening: float, between: tuple[float, float]
) -> list[dict[str, Any]]:
    """The fitted line, and its forecast with the interval of a single part, as far as the chart reaches (`between`, µm)."""
    back = fit.first - fit.last
    ends = [{"x": [fit.first, fit.last], "y": [_um(fit.at(back)), _um(fit.level)], "dash": "solid"}]
    traces: list[dict[str, Any]] = []
    if ahead:
        ends.append({"x": [fit.last, fit.last + ahead], "y": [_um(fit.level), _um(fit.at(ahead))], "dash": "dash"})
        places = [ahead * step / STEPS for step in range(STEPS + 1)]
        cone: dict[str, Any] = {
            "type": "scatter",
            "mode": "lines",
            "meta": "forecast",
            "line": {"width": 1, "color": colours.faint},
            "hoverinfo": "skip",
            "showlegend": False,
            "x": [fit.last + place for place in places],
        }
        low, high = (
            [min(max(_um(end), between[0]), between[1]) for end in ends_at.tolist()]
            for ends_at in wear.cone(fit, np.array(places), widening)
        )
        traces += [
            cone | {"y": low},
            cone
            | {
                "y": high,
                "fill": "tonexty",
                "fillcolor": _faded(colours.wear),
                "name": _("Forecast, 95 % interval"),
                "showlegend": True,
            },
        ]
    traces += [
        {
            "type": "scatter",
            "mode": "lines",
            "name": _("Line through the newest readings"),
            "meta": "line",
            "showlegend": at == 0,
            "x": end["x"],
            "y": end["y"],
            "line": {"width": 2.5, "color": colours.wear, "dash": end["dash"]},
            "hovertemplate": f"{per_part(fit.slope)} {_('per part')}<extra></extra>",
        }
        for at, end in enumerate(ends)
    ]
    return traces


def _changes(chart: WearChart, colours: Palette, end: float) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Lines and labels of the tool changes; those beyond `end` are labelled on the left, clear of the right margin."""
    lives = [life for life in (*chart.lives, chart.now) if life.sequence]
    places = [life.sequence[0] - 0.5 for life in lives[1:]]
    shapes = [
        {
            "type": "line",
            "layer": "below",
            "x0": place,
            "x1": place,
            "yref": "paper",
            "y0": 0,
            "y1": 1,
            "line": {"color": colours.quiet, "width": 1.25, "dash": "dot"},
        }
        for place in places
    ]
    texts = [
        {
            "x": place,
            "yref": "paper",
            "y": 0,
            "yanchor": "bottom",
            "xanchor": "right" if place > end else "left",
            "xshift": -4 if place > end else 4,
            "text": _("Tool changed"),
            "showarrow": False,
            "font": {"size": 12, "color": colours.quiet},
        }
        for place in places[-6:]
    ]
    return shapes, texts


def _limits(near: Mapping[Towards, float], colours: Palette) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    shapes = [
        {
            "type": "line",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "y0": limit * 1000,
            "y1": limit * 1000,
            "line": {"color": colours.ink, "width": 1.75},
        }
        for limit in near.values()
    ]
    texts = [
        {
            "xref": "paper",
            "x": 0,
            "xanchor": "left",
            "xshift": 6,
            "y": limit * 1000,
            "yanchor": "bottom",
            "text": f"{towards_name(name)} {um(limit)}",
            "showarrow": False,
            "font": {"size": 12, "color": colours.ink},
        }
        for name, limit in near.items()
    ]
    return shapes, texts


def _labels(chart: WearChart, colours: Palette, ahead: float, width: int) -> list[dict[str, Any]]:
    """At the right: the slope, and when what comes first comes."""
    if chart.fit is None or width < NARROW:
        return []
    lines = [f"<b>{per_part(chart.fit.slope)}</b>", _("per part")] if chart.fit.is_wear else [_("no wear visible")]
    tolerance = chart.forecasts.get(Towards.TOLERANCE)
    if tolerance is not None and tolerance.parts <= ahead:
        lines += ["", towards_name(Towards.TOLERANCE), parts_left(tolerance)]
    return [
        {
            "xref": "paper",
            "x": 1,
            "xanchor": "left",
            "xshift": 10,
            "y": _um(chart.fit.at(ahead)),
            "yanchor": "middle",
            "align": "left",
            "text": "<br>".join(lines),
            "showarrow": False,
            "font": {"size": 12, "color": colours.ink},
        }
    ]


def _title(text: str, colours: Palette) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 6}


def _um(length: float) -> float:
    return round(length * 1000, 3)


def _faded(colour: str) -> str:
    """The colour as a veil.

    >>> _faded("#8a2a8c")
    'rgba(138,42,140,0.14)'
    """
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.14)"
