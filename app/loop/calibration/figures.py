"""The history of a calibrated place as a chart. Pure; lengths in mm in, µm on the axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from app.language.i18n import _
from app.language.numbers import um
from app.language.times import on_axis
from app.web.theme import Palette, ThemeName, date_axis, layout, legend, nothing_drawn, palette

SYMBOLS = {
    "unchanged": "circle",
    "accepted": "square",
    "proposed": "diamond",
    "overtaken": "circle-open",
    "refused": "x",
}


@dataclass(frozen=True)
class Mark:
    """A calibration as it is drawn; mm.

    difference: what the machine read too much, or how far the probe stood beside the spindle. zero, averaging: R33 and R34
    about `before`, the value in effect. low, high: the confidence interval of pairs. diameters, smallest, largest: of a
    ring, less its nominal. text: its sentence.
    """

    at: datetime
    number: int
    status: str
    status_word: str
    difference: float | None
    before: float = 0.0
    zero: float | None = None
    averaging: float | None = None
    low: float | None = None
    high: float | None = None
    diameters: Sequence[float] = field(default_factory=tuple)
    smallest: float | None = None
    largest: float | None = None
    text: str = ""


def gauge_figure(
    marks: Sequence[Mark], changes: Sequence[tuple[datetime, float]], value: float, *, theme: ThemeName = "light"
) -> dict[str, Any]:
    """Differences over time against the empirical value in effect (steps) with the zones R33 and R34 about it.

    changes: when the empirical value became what, oldest first; value: the one in effect now. A refused calibration may lie
    a thousand times further off than the others: it is drawn at the edge, and its text says where it was.
    """
    colours = palette(theme)
    if not marks and not changes:
        return nothing_drawn(theme, _("Not calibrated yet"))
    heights = [value] + [value_after for _at, value_after in changes]
    for mark in marks:
        heights += [mark.before + side * (mark.averaging or mark.zero or 0.0) for side in (-1, 1)]
        heights += [limit for limit in (mark.low, mark.high) if limit is not None]
        if mark.status != "refused" and mark.difference is not None:
            heights.append(mark.difference)
    low, high = min(heights), max(heights)
    room = max(0.12 * (high - low), 0.0005)
    low, high = low - room, high + room
    traces = [
        *_zone(marks, "averaging", colours.bands[1], _("R34: the average decides")),
        *_zone(marks, "zero", colours.bands[2], _("R33: nothing changes")),
        _steps(marks, changes, value, colours),
        *_marks(marks, colours, (low, high)),
    ]
    return {
        "data": traces,
        "layout": _layout(
            theme,
            yaxis=_axis(colours, _("Measuring error, µm"), [low * 1000, high * 1000]),
            annotations=[
                {
                    "x": 0.004,
                    "xref": "paper",
                    "xanchor": "left",
                    "y": mark.before * 1000 + side,
                    "yref": "y",
                    "yanchor": "bottom",
                    "showarrow": False,
                    "text": name,
                    "font": {"size": 12, "color": colours.quiet},
                }
                for mark in [other for other in marks if other.zero is not None][:1]
                for name, side in (("R33", (mark.zero or 0) * 1000), ("R34", (mark.averaging or 0) * 1000))
            ],
        ),
    }


def _zone(marks: Sequence[Mark], limit: str, colour: str, name: str) -> list[dict[str, Any]]:
    """A band about the value in effect. What a calibration was judged by held since the one before it."""
    chosen = [mark for mark in marks if getattr(mark, limit) is not None]
    if len(chosen) < 2:
        return []
    shared = {
        "type": "scatter",
        "mode": "lines",
        "x": [on_axis(mark.at) for mark in chosen],
        "line": {"width": 0, "shape": "vh"},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    below = [(mark.before - getattr(mark, limit)) * 1000 for mark in chosen]
    above = [(mark.before + getattr(mark, limit)) * 1000 for mark in chosen]
    return [
        shared | {"meta": f"{limit} below", "y": below},
        shared | {"meta": limit, "name": name, "y": above, "fill": "tonexty", "fillcolor": colour},
    ]


def _steps(
    marks: Sequence[Mark], changes: Sequence[tuple[datetime, float]], value: float, colours: Palette
) -> dict[str, Any]:
    points = list(changes)
    if marks and (not points or marks[0].at < points[0][0]):
        points.insert(0, (marks[0].at, marks[0].before))
    last = max([at for at, _value in points] + [mark.at for mark in marks])
    points.append((last, value))
    return {
        "type": "scatter",
        "mode": "lines",
        "name": _("Empirical value in effect"),
        "meta": "value",
        "x": [on_axis(at) for at, _value in points],
        "y": [value * 1000 for _at, value in points],
        "line": {"width": 2, "color": colours.correction, "shape": "hv"},
        "hovertemplate": _("empirical value %{y:+.1f} µm") + "<extra></extra>",
    }


def _marks(
    marks: Sequence[Mark], colours: Palette, edges: tuple[float, float], axis: str = "y"
) -> list[dict[str, Any]]:
    """One trace per status, so that each has its shape, its word in the legend and its colour."""
    low, high = edges
    inset = (high - low) * 0.03
    traces = []
    for status, symbol in SYMBOLS.items():
        chosen = [mark for mark in marks if mark.status == status and mark.difference is not None]
        if not chosen:
            continue
        tone = {"proposed": colours.waiting, "refused": colours.stop}.get(status, colours.ink)
        heights = [min(max(mark.difference or 0.0, low + inset), high - inset) * 1000 for mark in chosen]
        trace: dict[str, Any] = {
            "type": "scatter",
            "mode": "markers",
            "name": chosen[0].status_word,
            "meta": status,
            "x": [on_axis(mark.at) for mark in chosen],
            "y": heights,
            "yaxis": axis,
            "marker": {"symbol": symbol, "size": 11, "color": tone, "line": {"width": 1.5, "color": tone}},
            "customdata": [f"#calibration-{mark.number}" for mark in chosen],
            "text": [
                f"<b>{_('Calibration {n}').format(n=mark.number)}</b>: {um(mark.difference)}<br>{_broken(mark.text)}"
                for mark in chosen
            ],
            "hovertemplate": "%{text}<extra></extra>",
            "cliponaxis": False,
        }
        if any(mark.low is not None for mark in chosen):
            trace["error_y"] = {
                "type": "data",
                "symmetric": False,
                "array": [_beyond(mark.high, mark.difference) for mark in chosen],
                "arrayminus": [_beyond(mark.difference, mark.low) for mark in chosen],
                "color": tone,
                "thickness": 1.5,
            }
        traces.append(trace)
    return traces


def _beyond(upper: float | None, lower: float | None) -> float:
    return 0.0 if upper is None or lower is None else (upper - lower) * 1000


def _broken(text: str, width: int = 64) -> str:
    lines = [""]
    for word in text.split(" "):
        if len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] += f" {word}" if lines[-1] else word
    return "<br>".join(lines)


def ring_figure(marks: Sequence[Mark], *, theme: ThemeName = "light") -> dict[str, Any]:
    """Above, how far the probe stood beside the spindle; below, the ring's diameters at the three sections."""
    colours = palette(theme)
    if not marks:
        return nothing_drawn(theme, _("Not calibrated yet"))
    good = [mark.difference for mark in marks if mark.difference is not None]
    reach = max([abs(correction) for correction in good] + [0.001]) * 1.2
    ring = [mark for mark in marks if mark.smallest is not None and mark.largest is not None]
    at = [on_axis(mark.at) for mark in ring]
    limits: list[dict[str, Any]] = [
        {
            "type": "scatter",
            "mode": "lines",
            "meta": name,
            "name": name,
            "showlegend": False,
            "yaxis": "y2",
            "x": at,
            "y": [height * 1000 for height in heights],
            "line": {"width": 1.5, "dash": "dash", "color": colours.quiet, "shape": "hv"},
            "hoverinfo": "skip",
        }
        for name, heights in (
            ("ES", [mark.largest or 0.0 for mark in ring]),
            ("EI", [mark.smallest or 0.0 for mark in ring]),
        )
        if ring
    ]
    span = [size for mark in ring for size in (mark.smallest or 0.0, mark.largest or 0.0)] or [-0.001, 0.001]
    room = max(0.6 * (max(span) - min(span)), 0.001)
    edges = (min(span) - room, max(span) + room)
    sections = [
        {
            "type": "scatter",
            "mode": "markers",
            "meta": f"section {number + 1}",
            "name": _("Section {n}").format(n=number + 1),
            "yaxis": "y2",
            "x": [on_axis(mark.at) for mark in marks if len(mark.diameters) > number],
            "y": [
                min(max(mark.diameters[number], edges[0]), edges[1]) * 1000
                for mark in marks
                if len(mark.diameters) > number
            ],
            "marker": {
                "symbol": ("triangle-left", "circle", "triangle-right")[number],
                "size": 9,
                "color": colours.steady,
            },
            "text": [
                _("section {n}: {value}").format(n=number + 1, value=um(mark.diameters[number]))
                for mark in marks
                if len(mark.diameters) > number
            ],
            "hovertemplate": "%{text}<extra></extra>",
            "cliponaxis": False,
        }
        for number in range(max([len(mark.diameters) for mark in marks], default=0))
    ]
    names = [
        {
            "x": 0.004,
            "xref": "paper",
            "xanchor": "left",
            "y": trace["y"][0],
            "yref": "y2",
            "showarrow": False,
            "yanchor": "bottom",
            "text": trace["name"],
            "font": {"size": 12, "color": colours.quiet},
        }
        for trace in limits
    ]
    return {
        "data": [*_marks(marks, colours, (-reach, reach)), *limits, *sections],
        "layout": _layout(
            theme,
            yaxis=_axis(colours, _("Beside the spindle, µm"), [-reach * 1000, reach * 1000])
            | {"domain": [0.55, 1], "zeroline": True, "zerolinecolor": colours.faint},
            yaxis2=_axis(colours, _("Ring less nominal, µm"), [edges[0] * 1000, edges[1] * 1000])
            | {"domain": [0, 0.45], "color": colours.quiet, "gridcolor": colours.grid, "tickfont": {"size": 12}},
            annotations=names,
        ),
    }


def _axis(colours: Palette, title: str, extent: list[float]) -> dict[str, Any]:
    return {
        "range": extent,
        "tickformat": "+.4~g",
        "nticks": 6,
        "title": {"text": title, "font": {"size": 13, "color": colours.quiet}, "standoff": 8},
    }


def _layout(theme: ThemeName, **more: Any) -> dict[str, Any]:
    return layout(theme, margin={"l": 84, "t": 34}, showlegend=True, legend=legend(theme), xaxis=date_axis(), **more)
