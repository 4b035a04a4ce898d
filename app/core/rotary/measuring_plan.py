"""The measuring plan of rotary axes (cycles 451 and 452): the angles at which each axis is measured, and what to check before.

The control measures A, then B, then C. The positions of an axis run in equal steps from its start to its end angle; an axis
with Hirth teeth is on the nearest tooth. Lengths are mm, angles degrees, feeds mm/min.
"""

from collections.abc import Iterator
from typing import Literal, NamedTuple

from app.core.rotary.axis import AXES, FEWEST, NARROWEST_ARC, AxisName, arc_of
from app.core.warning import CodedWarning

MOST_POSITIONS = 12
TO_LIMIT_SWITCH = 1.0  # degrees that an axis without an encoder of its own needs beyond each position
PLACES = 4  # of an angle or a length on this control
FeedWord = Literal["FMAX", "FAUTO", "PREDEF"]


class AxisPlan(NamedTuple):
    """Measuring plan of one axis; points 0: the axis is not measured.

    incidence: where it stands while the others are measured. teeth: grid of its Hirth teeth, None for an axis that turns
    freely. travel: its limit switches. encoder: it has a position encoder of its own.
    """

    axis: AxisName
    start: float
    end: float
    incidence: float
    points: int
    teeth: float | None = None
    travel: tuple[float, float] | None = None
    encoder: bool = True


class MeasuringPlan(NamedTuple):
    """A call of cycle 451 or 452. feed: mm/min or a word; clearance: mm, or PREDEF; mode (Q406) and preset (Q431): 451 only."""

    cycle: Literal[451, 452]
    ball_radius: float
    axes: tuple[AxisPlan, ...]
    clearance: float | Literal["PREDEF"] = 0.0
    retract_height: float = 0.0
    feed: float | FeedWord = 750.0
    reference_angle: float = 0.0
    touches: int = 4
    backlash_angle: float = 0.0
    mode: int = 0
    preset: int = 0

    @property
    def order(self) -> tuple[AxisPlan, ...]:
        """The axes that are measured, in the order of the control."""
        return tuple(axis for letter in AXES for axis in self.axes if axis.axis == letter and axis.points)


def positions(axis: AxisPlan) -> tuple[float, ...]:
    """The angles at which an axis is measured.

    >>> positions(AxisPlan("A", -30, 90, 0, 4, teeth=3)), positions(AxisPlan("C", -90, 90, 0, 3))
    ((-30.0, 9.0, 51.0, 90.0), (-90.0, 0.0, 90.0))
    """
    step = (axis.end - axis.start) / (axis.points - 1) if axis.points > 1 else 0.0
    angles = [axis.start + number * step for number in range(axis.points)]
    if axis.teeth:
        angles = [_nearest_tooth(angle, axis.teeth) for angle in angles]
    return tuple(round(angle, PLACES) + 0.0 for angle in angles)


def _nearest_tooth(angle: float, teeth: float) -> float:
    return round(angle / teeth) * teeth


def arc(axis: AxisPlan) -> float:
    """The smallest arc that holds all positions, degrees; 0 for fewer than two."""
    angles = positions(axis)
    return arc_of(angles) if len({round(angle % 360, 6) for angle in angles}) > 1 else 0.0


def faults(plan: MeasuringPlan) -> list[CodedWarning]:
    """Reasons why the control would not run the plan, or run into a limit switch."""
    return list(_faults(plan))


def _faults(plan: MeasuringPlan) -> Iterator[CodedWarning]:
    for number, axis in enumerate(plan.axes):
        field = f"axes[{number}]"
        if not axis.points:
            continue
        if axis.teeth and plan.retract_height == 0:
            yield CodedWarning("hirth_no_retract", {"axis": axis.axis}, "retract_height")
        if axis.travel:
            low, high = axis.travel
            for angle in positions(axis):
                if not low <= angle <= high:
                    yield CodedWarning(
                        "beyond_travel", {"axis": axis.axis, "angle": angle, "low": low, "high": high}, field
                    )
                    break


def warnings(plan: MeasuringPlan) -> list[CodedWarning]:
    """Warn of difficulties with a plan that the control accepts."""
    return list(_warnings(plan))


def _warnings(plan: MeasuringPlan) -> Iterator[CodedWarning]:
    if not plan.order:
        yield CodedWarning("no_axis", {}, "axes")
    if plan.feed == 0:
        yield CodedWarning("feed_zero", {}, "feed")
    if plan.cycle == 452:
        for field, q, value in (("mode", "Q406", plan.mode), ("preset", "Q431", plan.preset)):
            if value:
                yield CodedWarning("only_451", {"q": q, "value": value}, field)
    for number, axis in enumerate(plan.axes):
        if axis.points:
            yield from _of_axis(plan, axis, f"axes[{number}]")


def _of_axis(plan: MeasuringPlan, axis: AxisPlan, field: str) -> Iterator[CodedWarning]:
    angles = positions(axis)
    distinct = {round(angle % 360, 6) for angle in angles}
    if len(distinct) < FEWEST:
        values = {"axis": axis.axis, "got": len(distinct), "needed": FEWEST}
        yield CodedWarning("few_positions", values, f"{field}.points")
    elif arc(axis) < NARROWEST_ARC:
        yield CodedWarning("narrow_arc", {"axis": axis.axis, "arc": arc(axis), "needed": NARROWEST_ARC}, field)
    if len(distinct) < len(angles) and axis.points > 1:
        yield CodedWarning("measured_twice", {"axis": axis.axis}, field)
    if axis.teeth:
        planned = positions(axis._replace(teeth=None))
        moved = max(abs(a - b) for a, b in zip(angles, planned, strict=True))
        if moved > 10**-PLACES:
            yield CodedWarning("moved_to_teeth", {"axis": axis.axis, "moved": round(moved, PLACES)}, field)
    if not axis.encoder:
        yield from _limit_switches(plan, axis, angles, field)


def _limit_switches(
    plan: MeasuringPlan, axis: AxisPlan, angles: tuple[float, ...], field: str
) -> Iterator[CodedWarning]:
    if axis.travel is None:
        yield CodedWarning("travel_unknown", {"axis": axis.axis, "needed": TO_LIMIT_SWITCH}, f"{field}.travel")
        return
    room = min(min(angle - axis.travel[0], axis.travel[1] - angle) for angle in angles)
    needed = TO_LIMIT_SWITCH + abs(plan.backlash_angle)
    if room < needed:
        yield CodedWarning(
            "near_limit_switch", {"axis": axis.axis, "room": round(room, PLACES), "needed": needed}, field
        )


# --- as Q parameters

OF_AXIS: dict[AxisName, tuple[str, str, str, str]] = {
    "A": ("Q411", "Q412", "Q413", "Q414"),
    "B": ("Q415", "Q416", "Q417", "Q418"),
    "C": ("Q419", "Q420", "Q421", "Q422"),
}
"""Start, end, incidence angle and number of points of each axis."""
QValue = float | str


def q_values(plan: MeasuringPlan) -> dict[str, QValue]:
    """The Q parameters of the call, in the order of the control."""
    values: dict[str, QValue] = {"Q406": float(plan.mode)} if plan.cycle == 451 else {}
    values |= {"Q407": plan.ball_radius, "Q320": plan.clearance, "Q408": plan.retract_height, "Q253": plan.feed}
    values["Q380"] = plan.reference_angle
    by_letter = {axis.axis: axis for axis in plan.axes}
    for letter in AXES:
        axis = by_letter.get(letter, AxisPlan(letter, 0.0, 0.0, 0.0, 0))
        values |= dict(zip(OF_AXIS[letter], (axis.start, axis.end, axis.incidence, float(axis.points)), strict=True))
    values["Q423"] = float(plan.touches)
    if plan.cycle == 451:
        values["Q431"] = float(plan.preset)
    values["Q432"] = plan.backlash_angle
    return values
