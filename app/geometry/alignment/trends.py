"""Chart of one set-up's position over time. Pure; shifts in mm in, µm on the axis; turns in degrees."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import NamedTuple

from app.charts import Axis, Chart, Dots, Panel, Pen, Room, Series, time_axis
from app.language.formatting import signed
from app.language.i18n import _

PENS = (Pen("ink"), Pen("correction", dash="dash"), Pen("wear", dash="dot"))


class Mark(NamedTuple):
    """An alignment as it is drawn over time: shifts in mm, turns in degrees."""

    at: datetime
    number: int
    shift: Sequence[float]
    turns: Sequence[float]
    doubted: bool


def trend(marks: Sequence[Mark]) -> Chart:
    """Shifts above, turns below, one line for each axis, distinguished by their marks as well."""
    shifts = [_course(marks, axis, [mark.shift[axis] * 1000 for mark in marks], "µm", 1) for axis in range(3)]
    turns = [_course(marks, axis, [mark.turns[axis] for mark in marks], "°", 4) for axis in range(3)]
    return Chart(
        [
            Panel(shifts, Axis(_("Shift, µm"), format="+.4~g", zero="faint"), (0.54, 1)),
            Panel(
                [replace(turn, name="") for turn in turns], Axis(_("Turn, °"), format="+.4~g", zero="faint"), (0, 0.46)
            ),
        ],
        time_axis([mark.at for mark in marks]),
        Room(72, 16, 48, 36),
    )


def _course(marks: Sequence[Mark], axis: int, values: list[float], unit: str, decimals: int) -> Series:
    name, pen = "XYZ"[axis], PENS[axis]
    return Series(
        [mark.at for mark in marks],
        values,
        pen,
        Dots(("circle", "square", "diamond")[axis], 8, pen.colour),
        name=name,
        hover=[
            _("alignment {n}: {axis} {value} {unit}").format(
                n=mark.number, axis=name, value=signed(value, decimals), unit=unit
            )
            for mark, value in zip(marks, values, strict=True)
        ],
        links=[f"/alignments/{mark.number}" for mark in marks],
    )
