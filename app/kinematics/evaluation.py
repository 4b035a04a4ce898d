"""From what was sent to what it comes to, whichever form it came in. Pure but for the words of refusals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from app.core.kinematics.axis import AXES, ERRORS, AxisErrors, AxisName, Estimate, NoAxis, Position, estimate
from app.core.kinematics.results import MEASURED, OFFSETS, OPTIMISED, SCALARS, STRINGS, Results, read_results
from app.core.kinematics.sphere import NoSphere, fit_sphere, radius_is_wrong
from app.core.zones import nanometres
from app.errors import FieldError, Invalid
from app.formats.rotary_protocol import AxisProtocol, Protocol, read_protocol
from app.kinematics import wording
from app.kinematics.schemas import AxisIn, PositionIn, RunIn, ShiftIn
from app.kinematics.values import errors_of
from app.web.i18n import _

APPROACHES = {"positive": 1, "negative": -1, None: 0}
LETTERS = "XYZ"
MOST_NOTES = 200


@dataclass
class Evaluated:
    """What a run comes to. results: as they are kept; head: texts that the protocol says of itself."""

    form: str
    outcome: str = "measured"
    reason: dict[str, Any] = field(default_factory=lambda: {"code": "measured"})
    results: dict[str, Any] = field(default_factory=lambda: {"axes": [], "offsets": None, "balls": [], "notes": []})
    head: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Limits:
    """What the control's machine parameters permit; mm and degrees, None: nothing is said."""

    ball_radius: float | None = None
    max_modification: float | None = None
    max_modification_angle: float | None = None
    max_dev_cal_ball: float | None = None


def evaluate(given: RunIn, limits: Limits) -> Evaluated:
    """What a run comes to. Raises `Invalid` for touches or positions that determine nothing, or text that says nothing."""
    if given.protocol is not None:
        made = _of_protocol(given.protocol)
    elif given.results is not None:
        made = _of_parameters(_results_of(given.results), "results")
    elif given.pasted is not None:
        made = _of_parameters(read_results(given.pasted), "pasted")
    elif given.shift is not None:
        made = _of_shift(given.shift, given, limits)
    else:
        made = _of_positions(given.axes or [], given, limits)
    if made.outcome != "refused":
        _hold_against(made, limits)
    return made


def _hold_against(made: Evaluated, limits: Limits) -> None:
    """maxModification: the largest change that somebody would enter."""
    for unit, limit in (("mm", limits.max_modification), ("°", limits.max_modification_angle)):
        found = {
            name: value
            for name, value in errors_of(made.results).items()
            if (unit == "°") is (name[1] in "ABC") and limit is not None
        }
        if unit == "mm" and limit is not None:
            found |= {n: v for n, letter in OFFSETS.items() if (v := (made.results["offsets"] or {}).get(letter))}
        over = {name: v for name, v in found.items() if limit is not None and nanometres(abs(v)) > nanometres(limit)}
        if over:
            name = max(over, key=lambda each: abs(over[each]))
            made.outcome = "too_large"
            made.reason = {"code": "max_modification", "name": name, "value": over[name], "limit": limit, "unit": unit}
            return


# --- touches and centres


def _of_positions(axes: Sequence[AxisIn], given: RunIn, limits: Limits) -> Evaluated:
    touched = any(position.touches is not None for axis in axes for position in axis.positions)
    made = Evaluated("touches" if touched else "centres")
    shifts: list[Sequence[Estimate]] = []
    for at, axis in enumerate(axes):
        seen = []
        for number, position in enumerate(axis.positions):
            where = f"axes[{at}].positions[{number}]"
            seen.append(
                Position(position.angle, _centre(position, where, given, limits, made), APPROACHES[position.approach])
            )
            if made.outcome == "refused":
                made.reason |= {"axis": axis.axis, "angle": position.angle}
                return made
        try:
            found = estimate(axis.axis, seen, axis.ball, ball_known=axis.ball_known and axis.ball is not None)
        except NoAxis as fault:
            wrong = wording.no_axis(axis.axis, fault)
            raise Invalid(
                f"axes[{at}].positions: {wrong}.",
                wording.what_axis_needs(fault),
                errors=[FieldError(f"axes[{at}].positions", wrong)],
            ) from None
        if axis.ball is not None and found.shift is not None:
            shifts.append(found.shift)
        made.results["axes"].append(_axis(found, axis, seen))
    if shifts:
        made.results["offsets"] = {
            letter: _mean([shift[place].value for shift in shifts]) for place, letter in enumerate(LETTERS)
        }
    return made


def _centre(
    position: PositionIn | ShiftIn, where: str, given: RunIn, limits: Limits, made: Evaluated
) -> tuple[float, float, float]:
    """The centre of the ball; a radius that is wrong makes the run a refused one (maxDevCalBall)."""
    if position.centre is not None:
        x, y, z = position.centre
        return x, y, z
    try:
        ball = fit_sphere(position.touches or [])
    except NoSphere as fault:
        wrong = wording.no_sphere(fault)
        raise Invalid(
            f"{where}.touches: {wrong}.",
            _("Touch the ball at several places round its equator and once on top."),
            errors=[FieldError(f"{where}.touches", wrong)],
        ) from None
    radius = round(ball.radius - given.tip_radius, 9)
    made.results["balls"].append({"radius": radius, "deviation": ball.deviation, "form": ball.form})
    calibrated = given.ball_radius or limits.ball_radius
    if calibrated is not None and radius_is_wrong(radius, calibrated, limits.max_dev_cal_ball):
        made.outcome = "refused"
        made.reason = {
            "code": "max_dev_cal_ball",
            "measured": radius,
            "calibrated": calibrated,
            "limit": limits.max_dev_cal_ball,
        }
    return ball.centre


def _of_shift(shift: ShiftIn, given: RunIn, limits: Limits) -> Evaluated:
    made = Evaluated("centres" if shift.centre is not None else "touches")
    centre = _centre(shift, "shift", given, limits, made)
    if made.outcome != "refused":
        made.results["offsets"] = {
            letter: round(found - nominal, 9) + 0.0
            for letter, found, nominal in zip(LETTERS, centre, shift.nominal, strict=True)
        }
    return made


def _axis(found: AxisErrors, given: AxisIn, seen: Sequence[Position]) -> dict[str, Any]:
    angles = [position.angle for position in seen]
    correction = _correction(given.axis, {name: each.value for name, each in found.errors.items()})
    before = given.position
    return {
        "axis": given.axis,
        "errors": {name: each._asdict() for name, each in found.errors.items()},
        "backlash": found.backlash._asdict() if found.backlash else None,
        "scatter_before": found.scatter_before,
        "scatter_after": found.scatter_after,
        "greatest_before": found.greatest_before,
        "greatest_after": found.greatest_after,
        "mean_error": found.mean_error,
        "angle_error": found.angle_error,
        "radius": found.radius,
        "start_angle": min(angles),
        "end_angle": max(angles),
        "points": len({round(angle % 360, 6) for angle in angles}),
        "incidence": given.incidence,
        "angles": sorted(set(angles)),
        "ball": list(found.ball),
        "shift": [each._asdict() for each in found.shift] if found.shift else None,
        "correction": correction,
        "position_before": before,
        "position_after": [round(a + b, 9) for a, b in zip(before, correction, strict=True)] if before else None,
        "positions": [
            {
                "angle": position.angle,
                "approach": position.approach,
                "measured": list(measured),
                "optimised": list(optimised),
            }
            for position, measured, optimised in zip(seen, found.measured, found.optimised, strict=True)
        ],
        "arc": found.arc,
        "condition": found.condition,
        "freedom": found.freedom,
        "noise": found.noise,
    }


def _correction(axis: AxisName, errors: Mapping[str, float | None]) -> list[float]:
    """Where the axis has to go, X Y Z, mm."""
    return [(errors.get(f"E{letter}0{axis}") or 0.0) + 0.0 for letter in LETTERS]


def _mean(values: Sequence[float]) -> float:
    return round(sum(values) / len(values), 9) + 0.0


# --- result parameters


def _results_of(given: Mapping[str, float | str]) -> Results:
    """Parameters that came as fields. Raises `Invalid` for names that there are not, and text where a number belongs."""
    errors = []
    lines = []
    for name, value in given.items():
        known = name.upper() if name.isascii() else name
        if known not in {*SCALARS, *STRINGS}:
            errors.append(FieldError("results", _("there is no result {name}").format(name=repr(name[:20]))))
        elif (known in STRINGS) is not isinstance(value, str):
            wrong = _("four numbers of ten characters, as text") if known in STRINGS else _("must be a number")
            errors.append(FieldError(f"results.{known}", wrong))
        else:
            lines.append(f'{known} = "{value}"' if isinstance(value, str) else f"{known} = {value:.12f}")
    if errors:
        raise Invalid(
            f"{errors[0].field}: {errors[0].message}.", _("There are Q141 to Q149 and QS144 to QS146."), errors=errors
        )
    return read_results("\n".join(lines))


def _of_parameters(read: Results, came_as: str) -> Evaluated:
    made = Evaluated("results")
    made.results["notes"] = [wording.flaw(each) for each in read.flaws[:MOST_NOTES]]
    _fill_in(made, read, {})
    if not made.results["axes"] and made.results["offsets"] is None:
        wrong = _("no result parameter can be read: {notes}").format(notes="; ".join(made.results["notes"][:3]))
        raise Invalid(
            f"{came_as}: {wrong}.",
            _('Write a line for each, like Q143 = 0.0134 or QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345".'),
            errors=[FieldError(came_as, wrong)],
        )
    return made


def _fill_in(made: Evaluated, read: Results, axes: Mapping[AxisName, AxisProtocol]) -> None:
    """Results that nothing is to be computed of: as they stand in parameters and protocol."""
    for axis in AXES:
        said = axes.get(axis)
        errors: dict[str, float | None] = (
            dict(read.errors.get(axis) or {}) if said is None else {**said.errors, **(read.errors.get(axis) or {})}
        )
        before = read.scalars.get(next(name for name, owner in MEASURED.items() if owner == axis))
        after = read.scalars.get(next(name for name, owner in OPTIMISED.items() if owner == axis))
        if said is None and before is None and after is None and not any(v is not None for v in errors.values()):
            continue
        made.results["axes"].append(_said_axis(axis, errors, before, after, said or AxisProtocol()))
    offsets = {letter: read.scalars[name] for name, letter in OFFSETS.items() if name in read.scalars}
    if offsets:
        made.results["offsets"] = {letter: offsets.get(letter) for letter in LETTERS}


def _said_axis(
    axis: AxisName, errors: Mapping[str, float | None], before: float | None, after: float | None, said: AxisProtocol
) -> dict[str, Any]:
    numbers, vectors = said.numbers, said.vectors
    place = vectors.get("correction")
    known = {name: errors.get(name) for name in ERRORS[axis]}
    if place is not None:  # a protocol that says where the axis has to go, and not in the words of a string
        for letter, value in zip(LETTERS, place, strict=True):
            name = f"E{letter}0{axis}"
            if name in known and known[name] is None:
                known[name] = value
    points = numbers.get("points")
    backlash = numbers.get("backlash")
    return {
        "axis": axis,
        "errors": {name: {"value": value, "deviation": None} for name, value in known.items() if value is not None},
        "backlash": None if backlash is None else {"value": backlash, "deviation": None},
        "scatter_before": before if before is not None else numbers.get("scatter_before"),
        "scatter_after": after if after is not None else numbers.get("scatter_after"),
        "greatest_before": numbers.get("greatest"),
        "greatest_after": None,
        "mean_error": numbers.get("mean_error"),
        "angle_error": numbers.get("angle_error"),
        "radius": numbers.get("radius"),
        "start_angle": numbers.get("start_angle"),
        "end_angle": numbers.get("end_angle"),
        "points": None if points is None else int(points),
        "incidence": numbers.get("incidence"),
        "angles": list(said.angles) or sorted({each.angle for each in said.deviations}),
        "ball": None,
        "shift": None,
        "correction": list(place) if place is not None else _correction(axis, known),
        "position_before": list(vectors["before"]) if "before" in vectors else None,
        "position_after": list(vectors["after"]) if "after" in vectors else None,
        "positions": [
            {
                "angle": each.angle,
                "approach": each.approach,
                "measured": list(each.measured),
                "optimised": list(each.optimised),
            }
            for each in said.deviations
        ],
        "arc": None,
        "condition": None,
        "freedom": None,
        "noise": None,
    }


# --- the control's protocol


def _of_protocol(text: str) -> Evaluated:
    protocol: Protocol = read_protocol(text)
    made = Evaluated("protocol", head=protocol.head)
    read = read_results("\n".join(protocol.parameters))
    made.results["notes"] = [
        *(wording.not_understood(each) for each in protocol.unread[:MOST_NOTES]),
        *(wording.flaw(each) for each in read.flaws[:MOST_NOTES]),
    ]
    if protocol.ball_radius is not None:
        made.head["ball_radius"] = f"{protocol.ball_radius:g}"
    _fill_in(made, read, protocol.axes)
    for axis in made.results["axes"]:
        if axis["incidence"] is None:
            axis["incidence"] = protocol.incidence
    if not made.results["axes"] and made.results["offsets"] is None:
        notes = "; ".join(made.results["notes"][:3])
        wrong = _("nothing of a rotary axis can be read in it: {notes}").format(notes=notes or _("it is empty"))
        raise Invalid(
            f"protocol: {wrong}.",
            _("Send TCHPRAUTO.html as the control has written it, in German, English or Slovene."),
            errors=[FieldError("protocol", wrong)],
        )
    return made
