"""From a chart to a drawing of it on paper: lines, areas and words.

What is for the screen – hovering, links – is left out; the ground stays white.
"""

import re
from collections.abc import Sequence
from html import unescape
from itertools import groupby
from typing import NamedTuple

from app.charts.description import (
    Bars,
    Chart,
    Dots,
    Ground,
    Note,
    Panel,
    Pen,
    Rule,
    Series,
    Shades,
    Share,
    Value,
    words_of,
)
from app.charts.marks import Anchor, Area, Box, Drawing, Group, Line, Mark, Place, Words, symbol
from app.charts.palette import Colour, Faded, shown
from app.charts.scales import Scale, scale_of, spread

LEGEND_GAP = 24  # between two entries, pixels
LETTER = 0.54  # of its size that a letter is wide, about
DASHES = {"dot": (1.5, 3.0), "dash": (7.0, 4.0), "dashdot": (7.0, 3.0, 1.5, 3.0), "longdash": (12.0, 5.0)}
ANCHORS: dict[str, Anchor] = {"left": "start", "right": "end", "center": "middle"}
WHITE = "#ffffff"


def to_drawing(chart: Chart, width: float, height: float) -> Drawing:
    """The chart, drawn into N pixels."""
    return _Paper(chart, width, height).drawn()


def lines_of(text: str) -> list[tuple[str, bool]]:
    """A label's lines, each with whether it is bold.

    >>> lines_of("<b>R35/2  +8.0 &lt;</b><br>tolerance")
    [('R35/2  +8.0 <', True), ('tolerance', False)]
    """
    parts = re.split(r"<br\s*/?>", text)
    return [(unescape(re.sub(r"<[^<>]*>", "", part)).replace("\n", " "), "<b>" in part) for part in parts]


class _Laid(NamedTuple):
    """A panel with its scales."""

    panel: Panel
    x: Scale
    y: Scale


class _Paper:
    """One chart being drawn."""

    def __init__(self, chart: Chart, width: float, height: float) -> None:
        self.chart = chart
        room = chart.room
        self.box = Box(room.left, chart.top, width - room.right, height - room.bottom)
        self.drawing = Drawing(width, height)
        shared = [panel for panel in chart.panels if panel.x is None]
        x = scale_of(chart.x, _values(shared, "x"), self.box.left, self.box.right)
        self.panels = [self._laid(panel, x) for panel in chart.panels]

    def _laid(self, panel: Panel, shared: Scale) -> _Laid:
        box, x = self.box, shared
        if panel.x is not None:
            ends = [box.left + part * box.width for part in panel.across]
            x = scale_of(panel.x, _values([panel], "x"), ends[0], ends[1])
        foot, head = (box.bottom - part * box.height for part in panel.share)
        return _Laid(panel, x, scale_of(panel.y, _values([panel], "y"), foot, head))

    def drawn(self) -> Drawing:
        marks = [(mark, laid) for laid in self.panels for mark in laid.panel.marks]
        for mark, laid in marks:
            if isinstance(mark, Ground):
                self._add(self.box, self._across(mark, laid))
        own = [laid for laid in self.panels if laid.panel.x is not None]
        for scale in [*(laid.x for laid in own), *([] if len(own) == len(self.panels) else [self._shared()])]:
            self._add(None, self._axis(scale, flat=True))
        for laid in self.panels:
            self._add(None, self._axis(laid.y, flat=False))
        for mark, laid in marks:
            if isinstance(mark, Rule) and not mark.front:
                self._add(self.box, self._across(mark, laid))
        for laid in self.panels:
            course: list[Place] = []
            for mark in laid.panel.marks:
                if isinstance(mark, Bars):
                    self._add(self.box, _bars(mark, laid))
                elif isinstance(mark, Series):
                    course = self._series(mark, laid, course)
        for mark, laid in marks:
            if isinstance(mark, Rule) and mark.front:
                self._add(self.box, self._across(mark, laid))
        for mark, laid in marks:
            if isinstance(mark, Rule) and mark.words:
                self._add(None, self._note(words_of(mark), laid))
            elif isinstance(mark, Note) and not self._crowded(mark, laid):
                self._add(None, self._note(mark, laid))
        self._add(None, self._legend())
        return self.drawing

    def _shared(self) -> Scale:
        return next(laid.x for laid in self.panels if laid.panel.x is None)

    def _add(self, clip: Box | None, marks: list[Mark]) -> None:
        if marks:
            self.drawing.groups.append(Group(clip, marks))

    def _axis(self, scale: Scale, *, flat: bool) -> list[Mark]:
        axis, box = scale.axis, self.box
        if axis.hidden:
            return []
        colour, letters = _ink(axis.colour), axis.letters
        ticks = scale.ticks()
        marks: list[Mark] = []
        if axis.grid:
            for at, _text in ticks:
                ends = ((at, box.top), (at, box.bottom)) if flat else ((box.left, at), (box.right, at))
                marks.append(Line(ends, _ink("grid"), 0.75))
        if axis.line:
            ends = ((scale.start, box.bottom), (scale.end, box.bottom))
            ends = ends if flat else ((box.left, scale.start), (box.left, scale.end))
            marks.append(Line(ends, _ink("faint"), 1))
        if axis.zero and (zero := scale.place(0)) is not None and not flat:
            marks.append(Line(((box.left, zero), (box.right, zero)), _ink(axis.zero), 0.75))
        least = max((len(text) for _at, text in ticks), default=1) * letters * LETTER + 6 if flat else letters
        for at, label in spread(ticks, least):
            for row, (text, bold) in enumerate(lines_of(label)):
                if flat:
                    marks.append(
                        Words((at, box.bottom + (row + 1.35) * letters), text, letters, colour, "middle", bold)
                    )
                else:
                    marks.append(Words((box.left - 6, at + letters * 0.36), text, letters, colour, "end", bold))
        return [*marks, *self._title(scale, ticks, flat=flat)]

    def _title(self, scale: Scale, ticks: Sequence[tuple[float, str]], *, flat: bool) -> list[Mark]:
        axis, middle = scale.axis, (scale.start + scale.end) / 2
        if not axis.title:
            return []
        size = axis.title_letters
        if flat:
            return [Words((middle, self.drawing.height - 6), axis.title, size, _ink("quiet"), "middle")]
        widest = max((len(lines_of(text)[0][0]) for _at, text in ticks), default=0) * axis.letters * LETTER
        at = max(size, self.box.left - 16 - widest)
        return [Words((at, middle), axis.title, size, _ink("quiet"), "middle", turned=True)]

    def _series(self, series: Series, laid: _Laid, before: list[Place]) -> list[Place]:
        """One series; its line, for one that is filled down to it."""
        x, y = laid.x, laid.y
        clip = Box(min(x.start, x.end), min(y.start, y.end), max(x.start, x.end), max(y.start, y.end))
        places = [(x.place(a), y.place(b)) for a, b in zip(series.x, series.y, strict=False)]
        steps = series.pen.steps if series.pen else "linear"
        runs = [
            _stepped([(a or 0.0, b or 0.0) for a, b in run], steps)
            for whole, run in groupby(places, key=lambda place: None not in place)
            if whole
        ]
        course = [place for run in runs for place in run]
        if series.fill and course and before:
            self._add(clip, [Area((*before, *reversed(course)), _ink(series.fill))])
        if series.pen and series.pen.width > 0:
            self._add(clip, [_line(tuple(run), series.pen) for run in runs if len(run) > 1])
        if series.spread:
            self._add(clip, _whiskers(series, laid))
        if series.dots:
            self._add(None, [mark for at, place in enumerate(places) for mark in _dot(series.dots, at, place, clip)])
        if series.labels:
            self._add(None, [mark for at, place in enumerate(places) for mark in _label(series, at, place)])
        return course

    def _across(self, mark: Rule | Ground, laid: _Laid) -> list[Mark]:
        """A rule or a ground, across the panel or up through all of them."""
        box = self.box
        if isinstance(mark, Rule):
            if mark.y is not None:
                place = laid.y.place(mark.y)
                ends = ((box.left, place or 0), (box.right, place or 0))
            else:
                place = laid.x.place(mark.x)
                ends = ((place or 0, box.bottom), (place or 0, box.bottom - mark.upto * box.height))
            return [] if place is None else [_line(ends, mark.pen)]
        scale = laid.x if mark.y is None else laid.y
        low, high = (scale.place(value) or 0.0 for value in mark.y or mark.x or (0.0, 0.0))
        corners = ((low, box.top), (high, box.top), (high, box.bottom), (low, box.bottom))
        if mark.y is not None:
            corners = ((box.left, low), (box.right, low), (box.right, high), (box.left, high))
        return [Area(corners, _ink(mark.colour))]

    def _note(self, note: Note, laid: _Laid) -> list[Mark]:
        x, y = self._at(note.x, laid.x, flat=True), self._at(note.y, laid.y, flat=False)
        if x is None or y is None or not note.text:
            return []
        x, y, size = x + note.shift[0], y - note.shift[1], note.size
        lines = lines_of(note.text)
        height = size * 1.28
        tall = height * len(lines)
        top = {"top": y, "bottom": y - tall, "middle": y - tall / 2}[note.upward]
        return [
            Words((x, top + row * height + size * 0.98), text, size, _ink(note.colour), ANCHORS[note.across], bold)
            for row, (text, bold) in enumerate(lines)
            if text
        ]

    def _crowded(self, note: Note, laid: _Laid) -> bool:
        """Tell if words that may be given up would lie over the words beside them, as chart-details.js does on the page."""
        if not note.detail or (y := self._at(note.y, laid.y, flat=False)) is None:
            return False
        beside = (mark for mark in laid.panel.marks if isinstance(mark, Note) and mark is not note and mark.x == note.x)
        places = [self._at(mark.y, laid.y, flat=False) for mark in beside if mark.text]
        return any(place is not None and abs(place - y) < note.size + 1 for place in places)

    def _at(self, value: Value | Share, scale: Scale, *, flat: bool) -> float | None:
        if not isinstance(value, Share):
            return scale.place(value)
        if value.inside:
            return scale.share(value.part)
        box = self.box
        return box.left + value.part * box.width if flat else box.bottom - value.part * box.height

    def _legend(self) -> list[Mark]:
        named = [
            mark for laid in self.panels for mark in laid.panel.marks if isinstance(mark, Series | Bars) and mark.name
        ]
        named.sort(key=lambda mark: not (isinstance(mark, Series) and mark.first))
        size = 13.0
        x, y = self.box.left, self.box.top - 10
        room = sum(24 + len(mark.name) * size * LETTER + LEGEND_GAP for mark in named) - LEGEND_GAP
        if x + room > self.drawing.width:  # one row: begun further left, and as small as that takes
            x, size = 8.0, size * min(1.0, (self.drawing.width - 16) / room)
        marks: list[Mark] = []
        for mark in named:
            marks += _key(mark, x, y - size * 0.33)
            marks.append(Words((x + 24, y), mark.name, size, _ink("quiet")))
            x += 24 + len(mark.name) * size * LETTER + LEGEND_GAP
        return marks


def _ink(colour: Colour) -> str:
    """A colour on paper."""
    return WHITE if colour == "surface" else shown(colour, "light")


def _line(ends: tuple[Place, ...], pen: Pen) -> Line:
    return Line(ends, _ink(pen.colour), pen.width, _dash(pen.dash))


def _key(mark: Series | Bars, x: float, middle: float) -> list[Mark]:
    """The small picture before the words in the legend."""
    if isinstance(mark, Bars):
        return [_patch(x, middle, _nth(mark.colour, 0))]
    marks: list[Mark] = []
    if mark.fill:
        marks.append(_patch(x, middle, mark.fill))
    elif mark.pen and mark.pen.width:
        marks.append(_line(((x, middle), (x + 18, middle)), mark.pen))
    if mark.dots:
        dots = mark.dots
        size = min(_size(dots.size, 0), 10)
        marks += symbol(_word(dots.symbol, 0), (x + 9, middle), size, _ink(_colour(dots, 0)), _edge(dots, 0))
    return marks


def _patch(x: float, middle: float, colour: Colour) -> Area:
    return Area(((x, middle - 4), (x + 18, middle - 4), (x + 18, middle + 4), (x, middle + 4)), _ink(colour))


def _bars(bars: Bars, laid: _Laid) -> list[Mark]:
    values, centres = (laid.x, laid.y) if bars.lying else (laid.y, laid.x)
    tops, at = (bars.x, bars.y) if bars.lying else (bars.y, bars.x)
    marks: list[Mark] = []
    half = (bars.width or 0.8) / 2
    for number, (top, centre) in enumerate(zip(tops, at, strict=False)):
        middle, end, zero = centres.number(centre), values.place(top), values.place(0)
        if middle is None or end is None or zero is None or not top:
            continue
        ends = [
            centres.start + (place - centres.low) / (centres.high - centres.low) * (centres.end - centres.start)
            for place in (middle - half, middle + half)
        ]
        outline = ((zero, ends[0]), (end, ends[0]), (end, ends[1]), (zero, ends[1]))
        colour = _ink(_nth(bars.colour, number))
        marks.append(Area(outline if bars.lying else tuple((b, a) for a, b in outline), colour))
    return marks


def _dot(dots: Dots, number: int, place: tuple[float | None, float | None], clip: Box) -> list[Mark]:
    x, y = place
    if x is None or y is None or not (clip.left - 1 <= x <= clip.right + 1 and clip.top - 1 <= y <= clip.bottom + 1):
        return []
    size, name = _size(dots.size, number), _word(dots.symbol, number)
    return symbol(name, (x, y), size, _ink(_colour(dots, number)), _edge(dots, number))


def _label(series: Series, number: int, place: tuple[float | None, float | None]) -> list[Mark]:
    """Words beside a point, where they are wanted: `middle right`, `top center` …"""
    labels, (x, y) = series.labels, place
    if labels is None or x is None or y is None or not labels.texts[number]:
        return []
    upward, _space, across = _word(labels.at, number).partition(" ")
    reach = _size(series.dots.size, number) / 2 + 4 if series.dots else 2
    x += {"right": reach, "left": -reach}.get(across, 0)
    y += labels.size * 0.36 + {"top": -reach - 4, "bottom": reach + 6}.get(upward, 0)
    anchor: Anchor = "start" if across == "right" else "end" if across == "left" else "middle"
    return [Words((x, y), labels.texts[number].strip(), labels.size, _ink(labels.colour), anchor)]


def _whiskers(series: Series, laid: _Laid) -> list[Mark]:
    marks: list[Mark] = []
    spread_of = series.spread
    assert spread_of is not None
    along = laid.x if spread_of.across else laid.y
    for number, (x, y) in enumerate(zip(series.x, series.y, strict=False)):
        middle = along.number(x if spread_of.across else y)
        other = laid.y.place(y) if spread_of.across else laid.x.place(x)
        if middle is None or other is None:
            continue
        down = spread_of.up if spread_of.down is None else spread_of.down
        ends = [along.place(middle - down[number]) or 0.0, along.place(middle + spread_of.up[number]) or 0.0]
        line = ((ends[0], other), (ends[1], other)) if spread_of.across else ((other, ends[0]), (other, ends[1]))
        marks.append(Line(line, _ink(spread_of.colour), 1.2))
    return marks


def _values(panels: Sequence[Panel], letter: str) -> list[Value]:
    """The values drawn along an axis, for one that has no reach of its own."""
    marks = [mark for panel in panels for mark in panel.marks if isinstance(mark, Series | Bars)]
    return [value for mark in marks for value in (mark.x if letter == "x" else mark.y)]


def _stepped(places: list[Place], steps: str) -> list[Place]:
    """The line with its corners; `hv` goes across before it goes up.

    >>> _stepped([(0, 0), (1, 1)], "hv")
    [(0, 0), (1, 0), (1, 1)]
    """
    if steps not in {"hv", "vh"}:
        return places
    course = places[:1]
    for place in places[1:]:
        corner = (place[0], course[-1][1]) if steps == "hv" else (course[-1][0], place[1])
        course += [corner, place]
    return course


def _dash(dash: str) -> tuple[float, ...]:
    if dash == "solid":
        return ()
    return DASHES.get(dash) or tuple(float(part) for part in re.findall(r"[\d.]+", dash))


def _word(words: str | Sequence[str], number: int) -> str:
    """The word that holds for all points, or for this one."""
    return words if isinstance(words, str) else words[number] if number < len(words) else ""


def _size(sizes: float | Sequence[float], number: int) -> float:
    return sizes if isinstance(sizes, int | float) else sizes[number] if number < len(sizes) else 6


def _nth(colours: Colour | Sequence[Colour], number: int) -> Colour:
    if isinstance(colours, str | Faded):
        return colours
    return colours[number] if number < len(colours) else "ink"


def _colour(dots: Dots, number: int) -> Colour:
    if not isinstance(dots.colour, Shades):
        return _nth(dots.colour, number)
    value = dots.colour.values[number]
    return "band-2" if abs(value) < dots.colour.reach / 2 else "attention" if value > 0 else "waiting"


def _edge(dots: Dots, number: int) -> tuple[str | None, float]:
    """The edge of a dot: what is filled like the paper would not be seen without it."""
    width = _size(dots.edge_width, number)
    return (None, width) if dots.edge is None else (_ink(_nth(dots.edge, number)), width)
