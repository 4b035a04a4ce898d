"""The history of a calibrated place as a chart. Pure; lengths in mm in, µm on the axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime

from app.charts import (
    Axis,
    Chart,
    Dots,
    Note,
    Panel,
    Pen,
    Role,
    Room,
    Series,
    Share,
    Spread,
    band,
    bold,
    nothing,
    time_axis,
)
from app.charts import Mark as Drawn
from app.language.formatting import um
from app.language.i18n import _

SYMBOLS = {
    "unchanged": "circle",
    "accepted": "square",
    "proposed": "diamond",
    "overtaken": "circle-open",
    "refused": "x",
}
TONES: dict[str, Role] = {"proposed": "waiting", "refused": "stop"}


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


def gauge_figure(marks: Sequence[Mark], changes: Sequence[tuple[datetime, float]], value: float) -> Chart:
    """Differences over time against the empirical value in effect (steps) with the zones R33 and R34 about it.

    changes: when the empirical value became what, oldest first; value: the one in effect now. A refused calibration may lie
    a thousand times further off than the others: it is drawn at the edge, and its text says where it was.
    """
    if not marks and not changes:
        return nothing(_("Not calibrated yet"))
    heights = [value] + [value_after for _at, value_after in changes]
    for mark in marks:
        heights += [mark.before + side * (mark.averaging or mark.zero or 0.0) for side in (-1, 1)]
        heights += [limit for limit in (mark.low, mark.high) if limit is not None]
        if mark.status != "refused" and mark.difference is not None:
            heights.append(mark.difference)
    low, high = min(heights), max(heights)
    room = max(0.12 * (high - low), 0.0005)
    low, high = low - room, high + room
    names = [
        Note(name, Share(0), (mark.before + side) * 1000, "left", "bottom", (4, 0))
        for mark in [other for other in marks if other.zero is not None][:1]
        for name, side in (("R33", mark.zero or 0), ("R34", mark.averaging or 0))
    ]
    drawn: list[Drawn] = [
        *_zone(marks, "averaging", "band-1"),
        *_zone(marks, "zero", "band-2"),
        _steps(marks, changes, value),
        *_marks(marks, (low, high)),
        *names,
    ]
    return Chart([Panel(drawn, _axis(_("Measuring error, µm"), low, high))], time_axis(), Room(left=84))


def _zone(marks: Sequence[Mark], limit: str, colour: Role) -> list[Series]:
    """A band about the value in effect. What a calibration was judged by held since the one before it."""
    chosen = [mark for mark in marks if getattr(mark, limit) is not None]
    if len(chosen) < 2:
        return []
    below, above = ([(mark.before + side * getattr(mark, limit)) * 1000 for mark in chosen] for side in (-1, 1))
    at = [mark.at for mark in chosen]
    return band(at, below, above, colour, metas=(f"{limit} below", limit), pen=Pen(colour, 0, steps="vh"))


def _steps(marks: Sequence[Mark], changes: Sequence[tuple[datetime, float]], value: float) -> Series:
    points = list(changes)
    if marks and (not points or marks[0].at < points[0][0]):
        points.insert(0, (marks[0].at, marks[0].before))
    last = max([at for at, _value in points] + [mark.at for mark in marks])
    points.append((last, value))
    return Series(
        [at for at, _value in points],
        [value * 1000 for _at, value in points],
        Pen("correction", 2, steps="hv"),
        meta="value",
        name=_("Empirical value in effect"),
        hover=_("empirical value %{y:+.1f} µm"),
    )


def _marks(marks: Sequence[Mark], edges: tuple[float, float]) -> list[Series]:
    """One series per status, so that each has its shape, its word in the legend and its colour."""
    low, high = edges
    inset = (high - low) * 0.03
    drawn = []
    for status, symbol in SYMBOLS.items():
        chosen = [mark for mark in marks if mark.status == status and mark.difference is not None]
        if not chosen:
            continue
        tone = TONES.get(status, "ink")
        spread = None
        if any(mark.low is not None for mark in chosen):
            up, down = (
                [_beyond(mark.high, mark.difference) for mark in chosen],
                [_beyond(mark.difference, mark.low) for mark in chosen],
            )
            spread = Spread(up, down, tone)
        drawn.append(
            Series(
                [mark.at for mark in chosen],
                [min(max(mark.difference or 0.0, low + inset), high - inset) * 1000 for mark in chosen],
                dots=Dots(symbol, 11, tone, tone),
                spread=spread,
                meta=status,
                name=chosen[0].status_word,
                hover=[
                    bold(_("Calibration {n}").format(n=mark.number))
                    + f": {um(mark.difference)}<br>{_broken(mark.text)}"
                    for mark in chosen
                ],
                links=[f"#calibration-{mark.number}" for mark in chosen],
            )
        )
    return drawn


def _beyond(upper: float | None, lower: float | None) -> float:
    return 0.0 if upper is None or lower is None else (upper - lower) * 1000


def _broken(text: str, width: int = 64) -> str:
    lines = [""]
    for word in text.split(" "):
        if len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] += f" {word}" if lines[-1] else word
    return "<br>".join(lines)


def ring_figure(marks: Sequence[Mark]) -> Chart:
    """Above, how far the probe stood beside the spindle; below, the ring's diameters at the three sections."""
    if not marks:
        return nothing(_("Not calibrated yet"))
    good = [mark.difference for mark in marks if mark.difference is not None]
    reach = max([abs(correction) for correction in good] + [0.001]) * 1.2
    ring = [mark for mark in marks if mark.smallest is not None and mark.largest is not None]
    span = [size for mark in ring for size in (mark.smallest or 0.0, mark.largest or 0.0)] or [-0.001, 0.001]
    room = max(0.6 * (max(span) - min(span)), 0.001)
    edges = (min(span) - room, max(span) + room)
    sizes: list[Series | Note] = []
    for name, heights in (
        ("ES", [mark.largest or 0.0 for mark in ring]),
        ("EI", [mark.smallest or 0.0 for mark in ring]),
    ):
        if ring:
            y = [height * 1000 for height in heights]
            sizes.append(Series([mark.at for mark in ring], y, Pen("quiet", dash="dash", steps="hv"), meta=name))
            sizes.append(Note(name, Share(0), y[0], "left", "bottom", (4, 0)))
    for number in range(max([len(mark.diameters) for mark in marks], default=0)):
        probed = [mark for mark in marks if len(mark.diameters) > number]
        sizes.append(
            Series(
                [mark.at for mark in probed],
                [min(max(mark.diameters[number], edges[0]), edges[1]) * 1000 for mark in probed],
                dots=Dots(("triangle-left", "circle", "triangle-right")[number]),
                meta=f"section {number + 1}",
                name=_("Section {n}").format(n=number + 1),
                hover=[
                    _("section {n}: {value}").format(n=number + 1, value=um(mark.diameters[number])) for mark in probed
                ],
            )
        )
    beside = replace(_axis(_("Beside the spindle, µm"), -reach, reach), zero="faint")
    return Chart(
        [
            Panel(_marks(marks, (-reach, reach)), beside, (0.55, 1)),
            Panel(sizes, _axis(_("Ring less nominal, µm"), *edges), (0, 0.45)),
        ],
        time_axis(),
        Room(left=84),
    )


def _axis(title: str, low: float, high: float) -> Axis:
    return Axis(title, reach=(low * 1000, high * 1000), format="+.4~g", ticks=6)
