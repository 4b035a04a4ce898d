"""From what was sent to what it comes to, whichever form it came in. Pure but for the words of refusals."""

from collections.abc import Sequence
from math import sqrt
from typing import Any

from app.core.decision.limits import nanometres
from app.core.decision.step import rounded
from app.core.rotary.axis import AxisErrors, Estimate, NoAxis, Position, estimate
from app.core.rotary.results import OFFSETS, read_results
from app.core.rotary.sphere import FEWEST, NoSphere, Sphere, fit_sphere, radius_is_wrong
from app.errors import Invalid
from app.files.formats.rotary_protocol import Protocol
from app.geometry.rotary_axes import wording
from app.geometry.rotary_axes.control_results import of_parameters, of_protocol, results_of
from app.geometry.rotary_axes.outcome import LETTERS, Evaluated, Limits
from app.geometry.rotary_axes.outcome import correction as correction_of
from app.geometry.rotary_axes.result_values import errors_of
from app.geometry.rotary_axes.schemas import AxisIn, PositionIn, RunIn, ShiftIn
from app.language.i18n import _

APPROACHES = {"positive": 1, "negative": -1, None: 0}


def evaluate(body: RunIn, limits: Limits, protocol: Protocol | None = None) -> Evaluated:
    """Evaluate a run. protocol: that of the run, where it is read already. Raises `Invalid` for points or positions that determine nothing, or text without values."""
    if body.protocol is not None:
        evaluated = of_protocol(body.protocol, protocol)
    elif body.results is not None:
        evaluated = of_parameters(results_of(body.results), "results")
    elif body.pasted is not None:
        evaluated = of_parameters(read_results(body.pasted), "pasted")
    elif body.shift is not None:
        evaluated = _of_shift(body.shift, body, limits)
    else:
        evaluated = _of_positions(body.axes or [], body, limits)
    if evaluated.outcome != "refused":
        _hold_against(evaluated, limits)
    if evaluated.results["balls"] and limits.max_dev_cal_ball and not (body.ball_radius or limits.ball_radius):
        evaluated.results["notes"].append(wording.no_calibrated_radius())
    return evaluated


def _hold_against(evaluated: Evaluated, limits: Limits) -> None:
    """maxModification: the largest change that a person would enter."""
    for unit, limit in (("mm", limits.max_modification), ("°", limits.max_modification_angle)):
        values = {
            name: value
            for name, value in errors_of(evaluated.results).items()
            if (unit == "°") is (name[1] in "ABC") and limit is not None
        }
        if unit == "mm" and limit is not None:
            values |= {n: v for n, letter in OFFSETS.items() if (v := (evaluated.results["offsets"] or {}).get(letter))}
        over = {name: v for name, v in values.items() if limit is not None and nanometres(abs(v)) > nanometres(limit)}
        if over:
            name = max(over, key=lambda name_of_value: abs(over[name_of_value]))
            evaluated.outcome = "too_large"
            evaluated.reason = {
                "code": "max_modification",
                "name": name,
                "value": over[name],
                "limit": limit,
                "unit": unit,
            }
            return


# --- touches and centres


def _of_positions(axes: Sequence[AxisIn], body: RunIn, limits: Limits) -> Evaluated:
    touched = any(position.touches is not None for axis in axes for position in axis.positions)
    evaluated = Evaluated("touches" if touched else "centres")
    shifts: list[Sequence[Estimate]] = []
    for at, axis in enumerate(axes):
        seen: list[Position] = []
        balls: list[Sphere] = []
        for number, position in enumerate(axis.positions):
            where = f"axes[{at}].positions[{number}]"
            ball = _ball(position, where, body, limits, evaluated)
            balls += [] if ball is None else [ball]
            centre = _from_axis(axis, (ball.centre if ball else position.centre) or ())
            approach = APPROACHES[position.approach]
            seen.append(Position(position.angle, centre, approach, ball.spread if ball else None))
            if evaluated.outcome == "refused":
                evaluated.reason |= {"axis": axis.axis, "angle": position.angle}
                return evaluated
        try:
            errors = estimate(
                axis.axis,
                seen,
                None if axis.ball is None else _from_axis(axis, axis.ball),
                ball_known=axis.ball_known and axis.ball is not None,
                carries=axis.carries,
                reversed_=axis.reversed,
                touch=_of_a_touch(balls),
            )
        except NoAxis as fault:
            raise Invalid.at(
                f"axes[{at}].positions", wording.no_axis(axis.axis, fault), do=wording.what_axis_needs(fault)
            ) from None
        if axis.ball is not None and errors.shift is not None:
            shifts.append(errors.shift)
        evaluated.results["axes"].append(_axis(errors, axis, seen))
    if shifts:
        evaluated.results["offsets"] = {
            letter: _mean([shift[place].value for shift in shifts]) for place, letter in enumerate(LETTERS)
        }
    return evaluated


def _from_axis(axis: AxisIn, point: Sequence[float]) -> tuple[float, float, float]:
    """Seen from where the axis should stand."""
    home = axis.position if axis.seen_from == "machine" and axis.position is not None else (0.0, 0.0, 0.0)
    x, y, z = (value - from_there for value, from_there in zip(point, home, strict=True))
    return x, y, z


def _ball(
    position: PositionIn | ShiftIn, where: str, body: RunIn, limits: Limits, evaluated: Evaluated
) -> Sphere | None:
    """The ball, where it was touched; a radius that is wrong makes the run a refused one (maxDevCalBall)."""
    if position.touches is None:
        return None
    try:
        ball = fit_sphere(position.touches)
    except NoSphere as fault:
        raise Invalid.at(
            f"{where}.touches",
            wording.no_sphere(fault),
            do=_("Probe the sphere at several places round its equator and once on top."),
        ) from None
    radius = round(ball.radius - body.tip_radius, 9)
    evaluated.results["balls"].append({"radius": radius, "deviation": ball.deviation, "form": ball.form})
    calibrated = body.ball_radius or limits.ball_radius
    if calibrated is not None and radius_is_wrong(radius, calibrated, limits.max_dev_cal_ball):
        evaluated.outcome = "refused"
        evaluated.reason = {
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


def _of_shift(shift: ShiftIn, body: RunIn, limits: Limits) -> Evaluated:
    evaluated = Evaluated("centres" if shift.centre is not None else "touches")
    ball = _ball(shift, "shift", body, limits, evaluated)
    centre = (ball.centre if ball else shift.centre) or ()
    if evaluated.outcome != "refused":
        evaluated.results["offsets"] = {
            letter: rounded(measured - nominal)
            for letter, measured, nominal in zip(LETTERS, centre, shift.nominal, strict=True)
        }
    return evaluated


def _axis(errors: AxisErrors, body: AxisIn, seen: Sequence[Position]) -> dict[str, Any]:
    angles = [position.angle for position in seen]
    correction = correction_of(body.axis, {name: estimated.value for name, estimated in errors.errors.items()})
    before = body.position
    return {
        "axis": body.axis,
        "carries": body.carries.value,
        "errors": {name: estimated._asdict() for name, estimated in errors.errors.items()},
        "backlash": errors.backlash._asdict() if errors.backlash else None,
        "scatter_before": errors.scatter_before,
        "scatter_after": errors.scatter_after,
        "greatest_before": errors.greatest_before,
        "greatest_after": errors.greatest_after,
        "mean_error": errors.mean_error,
        "angle_error": errors.angle_error,
        "radius": errors.radius,
        "start_angle": min(angles),
        "end_angle": max(angles),
        "points": len({round(angle % 360, 6) for angle in angles}),
        "incidence": body.incidence,
        "angles": sorted(set(angles)),
        "ball": list(errors.ball),
        "shift": [estimated._asdict() for estimated in errors.shift] if errors.shift else None,
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
            for position, measured, optimised in zip(seen, errors.measured, errors.optimised, strict=True)
        ],
        "arc": errors.arc,
        "condition": errors.condition,
        "freedom": errors.freedom,
        "noise": errors.noise,
    }


def _mean(values: Sequence[float]) -> float:
    return rounded(sum(values) / len(values))
