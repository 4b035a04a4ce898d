"""Forms of the rotary axes: a protocol, parameters, sphere centres or points in a grid, limits one a line."""

import re
from collections.abc import Mapping
from datetime import UTC
from typing import Any, NamedTuple

from app.core.number_text import has_broken_number
from app.errors import FieldError, Invalid
from app.files.formats.cell_values import Unreadable, moment, zone_named
from app.geometry.rotary_axes.schemas import KinematicsPlanIn, RunIn
from app.geometry.rotary_axes.tables import KinematicsPlan
from app.language.i18n import _
from app.language.times import plant_zone
from app.web.forms import by_field, length, read, typed

NUMBERS = ("ball_radius", "max_modification", "max_modification_angle", "max_dev_cal_ball")
WAYS = ("protocol", "pasted", "positions", "shift")
COLUMNS = ("axis", "angle", "from", "x", "y", "z")
SETTINGS = (
    *("machine", "program", "tool", "kinematics", "mode", "head", "ball_radius", "tip_radius", "clearance"),
    *("retract_height", "feed", "reference_angle", "backlash_angle", "touches_per_ball"),
)
LINES, MOST_LINES, MOST_PASTED = 12, 120, 2_000
FEWEST_TOUCHES = 4
CHARSETS = {"windows-1250": "cp1250", "cp1250": "cp1250", "iso-8859-2": "iso8859-2", "latin2": "iso8859-2"}
_SLOVENE = re.compile(rb"Za\xe8etn|Kon\xe8n|to\xe8k|zra\xe8nost|na\xe8in|Povpre\xe8n", re.IGNORECASE)  # with \xe8 for č
_CHARSET = re.compile(rb"charset\s*=\s*[\"']?\s*([A-Za-z0-9_-]{1,20})", re.IGNORECASE)
_POSITION = re.compile(r"positions\[(\d+)\]")
SIGNS = {"": None, "+": "positive", "-": "negative", "\N{MINUS SIGN}": "negative"}


class Line(NamedTuple):
    """A line of the grid or of what was pasted; where: the field of the form that it is in."""

    where: str
    number: int
    cells: list[str]


def decoded(content: bytes) -> str:
    """A protocol as text: UTF-8, UTF-16 with its mark, as it says itself, else as controls of its language write."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace").replace("\0", "")
    try:
        return content.decode("utf-8-sig").replace("\0", "")
    except UnicodeDecodeError:
        match = _CHARSET.search(content[:2048])
        name = match[1].decode("ascii").lower() if match else ""
        likely = "cp1250" if _SLOVENE.search(content) else "cp1252"
        return content.decode(CHARSETS.get(name, likely), errors="replace").replace("\0", "")


def way(form: Mapping[str, str]) -> str:
    """Way in which the run is entered."""
    return form["as"] if form.get("as") in WAYS else WAYS[0]


def run(form: Mapping[str, str]) -> dict[str, Any]:
    """The form of a run as the API's fields. Raises `Invalid` for what is missing, and for lines that are no position."""
    values = read(RunIn, {name: form.get(name, "") for name in SETTINGS}) | {
        "measured_at": _moment(form, "measured_at")
    }
    match way(form):
        case "positions":
            values["axes"] = _axes(form)
        case "shift":
            nominal, measured = _points(form, "nominal"), _points(form, "found")
            values["shift"] = {"nominal": nominal[0] if nominal else []}
            values["shift"] |= {"centre": measured[0]} if len(measured) == 1 else {"touches": measured}
        case kind:
            values[kind] = form.get(kind, "").strip()
            if kind == "protocol":  # clocks of controls know no zone: that of who sends it
                values["timezone"] = form.get("timezone", "").strip()
            if not values[kind]:
                wrong = _("choose the file of the protocol, or paste its text")
                raise Invalid.at(kind, wrong if kind == "protocol" else _("paste the result parameters"))
    return values


def entry(form: Mapping[str, str]) -> dict[str, str]:
    """The form of an act on a run, its time by the clock of the plant. Raises `Invalid` for what is no time."""
    return {**form, "at": _moment(form, "at") or ""}


def _moment(form: Mapping[str, str], field: str) -> str | None:
    """Time of an action, by the clock of the plant."""
    typed, zone = form.get(field, "").strip(), plant_zone()
    if not typed:
        return None
    try:
        if form.get("timezone"):
            zone = zone_named(form["timezone"])
        return moment(typed, zone).astimezone(UTC).isoformat()
    except Unreadable as error:
        raise Invalid(f"{field}: {error}.", errors=[FieldError(field, str(error))]) from None


# --- positions


def lines_of(form: Mapping[str, str]) -> list[Line]:
    """Lines typed into the grid and pasted below it; empty lines left out."""
    lines = [
        Line(f"g_{row}", row + 1, [form.get(f"{column}_{row}", "").strip() for column in COLUMNS])
        for row in range(MOST_LINES)
    ]
    for number, text in enumerate(form.get("positions", "").splitlines()[:MOST_PASTED], 1):
        lines.append(Line("positions", number, _cells(text)))
    return [line for line in lines if any(line.cells)]


def _cells(text: str) -> list[str]:
    """A pasted line: [axis] angle [+ or -] X Y Z, between blanks, tabs or semicolons; the axis and the sign may be left out."""
    if has_broken_number(text):
        return [text]  # refused as a whole: one number would be read as two
    words = text.replace(";", " ").split()
    axis = words.pop(0).upper() if words and words[0].upper() in ("A", "B", "C") else ""
    came = words.pop(1) if len(words) == 5 and words[1] in SIGNS else ""
    if len(words) == 3:  # the angle as above
        words.insert(0, "")
    return [axis, *words[:1], came, *words[1:]] if words else [axis] if axis else []


def _axes(form: Mapping[str, str]) -> list[dict[str, Any]]:
    """Axis, angle and sign of a line stand for those below that leave them out.

    Of an angle that is on four lines or more, the lines are touches of the ball; else each is its centre.
    """
    axis, angle, came = "C", None, None
    seen: dict[str, dict[tuple[float, str | None], list[list[float]]]] = {}
    for line in lines_of(form):
        cells = line.cells
        values = [length(cell) for cell in (cells[1], *cells[3:])] if len(cells) == len(COLUMNS) else []
        if len(values) != 4 or cells[0].upper() not in ("", "A", "B", "C") or cells[2] not in SIGNS:
            raise _no_position(line)
        if cells[0]:
            axis = cells[0].upper()
        if values[0] is not None:
            angle, came = values[0], SIGNS[cells[2]]
        point = [value for value in values[1:] if isinstance(value, float)]
        if not isinstance(angle, float) or len(point) != 3:
            raise _no_position(line)
        seen.setdefault(axis, {}).setdefault((angle, came), []).append(point)
    if not seen:
        raise Invalid.at("positions", _("enter the positions: one line per angle, or per probed point"))
    balls, places = _by_axis(form, "ball"), _by_axis(form, "position")
    return [_axis(axis, positions, form, balls, places) for axis, positions in seen.items()]


def _axis(
    axis: str,
    seen: Mapping[tuple[float, str | None], list[list[float]]],
    form: Mapping[str, str],
    balls: Mapping[str, list[float]],
    places: Mapping[str, list[float]],
) -> dict[str, Any]:
    positions: list[dict[str, Any]] = []
    for (angle, came), points in seen.items():
        if len(points) >= FEWEST_TOUCHES:
            positions.append({"angle": angle, "approach": came, "touches": points})
        else:
            positions += [{"angle": angle, "approach": came, "centre": point} for point in points]
    ball = balls.get(axis) or balls.get("")
    known = form.get("ball_known") == "true" and ball is not None
    values: dict[str, Any] = {"axis": axis, "positions": positions, "ball": ball, "ball_known": known}
    values |= {"carries": form.get("carries") or "table", "reversed": axis in form.get("reversed", "").upper()}
    return values | {"seen_from": form.get("seen_from") or "axis", "position": places.get(axis) or places.get("")}


def _by_axis(form: Mapping[str, str], field: str) -> dict[str, list[float]]:
    """Places: X Y Z for every axis, or a letter before them and one of them after another."""
    points: dict[str, list[float]] = {}
    for part in form.get(field, "").replace("\n", ";").split(";"):
        words = part.split()
        axis = words.pop(0).upper() if words and words[0].upper() in ("A", "B", "C") else ""
        point = [value for value in map(length, words) if isinstance(value, float)]
        if not words and not axis:
            continue
        if len(point) != 3 or len(words) != 3:
            raise Invalid.at(
                field, _("X, Y and Z are needed, such as 180 0 40, not “{text}”").format(text=part.strip()[:60])
            )
        points[axis] = point
    return points


def _no_position(line: Line) -> Invalid:
    """Refusal that names the missing value of a line, where it was typed."""
    text = " ".join(cell for cell in line.cells if cell)[:60]
    wrong = _("line {line}: an axis (A, B, C), an angle, + or −, and X, Y, Z are read, not “{text}”").format(
        line=line.number, text=text
    )
    return Invalid(f"positions: {wrong}.", errors=[FieldError("positions", wrong), FieldError(line.where, wrong)])


def _points(form: Mapping[str, str], field: str) -> list[list[float]]:
    points = []
    for number, text in enumerate(form.get(field, "").splitlines(), 1):
        words = text.replace(";", " ").split()
        point = [value for value in map(length, words) if isinstance(value, float)]
        if not words:
            continue
        if len(point) != 3 or len(words) != 3:
            raise Invalid.at(
                field, _("line {line}: X, Y and Z are needed, not “{text}”").format(line=number, text=text.strip()[:60])
            )
        points.append(point)
    if not points:
        raise Invalid.at(field, _("X, Y and Z are needed, such as 0 0 0"))
    return points


def shown_lines(form: Mapping[str, str]) -> int:
    """Number of lines in the grid: the number asked for, and at least all that hold anything."""
    typed_number = form.get("lines", "").strip()
    number = int(typed_number) if typed_number.isascii() and typed_number.isdigit() and len(typed_number) < 6 else LINES
    filled = [row for row in range(MOST_LINES) if any(form.get(f"{column}_{row}", "").strip() for column in COLUMNS)]
    return max(min(number, MOST_LINES), (filled or [0])[-1] + 1, 4)


# --- limits


def plan(form: Mapping[str, str]) -> KinematicsPlanIn:
    """The limits as typed. Raises `Invalid` that names the line."""
    limits = {name: length(value) for name, value in _pairs(form, "limits")}
    return typed(KinematicsPlanIn, form, limits=limits, characteristics=dict(_pairs(form, "characteristics")))


def _pairs(form: Mapping[str, str], field: str) -> list[tuple[str, str]]:
    pairs = []
    for number, line in enumerate(form.get(field, "").splitlines(), 1):
        words = line.replace("=", " ").replace("±", " ").split()
        if not words:
            continue
        if len(words) != 2:
            raise Invalid.at(
                field,
                _("line {line}: a name and a value are needed, not “{text}”").format(
                    line=number, text=line.strip()[:60]
                ),
            )
        pairs.append((words[0], words[1]))
    return pairs


def filled_in(plan: KinematicsPlan) -> dict[str, str]:
    """Values that fill the form of the limits."""
    begun = {name: f"{value:g}" for name in NUMBERS if (value := getattr(plan, name)) is not None}
    begun["reference_head"] = plan.reference_head or ""
    begun["limits"] = "\n".join(f"{name} {value:g}" for name, value in plan.limits.items())
    begun["characteristics"] = "\n".join(f"{name} {key}" for name, key in plan.characteristics.items())
    return begun


def at_fields(error: Invalid, form: Mapping[str, str]) -> dict[str, str]:
    """Messages by the field of the form; those of a list belong to the list."""

    def at(field: str, message: str) -> tuple[str, str]:
        top = field.partition("[")[0].partition(".")[0]
        inner = "nominal" if "nominal" in field else "found"
        name = {"axes": "positions", "body": way(form), "results": "pasted", "shift": inner}.get(top, top)
        place = _POSITION.search(field)
        if place is None or name != "positions":
            return name, message
        return name, _("position {n}: {message}").format(n=int(place[1]) + 1, message=message)

    return by_field(error, at)
