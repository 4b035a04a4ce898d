"""From a figure as the pages have it (a Plotly dict: scatter, bars, shapes, annotations, legend) to a drawing of the same data.

What is drawn for the screen – hovering, links – is left out; grounds stay white, for paper.
"""

import re
from collections.abc import Mapping, Sequence
from html import unescape
from itertools import groupby
from typing import Any, Literal

from app.charts import Chart, to_drawing
from app.charts.marks import Anchor, Area, Box, Drawing, Group, Line, Mark, Place, Words, symbol
from app.files.documents.drawing.axes import Axis, axis_of, position, spread

INK, QUIET = "#1d2328", "#5a646c"
LEGEND_GAP = 24  # between two entries, pixels
LETTER = 0.54  # of its size that a letter is wide, about
DASHES = {"dot": (1.5, 3.0), "dash": (7.0, 4.0), "dashdot": (7.0, 3.0, 1.5, 3.0), "longdash": (12.0, 5.0)}
ANCHORS: dict[str, Anchor] = {"left": "start", "right": "end", "center": "middle"}
Figure = Mapping[str, Any]


def drawing_of(figure: Figure | Chart, width: float, height: float) -> Drawing:
    """The figure, drawn into so many pixels."""
    if isinstance(figure, Chart):
        return to_drawing(figure, width, height)
    return _Plot(figure, width, height).drawn()


def lines_of(text: str) -> list[tuple[str, bool]]:
    """A label's lines, each with whether it is bold.

    >>> lines_of("<b>R35/2  +8.0 &lt;</b><br>tolerance")
    [('R35/2  +8.0 <', True), ('tolerance', False)]
    """
    parts = re.split(r"<br\s*/?>", text)
    return [(unescape(re.sub(r"<[^>]*>", "", part)).replace("\n", " "), "<b>" in part) for part in parts]


class _Plot:
    """One figure being drawn."""

    def __init__(self, figure: Figure, width: float, height: float) -> None:
        self.layout: Figure = figure.get("layout") or {}
        self.traces = [
            trace
            for trace in figure.get("data") or ()
            if trace.get("visible", True) is True and trace.get("opacity") != 0
        ]
        margin = self.layout.get("margin") or {}
        left, top = margin.get("l", 64), margin.get("t", 16)
        self.box = Box(left, top, width - margin.get("r", 16), height - margin.get("b", 44))
        self.drawing = Drawing(width, height)
        self.axes: dict[str, Axis] = {}

    def axis(self, name: str) -> Axis:
        if name not in self.axes:
            letter = name[0]
            values = [
                value
                for trace in self.traces
                if str(trace.get(f"{letter}axis") or letter) == name
                for value in trace.get(letter) or ()
            ]
            self.axes[name] = axis_of(self.layout, name, values, self.box)
        return self.axes[name]

    def drawn(self) -> Drawing:
        shapes = self.layout.get("shapes") or ()
        self._add(self.box, [mark for shape in shapes if shape.get("layer") == "below" for mark in self._shape(shape)])
        names = {str(trace.get(f"{letter}axis") or letter) for trace in self.traces for letter in "xy"}
        for name in sorted(names | {"x", "y"}):
            self._add(None, self._axis(name))
        before: list[Place] = []
        for trace in self.traces:
            x = self.axis(str(trace.get("xaxis") or "x"))
            y = self.axis(str(trace.get("yaxis") or "y"))
            if trace.get("type") == "bar":
                self._add(self.box, _bars(trace, x, y))
                continue
            places = [
                (x.place(a), y.place(b)) for a, b in zip(trace.get("x") or (), trace.get("y") or (), strict=False)
            ]
            before = self._scatter(
                trace, places, before, Box(self.box.left, min(y.start, y.end), self.box.right, max(y.start, y.end))
            )
        self._add(self.box, [mark for shape in shapes if shape.get("layer") != "below" for mark in self._shape(shape)])
        self._add(None, [mark for note in self.layout.get("annotations") or () for mark in self._note(note)])
        self._add(None, self._legend())
        return self.drawing

    def _add(self, clip: Box | None, marks: list[Mark]) -> None:
        if marks:
            self.drawing.groups.append(Group(clip, marks))

    def _axis(self, name: str) -> list[Mark]:
        axis = self.axis(name)
        described = axis.layout
        if described.get("visible") is False:
            return []
        flat = name[0] == "x"
        box, colour = self.box, str((described.get("tickfont") or {}).get("color") or QUIET)
        letters = float((described.get("tickfont") or {}).get("size") or 12)
        ticks = axis.ticks()
        marks: list[Mark] = []
        if described.get("showgrid", True):
            grid = str(described.get("gridcolor") or "#dfe3e5")
            for at, _text in ticks:
                ends = ((at, box.top), (at, box.bottom)) if flat else ((box.left, at), (box.right, at))
                marks.append(Line(ends, grid, 0.75))
        if described.get("showline"):
            foot = max(axis.start, axis.end) if not flat else box.bottom
            marks.append(
                Line(
                    ((box.left, foot), (box.right, foot)) if flat else ((box.left, box.top), (box.left, foot)),
                    "#8d979e",
                    1,
                )
            )
        if described.get("zeroline") and (zero := axis.place(0)) is not None and not flat:
            marks.append(
                Line(((box.left, zero), (box.right, zero)), str(described.get("zerolinecolor") or "#8d979e"), 0.75)
            )
        least = max((len(text) for _at, text in ticks), default=1) * letters * LETTER + 6 if flat else letters
        for at, label in spread(ticks, least):
            for row, (text, bold) in enumerate(lines_of(label)):
                if flat:
                    marks.append(
                        Words((at, box.bottom + (row + 1.35) * letters), text, letters, colour, "middle", bold)
                    )
                else:
                    marks.append(Words((box.left - 6, at + letters * 0.36), text, letters, colour, "end", bold))
        title = described.get("title") or {}
        if title and title.get("text"):
            size = float((title.get("font") or {}).get("size") or 13)
            if flat:
                marks.append(
                    Words(((box.left + box.right) / 2, self.drawing.height - 6), title["text"], size, QUIET, "middle")
                )
            else:
                widest = max((len(lines_of(text)[0][0]) for _at, text in ticks), default=0) * letters * LETTER
                at = max(size, box.left - 16 - widest)
                marks.append(
                    Words((at, (axis.start + axis.end) / 2), title["text"], size, QUIET, "middle", turned=True)
                )
        return marks

    def _scatter(
        self, trace: Figure, places: Sequence[tuple[float | None, float | None]], before: list[Place], clip: Box
    ) -> list[Place]:
        """One trace; its line, for a trace that is filled down to it."""
        mode = str(trace.get("mode") or "lines+markers")
        line = trace.get("line") or {}
        runs: list[list[Place]] = []
        for whole, run in groupby(places, key=lambda place: None not in place):
            if whole:
                runs.append(_stepped([(a or 0.0, b or 0.0) for a, b in run], str(line.get("shape") or "linear")))
        course = [place for run in runs for place in run]
        if trace.get("fill") == "tonexty" and course and before:
            self._add(clip, [Area((*before, *reversed(course)), str(trace.get("fillcolor") or "#eeeeee"))])
        elif trace.get("fill") == "toself" and course:
            self._add(clip, [Area(tuple(course), str(trace.get("fillcolor") or "#eeeeee"))])
        if "lines" in mode and (thick := float(line.get("width", 2))) > 0:
            colour = str(line.get("color") or INK)
            self._add(clip, [Line(tuple(run), colour, thick, _dash(line.get("dash"))) for run in runs if len(run) > 1])
        if "markers" in mode:
            self._add(None, _markers(trace.get("marker") or {}, places))
        return course

    def _shape(self, shape: Figure) -> list[Mark]:
        x0, x1 = (self._at("x", shape.get("xref") or "x", shape.get(key)) for key in ("x0", "x1"))
        y0, y1 = (self._at("y", shape.get("yref") or "y", shape.get(key)) for key in ("y0", "y1"))
        if x0 is None or x1 is None or y0 is None or y1 is None:
            return []
        line = shape.get("line") or {}
        if shape.get("type") == "rect":
            fill = str(shape["fillcolor"]) if shape.get("fillcolor") else None
            edge = str(line["color"]) if line.get("color") and line.get("width", 1) else None
            return [Area(((x0, y0), (x1, y0), (x1, y1), (x0, y1)), fill, edge, float(line.get("width", 1)))]
        return [
            Line(
                ((x0, y0), (x1, y1)),
                str(line.get("color") or INK),
                float(line.get("width", 1)),
                _dash(line.get("dash")),
            )
        ]

    def _at(self, letter: Literal["x", "y"], ref: str, value: Any) -> float | None:
        """A place by what it refers to: `paper`, an axis, or an axis' domain."""
        if ref == "paper":
            box, part = self.box, float(value)
            return box.left + part * box.width if letter == "x" else box.bottom - part * box.height
        name, _space, domain = ref.partition(" ")
        axis = self.axis(name)
        return axis.share(float(value)) if domain else axis.place(value)

    def _note(self, note: Figure) -> list[Mark]:
        x = self._at("x", str(note.get("xref") or "x"), note.get("x", 0.5))
        y = self._at("y", str(note.get("yref") or "y"), note.get("y", 0.5))
        if x is None or y is None or not note.get("text"):
            return []
        font = note.get("font") or {}
        size, colour = float(font.get("size") or 12), str(font.get("color") or QUIET)
        x += float(note.get("xshift") or 0)
        y -= float(note.get("yshift") or 0)
        lines = lines_of(str(note["text"]))
        height = size * 1.28
        tall = height * len(lines)
        top = {"top": y, "bottom": y - tall}.get(str(note.get("yanchor") or "middle"), y - tall / 2)
        anchor = ANCHORS.get(str(note.get("xanchor") or "center"), "middle")
        return [
            Words((x, top + row * height + size * 0.98), text, size, colour, anchor, bold)
            for row, (text, bold) in enumerate(lines)
            if text
        ]

    def _legend(self) -> list[Mark]:
        if not self.layout.get("showlegend"):
            return []
        described = self.layout.get("legend") or {}
        size = float((described.get("font") or {}).get("size") or 12)
        traces = [trace for trace in self.traces if trace.get("showlegend", True) and trace.get("name")]
        x, y = self.box.left, self.box.top - 10
        room = sum(24 + len(str(trace["name"])) * size * LETTER + LEGEND_GAP for trace in traces) - LEGEND_GAP
        if x + room > self.drawing.width:  # one row: begun further left, and as small as that takes
            x, size = 8.0, size * min(1.0, (self.drawing.width - 16) / room)
        marks: list[Mark] = []
        for trace in sorted(traces, key=lambda trace: trace.get("legendrank", 1000)):
            line, marker = trace.get("line") or {}, trace.get("marker") or {}
            mode = str(trace.get("mode") or "lines+markers")
            middle = y - size * 0.33
            if trace.get("fill"):
                marks.append(
                    Area(
                        ((x, middle - 4), (x + 18, middle - 4), (x + 18, middle + 4), (x, middle + 4)),
                        str(trace.get("fillcolor") or "#eeeeee"),
                    )
                )
            elif "lines" in mode and float(line.get("width", 2)):
                marks.append(
                    Line(
                        ((x, middle), (x + 18, middle)),
                        str(line.get("color") or INK),
                        float(line.get("width", 2)),
                        _dash(line.get("dash")),
                    )
                )
            if "markers" in mode:
                marks += symbol(
                    _first(marker.get("symbol"), "circle"),
                    (x + 9, middle),
                    min(_number(marker.get("size"), 6), 10),
                    _first(marker.get("color"), INK),
                    _edge(marker),
                )
            marks.append(Words((x + 24, y), str(trace["name"]), size, QUIET))
            x += 24 + len(str(trace["name"])) * size * LETTER + LEGEND_GAP
        return marks


def _edge(marker: Figure) -> tuple[str | None, float]:
    """The edge of a marker in the legend: what is filled like the paper would not be seen without it."""
    line = marker.get("line") or {}
    return (_first(line.get("color"), INK), _number(line.get("width"), 1)) if line.get("width") else (None, 1)


def _bars(trace: Figure, x: Axis, y: Axis) -> list[Mark]:
    lying = trace.get("orientation") == "h"
    values, centres = (x, y) if lying else (y, x)
    tops, at = (trace.get("x"), trace.get("y")) if lying else (trace.get("y"), trace.get("x"))
    marks: list[Mark] = []
    colours = (trace.get("marker") or {}).get("color")
    wide = trace.get("width")
    for number, (top, centre) in enumerate(zip(tops or (), at or (), strict=False)):
        middle, half = position(centre), (wide[number] if isinstance(wide, list) else wide or 0.8) / 2
        end, zero = values.place(top), values.place(0)
        if middle is None or end is None or zero is None or not top:
            continue
        one, two = centres.place(middle - half) or 0.0, centres.place(middle + half) or 0.0
        outline = ((zero, one), (end, one), (end, two), (zero, two))
        marks.append(Area(outline if lying else tuple((b, a) for a, b in outline), _nth(colours, number, INK)))
    return marks


def _markers(marker: Figure, places: Sequence[tuple[float | None, float | None]]) -> list[Mark]:
    line = marker.get("line") or {}
    marks: list[Mark] = []
    for number, (x, y) in enumerate(places):
        if x is None or y is None:
            continue
        colour = _nth(marker.get("color"), number, INK)
        edge = _nth(line.get("color"), number, "#ffffff") if line.get("width") else None
        size = _number(_nth_of(marker.get("size"), number), 6)
        thick = _number(_nth_of(line.get("width"), number), 0.75)
        marks += symbol(_nth(marker.get("symbol"), number, "circle"), (x, y), size, colour, (edge, thick))
    return marks


def _stepped(places: list[Place], shape: str) -> list[Place]:
    """The line with its corners; `hv` goes across before it goes up.

    >>> _stepped([(0, 0), (1, 1)], "hv")
    [(0, 0), (1, 0), (1, 1)]
    """
    if shape not in {"hv", "vh"}:
        return places
    course = places[:1]
    for place in places[1:]:
        corner = (place[0], course[-1][1]) if shape == "hv" else (course[-1][0], place[1])
        course += [corner, place]
    return course


def _dash(dash: Any) -> tuple[float, ...]:
    if not dash or dash == "solid":
        return ()
    return DASHES.get(dash) or tuple(float(part) for part in re.findall(r"[\d.]+", str(dash)))


def _nth_of(values: Any, number: int) -> Any:
    return (values[number] if number < len(values) else None) if isinstance(values, list | tuple) else values


def _nth(values: Any, number: int, default: str) -> str:
    return str(_nth_of(values, number) or default)


def _first(values: Any, default: str) -> str:
    return _nth(values, 0, default)


def _number(values: Any, default: float) -> float:
    value = _nth_of(values, 0)
    return float(value) if isinstance(value, int | float) else default
