"""Warnings about rotary axes that stand further off than a machine can have them. Lengths mm, angles degrees."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from app.core.rotary.results import OFFSETS, SCALARS
from app.core.warning import CodedWarning


class AxisBounds(NamedTuple):
    """Largest plausible error of a rotary axis: its lean in degrees, its place in mm."""

    turn: float = 1.0
    shift: float = 1.0


def axis_warnings(values: Mapping[str, float], bounds: AxisBounds) -> Iterator[CodedWarning]:
    """Yield a warning for each value beyond the bounds, by its name.

    values: position errors (EX0C …), the scatter (Q141 to Q146), the offsets (Q147 to Q149).

    >>> [(w.code, w.values["name"]) for w in axis_warnings({"EX0C": 99999.1234, "EA0C": 0.01, "Q143": 0.01}, AxisBounds())]
    [('axis_far_off', 'EX0C')]
    """
    for name, value in values.items():
        if name.startswith("E") and name[1:2] in "ABC":
            code, limit = "axis_leans_far", bounds.turn
        elif name in OFFSETS:
            code, limit = "ball_far_off", bounds.shift
        elif name in SCALARS:
            code, limit = "scatter_large", bounds.shift
        elif name.startswith("E"):
            code, limit = "axis_far_off", bounds.shift
        else:
            continue
        if abs(value) > limit:
            yield CodedWarning(code, {"name": name, "value": value, "limit": limit})
