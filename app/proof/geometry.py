"""Examples of fits and form: given what an example gives, what the live engine makes of it. Lengths in mm."""

from typing import Any

from app.core.geometry.circle import fit_circle
from app.core.geometry.elements import Section
from app.core.geometry.form import Method, Touched, axis_straightness
from app.core.geometry.line import fit_line
from app.core.geometry.plane import fit_plane

Given = dict[str, Any]
Got = dict[str, Any]


def circle(given: Given) -> Got:
    found = fit_circle(given["points"])
    return {"x": float(found.centre[0]), "y": float(found.centre[1]), "radius": found.radius}


def line(given: Given) -> Got:
    found = fit_line(given["points"])
    slope = float(found.direction[1] / found.direction[0])
    return {"slope": slope, "intercept": float(found.point[1]) - slope * float(found.point[0])}


def plane(given: Given) -> Got:
    found = fit_plane(given["points"])
    return {"normal": found.normal.tolist(), "offset": float(found.normal @ found.point)}


def printed_straightness(given: Given) -> Got:
    """The printed method on the printed table, and the touch that does not belong."""
    found = axis_straightness(Touched(tuple(Section(tuple(map(tuple, touches))) for touches in given["sections"])))
    (suspect,) = found.suspicion.suspects
    return {
        "straightness": found.by(Method.PRINTED).value,
        "suspected_section": suspect.section,
        "suspected_touch": suspect.touch,
        "off": suspect.off,
        "would_fit_at_x": suspect.alone[0],
    }
