"""From what was sent to what it comes to, whichever form it came in. Pure but for the words of refusals."""

from collections.abc import Sequence
from math import sqrt
from typing import Any

from app.core.kinematics.axis import AxisErrors, Estimate, NoAxis, Position, estimate
from app.core.kinematics.results import OFFSETS, read_results
from app.core.kinematics.sphere import FEWEST, NoSphere, Sphere, fit_sphere, radius_is_wrong
from app.core.zones import nanometres
from app.errors import FieldError, Invalid
from app.kinematics import wording
from app.kinematics.outcome import LETTERS, Evaluated, Limits
from app.kinematics.outcome import correction as correction_of
from app.kinematics.schemas import AxisIn, PositionIn, RunIn, ShiftIn
from app.kinematics.stated import of_parameters, of_protocol, results_of
from app.kinematics.values import errors_of
from app.web.i18n import _

APPROACHES = {"positive": 1, "negative": -1, None: 0}


def evaluate(given: RunIn, limits: Limits) -> Evaluated:
    """What a run comes to. Raises `Invalid` for touches or positions that determine nothing, or text that says nothing."""
    if given.protocol is not None:
        made = of_protocol(given.protocol)
    elif given.results is not None:
        made = of_parameters(results_of(given.results), "results")
    elif given.pasted is not None:
        made = of_parameters(read_results(given.pasted), "pasted")
    elif given.shift is not None:
        made = _of_shift(given.shift, given, limits)
    else:
        made = _of_positions(given.axes or [], given, limits)
    if made.outcome != "refused":
        _hold_against(made, limits)
    if made.results["balls"] and limits.max_dev_cal_ball and not (given.ball_radius or limits.ball_radius):
        made.results["notes"].append(wording.no_calibrated_radius())
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
        seen: list[Position] = []
        balls: list[Sphere] = []
        for number, position in enumerate(axis.positions):
            where = f"axes[{at}].positions[{number}]"
            ball = _ball(position, where, given, limits, made)
            balls += [] if ball is None else [ball]
            centre = _from_axis(axis, (ball.centre if ball else position.centre) or ())
            approach = APPROACHES[position.approach]
            seen.append(Position(position.angle, centre, approach, ball.spread if ball else None))
            if made.outcome == "refused":
                made.reason |= {"axis": axis.axis, "angle": position.angle}
                return made
        try:
            found = estimate(
                axis.axis,
                seen,
                None if axis.ball is None else _from_axis(axis, axis.ball),
                ball_known=axis.ball_known and axis.ball is not None,
                carries=axis.carries,
                reversed_=axis.reversed,
                touch=_of_a_touch(balls),
            )
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


def _from_axis(axis: AxisIn, point: Sequence[float]) -> tuple[float, float, float]:
    """Seen from where the axis should stand."""
    home = axis.position if axis.seen_from == "machine" and axis.position is not None else (0.0, 0.0, 0.0)
    x, y, z = (value - from_there for value, from_there in zip(point, home, strict=True))
    return x, y, z


def _ball(position: PositionIn | ShiftIn, where: str, given: RunIn, limits: Limits, made: Evaluated) -> Sphere | None:
    """The ball, where it was touched; a radius that is wrong makes the run a refused one (maxDevCalBall)."""
    if position.touches is None:
        return None
    try:
        ball = fit_sphere(position.touches)
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
    return ball


def _of_a_touch(balls: Sequence[Sphere]) -> float | None:
    """The standard deviation of a touch, from all balls together; None where none was touched more than four times."""
    free = sum(len(ball.residuals) - FEWEST for ball in balls)
    squares = sum(residual**2 for ball in balls for residual in ball.residuals)
    return sqrt(squares / free) if free else None


def _of_shift(shift: ShiftIn, given: RunIn, limits: Limits) -> Evaluated:
    made = Evaluated("centres" if shift.centre is not None else "touches")
    ball = _ball(shift, "shift", given, limits, made)
    centre = (ball.centre if ball else shift.centre) or ()
    if made.outcome != "refused":
        made.results["offsets"] = {
            letter: round(found - nominal, 9) + 0.0
            for letter, found, nominal in zip(LETTERS, centre, shift.nominal, strict=True)
        }
    return made


def _axis(found: AxisErrors, given: AxisIn, seen: Sequence[Position]) -> dict[str, Any]:
    angles = [position.angle for position in seen]
    correction = correction_of(given.axis, {name: each.value for name, each in found.errors.items()})
    before = given.position
    return {
        "axis": given.axis,
        "carries": given.carries.value,
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


def _mean(values: Sequence[float]) -> float:
    return round(sum(values) / len(values), 9) + 0.0
