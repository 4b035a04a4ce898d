"""What people type about rotary axes: a protocol sent as a file, parameters or positions pasted, limits one a line."""

from collections.abc import Mapping
from typing import Any

from app.errors import FieldError, Invalid
from app.kinematics.tables import KinematicsPlan
from app.web.forms import length
from app.web.i18n import _

NUMBERS = ("ball_radius", "max_modification", "max_modification_angle", "max_dev_cal_ball")
MOST_LINES = 2_000
FEWEST_TOUCHES = 4
SIGNS = {"+": "positive", "-": "negative", "\N{MINUS SIGN}": "negative"}


def decoded(content: bytes) -> str:
    """A protocol as text: UTF-8, UTF-16 with its mark, else as Western European controls write."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace").replace("\0", "")
    try:
        return content.decode("utf-8-sig").replace("\0", "")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace").replace("\0", "")


def run(form: Mapping[str, str], machine: str, protocol: str) -> dict[str, Any]:
    """The form of a run as the API's fields. Raises `Invalid` for a line that is no position."""
    made: dict[str, Any] = {
        "machine": machine,
        "head": form.get("head"),
        "measured_at": form.get("measured_at"),
        "protocol": protocol or None,
        "pasted": form.get("pasted", "").strip() or None,
    }
    if form.get("positions", "").strip():
        made["axes"] = [_axis(form)]
    if not (made["protocol"] or made["pasted"] or "axes" in made):
        wrong = _("choose the protocol of the control, or paste parameters or positions")
        raise Invalid(f"file: {wrong}.", errors=[FieldError("file", wrong)])
    return made


def _axis(form: Mapping[str, str]) -> dict[str, Any]:
    """Lines of `angle X Y Z`, with + or - behind the angle for where the axis came from.

    Of an angle that stands on four lines or more, the lines are touches of the ball; else its centre.
    """
    seen: dict[tuple[float, str | None], list[list[float]]] = {}
    lines = [(n, line) for n, line in enumerate(form["positions"].splitlines(), 1) if line.strip()]
    for number, line in lines[: MOST_LINES + 1]:
        words = line.replace(";", " ").split()
        approach = SIGNS.get(words[1]) if len(words) == 5 else None
        values = [length(word) for word in ([words[0], *words[2:]] if approach else words)]
        if len(values) != 4 or not all(isinstance(each, float) for each in values) or number > MOST_LINES:
            wrong = _("line {line}: an angle and X, Y, Z are needed, not “{text}”").format(
                line=number, text=line.strip()[:60]
            )
            raise Invalid(f"positions: {wrong}.", errors=[FieldError("positions", wrong)])
        angle, *point = [each for each in values if isinstance(each, float)]
        seen.setdefault((angle, approach), []).append(point)
    positions = []
    for (angle, approach), points in seen.items():
        if len(points) >= FEWEST_TOUCHES:
            positions.append({"angle": angle, "approach": approach, "touches": points})
        else:
            positions += [{"angle": angle, "approach": approach, "centre": point} for point in points]
    ball = [length(word) for word in form.get("ball", "").replace(";", " ").split()]
    return {"axis": form.get("axis", ""), "positions": positions, "ball": ball or None}


def plan(form: Mapping[str, str]) -> dict[str, Any]:
    """The form of the limits as the API's fields. Raises `Invalid` that names the line."""
    return {
        **{name: length(form.get(name)) for name in NUMBERS},
        "reference_head": form.get("reference_head"),
        "limits": {name: length(value) for name, value in _pairs(form, "limits")},
        "characteristics": dict(_pairs(form, "characteristics")),
        "reason": form.get("reason"),
    }


def _pairs(form: Mapping[str, str], field: str) -> list[tuple[str, str]]:
    made = []
    for number, line in enumerate(form.get(field, "").splitlines(), 1):
        words = line.replace("=", " ").replace("±", " ").split()
        if not words:
            continue
        if len(words) != 2:
            wrong = _("line {line}: a name and a value are needed, not “{text}”").format(
                line=number, text=line.strip()[:60]
            )
            raise Invalid(f"{field}: {wrong}.", errors=[FieldError(field, wrong)])
        made.append((words[0], words[1]))
    return made


def filled_in(plan: KinematicsPlan) -> dict[str, str]:
    """What the form of the limits begins with."""
    begun = {name: f"{value:g}" for name in NUMBERS if (value := getattr(plan, name)) is not None}
    begun["reference_head"] = plan.reference_head or ""
    begun["limits"] = "\n".join(f"{name} {value:g}" for name, value in plan.limits.items())
    begun["characteristics"] = "\n".join(f"{name} {key}" for name, key in plan.characteristics.items())
    return begun


def at_fields(error: Invalid) -> dict[str, str]:
    """What is wrong, by the field of the form: what lies within a list stands with the list."""
    found: dict[str, str] = {}
    for field, message in error.errors:
        top = field.partition("[")[0].partition(".")[0]
        name = {"axes": "positions", "body": "file", "protocol": "file"}.get(top, top)
        said = message[:1].upper() + message[1:]
        found[name] = f"{found[name]}. {said}" if name in found else said
    return found
