"""Control charts. Pure; lengths in mm in, µm on the axes.

Points are steady grey; one that makes a signal is orange and a triangle that points the way it lies, or a diamond where a rule knows no
side. Of more points than pixels each stretch shows its lowest and its highest, and those of its signals, so no extreme is
thinned away.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.charts import Axis, Chart, Dots, Ground, Note, Panel, Pen, Room, Rule, Series, Share, nothing, reading_axis
from app.core.spc.rules import Signals
from app.core.spc.shewhart import Chart as Shewhart
from app.language.formatting import signed
from app.language.i18n import _
from app.quality.baselines.wording import axis
from app.quality.control_charts.axis_range import UNSIGNED, beyond, reach
from app.quality.control_charts.downsampling import thinned
from app.quality.control_charts.view import Marks, View

MOST_CHANGES = 40  # lines of tool changes; more are a fence
WITH_MARKERS = 400
CENTRE, LIMIT = Pen("quiet"), Pen("ink", dash="dash")
TOGETHER = 0.1  # of the axis: limits that lie closer than this are named in one line
Links = Callable[[Any], object]
SYMBOLS = {1: "triangle-up", 0: "diamond", -1: "triangle-down"}


def control_figure(
    view: View,
    *,
    key: str,
    marked: Marks | None = None,
    width: int = 1240,
    inner: int | None = None,
    picks: bool = False,
) -> Chart:
    """One control chart.

    inner: pixels between its sides, if they are fewer than its width says. picks: dragging chooses a period, and a click a
    point (see pick-period.js).
    """
    if not len(view.points):
        return nothing(_("No points in this period."))
    sides = _sides(view.signals, len(view))
    drawn = thinned(view.points if view.below is None else view.points - view.below, sides != NO_SIGNAL)
    links = _links(view, key, picks=picks)
    low, high = reach(view)
    first, last = int(view.first[0]), int(view.last[-1])
    edge = max(1.0, (last - first) * 0.01)
    marks = [
        *(_period(marked, view) if marked is not None else []),
        *_changes(view),
        *_limits(view, drawn),
        _points(view, view.points, drawn, links, picks=picks),
        *([] if view.below is None else [_points(view, view.below, drawn, links, picks=picks)]),
        *_signals(view, drawn, sides, links),
        *beyond(view, drawn, [links(at) for at in drawn], low, high, inner or width),
        *_names(view, width, high - low),
    ]
    height = Axis(_axis(view), reach=(low, high), format=_format(view.kind, high - low), ticks=7, fixed=picks)
    return Chart(
        [Panel(marks, height)],
        reading_axis((first - edge, last + edge), width),
        Room(76, 20 if width < 600 or view.centre is None else 118, 44, 26),
        drag="select" if picks else "zoom",
    )


NO_SIGNAL = 9


def _sides(signals: Signals | None, count: int) -> NDArray[np.int8]:
    """Of each point the side of its signal, or `NO_SIGNAL`."""
    return np.full(count, NO_SIGNAL, np.int8) if signals is None else signals.sides(NO_SIGNAL)


def _um(values: Any) -> Any:
    return np.round(np.asarray(values) * 1000, 4)


def _points(view: View, values: NDArray[np.float64], drawn: NDArray[np.int64], links: Links, *, picks: bool) -> Series:
    """The points, joined within each tool: a gap at each change of it, unless a chart carries over."""
    few = len(drawn) <= WITH_MARKERS
    x: list[Any] = view.last[drawn].tolist()
    y: list[Any] = _um(values[drawn]).tolist()
    opened: list[Any] = [links(at) for at in drawn]
    edges = np.cumsum(view.begins)[drawn]
    if view.kind in (Shewhart.INDIVIDUALS, Shewhart.MOVING_RANGE):
        for at in reversed((np.flatnonzero(np.diff(edges)) + 1).tolist()):
            for column in (x, y, opened):
                column.insert(at, None)
    return Series(
        x,
        y,
        Pen("faint" if few else "steady", 1.2),
        Dots(size=6 if few else 3) if few or picks else None,
        meta="points",
        hover=_hover(view),
        links=opened,
    )


def _signals(view: View, drawn: NDArray[np.int64], sides: NDArray[np.int8], links: Links) -> list[Series]:
    at = drawn[sides[drawn] != NO_SIGNAL]
    if not len(at):
        return []
    values = view.points if view.below is None else np.where(sides == -1, view.below, view.points)
    symbols = [SYMBOLS[int(side)] for side in sides[at]]
    return [
        Series(
            view.last[at].tolist(),
            _um(values[at]).tolist(),
            dots=Dots(symbols, 12 if len(at) <= 60 else 8, "attention", "surface", 1),
            meta="signals",
            hover=_hover(view),
            links=[links(one) for one in at],
        )
    ]


def _links(view: View, key: str, *, picks: bool) -> Links:
    """Target of a click on a point: the reading; where the chart picks readings, its number."""
    if picks:
        return lambda at: int(view.last[at])
    return lambda at: f"/characteristics/{key}/readings/{view.last[at]}"


def _hover(view: View) -> str:
    value = "%{y:.2f}" if view.kind in UNSIGNED else "%{y:+.2f}"
    return _("Reading") + " %{x:d}<br>" + value + " µm"


def _limits(view: View, drawn: NDArray[np.int64]) -> list[Series]:
    lines = (("centre", view.centre, CENTRE), ("lower", view.lower, LIMIT), ("upper", view.upper, LIMIT))
    ends = [int(view.first[0]), int(view.last[-1])]
    return [
        Series(ends, [float(_um(values))] * 2, pen, meta=name)
        if np.ndim(values) == 0
        else Series(
            view.last[drawn].tolist(), _um(np.asarray(values)[drawn]).tolist(), replace(pen, steps="hvh"), meta=name
        )
        for name, values, pen in lines
        if values is not None and not _is_floor(view, values)
    ]


def _names(view: View, width: int, span: float) -> list[Note]:
    """The limits by name, at the right of the newest point."""
    notes = [_given()] if view.given and view.centre is not None else []
    if width < 600 or view.centre is None:
        return notes
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
    return notes + [Note(text, Share(1), value, "left", shift=(6, 0)) for text, value in labels]


def _given() -> Note:
    text = _("limits given by the customer")
    return Note(text, Share(0, inside=True), Share(0, inside=True), "left", "bottom", shift=(6, 4), ground=True)


def _value(view: View, value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if view.kind in UNSIGNED else signed(value, decimals)


def _is_floor(view: View, values: Any) -> bool:
    """A lower limit of 0 limits nothing where there is nothing below."""
    return view.kind in UNSIGNED and not np.any(values)


def _changes(view: View) -> list[Rule]:
    """Lines at tool changes, and at changes of the size that readings are measured by."""
    at = view.first[view.begins]
    at = at[at > view.first[0]]
    return [] if len(at) > MOST_CHANGES else [Rule(Pen("faint", 1, "dot"), x=number - 0.5) for number in at.tolist()]


def _period(marked: Marks, view: View) -> list[Ground | Note]:
    first, last = max(marked.first, int(view.first[0])), min(marked.last, int(view.last[-1]))
    if first > last:
        return []
    return [
        Ground("band-2", x=(first - 0.5, last + 0.5)),
        *(
            Ground("band-4", x=(low - 0.5, high + 0.5))
            for low, high in marked.excluded
            if high >= first and low <= last
        ),
        Note(marked.name, first, Share(1, inside=True), "left", "top"),
    ]


def _axis(view: View) -> str:
    match view.kind:
        case Shewhart.MOVING_RANGE:
            return _("Moving range, µm")
        case Shewhart.RANGES:
            return _("Range, µm")
        case Shewhart.DEVIATIONS:
            return _("Standard deviation, µm")
        case Shewhart.CUSUM:
            return _("Cumulative sum, µm")
        case _:
            return axis(view.quantity)


def _format(kind: Shewhart, span: float) -> str:
    sign = "" if kind in UNSIGNED else "+"
    return f"{sign}.0f" if span > 8 else f"{sign}.1f" if span > 0.8 else f"{sign}.2f"
