"""The description of a chart: panels of marks above an axis. Figures describe; `plotly` and `paper` draw.

A colour is a role, the name of what it is for; which colour that is, the theme says. Lengths of the drawing are pixels. Values
lie on the axes: numbers, moments (`datetime`), or names. Words may hold `<b>` and `<br>`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Literal

from app.charts.palette import Colour
from app.language.i18n import _
from app.language.times import plant_zone

Value = float | str | datetime | None  # None leaves a gap
Across = Literal["left", "center", "right"]
Upward = Literal["top", "middle", "bottom"]


@dataclass(frozen=True)
class Pen:
    """The look of a line. dash: `solid`, `dot`, `dash` …, or lengths: `4px,4px`; steps: `hv` goes across before it goes up."""

    colour: Colour
    width: float = 1.5
    dash: str = "solid"
    steps: Literal["linear", "hv", "vh", "hvh"] = "linear"


@dataclass(frozen=True)
class Shades:
    """Colours by values from -reach through grey to +reach; with a title they are explained by a bar at the right."""

    values: Sequence[float]
    reach: float
    title: str = ""


@dataclass(frozen=True)
class Dots:
    """The look of points: each alike, or each its own. edge: its colour; hollow symbols end in `-open`."""

    symbol: str | Sequence[str] = "circle"
    size: float | Sequence[float] = 9
    colour: Colour | Sequence[Colour] | Shades = "steady"
    edge: Colour | Sequence[Colour] | None = None
    edge_width: float | Sequence[float] = 1.5
    opacity: float = 1


@dataclass(frozen=True)
class Labels:
    """Words written beside points."""

    texts: Sequence[str]
    at: str | Sequence[str] = "middle right"
    colour: Colour = "quiet"
    size: float = 12


@dataclass(frozen=True)
class Spread:
    """Lengths by which each point may lie off, upward and downward alike or not; `across`: along x."""

    up: Sequence[float]
    down: Sequence[float] | None = None
    colour: Colour = "quiet"
    across: bool = False


@dataclass(frozen=True)
class Series:
    """Points: joined by a pen, marked by dots, labelled; with the colour `fill` down to the series before.

    meta: what it is, for tests and scripts. name: its words in the legend; without it is there not. hover: words when
    pointed at, one for each point, or one for all with Plotly's `%{y:+.1f}`. links: what a click opens, for each point.
    """

    x: Sequence[Value]
    y: Sequence[Value]
    pen: Pen | None = None
    dots: Dots | None = None
    labels: Labels | None = None
    spread: Spread | None = None
    fill: Colour | None = None
    meta: str = ""
    name: str = ""
    hover: str | Sequence[str] = ""
    links: Sequence[object] | None = None
    first: bool = False  # in the legend, wherever it is drawn


@dataclass(frozen=True)
class Bars:
    """Bars from 0 to `y`, standing at `x`; or lying: from 0 to `x`, at `y`. width: on the axis where they stand."""

    x: Sequence[Value]
    y: Sequence[Value]
    colour: Colour | Sequence[Colour] = "steady"
    width: float | None = None
    lying: bool = False
    hatched: Sequence[bool] | None = None
    opacity: float = 1
    texts: Sequence[str] | None = None  # written at their ends
    meta: str = ""
    name: str = ""
    hover: str | Sequence[str] = ""


@dataclass(frozen=True)
class Rule:
    """A line across the panel at `y`, or up through all panels at `x`, and its words: beside the panel, or on the line.

    Words of a line upward are above it. raised: of the words, pixels. upto: share of the height that a line upward takes.
    front: before what is drawn, not behind it.
    """

    pen: Pen
    y: float | None = None
    x: Value = None
    words: str = ""
    on: bool = False
    colour: Colour = "quiet"
    raised: float = 0
    upto: float = 1
    front: bool = False


@dataclass(frozen=True)
class Ground:
    """A coloured ground between two values of y across the panel, or of x through all panels."""

    colour: Colour
    y: tuple[float, float] | None = None
    x: tuple[float, float] | None = None


@dataclass(frozen=True)
class Share:
    """A place as a share of the whole chart's width or height, or `inside` the panel, from left or bottom."""

    part: float
    inside: bool = False


@dataclass(frozen=True)
class Note:
    """Words at a place. across, upward: which point of the words lies there; shift: from there, pixels right and up."""

    text: str
    x: Value | Share
    y: float | Share
    across: Across = "center"
    upward: Upward = "middle"
    shift: tuple[float, float] = (0, 0)
    size: float = 12
    colour: Colour = "quiet"
    ground: bool = False  # written on a ground of the chart's own, so that lines stop at it
    detail: bool = False  # given up where the chart is too low for it (chart-details.js)


Mark = Series | Bars | Rule | Ground | Note


@dataclass(frozen=True)
class Axis:
    """One axis. ticks: how many at most; every: their distance; at: where they stand, and `words` what they say.

    reach: lowest and highest value; without it what is drawn. zero: colour of a line at 0. fixed: zooming leaves it.
    matched: reaches as far as that of the first panel, even when zoomed.
    """

    title: str = ""
    kind: Literal["numbers", "time", "names"] = "numbers"
    reach: tuple[Value, Value] | None = None
    from_zero: bool = False
    ticks: int | None = None
    every: float | None = None
    at: Sequence[float] | None = None
    words: Sequence[str] | None = None
    format: str = ""
    grid: bool = True
    line: bool = True
    zero: Colour | None = None
    fixed: bool = False
    hidden: bool = False
    labelled: bool = True
    matched: bool = False
    colour: Colour = "quiet"
    letters: float = 12
    title_letters: float = 13


@dataclass(frozen=True)
class Panel:
    """Marks from the back to the front, with the axis at their left. share: of the chart's height, from the bottom.

    x: an axis of its own, over `across` of the width. equal: a unit is as long upward as across.
    """

    marks: Sequence[Mark]
    y: Axis = Axis()
    share: tuple[float, float] = (0, 1)
    x: Axis | None = None
    across: tuple[float, float] = (0, 1)
    equal: bool = False


@dataclass(frozen=True)
class Room:
    """Pixels about the panels, for words and axes. top: by default as the legend needs."""

    left: float = 64
    right: float = 16
    bottom: float = 44
    top: float | None = None


@dataclass(frozen=True)
class Chart:
    """Panels above each other, on one axis below the lowest. drag: what dragging a finger or the mouse does."""

    panels: Sequence[Panel]
    x: Axis = Axis()
    room: Room = Room()
    legend: Literal["above", "below"] = "above"
    drag: Literal["zoom", "select", "nothing"] = "zoom"

    @property
    def named(self) -> bool:
        """Something has words in the legend."""
        return any(mark.name for panel in self.panels for mark in panel.marks if isinstance(mark, Series | Bars))

    @property
    def top(self) -> float:
        """Room above the panels, pixels."""
        return self.room.top if self.room.top is not None else 34 if self.named else 16


def time_axis(moments: Sequence[datetime] = (), *, hidden: bool = False) -> Axis:
    """An axis of time, in the zone of the plant, which it names. Where all moments are of one hour it shows half a day before
    and after: else it would count seconds.
    """
    known = sorted(moments)
    half = timedelta(hours=12)
    close = bool(known) and known[-1] - known[0] <= timedelta(hours=1)
    reach = (known[0] - half, known[-1] + half) if close else None
    zone = plant_zone().key
    return Axis(zone, "time", reach, grid=False, hidden=hidden, title_letters=12)


def reading_axis(reach: tuple[float, float], width: int) -> Axis:
    """An axis of the numbers of readings, in a chart N pixels wide."""
    return Axis(_("Reading number"), reach=reach, format="d", ticks=8 if width > 900 else 5, grid=False)


def band(
    x: Sequence[Value],
    low: Sequence[Value],
    high: Sequence[Value],
    fill: Colour,
    *,
    metas: tuple[str, str],
    pen: Pen | None = None,
    name: str = "",
    hover: str | Sequence[str] = "",
    links: Sequence[object] | None = None,
) -> list[Series]:
    """The ground between two lines. pen: of its edges; metas: what the lower and the upper one are."""
    pen = pen or Pen(fill, 0)
    return [
        Series(x, low, pen, meta=metas[0], hover=hover, links=links),
        Series(x, high, pen, meta=metas[1], hover=hover, links=links, fill=fill, name=name),
    ]


def words_of(rule: Rule) -> Note:
    """The words of a rule: above one that goes up; beside the panel or on the line of one that goes across."""
    words, colour, raised = rule.words, rule.colour, rule.raised
    if rule.y is None:
        return Note(words, rule.x, Share(1), upward="bottom", shift=(0, raised), colour=colour)
    if rule.on:
        return Note(words, Share(0), rule.y, "left", "bottom", (4, raised), colour=colour)
    return Note(words, Share(1), rule.y, "left", shift=(8, raised), colour=colour)


def bold(words: str) -> str:
    """Words in bold letters."""
    return f"<b>{words}</b>"


def empty(words: str) -> Note:
    """Words in the middle of a panel with nothing in it."""
    return Note(bold(words), Share(0.5), Share(0.5, inside=True), size=15, ground=True)


def nothing(words: str) -> Chart:
    """A chart that says why there is nothing in it."""
    return Chart([Panel([empty(words)], Axis(hidden=True))], Axis(hidden=True))
