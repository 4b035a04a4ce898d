"""Examples of fits and form: given what an example gives, what the live engine makes of it. Lengths in mm."""

from typing import Any

from app.core.geometry.circle import fit_circle
from app.core.geometry.elements import Section
from app.core.geometry.form import Method, ProbedFeature, axis_straightness
from app.core.geometry.line import fit_line
from app.core.geometry.plane import fit_plane

Given = dict[str, Any]
Got = dict[str, Any]


def circle(given: Given) -> Got:
    circle = fit_circle(given["points"])
    return {"x": float(circle.centre[0]), "y": float(circle.centre[1]), "radius": circle.radius}


def line(given: Given) -> Got:
    line = fit_line(given["points"])
    slope = float(line.direction[1] / line.direction[0])
    return {"slope": slope, "intercept": float(line.point[1]) - slope * float(line.point[0])}


def plane(given: Given) -> Got:
    plane = fit_plane(given["points"])
    return {"normal": plane.normal.tolist(), "offset": float(plane.normal @ plane.point)}


def printed_straightness(given: Given) -> Got:
    """The printed method on the printed table, and the touch that does not belong."""
    result = axis_straightness(
        ProbedFeature(tuple(Section(tuple(map(tuple, touches))) for touches in given["sections"]))
    )
    (suspect,) = result.suspicion.suspects
    return {
        "straightness": result.by(Method.PRINTED).value,
        "suspected_section": suspect.section,
        "suspected_touch": suspect.touch,
        "off": suspect.off,
        "would_fit_at_x": suspect.alone[0],
    }
