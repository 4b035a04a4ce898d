"""Diagrams of rotary axes. Pure; mm and degrees in, µm on the axes.

As in the control's protocol: measured red, optimised green, against the angle of the axis; here with shapes and words as
well. Angles become what they come to over one metre, so that all position errors stand in one picture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from app.geometry.rotary_axes.drift import Compared, Drift
from app.geometry.rotary_axes.result_values import UNITS, as_reading
from app.geometry.rotary_axes.wording import difference, name_words
from app.geometry.rotary_axes.wording import entered as told
from app.language.i18n import _
from app.language.times import on_axis
from app.web.theme import Palette, ThemeName, date_axis, layout, legend, nothing_drawn, palette

GREEN: dict[ThemeName, str] = {"light": "#1a7a3c", "dark": "#62c985"}
LETTERS = "XYZ"
ARROWS = {1: "\N{UPWARDS ARROW}", -1: "\N{DOWNWARDS ARROW}"}  # the axis came from smaller angles, or from larger ones
SHAPES = {1: "triangle-up", -1: "triangle-down", 0: "circle"}
ROOM = 1.25


def diagram(axis: Mapping[str, Any], letter: str, *, theme: ThemeName = "light", height: float = 0.0) -> dict[str, Any]:
    """E{letter}{axis}: the deviation in one direction against the angle, for each approach, before and after.

    height: of the axis, mm at least, so that the diagrams of an axis can be read side by side.
    """
    colours, at = palette(theme), LETTERS.index(letter)
    traces: list[dict[str, Any]] = []
    for kind, words, colour, dash in (
        ("measured", _("measured"), colours.stop, "solid"),
        ("optimised", _("optimised"), GREEN[theme], "dash"),
    ):
        for approach in sorted({position["approach"] for position in axis["positions"]}, reverse=True):
            chosen = sorted(
                (position["angle"], position[kind][at])
                for position in axis["positions"]
                if position["approach"] == approach and position[kind][at] is not None
            )
            if not chosen:
                continue
            side = ARROWS.get(approach)
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines+markers",
                    "name": f"{words} {side}" if side else words,
                    "meta": kind,
                    "x": [angle for angle, _value in chosen],
                    "y": [value * 1000 for _angle, value in chosen],
                    "line": {"color": colour, "width": 2, "dash": dash},
                    "marker": {
                        "symbol": ("square" if kind == "optimised" else "circle") if not approach else SHAPES[approach],
                        "size": 9,
                        "color": colour if kind == "measured" else colours.surface,
                        "line": {"color": colour, "width": 2},
                    },
                    "hovertemplate": "%{x:+.3f}°: %{y:+.1f} µm<extra>" + words + "</extra>",
                    "cliponaxis": False,
                }
            )
    if not traces:
        return nothing_drawn(theme, _("This run holds no single positions"))
    reach = max([abs(y) for trace in traces for y in trace["y"]] + [height * 1000, 1.0]) * ROOM
    return {
        "data": traces,
        "layout": layout(
            theme,
            margin={"l": 64, "t": 34, "b": 46},
            showlegend=True,
            legend=legend(theme),
            xaxis={
                "title": {"text": _("{axis}, °").format(axis=axis["axis"]), "standoff": 6},
                "tickvals": sorted(set(axis["angles"])) if len(axis["angles"]) <= 8 else None,
                "showgrid": True,
            },
            yaxis={
                "title": {"text": f"E{letter}{axis['axis']}, µm", "standoff": 6},
                "range": [-reach, reach],
                "zeroline": True,
                "zerolinecolor": colours.faint,
                "tickformat": "+.3~g",
                "nticks": 6,
            },
        ),
    }


def greatest(axis: Mapping[str, Any]) -> float:
    """The largest deviation in any direction, mm: the height that all diagrams of an axis have."""
    values = [
        abs(v) for position in axis["positions"] for kind in ("measured", "optimised") for v in position[kind] if v
    ]
    return max(values, default=0.0)


def comparison(
    changes: Sequence[Compared], entered: Mapping[str, float], *, theme: ThemeName = "light"
) -> dict[str, Any]:
    """Picture of two runs: a row for each position error, an arrow from then to now, ±2 s about both."""
    colours = palette(theme)
    rows = [change for change in changes if change.name.startswith("E")]
    if not rows:
        return nothing_drawn(theme, _("The two runs have no position error in common"))
    names = [f"<b>{change.name}</b>  {name_words(change.name)}" for change in rows]
    before = [_um(change.name, change.change.before) for change in rows]
    after = [_um(change.name, change.change.after) for change in rows]
    tones = [_tone(change, colours) for change in rows]
    spread = [
        2 * _um(change.name, change.change.deviation / 2**0.5) if change.change.deviation else 0.0 for change in rows
    ]
    largest = max([abs(v) + s for values in (before, after) for v, s in zip(values, spread, strict=True)] + [1.0])
    span = 2.9 * largest  # room for the words at the right, on a narrow panel as well
    shapes, notes = [], []
    for row, change in enumerate(rows):
        shapes.append(
            {
                "type": "line",
                "xref": "x",
                "yref": "y",
                "x0": before[row],
                "x1": after[row],
                "y0": row,
                "y1": row,
                "line": {"color": tones[row], "width": 5 if change.change.moved else 2},
                "layer": "below",
            }
        )
        words = [_moved(change)]
        if (enter := entered.get(change.name)) is not None:
            words.append(f"<b>{_('enter {value}').format(value=told(change.name, enter))}</b>")
        notes.append(
            {
                "x": 1.0,
                "xref": "paper",
                "xanchor": "right",
                "y": row,
                "yref": "y",
                "showarrow": False,
                "text": " · ".join(words),
                "font": {"size": 14, "color": colours.ink},
                "align": "right",
            }
        )
    return {
        "data": [
            _key(_("then"), "circle-open", colours),
            _key(_("now"), "diamond", colours),
            _ends(_("then"), before, spread, tones, "circle-open", colours),
            _ends(_("now"), after, spread, tones, "diamond", colours),
        ],
        "layout": layout(
            theme,
            margin={"l": 196, "t": 34, "r": 12, "b": 46},
            showlegend=True,
            legend=legend(theme),
            xaxis={
                "title": {"text": _("µm; how an axis leans as µm over 1 m"), "standoff": 6},
                "range": [-1.15 * largest, span],
                "tickformat": "+.3~g",
                "zeroline": True,
                "zerolinecolor": colours.ink,
                "tickvals": _ticks(largest),
            },
            yaxis={
                "tickvals": list(range(len(rows))),
                "ticktext": names,
                "range": [len(rows) - 0.4, -0.6],
                "color": colours.ink,
                "tickfont": {"size": 14},
            },
            shapes=shapes,
            annotations=notes,
        ),
    }


def _key(name: str, symbol: str, colours: Palette) -> dict[str, Any]:
    """A line of the legend: the points themselves have the colour of what they mean."""
    marker = {"symbol": symbol, "size": 12, "color": colours.ink, "line": {"width": 2, "color": colours.ink}}
    return {"type": "scatter", "mode": "markers", "name": name, "x": [None], "y": [None], "marker": marker}


def _ends(
    name: str, values: list[float], spread: list[float], tones: list[str], symbol: str, colours: Palette
) -> dict[str, Any]:
    return {
        "showlegend": False,
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "meta": name,
        "x": values,
        "y": list(range(len(values))),
        "error_x": {"type": "data", "array": spread, "color": colours.quiet, "thickness": 1.2, "width": 4},
        "marker": {"symbol": symbol, "size": 13, "color": tones, "line": {"width": 2, "color": tones}},
        "hovertemplate": "%{x:+.1f} µm<extra>" + name + "</extra>",
        "cliponaxis": False,
    }


def _tone(change_row: Compared, colours: Palette) -> str:
    return colours.attention if change_row.change.moved else colours.steady


def _moved(change_row: Compared) -> str:
    if change_row.change.moved is None:
        return difference(change_row.name, change_row.change.difference)
    if not change_row.change.moved:
        return _("within scatter")
    return _("moved {by}").format(by=difference(change_row.name, change_row.change.difference))


def _ticks(largest: float) -> list[float]:
    step = next(s for s in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 10_000, 10**6, 10**9) if s * 3.5 >= largest)
    most = int(largest * 1.1 // step)
    return [float(n * step) for n in range(-most, most + 1)]


def course(drift: Drift, *, theme: ThemeName = "light") -> dict[str, Any]:
    """A value over the runs: its true course, what has been entered (steps), the limit about that, and the trend."""
    colours = palette(theme)
    if not drift.points:
        return nothing_drawn(theme, _("No run holds {name}").format(name=drift.name))
    angle = UNITS[drift.name] == "°"
    factor, unit = (1.0, "°") if angle else (1000.0, "µm")
    if drift.name.startswith("radius"):
        factor, unit = 1.0, "mm"
    at = [on_axis(point.at) for point in drift.points]
    base = [(point.true - point.value) * factor for point in drift.points]
    traces: list[dict[str, Any]] = []
    if drift.limit is not None:
        for sign, words in ((1, _("upper limit")), (-1, _("lower limit"))):
            edge = [value + sign * drift.limit * factor for value in base]
            traces.append(_steps(at, edge, words, {"color": colours.attention, "width": 1.5, "dash": "dash"}))
    if any(base):
        traces.append(_steps(at, base, _("entered"), {"color": colours.correction, "width": 2}))
    if drift.trend is not None:
        days = [point.at.timestamp() / 86_400 for point in drift.points]
        middle, mean = sum(days) / len(days), sum(point.true for point in drift.points) / len(days)
        ends = [(mean + drift.trend.slope * (day - middle)) * factor for day in (min(days), max(days))]
        line = {"color": colours.quiet, "width": 1.5, "dash": "dot"}
        first, last = min(drift.points, key=lambda p: p.at), max(drift.points, key=lambda p: p.at)
        traces.append(_steps([on_axis(first.at), on_axis(last.at)], ends, _("trend"), line) | {"line": line})
    beyond = [drift.limit is not None and abs(point.value) > drift.limit for point in drift.points]
    spread = [2 * (point.deviation or 0.0) * factor for point in drift.points]
    traces.append(
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": drift.name,
            "meta": drift.name,
            "x": at,
            "y": [point.true * factor for point in drift.points],
            "line": {"color": colours.steady, "width": 1.5},
            "marker": {
                "size": 9,
                "symbol": ["triangle-up" if out else "circle" for out in beyond],
                "color": [colours.attention if out else colours.steady for out in beyond],
            },
            "error_y": {"type": "data", "array": spread, "color": colours.quiet, "thickness": 1.2, "width": 3}
            if any(spread)
            else {"visible": False},
            "customdata": [f"/kinematics/runs/{point.number}" for point in drift.points],
            "text": [_("run {n}").format(n=point.number) for point in drift.points],
            "hovertemplate": "%{text}: %{y:+.4~g} " + unit + "<extra></extra>",
            "cliponaxis": False,
        }
    )
    heights = [y for trace in traces for y in trace["y"] if isfinite(y)]
    low, high = min(heights), max(heights)
    room = max((high - low) * 0.15, 1e-6 if angle else 0.5)
    return {
        "data": traces,
        "layout": layout(
            theme,
            margin={"l": 74, "t": 12},
            xaxis=date_axis(point.at for point in drift.points),
            yaxis={
                "title": {"text": f"{drift.name}, {unit}", "standoff": 6},
                "range": [low - room, high + room],
                "tickformat": "+.4~g",
                "nticks": 6,
                "zeroline": True,
                "zerolinecolor": colours.faint,
            },
        ),
    }


def _steps(at: list[str], values: list[float], name: str, line: dict[str, Any]) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "meta": name,
        "x": at,
        "y": values,
        "line": line | {"shape": "hv"},
        "hoverinfo": "skip",
    }


def _um(name: str, value: float) -> float:
    return as_reading(name, value) * 1000
