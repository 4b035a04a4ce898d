"""From what is kept of an alignment to the frame and its warnings. Pure but for the words of refusals; mm and degrees."""

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np

from app.core.decision.step import rounded
from app.core.geometry import alignment as core
from app.core.geometry.frames import angles_of, vector_of
from app.core.geometry.in_plane import Hole, InPlane, two_holes, two_points
from app.core.geometry.layout import MOTIONS, NotLaidOut
from app.core.geometry.plausible import Bounds, alignment_warnings, motion_warnings, plane_warnings
from app.core.geometry.points import Degenerate, Floats
from app.core.warning import CodedWarning, as_stored, of_stored
from app.errors import FieldError, Invalid
from app.geometry.alignment import wording
from app.geometry.alignment.tables import Alignment
from app.geometry.work_zero.wording import degenerate
from app.loop.tables.machines import Machine
from app.loop.warnings.queries import bounds_of

NEEDS = {"points": "touches", "two_points": "side", "two_holes": "holes"}
Values = dict[str, Any]


def warnings_of(alignment: Alignment, machine: Machine) -> list[CodedWarning]:
    """Return what may be wrong with an alignment: as it was kept with it, or, of one from before that, by the limits of now."""
    if "warnings" in alignment.result:
        return of_stored(alignment.result["warnings"])
    if alignment.kind == "pallet":
        return list(motion_warnings(np.array(alignment.result["matrix"]), (0.0, 0.0, 0.0), bounds_of(machine)))
    return of_stored(solved(alignment.kind, alignment.method, alignment.given, bounds_of(machine))["warnings"])


def middle_of(alignment: Alignment) -> list[float]:
    """The middle of the nominal places that were touched; the origin for one that was composed."""
    if alignment.kind == "pallet":
        return [0.0, 0.0, 0.0]
    places = [[*entry["nominal"], 0.0][:3] for entry in alignment.given[NEEDS[alignment.kind]]]
    return [float(entry) for entry in np.mean(places, axis=0)]


def solved(kind: str, method: str, inputs: Values, bounds: Bounds) -> Values:
    """The frame, how well it is known, and its warnings. Raises `Invalid` that names the touches."""
    solve: Callable[[Values], Values] = {
        "points": lambda inputs: _points(method, inputs, bounds),
        "two_points": lambda inputs: _side(inputs, bounds),
        "two_holes": lambda inputs: _holes(inputs, bounds),
    }[kind]
    try:
        return solve(inputs)
    except NotLaidOut as problem:
        wrong, remedy = wording.loose(problem)
        at = problem.at
    except Degenerate as problem:
        wrong, remedy = degenerate(problem)
        at = problem.at
    name = NEEDS[kind]
    fields = [f"{name}[{number - 1}]" for number in at] or [name]
    raise Invalid(f"{fields[0]}: {wrong}.", remedy, errors=[FieldError(field, wrong) for field in fields])


def _points(method: str, inputs: Values, bounds: Bounds) -> Values:
    touches = [
        core.Touch.by_tip(
            tuple(touch["nominal"]), tuple(touch["normal"]), tuple(touch["measured"]), inputs.get("tip", 0.0)
        )
        if "measured" in touch
        else core.Touch.off_by(tuple(touch["nominal"]), tuple(touch["normal"]), touch["deviation"])
        for touch in inputs["touches"]
    ]
    alignment = core.align(
        touches,
        core.Method(method),
        solve_for=inputs.get("solve_for", MOTIONS),
        repeatability=inputs.get("repeatability"),
    )
    advised = alignment.advice
    return frame_values(alignment.motion) | {
        "deviations": _rounded(alignment.deviations),
        "residuals": _rounded(alignment.residuals),
        "leverage": _rounded(alignment.leverage, 6),
        "condition": alignment.condition,
        "difference": alignment.difference,
        "solved_for": list(alignment.solved_for),
        "uncertainty": alignment.uncertainty,
        "weakest": _rounded(alignment.weakest, 6),
        "misfits": [list(group) for group in alignment.misfits],
        "advice": None
        if advised is None
        else {
            "place": list(advised.place),
            "normal": list(advised.normal),
            "gain": advised.gain if isfinite(advised.gain) else None,
        },
        "rms": alignment.rms,
        "warnings": as_stored(alignment_warnings(touches, alignment, bounds, inputs.get("repeatability"))),
    }


def _side(inputs: Values, bounds: Bounds) -> Values:
    nominal, measured = ([pair[name] for pair in inputs["side"]] for name in ("nominal", "measured"))
    fit = two_points(nominal, measured, inputs.get("repeatability"))
    return _plane(fit) | {"warnings": as_stored(plane_warnings(nominal, measured, fit, "side", bounds))}


def _holes(inputs: Values, bounds: Bounds) -> Values:
    holes = []
    for at, hole in enumerate(inputs["holes"]):
        try:
            holes.append(
                Hole(tuple(hole["centre"]))
                if "centre" in hole
                else Hole.from_touches([tuple(touch) for touch in hole["touches"]], hole["tip"], inside=hole["inside"])
            )
        except Degenerate as problem:
            wrong, remedy = degenerate(problem)
            field = f"holes[{at}].touches"
            raise Invalid.at(field, wrong, do=remedy) from None
    nominal = [hole["nominal"] for hole in inputs["holes"]]
    fit = two_holes(nominal, holes, inputs.get("repeatability"))
    return _plane(fit) | {
        "warnings": as_stored(plane_warnings(nominal, [hole.centre for hole in holes], fit, "holes", bounds)),
        "holes": [
            {"centre": list(hole.centre), "diameter": hole.diameter, "residuals": _rounded(hole.residuals)}
            for hole in holes
        ],
    }


def _plane(fit: InPlane) -> Values:
    return frame_values(fit.motion) | {
        "off": None if fit.off is None else rounded(fit.off),
        "uncertainty": fit.uncertainty,
        "solved_for": ["a", "b", "gamma"],
    }


def frame_values(motion: Floats) -> Values:
    return {
        "matrix": [[float(value) + 0.0 for value in row] for row in motion],
        "shift": _rounded(motion[:3, 3]),
        "angles": _rounded(angles_of(motion[:3, :3]), 10),
        "turns": _rounded(np.degrees(vector_of(motion[:3, :3])), 10),
    }


def _rounded(values: Any, places: int = 9) -> list[float]:
    return [round(float(value), places) + 0.0 for value in values]
