"""Diagrams of rotary axes. Pure; mm and degrees in, µm on the axes.

As in the control's protocol: measured red, optimised green, against the angle of the axis; here with shapes and words as
well. Angles become what they come to over one metre, so that all position errors are in one picture.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from app.charts import (
    Axis,
    Chart,
    Dots,
    Mark,
    Note,
    Panel,
    Pen,
    Role,
    Room,
    Series,
    Share,
    Spread,
    bold,
    nothing,
    time_axis,
)
from app.geometry.rotary_axes.drift import Compared, Drift
from app.geometry.rotary_axes.result_values import UNITS, as_reading
from app.geometry.rotary_axes.wording import difference, name_words
from app.geometry.rotary_axes.wording import entered as in_words
from app.language.i18n import _

LETTERS = "XYZ"
KINDS = ("measured", "optimised")
ARROWS = {1: "\N{UPWARDS ARROW}", -1: "\N{DOWNWARDS ARROW}"}  # the axis came from smaller angles, or from larger ones
SHAPES = {1: "triangle-up", -1: "triangle-down", 0: "circle"}
ROOM = 1.25


def diagram(axis: Mapping[str, Any], letter: str, *, height: float = 0.0) -> Chart:
    """E{letter}{axis}: the deviation in one direction against the angle, for each approach, before and after.

    height: of the axis, mm at least, so that the diagrams of an axis can be read side by side.
    """
    at = LETTERS.index(letter)
    marks: list[Series] = []
    for kind, words, pen in (
        ("measured", _("measured"), Pen("stop", 2)),
        ("optimised", _("optimised"), Pen("corrected", 2, "dash")),
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
            symbol = SHAPES[approach] if approach else "square" if kind == "optimised" else "circle"
            marks.append(
                Series(
                    [angle for angle, _value in chosen],
                    [value * 1000 for _angle, value in chosen],
                    pen,
                    Dots(symbol, 9, pen.colour if kind == "measured" else "surface", pen.colour, 2),
                    meta=kind,
                    name=f"{words} {side}" if side else words,
                    hover=f"%{{x:+.3f}}°: %{{y:+.1f}} µm<br>{words}",
                )
            )
    if not marks:
        return nothing(_("This run holds no single positions"))
    values = [value for position in axis["positions"] for kind in KINDS if (value := position[kind][at]) is not None]
    reach = max([abs(value) * 1000 for value in values] + [height * 1000, 1.0]) * ROOM
    angles = sorted(set(axis["angles"]))
    return Chart(
        [
            Panel(
                marks,
                Axis(f"E{letter}{axis['axis']}, µm", reach=(-reach, reach), format="+.3~g", ticks=6, zero="faint"),
            )
        ],
        Axis(_("{axis}, °").format(axis=axis["axis"]), at=angles if len(angles) <= 8 else None),
        Room(bottom=46),
    )


def greatest(axis: Mapping[str, Any]) -> float:
    """The largest deviation in any direction, mm: the height that all diagrams of an axis have."""
    values = [abs(v) for position in axis["positions"] for kind in KINDS for v in position[kind] if v]
    return max(values, default=0.0)


def comparison(changes: Sequence[Compared], entered: Mapping[str, float]) -> Chart:
    """Picture of two runs: a row for each position error, an arrow from then to now, ±2 s about both."""
    rows = [change for change in changes if change.name.startswith("E")]
    if not rows:
        return nothing(_("The two runs have no position error in common"))
    before = [_um(change.name, change.change.before) for change in rows]
    after = [_um(change.name, change.change.after) for change in rows]
    tones: list[Role] = ["attention" if change.change.moved else "steady" for change in rows]
    spread = [
        2 * _um(change.name, change.change.deviation / 2**0.5) if change.change.deviation else 0.0 for change in rows
    ]
    largest = max([abs(v) + s for values in (before, after) for v, s in zip(values, spread, strict=True)] + [1.0])
    marks: list[Mark] = []
    for row, change in enumerate(rows):
        pen = Pen(tones[row], 5 if change.change.moved else 2)
        marks.append(Series([before[row], after[row]], [row, row], pen))
        words = [_moved(change)]
        if (enter := entered.get(change.name)) is not None:
            words.append(bold(_("enter {value}").format(value=in_words(change.name, enter))))
        marks.append(Note(" · ".join(words), Share(1), row, "right", size=14, colour="ink"))
    for name, values, symbol in ((_("then"), before, "circle-open"), (_("now"), after, "diamond")):
        # The points have the colour of what they mean, so the legend has a mark of its own.
        marks.append(Series([None], [None], dots=Dots(symbol, 12, "ink", "ink", 2), name=name))
        marks.append(
            Series(
                values,
                list(range(len(rows))),
                dots=Dots(symbol, 13, tones, tones, 2),
                spread=Spread(spread, across=True),
                meta=name,
                hover=f"%{{x:+.1f}} µm<br>{name}",
            )
        )
    return Chart(
        [
            Panel(
                marks,
                Axis(
                    at=list(range(len(rows))),
                    words=[f"<b>{change.name}</b>  {name_words(change.name)}" for change in rows],
                    reach=(len(rows) - 0.4, -0.6),
                    colour="ink",
                    letters=14,
                ),
            )
        ],
        Axis(
            _("µm; how an axis leans as µm over 1 m"),
            reach=(-1.15 * largest, 2.9 * largest),  # room for the words at the right, on a narrow panel as well
            format="+.3~g",
            zero="ink",
            at=_ticks(largest),
        ),
        Room(left=196, right=12, bottom=46),
    )


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


def course(drift: Drift) -> Chart:
    """A value over the runs: its true course, what has been entered (steps), the limit about that, and the trend."""
    if not drift.points:
        return nothing(_("No run holds {name}").format(name=drift.name))
    angle = UNITS[drift.name] == "°"
    factor, unit = (1.0, "°") if angle else (1000.0, "µm")
    if drift.name.startswith("radius"):
        factor, unit = 1.0, "mm"
    at = [point.at for point in drift.points]
    base = [(point.true - point.value) * factor for point in drift.points]
    marks: list[Series] = []
    if drift.limit is not None:
        for sign, words in ((1, _("upper limit")), (-1, _("lower limit"))):
            edge = [value + sign * drift.limit * factor for value in base]
            marks.append(Series(at, edge, Pen("attention", dash="dash", steps="hv"), meta=words))
    if any(base):
        marks.append(Series(at, base, Pen("correction", 2, steps="hv"), meta=_("entered")))
    if drift.trend is not None:
        counting = [point for point in drift.points if not point.waits]
        days = [point.at.timestamp() / 86_400 for point in counting]
        middle, mean = sum(days) / len(days), sum(point.true for point in counting) / len(days)
        ends = [(mean + drift.trend.slope * (day - middle)) * factor for day in (min(days), max(days))]
        marks.append(Series([counting[0].at, counting[-1].at], ends, Pen("quiet", dash="dot"), meta=_("trend")))
    beyond = [drift.limit is not None and abs(point.value) > drift.limit for point in drift.points]
    spread = [2 * (point.deviation or 0.0) * factor for point in drift.points]
    marks.append(
        Series(
            at,
            [point.true * factor for point in drift.points],
            Pen("steady"),
            Dots(
                ["triangle-up" if out else "circle" for out in beyond],
                9,
                ["attention" if out else "steady" for out in beyond],
            ),
            spread=Spread(spread) if any(spread) else None,
            meta=drift.name,
            hover=[
                _("run {n}").format(n=point.number)
                + f": {point.true * factor:+.4g} {unit}"
                + (", " + _("to be confirmed") if point.waits else "")
                for point in drift.points
            ],
            links=[f"/kinematics/runs/{point.number}" for point in drift.points],
        )
    )
    heights = [y for mark in marks for y in mark.y if isinstance(y, float) and isfinite(y)]
    low, high = min(heights), max(heights)
    room = max((high - low) * 0.15, 1e-6 if angle else 0.5)
    height = Axis(f"{drift.name}, {unit}", reach=(low - room, high + room), format="+.4~g", ticks=6, zero="faint")
    return Chart([Panel(marks, height)], time_axis(at), Room(left=74, top=12))


def _um(name: str, value: float) -> float:
    return as_reading(name, value) * 1000
