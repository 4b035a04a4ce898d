"""From a chart to the dict that plotly.js takes."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from app.charts.description import (
    Axis,
    Bars,
    Chart,
    Ground,
    Mark,
    Note,
    Pen,
    Rule,
    Series,
    Shades,
    Share,
    Value,
    words_of,
)
from app.charts.palette import Colour, Faded, ThemeName, shown
from app.language.times import on_axis

FONT = '"IBM Plex Sans", "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", system-ui, sans-serif'
DAY = 86_400_000  # milliseconds
MOMENTS = [  # 24 hours, day before month
    {"dtickrange": [None, 59_999], "value": "%H:%M:%S\n%-d %b %Y"},
    {"dtickrange": [60_000, DAY - 1], "value": "%H:%M\n%-d %b %Y"},
    {"dtickrange": [DAY, None], "value": "%-d %b\n%Y"},
]
KINDS = {"time": "date", "names": "category"}
Json = dict[str, Any]


def to_plotly(chart: Chart, theme: ThemeName = "light") -> Json:
    """The figure, `{"data": …, "layout": …}`."""
    return _Figure(chart, theme).drawn()


class _Figure:
    """One chart being written. Panel 1 lies on axis `y`, panel 2 on `y2` …; an x axis of its own has the same number."""

    def __init__(self, chart: Chart, theme: ThemeName) -> None:
        self.chart, self.theme = chart, theme
        self.data: list[Json] = []
        self.shapes: list[Json] = []
        self.notes: list[Json] = []

    def colour(self, colour: Colour) -> str:
        return shown(colour, self.theme)

    def colours(self, colours: Colour | Sequence[Colour]) -> str | list[str]:
        if isinstance(colours, str | Faded):
            return self.colour(colours)
        return [self.colour(colour) for colour in colours]

    def drawn(self) -> Json:
        chart = self.chart
        lowest = min(range(len(chart.panels)), key=lambda at: chart.panels[at].share[0])
        axes: Json = {"xaxis": self._axis(chart.x) | ({"anchor": _name("y", lowest)} if lowest else {})}
        for at, panel in enumerate(chart.panels):
            x, y = _name("x", at) if panel.x else "x", _name("y", at)
            upward = self._axis(panel.y)
            if panel.share != (0, 1):
                upward["domain"] = list(panel.share)
            if at:
                upward["anchor"] = x
            if panel.equal:
                upward["scaleanchor"] = x
            axes[f"yaxis{y[1:]}"] = upward
            if panel.x:
                axes[f"xaxis{x[1:]}"] = self._axis(panel.x) | {"domain": list(panel.across), "anchor": y}
            for mark in panel.marks:
                self._mark(mark, x, y)
        if not chart.x.hidden:
            self.data += [self._unseen(at) for at in range(len(chart.panels)) if not self._has_points(at)]
        return {"data": self.data, "layout": self._layout() | axes}

    def _has_points(self, at: int) -> bool:
        return any((trace.get("yaxis") or "y") == _name("y", at) for trace in self.data)

    def _unseen(self, at: int) -> Json:
        """A point that is not seen: in a panel without points plotly would not know where its axes are."""
        panel = self.chart.panels[at]
        reach = (panel.x or self.chart.x).reach
        point: Json = {"type": "scatter", "x": [_value(reach[0]) if reach else 1], "y": [0], "opacity": 0}
        named = {"xaxis": _name("x", at)} if panel.x else {}
        return point | named | ({"yaxis": _name("y", at)} if at else {}) | {"showlegend": False, "hoverinfo": "skip"}

    def _layout(self) -> Json:
        chart, ink, surface = self.chart, self.colour("ink"), self.colour("surface")
        font = {"family": FONT, "size": 13, "color": ink}
        layout: Json = {
            "autosize": True,
            "font": font,
            "paper_bgcolor": surface,
            "plot_bgcolor": surface,
            "margin": {"l": chart.room.left, "r": chart.room.right, "t": chart.top, "b": chart.room.bottom, "pad": 0},
            "showlegend": chart.named,
            "hovermode": "closest",
            "hoverdistance": 24,
            "hoverlabel": {"bgcolor": surface, "bordercolor": self.colour("faint"), "font": font, "align": "left"},
            "dragmode": False if chart.drag == "nothing" else chart.drag,
            "uirevision": "keep",
            "separators": ".\N{NARROW NO-BREAK SPACE}",
            "bargap": 0.25,
            "bargroupgap": 0.08,
            "shapes": self.shapes,
            "annotations": self.notes,
        }
        if chart.drag == "select":
            layout["selectdirection"] = "h"
        if chart.named:  # in a row; to touch a name hides nothing
            above = {"y": 1.01, "yanchor": "bottom"} if chart.legend == "above" else {"y": -0.2, "yanchor": "top"}
            layout["legend"] = above | {
                "orientation": "h",
                "x": 0,
                "xanchor": "left",
                "font": {"size": 13, "color": self.colour("quiet")},
                "bgcolor": "rgba(0,0,0,0)",
                "itemclick": False,
                "itemdoubleclick": False,
            }
        return layout

    def _axis(self, axis: Axis) -> Json:
        if axis.hidden:
            return {"visible": False, "fixedrange": axis.fixed} | _reach(axis)
        written: Json = {
            "color": self.colour(axis.colour),
            "gridcolor": self.colour("grid"),
            "linecolor": self.colour("faint"),
            "zeroline": axis.zero is not None,
            "ticks": "",
            "tickfont": {"size": axis.letters},
            "automargin": False,
            "showgrid": axis.grid,
            "showline": axis.line,
            "fixedrange": axis.fixed,
        } | _reach(axis)
        if axis.zero:
            written["zerolinecolor"] = self.colour(axis.zero)
        if axis.title:
            font = {"size": axis.title_letters, "color": self.colour("quiet")}
            written["title"] = {"text": axis.title, "font": font, "standoff": 4 if axis.kind == "time" else 6}
        if axis.kind == "time":
            written |= {"automargin": "height", "tickformatstops": MOMENTS}
        if axis.kind in KINDS:
            written["type"] = KINDS[axis.kind]
        if not axis.labelled:
            written["showticklabels"] = False
        if axis.matched:
            written["matches"] = "y"
        ticks = {
            "nticks": None if axis.every else axis.ticks,
            "dtick": axis.every,
            "tickformat": axis.format or None,
            "tickvals": None if axis.at is None else list(axis.at),
            "ticktext": None if axis.words is None else list(axis.words),
            "tickangle": None if axis.words is None else 0,
        }
        return written | {key: value for key, value in ticks.items() if value is not None}

    def _mark(self, mark: Mark, x: str, y: str) -> None:
        match mark:
            case Series():
                self.data.append(self._series(mark) | _on(x, y))
            case Bars():
                self.data.append(self._bars(mark) | _on(x, y))
            case Rule():
                self.shapes.append(self._rule(mark, y))
                if mark.words:
                    self.notes.append(self._note(words_of(mark), x, y))
            case Ground():
                self.shapes.append(_across(mark.y, mark.x, y) | self._ground(mark))
            case Note():
                self.notes.append(self._note(mark, x, y))

    def _pen(self, pen: Pen) -> Json:
        line: Json = {"color": self.colour(pen.colour), "width": pen.width}
        if pen.dash != "solid":
            line["dash"] = pen.dash
        if pen.steps != "linear":
            line["shape"] = pen.steps
        return line

    def _series(self, series: Series) -> Json:
        parts = {"lines": series.pen, "markers": series.dots, "text": series.labels}
        trace: Json = {
            "type": "scatter",
            "mode": "+".join(part for part, drawn in parts.items() if drawn) or "none",
            "x": _values(series.x),
            "y": list(series.y),
            **_said(series),
        }
        if series.pen:
            trace["line"] = self._pen(series.pen)
        if series.dots or series.labels:
            trace["cliponaxis"] = False
        if series.dots:
            dots = series.dots
            trace["marker"] = {"symbol": _each(dots.symbol), "size": _each(dots.size), "opacity": dots.opacity}
            trace["marker"] |= (
                self._shades(dots.colour) if isinstance(dots.colour, Shades) else {"color": self.colours(dots.colour)}
            )
            if dots.edge:
                trace["marker"]["line"] = {"width": _each(dots.edge_width), "color": self.colours(dots.edge)}
        if series.labels:
            labels = series.labels
            trace |= {"text": list(labels.texts), "textposition": _each(labels.at)}
            trace["textfont"] = {"size": labels.size, "color": self.colour(labels.colour)}
        if series.spread:
            spread = series.spread
            whisker: Json = {"type": "data", "array": list(spread.up), "color": self.colour(spread.colour)}
            whisker |= {"thickness": 1.5, "width": 4}
            if spread.down is not None:
                whisker |= {"symmetric": False, "arrayminus": list(spread.down)}
            trace["error_x" if spread.across else "error_y"] = whisker
        if series.fill:
            trace |= {"fill": "tonexty", "fillcolor": self.colour(series.fill)}
        if series.links is not None:
            trace["customdata"] = list(series.links)
        if series.first:
            trace["legendrank"] = 1
        return trace

    def _shades(self, shades: Shades) -> Json:
        scale = [[at / 2, shade] for at, shade in enumerate(self.colours(["waiting", "band-2", "attention"]))]
        marker: Json = {"color": list(shades.values), "cmin": -shades.reach, "cmax": shades.reach, "colorscale": scale}
        if shades.title:
            bar = {"title": {"text": shades.title}, "thickness": 12, "tickformat": "+.3~g", "outlinewidth": 0}
            marker |= {"showscale": True, "colorbar": bar}
        return marker

    def _bars(self, bars: Bars) -> Json:
        trace: Json = {
            "type": "bar",
            "x": _values(bars.x),
            "y": list(bars.y),
            "marker": {"color": self.colours(bars.colour), "opacity": bars.opacity, "line": {"width": 0}},
            "textposition": "none",
            **_said(bars),
        }
        if bars.lying:
            trace["orientation"] = "h"
        if bars.width:
            trace["width"] = bars.width
        if bars.hatched:
            trace["marker"]["pattern"] = {"shape": ["/" if now else "" for now in bars.hatched], "fillmode": "overlay"}
        if bars.texts is not None:
            trace |= {"text": list(bars.texts), "textposition": "outside", "cliponaxis": False}
        return trace

    def _rule(self, rule: Rule, y: str) -> Json:
        at = None if rule.y is None else (rule.y, rule.y)
        place = _across(at, (rule.x, rule.x), y, rule.upto)
        return {"type": "line", "layer": "above" if rule.front else "between", "line": self._pen(rule.pen)} | place

    def _ground(self, ground: Ground) -> Json:
        return {"type": "rect", "layer": "below", "fillcolor": self.colour(ground.colour), "line": {"width": 0}}

    def _note(self, note: Note, x: str, y: str) -> Json:
        written = {
            **_place("x", note.x, x),
            **_place("y", note.y, y),
            "xanchor": note.across,
            "yanchor": note.upward,
            "align": note.across,
            "text": note.text,
            "showarrow": False,
            "font": {"size": note.size, "color": self.colour(note.colour)},
        }
        written |= {key: by for key, by in zip(("xshift", "yshift"), note.shift, strict=True) if by}
        if note.detail:
            written["name"] = "detail"
        return written | ({"bgcolor": self.colour("surface"), "borderpad": 1} if note.ground else {})


def _name(letter: str, at: int) -> str:
    return f"{letter}{at + 1}" if at else letter


def _on(x: str, y: str) -> Json:
    return ({} if x == "x" else {"xaxis": x}) | ({} if y == "y" else {"yaxis": y})


def _value(value: Value) -> Any:
    return on_axis(value) if isinstance(value, datetime) else value


def _values(values: Sequence[Value]) -> list[Any]:
    return [_value(value) for value in values]


def _each(value: Any) -> Any:
    return value if isinstance(value, str | int | float) else list(value)


def _reach(axis: Axis) -> Json:
    if axis.reach is not None:
        return {"range": _values(axis.reach)}
    return {"rangemode": "tozero" if axis.from_zero else "normal"}


def _said(mark: Series | Bars) -> Json:
    """Keys that say what a mark is, its words in the legend, and those when it is pointed at."""
    said: Json = {"showlegend": bool(mark.name)}
    if mark.meta:
        said["meta"] = mark.meta
    if mark.name:
        said["name"] = mark.name
    if not mark.hover:
        return said | {"hoverinfo": "skip"}
    if isinstance(mark.hover, str):
        return said | {"hovertemplate": f"{mark.hover}<extra></extra>"}
    labelled = mark.labels if isinstance(mark, Series) else mark.texts
    words = "hovertext" if labelled else "text"
    return said | {words: list(mark.hover), "hovertemplate": f"%{{{words}}}<extra></extra>"}


def _across(y: tuple[float, float] | None, x: tuple[Value, Value] | None, axis: str, upto: float = 1) -> Json:
    """Across the panel between two values of y, or up through the chart between two of x."""
    if y is not None:
        return {"xref": "paper", "x0": 0, "x1": 1, "yref": axis, "y0": y[0], "y1": y[1]}
    low, high = _values(x or (0, 0))
    return {"xref": "x", "x0": low, "x1": high, "yref": "paper", "y0": 0, "y1": upto}


def _place(letter: str, at: Value | Share, axis: str) -> Json:
    if isinstance(at, Share):
        return {letter: at.part, f"{letter}ref": f"{axis} domain" if at.inside else "paper"}
    return {letter: _value(at), f"{letter}ref": axis}
