"""The lane of events above a chart: tool changes, calibrations, versions of the parameters, alarms, notes. Pure.

Events that would cover each other are one mark with their number; pointed at, it names them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from math import inf
from typing import Literal

from app.charts import Axis, Bars, Chart, Dots, Note, Panel, Pen, Role, Rule, Series
from app.language.formatting import as_read
from app.language.i18n import _
from app.language.times import plant_zone
from app.web.theme import ZONE_SYMBOLS

TOOL_CHANGE = "tool_change"
MANUAL_EDIT = "manual_edit"
CALIBRATION = "calibration"
PARAMETERS = "parameters"
NOTE = "note"

LETTER = (
    6.5  # pixels that a letter of an event takes, about: words that would run into each other are left to the shapes
)
TWO_ROWS, ONE_ROW = (0.5, -0.5), (0.0,)  # of the events
APART = 16  # pixels between two marks; what lies closer is one
MOST_NAMED = 8  # of the events of one mark, when it is pointed at
MOST_LINES = 40  # upward through the chart; more are a fence
LANE, BELOW = (0.91, 1.0), 0.88  # of the height of a chart that is given a lane: the lane, and the chart below it
SHAPES = {
    TOOL_CHANGE: "triangle-down-open",
    MANUAL_EDIT: "square-open",
    CALIBRATION: "circle-open",
    PARAMETERS: "diamond-open",
    NOTE: "square",
    "tool_worn": ZONE_SYMBOLS["wear"],
}
TONES: dict[str, Role] = {
    TOOL_CHANGE: "correction",
    MANUAL_EDIT: "correction",
    CALIBRATION: "ink",
    PARAMETERS: "ink",
    NOTE: "ink",
    "probe_fault": "stop",
    "tool_worn": "wear",
}
_Side = Literal["left", "right"] | None  # of a mark, on which its word is written
SET_UP = (NOTE, PARAMETERS, CALIBRATION, MANUAL_EDIT, TOOL_CHANGE)  # from what matters least, below the alarms


@dataclass(frozen=True)
class Event:
    """One event. at: the number of a reading, or a moment. kind: as above, or that of an alarm; text: its word.

    more: what it says when it is pointed at. Both are markup, as labels of charts are.
    """

    at: float | datetime
    kind: str
    text: str
    link: str | None = None
    active: bool = False
    more: str = ""

    @property
    def is_alarm(self) -> bool:
        return self.kind not in SET_UP

    @property
    def tone(self) -> Role:
        return TONES.get(self.kind, "attention")

    @property
    def shape(self) -> str:
        return SHAPES.get(self.kind) or ZONE_SYMBOLS.get(self.kind, "star-triangle-up")

    @property
    def weight(self) -> tuple[bool, int]:
        """Order among others: what matters most is greatest."""
        return self.active, len(SET_UP) if self.is_alarm else SET_UP.index(self.kind)


@dataclass(frozen=True)
class _Mark:
    """Events of one place, that of the first; the one that matters most gives the look."""

    events: Sequence[Event]

    @property
    def main(self) -> Event:
        return max(reversed(self.events), key=lambda event: event.weight)

    @property
    def text(self) -> str:
        if len(self.events) == 1:
            return self.main.text
        if len({event.text for event in self.events}) == 1:
            return f"{self.main.text} ×{len(self.events)}"
        return f"{self.main.text} +{len(self.events) - 1}"

    @property
    def hover(self) -> str:
        named = [_pointed_at(event) for event in self.events[-MOST_NAMED:]]
        more = len(self.events) - len(named)
        return "<br>".join([*([_("{n} more before").format(n=more)] if more else []), *named])


def _pointed_at(event: Event) -> str:
    return "<br>".join([f"<b>{event.text}</b>", *([event.more] if event.more else []), _place_words(event.at)])


def _place_words(at: float | datetime) -> str:
    if isinstance(at, datetime):
        return f"{as_read(at)} {plant_zone().key}"
    return _("Reading {n}").format(n=round(at))


def _number(at: float | datetime) -> float:
    return at.timestamp() if isinstance(at, datetime) else at


def _marks(events: Sequence[Event], span: tuple[float, float], pixels: float) -> list[tuple[_Mark, float]]:
    """The events in marks that do not cover each other, with their pixels from the left."""
    per_pixel = (span[1] - span[0]) / pixels
    marks: list[tuple[list[Event], float]] = []
    for event in sorted(events, key=lambda event: _number(event.at)):
        place = (_number(event.at) - span[0]) / per_pixel
        if marks and place - marks[-1][1] < APART:
            marks[-1][0].append(event)
        else:
            marks.append(([event], place))
    return [(_Mark(together), place) for together, place in marks]


def _rows(marks: Sequence[tuple[_Mark, float]], most: float, rows: Sequence[float]) -> list[tuple[_Mark, float, _Side]]:
    """Each mark with its row and the side on which its word is written; a word gives way to the next mark's shape.

    most: pixels from the left that a word may reach; beside a mark near the end it is on the left, if there is room.
    """
    places: list[tuple[_Mark, float, _Side]] = []
    latest = dict.fromkeys(rows, -1)  # index of the last mark in the row
    end = dict.fromkeys(rows, -inf)  # where its word ends, px
    for mark, place in marks:
        word = LETTER * len(mark.text)
        side: _Side = "right" if place + 12 + word < most else "left"
        start = place - 8 if side == "right" else place - 12 - word
        row = rows[0] if end[rows[0]] <= start else min(end, key=lambda row: end[row])
        if end[row] > start and side == "left":
            side = None
        if end[row] > place - 8:
            before, _row, _side = places[latest[row]]
            places[latest[row]] = (before, row, None)
        latest[row], end[row] = len(places), place + 12 + word if side == "right" else place + 10
        places.append((mark, row, side))
    return places


def event_lane(
    events: Sequence[Event],
    span: tuple[float, float],
    pixels: float,
    beside: float,
    *,
    lines: bool = True,
    low: bool = False,
) -> list[Series | Rule | Note]:
    """Marks and words of the events within the span, and in the legend what their shapes mean.

    span: of the axis, N pixels wide; moments as seconds (Unix time). beside: pixels that words may reach out at its
    right. lines: upward through the chart, at what a person changed. low: the lane has room for one row. A word is left out where it
    would not fit.
    """
    within = [event for event in events if span[0] <= _number(event.at) <= span[1]]
    places = _rows(_marks(within, span, pixels), pixels + beside, ONE_ROW if low else TWO_ROWS)
    if not places:
        return []
    main = [mark.main for mark, _row, _side in places]
    colours = [event.tone for event in main]
    changed = [event for event in main if not event.is_alarm and event.kind != NOTE]
    return [
        *(
            Rule(Pen("correction", 1.25, "dot"), x=event.at, upto=0.94)
            for event in (changed if lines and len(changed) <= MOST_LINES else [])
        ),
        Series(
            [mark.events[0].at for mark, _row, _side in places],
            [row for _mark, row, _side in places],
            dots=Dots([event.shape for event in main], 12, colours, edge=colours),
            meta="events",
            hover=[mark.hover for mark, _row, _side in places],
            links=[event.link for event in main],
        ),
        *_legend(within),
        *(
            Note(
                f"<b>{mark.text}</b>" if mark.main.active else mark.text,
                mark.events[0].at,
                row,
                "left" if side == "right" else "right",  # the end of the words that lies at the mark
                shift=(9 if side == "right" else -9, 0),
                colour=mark.main.tone,
            )
            for mark, row, side in places
            if side
        ),
    ]


def _legend(events: Sequence[Event]) -> list[Series]:
    """A name for each shape that a person's changes have, and one for the alarms, whose zones have many."""
    words = {
        TOOL_CHANGE: _("Tool change"),
        MANUAL_EDIT: _("Offset edited"),
        CALIBRATION: _("Calibration"),
        PARAMETERS: _("Parameter version"),
        NOTE: _("Note"),
    }
    kinds = {event.kind if not event.is_alarm else "alarm": event for event in events}
    return [
        Series(
            [event.at],
            [None],
            dots=Dots(event.shape, 11, event.tone, event.tone),
            meta="legend",
            name=words.get(kind) or _("Alarm"),
        )
        for kind, event in sorted(kinds.items())
    ]


def span_of(chart: Chart) -> tuple[float, float] | None:
    """Ends of the chart's axis, moments as seconds; a little more at the right for what came last. None without points."""
    ends = chart.x.reach or [
        value
        for panel in chart.panels
        for mark in panel.marks
        if isinstance(mark, Series | Bars)
        for value in mark.x
        if value is not None
    ]
    numbers = [_number(value) for value in ends if isinstance(value, int | float | datetime)]
    if not numbers or min(numbers) == max(numbers):
        return None
    low, high = min(numbers), max(numbers)
    room = 0 if chart.x.reach else 0.02 * (high - low)
    return low - room, high + room


def with_lane(chart: Chart, events: Sequence[Event], width: int, *, lines: bool = True) -> Chart:
    """The chart with its events in a lane above; without any in its span, as it is. width: in pixels, about."""
    span = span_of(chart)
    if span is None:
        return chart
    pixels = max(width - chart.room.left - chart.room.right, 200)
    lane = event_lane(events, span, pixels, chart.room.right, lines=lines)
    if not lane:
        return chart
    hidden = Axis(reach=(-1, 1), grid=False, line=False, labelled=False, fixed=True)
    panels = [replace(panel, share=(panel.share[0] * BELOW, panel.share[1] * BELOW)) for panel in chart.panels]
    return replace(chart, panels=[*panels, Panel(lane, hidden, LANE)], room=replace(chart.room, top=max(chart.top, 34)))
