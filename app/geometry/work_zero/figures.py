"""Chart of a fixture's shift over time. Pure; lengths in mm in, µm on the axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import hypot

from app.charts import Axis, Chart, Dots, Panel, Pen, Role, Room, Rule, Series, bold, time_axis
from app.charts import Mark as Drawn
from app.language.formatting import um
from app.language.i18n import _

SYMBOLS = {"x": "circle", "y": "square", "z": "diamond"}
TONES: dict[str, Role] = {"x": "ink", "y": "steady", "z": "quiet"}
DASHES = {"x": "solid", "y": "dash", "z": "dot"}


@dataclass(frozen=True)
class Mark:
    """One zero. shifts: by axis, mm; state: as `core.geometry.work_zero.Shift`."""

    number: int
    at: datetime
    shifts: dict[str, float]
    state: str
    offset: str


def _tone(mark: Mark, axis: str, warning: float | None) -> Role:
    """The colour of an axis of a zero that has shifted: of the axis that has most, and of those that would do it alone."""
    size = abs(mark.shifts[axis])
    to_blame = size >= max(map(abs, mark.shifts.values())) or (warning is not None and size > warning)
    if mark.state in {"alarm", "warning"} and to_blame:
        return "stop" if mark.state == "alarm" else "attention"
    return TONES[axis]


def shift_figure(marks: Sequence[Mark], warning: float | None, alarm: float | None) -> Chart:
    """X, Y and Z of each zero against what the fixture is compared with, with the limits."""
    together = [mark for mark in marks if len(mark.shifts) > 1]
    drawn: list[Drawn] = [
        *_limit(warning, _("warning"), "attention"),
        *_limit(alarm, _("alarm"), "stop"),
    ]
    if together:
        drawn.append(
            Series(
                [mark.at for mark in together],
                [hypot(*mark.shifts.values()) * 1000 for mark in together],
                Pen("grid", 5),
                meta="together",
                name=_("together"),
            )
        )
    for axis, symbol in SYMBOLS.items():
        mine = [mark for mark in marks if axis in mark.shifts]
        if not mine:
            continue
        drawn.append(
            Series(
                [mark.at for mark in mine],
                [mark.shifts[axis] * 1000 for mark in mine],
                Pen(TONES[axis], dash=DASHES[axis]),
                Dots(symbol, 9, [_tone(mark, axis, warning) for mark in mine]),
                meta=axis,
                name=axis.upper(),
                hover=[
                    bold(_("Work zero {n}").format(n=mark.number))
                    + f", {mark.offset}<br>{axis.upper()} {um(mark.shifts[axis])}"
                    for mark in mine
                ],
                links=[f"/work-zeros/{mark.number}" for mark in mine],
            )
        )
    heights = [abs(value) for mark in marks for value in mark.shifts.values()]
    heights += [limit for limit in (warning, alarm) if limit is not None]
    reach = max([*heights, 0.001]) * 1150
    height = Axis(_("Shift, µm"), reach=(-reach, reach), format="+.4~g", ticks=7, zero="faint")
    return Chart([Panel(drawn, height)], time_axis([mark.at for mark in marks]), Room(left=84))


def _limit(limit: float | None, word: str, tone: Role) -> list[Rule]:
    if limit is None:
        return []
    pen = Pen(tone, dash="dash")
    return [Rule(pen, limit * 1000, words=word, on=True, colour=tone), Rule(pen, -limit * 1000)]
