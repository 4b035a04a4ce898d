"""Control charts as Plotly takes them. Pure; lengths in mm in, µm on the axes.

Points are steady grey; one that makes a signal is orange and a triangle that points the way it lies, or a diamond where a rule knows no
side. Of more points than pixels each stretch shows its lowest and its highest, and those of its signals, so no extreme is
thinned away.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.spc.rules import Signals
from app.core.spc.shewhart import Chart
from app.language.i18n import _
from app.language.numbers import signed
from app.quality.control_charts.axis_range import UNSIGNED, beyond, reach
from app.quality.control_charts.downsampling import thinned
from app.quality.control_charts.view import Marks, View
from app.quality.control_charts.wording import axis, chart_name
from app.web.theme import Palette, ThemeName, layout, nothing_drawn, palette

MOST_CHANGES = 40  # lines of tool changes; more are a fence
WITH_MARKERS = 400
TOGETHER = 0.1  # of the axis: limits that lie closer than this are named in one line
SYMBOLS = {1: "triangle-up", 0: "diamond", -1: "triangle-down"}


def control_figure(
    view: View,
    *,
    key: str,
    marked: Marks | None = None,
    theme: ThemeName = "light",
    width: int = 1240,
    picks: bool = False,
) -> dict[str, Any]:
    """One control chart. picks: dragging chooses a period, and a click a point (see pick-period.js)."""
    colours = palette(theme)
    if not len(view.points):
        return nothing_drawn(theme, _("No points in this period."))
    sides = _sides(view.signals, len(view))
    indices = thinned(view.points if view.below is None else view.points - view.below, sides != NO_SIGNAL)
    data = _limits(view, indices, colours)
    data += _line(view, view.points, indices, colours, key, picks=picks)
    if view.below is not None:
        data += _line(view, view.below, indices, colours, key, picks=picks)
        data += _signals(
            view, np.where(sides == -1, view.below, view.points), indices, sides, colours, key, picks=picks
        )
    else:
        data += _signals(view, view.points, indices, sides, colours, key, picks=picks)
    low, high = reach(view)
    data += beyond(view, indices, _custom(view, indices, key, picks=picks), colours, low, high)
    changes = _changes(view, colours)
    period = _period(marked, view, colours) if marked is not None else ([], [])
    first, last = int(view.first[0]), int(view.last[-1])
    edge = max(1.0, (last - first) * 0.01)
    return {
        "data": data,
        "layout": layout(
            theme,
            margin={"l": 76, "r": 20 if width < 600 or view.centre is None else 118, "t": 26, "b": 44},
            xaxis={
                "range": [first - edge, last + edge],
                "showgrid": False,
                "showline": True,
                "tickformat": "d",
                "nticks": 8 if width > 900 else 5,
                "title": _title(_("Reading"), colours),
            },
            yaxis={
                "range": [low, high],
                "tickformat": _format(view.kind, high - low),
                "nticks": 7,
                "title": _title(_axis(view), colours),
                "fixedrange": picks,
            },
            shapes=[*period[0], *changes],
            annotations=[*period[1], *_names(view, colours, width, high - low)],
            **({"dragmode": "select", "selectdirection": "h"} if picks else {}),
        ),
    }


NO_SIGNAL = 9


def _sides(signals: Signals | None, count: int) -> NDArray[np.int8]:
    """Of each point the side of its signal, or `NO_SIGNAL`."""
    return np.full(count, NO_SIGNAL, np.int8) if signals is None else signals.sides(NO_SIGNAL)


def _um(values: Any) -> Any:
    return np.round(np.asarray(values) * 1000, 4)


def _line(
    view: View, values: NDArray[np.float64], drawn: NDArray[np.int64], colours: Palette, key: str, *, picks: bool
) -> list[dict[str, Any]]:
    """The points, joined within each tool: a gap at each change of it, unless a chart carries over."""
    few = len(drawn) <= WITH_MARKERS
    x: list[Any] = view.last[drawn].tolist()
    y: list[Any] = _um(values[drawn]).tolist()
    data = _custom(view, drawn, key, picks=picks)
    edges = np.cumsum(view.begins)[drawn]
    if view.kind in (Chart.INDIVIDUALS, Chart.MOVING_RANGE):
        for at in reversed((np.flatnonzero(np.diff(edges)) + 1).tolist()):
            for column in (x, y, data):
                column.insert(at, None)
    return [
        {
            "type": "scatter",
            "mode": "lines+markers" if few or picks else "lines",
            "name": chart_name(view.kind),
            "meta": "points",
            "x": x,
            "y": y,
            "customdata": data,
            "connectgaps": False,
            "line": {"width": 1.2, "color": colours.faint if few else colours.steady},
            "marker": {"size": 6 if few else 3, "color": colours.steady},
            "hovertemplate": _hover(view),
        }
    ]


def _signals(
    view: View,
    values: NDArray[np.float64],
    drawn: NDArray[np.int64],
    sides: NDArray[np.int8],
    colours: Palette,
    key: str,
    *,
    picks: bool,
) -> list[dict[str, Any]]:
    at = drawn[sides[drawn] != NO_SIGNAL]
    if not len(at):
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "name": _("Signal"),
            "meta": "signals",
            "x": view.last[at].tolist(),
            "y": _um(values[at]).tolist(),
            "customdata": _custom(view, at, key, picks=picks),
            "marker": {
                "size": 12 if len(at) <= 60 else 8,
                "color": colours.attention,
                "symbol": [SYMBOLS[int(side)] for side in sides[at]],
                "line": {"width": 1, "color": colours.surface},
            },
            "hovertemplate": _hover(view),
        }
    ]


def _custom(view: View, at: NDArray[np.int64], key: str, *, picks: bool) -> list[Any]:
    """Target of a click: the reading; where the chart picks readings, its number."""
    last = view.last[at].tolist()
    return last if picks else [f"/characteristics/{key}/readings/{number}" for number in last]


def _hover(view: View) -> str:
    value = "%{y:.2f}" if view.kind in UNSIGNED else "%{y:+.2f}"
    return f"{_('Reading')} %{{x:d}}<br>{value} µm<extra></extra>"


def _limits(view: View, drawn: NDArray[np.int64], colours: Palette) -> list[dict[str, Any]]:
    lines = (
        ("centre", view.centre, {"width": 1.5, "color": colours.quiet}),
        ("lower", view.lower, {"width": 1.5, "color": colours.ink, "dash": "dash"}),
        ("upper", view.upper, {"width": 1.5, "color": colours.ink, "dash": "dash"}),
    )
    traces = []
    first, last = int(view.first[0]), int(view.last[-1])
    for name, values, line in lines:
        if values is None or _is_floor(view, values):
            continue
        single = np.ndim(values) == 0
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "meta": name,
                "x": [first, last] if single else view.last[drawn].tolist(),
                "y": [float(_um(values))] * 2 if single else _um(np.asarray(values)[drawn]).tolist(),
                "line": line | ({} if single else {"shape": "hvh"}),
                "hoverinfo": "skip",
            }
        )
    return traces


def _names(view: View, colours: Palette, width: int, span: float) -> list[dict[str, Any]]:
    """The limits by name, at the right of the newest point."""
    if width < 600 or view.centre is None:
        return []
    decimals = 2 if span < 20 else 1
    names = [(_("centre"), view.centre), (_("lower"), view.lower), (_("upper"), view.upper)]
    newest = {
        name: float(np.atleast_1d(_um(values))[-1])
        for name, values in names
        if values is not None and not _is_floor(view, values)
    }
    if max(newest.values()) - min(newest.values()) < TOGETHER * span:
        low, high = (_value(view, pick(newest.values()), decimals) for pick in (min, max))
        labels = [(_("{low} to {high}").format(low=low, high=high), float(np.mean(list(newest.values()))))]
    else:
        labels = [(f"{name} {_value(view, value, decimals)}", value) for name, value in newest.items()]
    return [
        {
            "x": 1,
            "xref": "paper",
            "xanchor": "left",
            "xshift": 6,
            "y": value,
            "yanchor": "middle",
            "showarrow": False,
            "text": text,
            "font": {"size": 12, "color": colours.quiet},
        }
        for text, value in labels
    ]


def _value(view: View, value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if view.kind in UNSIGNED else signed(value, decimals)


def _is_floor(view: View, values: Any) -> bool:
    """A lower limit of 0 limits nothing where there is nothing below."""
    return view.kind in UNSIGNED and not np.any(values)


def _changes(view: View, colours: Palette) -> list[dict[str, Any]]:
    """Lines at tool changes, and at changes of the size that readings are measured by."""
    at = view.first[view.begins]
    at = at[at > view.first[0]]
    if len(at) > MOST_CHANGES:
        return []
    return [
        {
            "type": "line",
            "x0": number - 0.5,
            "x1": number - 0.5,
            "y0": 0,
            "y1": 1,
            "yref": "paper",
            "line": {"width": 1, "color": colours.faint, "dash": "dot"},
        }
        for number in at.tolist()
    ]


def _period(marked: Marks, view: View, colours: Palette) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    first, last = max(marked.first, int(view.first[0])), min(marked.last, int(view.last[-1]))
    if first > last:
        return [], []
    box = {"type": "rect", "yref": "paper", "y0": 0, "y1": 1, "layer": "below", "line": {"width": 0}}
    shapes = [box | {"x0": first - 0.5, "x1": last + 0.5, "fillcolor": colours.bands[2]}]
    shapes += [
        box | {"x0": low - 0.5, "x1": high + 0.5, "fillcolor": colours.bands[4]}
        for low, high in marked.excluded
        if high >= first and low <= last
    ]
    name = {
        "x": first,
        "xanchor": "left",
        "y": 1,
        "yref": "paper",
        "yanchor": "bottom",
        "showarrow": False,
        "text": marked.name,
        "font": {"size": 12, "color": colours.quiet},
    }
    return shapes, [name]


def _axis(view: View) -> str:
    match view.kind:
        case Chart.MOVING_RANGE:
            return _("Moving range, µm")
        case Chart.RANGES:
            return _("Range, µm")
        case Chart.DEVIATIONS:
            return _("Standard deviation, µm")
        case Chart.CUSUM:
            return _("Cumulative sum, µm")
        case _:
            return axis(view.quantity)


def _format(kind: Chart, span: float) -> str:
    sign = "" if kind in UNSIGNED else "+"
    return f"{sign}.0f" if span > 8 else f"{sign}.1f" if span > 0.8 else f"{sign}.2f"


def _title(text: str, colours: Palette) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 8}
