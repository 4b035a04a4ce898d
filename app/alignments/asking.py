"""Touches of a part as people type or paste them, and the form as the API takes it. Lengths in mm, repeatability in µm.

A pasted line is a touch: nominal X Y Z, the face (``+Z``, or its normal as three numbers), and what was found: one number,
the deviation along the normal, or three, the point that was touched.
"""

import re
from collections.abc import Mapping
from typing import Any

from app.alignments.schemas import MOST_TOUCHES
from app.errors import FieldError, InbandError, Invalid
from app.web.forms import by_field, length
from app.web.i18n import _

KINDS = ("points", "two_points", "two_holes")
FACES = ("+Z", "+Z", "+Z", "-Y", "-Y", "-X")  # the six points, where nobody says otherwise
ROWS, MOST_ROWS = 6, 60
MOST_LETTERS = 40_000
AXES = ("x", "y", "z")
FOUND = {"deviation": ("d",), "measured": ("mx", "my", "mz")}
UNKNOWNS = {
    "": None,
    "base": ["c", "lambda", "beta"],
    "plane": ["a", "b", "gamma"],
    "shift": ["a", "b", "c"],
}
WORDS = ("machine", "kind", "name", "part", "method", "work_offset", "key")
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d{1,2})?")
_FACE = re.compile(r"(?<!\S)[+-]\s?[XYZ](?!\w)", re.IGNORECASE)
Asked = dict[str, Any]


def rows_of(form: Mapping[str, str]) -> int:
    """How many lines the grid of touches has."""
    typed = form.get("rows", "")
    asked = int(typed) if typed.isascii() and typed.isdigit() and len(typed) < 4 else ROWS
    return max(ROWS, min(asked, MOST_ROWS))


def found_by(form: Mapping[str, str]) -> str:
    """What is typed of each touch: its deviation, or the point that was touched."""
    return "measured" if form.get("found") == "measured" else "deviation"


def blank(kind: str) -> dict[str, str]:
    """The form as it is offered."""
    return {"kind": kind, "rows": str(ROWS), "tip": "0"} | {f"n{at}": face for at, face in enumerate(FACES)}


def fields(form: Mapping[str, str]) -> tuple[Asked, list[str]]:
    """The form as the API takes it, and by touch the line in which it was typed. Raises `Invalid` for a line that is none."""
    given: Asked = {name: form.get(name, "").strip() for name in WORDS}
    micrometres = length(form.get("repeatability"))
    given["repeatability"] = round(micrometres / 1000, 9) if isinstance(micrometres, float) else micrometres
    base = [length(form.get(f"base_{axis}")) for axis in AXES]
    given["base"] = base if any(each is not None for each in base) else None
    given["solve_for"] = UNKNOWNS.get(form.get("solve_for", ""))
    if form.get("table"):
        centre = [length(form.get(f"table_{axis}")) or 0.0 for axis in "xy"]
        given["table"] = {
            "axis": form.get("table_axis", "C"),
            "centre": centre,
            "position": length(form.get("table_position")) or 0.0,
            "clockwise": form.get("table_sense") != "counter",
        }
    if named := {name: key for name in "abc" if (key := form.get(f"as_{name}", "").strip())}:
        given["characteristics"] = named
    lines: list[str] = []
    match form.get("kind"):
        case "two_points":
            given["side"] = [_pairs(form, f"s{at}") for at in (1, 2)]
        case "two_holes":
            given["holes"] = [_hole(form, at) for at in (1, 2)]
        case _:
            given["touches"], lines = _touches(form)
            given["tip"] = length(form.get("tip"))
    return given, lines


def _touches(form: Mapping[str, str]) -> tuple[list[Asked], list[str]]:
    """Of the grid, and of what was pasted below it."""
    columns = FOUND[found_by(form)]
    touches, lines = [], []
    for at in range(rows_of(form)):
        typed = [form.get(f"{column}{at}", "").strip() for column in (*AXES, *columns)]
        if not any(typed):
            continue
        nominal = [length(each) for each in typed[:3]]
        found = [length(each) for each in typed[3:]]
        made: Asked = {"nominal": nominal, "normal": face(form.get(f"n{at}", ""))}
        if any(each is not None for each in found):
            made |= {"deviation": found[0]} if len(found) == 1 else {"measured": found}
        touches.append(made)
        lines.append(f"row{at}")
    pasted = _pasted(form.get("lines", ""))
    return touches + pasted, lines + ["lines"] * len(pasted)


def face(text: str) -> str | list[Any]:
    """A face as it is typed: +Z, or the numbers of its normal.

    >>> face("−y"), face("0 0,6 0,8")
    ('-Y', [0.0, 0.6, 0.8])
    """
    plain = text.replace("\N{MINUS SIGN}", "-").strip()
    parts = plain.replace(";", " ").split()
    if len(parts) == 3:
        return [length(part) for part in parts]
    return plain.upper().replace(" ", "")


def _pasted(text: str) -> list[Asked]:
    if len(text) > MOST_LETTERS:
        wrong = _("this is more text than {most} touches take").format(most=MOST_TOUCHES)
        raise Invalid(f"lines: {wrong}.", errors=[FieldError("lines", wrong)])
    return [line(row, number) for number, row in enumerate(text.splitlines(), 1) if row.strip()]


def line(row: str, number: int) -> Asked:
    """A touch of one pasted line. Raises `Invalid` naming it.

    >>> line("10 10 0 +Z 0.012", 1)
    {'nominal': [10.0, 10.0, 0.0], 'normal': '+Z', 'deviation': 0.012}
    >>> line("20\\t0\\t-15\\t-Y\\t20\\t0,104\\t-15", 2)
    {'nominal': [20.0, 0.0, -15.0], 'normal': '-Y', 'measured': [20.0, 0.104, -15.0]}
    """
    plain = row.replace("\N{MINUS SIGN}", "-")
    if "." not in plain:
        plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    plain = re.sub(r"[,;|]", " ", plain)
    faces = _FACE.findall(plain)
    before, _at, after = plain.partition(faces[0]) if len(faces) == 1 else (plain, "", "")
    numbers = [_numbers(part) for part in (before, after)]
    if len(faces) == 1 and None not in numbers:
        nominal, found = numbers[0] or [], numbers[1] or []
        normal: str | list[float] = faces[0].upper().replace(" ", "")
    else:
        every = numbers[0] or []
        nominal, normal, found = every[:3], every[3:6], every[6:]
    if len(nominal) != 3 or len(normal) not in (2, 3) or len(found) not in (1, 3):
        wrong = _("line {number} is no touch: {row}").format(number=number, row=repr(row.strip()[:60]))
        raise Invalid(
            f"lines: {wrong}.",
            _("Write one touch a line: X Y Z, the face such as +Z, and the deviation or the X Y Z that were touched."),
            errors=[FieldError("lines", wrong)],
        )
    return {"nominal": nominal, "normal": normal} | (
        {"deviation": found[0]} if len(found) == 1 else {"measured": found}
    )


def _numbers(text: str) -> list[float] | None:
    parts = text.split()
    return [float(part) for part in parts] if all(_NUMBER.fullmatch(part) for part in parts) else None


def _pairs(form: Mapping[str, str], name: str) -> Asked:
    return {
        "nominal": [length(form.get(f"{name}_{axis}")) for axis in "xy"],
        "measured": [length(form.get(f"{name}_m{axis}")) for axis in "xy"],
    }


def _hole(form: Mapping[str, str], at: int) -> Asked:
    """A hole: its centre as the control says it, or touches, one a line."""
    made: Asked = {"nominal": [length(form.get(f"h{at}_{axis}")) for axis in "xy"]}
    centre = [length(form.get(f"h{at}_m{axis}")) for axis in "xy"]
    if any(each is not None for each in centre):
        made["centre"] = centre
    text = form.get(f"h{at}_touches", "")
    if text.strip():
        made["touches"] = [_place(row, number, at) for number, row in enumerate(text.splitlines(), 1) if row.strip()]
        made["tip"] = length(form.get("tip")) or 0.0
        made["inside"] = form.get(f"h{at}_side") != "outside"
    return made


def _place(row: str, number: int, hole: int) -> list[float]:
    plain = row.replace("\N{MINUS SIGN}", "-")
    if "." not in plain:
        plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    found = _numbers(re.sub(r"[,;|]", " ", plain))
    if found is None or len(found) != 2:
        wrong = _("line {number} is no touch: {row}").format(number=number, row=repr(row.strip()[:60]))
        raise Invalid(
            f"{wrong}.", _("Write X and Y of one touch a line."), errors=[FieldError(f"h{hole}_touches", wrong)]
        )
    return found


# --- pallets, once more


def pallet(form: Mapping[str, str]) -> Asked:
    """A pallet and a part on it, as the API takes them."""
    given: Asked = {name: whole(form.get(name, "")) for name in ("pallet", "part")}
    pose = [length(form.get(f"pose_{axis}")) for axis in AXES]
    turn = length(form.get("pose_turn"))
    if any(each is not None for each in (*pose, turn)):
        given["pose"] = {"shift": [0.0 if each is None else each for each in pose], "rotation": turn or 0.0}
    return given | {name: form.get(name, "").strip() for name in ("name", "key")}


def again(form: Mapping[str, str]) -> Asked:
    """Computing once more, as the API takes it."""
    given: Asked = {"method": form.get("method", "").strip(), "reason": form.get("reason", "").strip()}
    micrometres = length(form.get("repeatability"))
    given["repeatability"] = round(micrometres / 1000, 9) if isinstance(micrometres, float) else micrometres
    given["leave_out"] = [whole(each) for each in form.get("leave_out", "").replace(",", " ").replace(";", " ").split()]
    return given


def whole(text: str) -> int | str:
    """A whole number; what is none is left for the schema to refuse."""
    text = text.strip()
    return int(text) if text.isascii() and text.isdigit() and len(text) < 19 else text


# --- what is wrong, where it was typed


def at_fields(error: InbandError, lines: list[str]) -> dict[str, str]:
    """What is wrong, by the field of the form or the line of the grid."""
    moved = []
    for field, message in error.errors:
        folder, _dot, rest = field.partition(".")
        name, told = folder, message
        at = re.fullmatch(r"(touches|side|holes)\[(\d+)\]", folder)
        if at is not None:
            number = int(at[2])
            if at[1] == "touches":
                name = lines[number] if number < len(lines) else "lines"
                told = f"{said(rest)}: {message}" if rest else message
            else:
                name = f"{at[1]}{number + 1}"
                told = f"{said(rest)}: {message}" if rest else message
        elif folder == "characteristics":
            name = f"as_{rest}"
        elif folder.partition("[")[0] in {"base", "table", "pose", "leave_out"}:
            name = folder.partition("[")[0]
        if FieldError(name, told) not in moved:
            moved.append(FieldError(name, told))
    error.errors = moved
    return by_field(error)


def said(field: str) -> str:
    """A part of a touch as the grid calls it.

    >>> said("nominal[1]"), said("measured[0]")
    ('Y', 'found X')
    """
    name, _bracket, index = field.rstrip("]").partition("[")
    axis = "XYZ"[int(index)] if index.isdigit() and int(index) < 3 else ""
    words = {
        "nominal": axis,
        "measured": _("found {axis}").format(axis=axis),
        "centre": _("centre {axis}").format(axis=axis),
        "normal": _("face"),
        "deviation": _("deviation"),
    }
    return words.get(name, name) or _("nominal place")


# --- filled in like another one


def like(kind: str, given: Mapping[str, Any]) -> dict[str, str]:
    """The form as another alignment was typed, what was found left out: the same part, clamped again."""
    made = blank(kind)
    made["found"] = "measured" if any("measured" in touch for touch in given.get("touches", ())) else "deviation"
    touches = given.get("touches", ())[:MOST_ROWS]
    made["rows"] = str(max(ROWS, len(touches)))
    for at, touch in enumerate(touches):
        made |= {f"{axis}{at}": plain(value) for axis, value in zip(AXES, touch["nominal"], strict=True)}
        made[f"n{at}"] = face_word(touch["normal"])
    if touches:
        made |= {f"n{at}": "" for at in range(len(touches), ROWS)}
    for name, entries in (("s", given.get("side", ())), ("h", given.get("holes", ()))):
        for at, entry in enumerate(entries, 1):
            made |= {f"{name}{at}_{axis}": plain(value) for axis, value in zip("xy", entry["nominal"], strict=True)}
            if entry.get("tip"):
                made["tip"] = plain(entry["tip"])
    if given.get("tip"):
        made["tip"] = plain(given["tip"])
    if given.get("repeatability"):
        made["repeatability"] = f"{given['repeatability'] * 1000:.6g}"
    if "work_offset" in given:
        made["work_offset"] = given["work_offset"]
    if table := given.get("table"):
        made |= {"table": "true", "table_axis": table["axis"], "table_sense": "" if table["clockwise"] else "counter"}
        made |= {f"table_{axis}": plain(value) for axis, value in zip("xy", table["centre"], strict=True)}
    made["solve_for"] = next((name for name, value in UNKNOWNS.items() if value == given.get("solve_for")), "")
    return made


def face_word(normal: Any) -> str:
    """A stored normal as it is typed."""
    for axis, name in enumerate("XYZ"):
        if abs(abs(normal[axis]) - 1) < 1e-12:
            return ("+" if normal[axis] > 0 else "-") + name
    return " ".join(plain(each) for each in normal)


def plain(value: float) -> str:
    """A stored number as it is typed."""
    return f"{value:.9g}"
