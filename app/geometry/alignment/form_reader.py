"""Touches of a part as people type or paste them, and the form as the API takes it. Lengths in mm, repeatability in µm.

A pasted line is a touch: nominal X Y Z, the face (``+Z``, or its normal as three numbers), and what was found: one number,
the deviation along the normal, or three, the point that was touched.
"""

import re
from collections.abc import Mapping
from typing import Any

from app.core.number_text import has_broken_number
from app.core.number_text import plain as plain_text
from app.errors import FieldError, InbandError, Invalid
from app.geometry.alignment.schemas import AlignmentIn, PalletIn
from app.language.i18n import _
from app.web.again import MOST_TOUCHES
from app.web.forms import by_field, characteristics_typed, length, read, typed

KINDS = ("points", "two_points", "two_holes")
FACES = ("+Z", "+Z", "+Z", "-Y", "-Y", "-X")  # the six points, where nobody says otherwise
ROWS, MOST_ROWS = 6, 60
MOST_LETTERS = 100_000
AXES = ("x", "y", "z")
FOUND = {"deviation": ("d",), "measured": ("mx", "my", "mz")}
UNKNOWNS = {
    "": None,
    "base": ["c", "lambda", "beta"],
    "plane": ["a", "b", "gamma"],
    "shift": ["a", "b", "c"],
}
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d{1,2})?")
_FACE = re.compile(r"(?<!\S)[+-]\s?[XYZ](?!\w)", re.IGNORECASE)
FormValues = dict[str, Any]


def rows_of(form: Mapping[str, str]) -> int:
    """Number of lines in the grid of points."""
    typed = form.get("rows", "")
    number = int(typed) if typed.isascii() and typed.isdigit() and len(typed) < 4 else ROWS
    return max(ROWS, min(number, MOST_ROWS))


def found_by(form: Mapping[str, str]) -> str:
    """Tell if the form takes the deviation of each point, or the point itself."""
    return "measured" if form.get("found") == "measured" else "deviation"


def blank(kind: str) -> dict[str, str]:
    """The form as it is offered."""
    return {"kind": kind, "rows": str(ROWS), "tip": "0"} | {f"n{at}": face for at, face in enumerate(FACES)}


def fields(form: Mapping[str, str]) -> tuple[FormValues, list[str]]:
    """The form as the API takes it, and by touch the line in which it was typed. Raises `Invalid` for a line that is none."""
    values = read(AlignmentIn, form) | dict.fromkeys(("tip", "touches", "side", "holes", "table"))
    base = [length(form.get(f"base_{axis}")) for axis in AXES]
    values["base"] = base if any(value is not None for value in base) else None
    values["solve_for"] = UNKNOWNS.get(form.get("solve_for", ""))
    if form.get("table"):
        centre = [length(form.get(f"table_{axis}")) or 0.0 for axis in "xy"]
        values["table"] = {
            "axis": form.get("table_axis", "C"),
            "centre": centre,
            "position": length(form.get("table_position")) or 0.0,
            "clockwise": form.get("table_sense") != "counter",
        }
    values["characteristics"] = characteristics_typed(form, "abc") or None
    lines: list[str] = []
    match form.get("kind"):
        case "two_points":
            values["side"] = [_pairs(form, f"s{at}") for at in (1, 2)]
        case "two_holes":
            values["holes"] = [_hole(form, at) for at in (1, 2)]
        case _:
            values["touches"], lines = _touches(form)
            values["tip"] = length(form.get("tip"))
    return values, lines


def _touches(form: Mapping[str, str]) -> tuple[list[FormValues], list[str]]:
    """Points of the grid, and those pasted below it."""
    columns = FOUND[found_by(form)]
    touches, lines = [], []
    for at in range(rows_of(form)):
        typed = [form.get(f"{column}{at}", "").strip() for column in (*AXES, *columns)]
        if not any(typed):
            continue
        nominal = [length(value) for value in typed[:3]]
        result = [length(value) for value in typed[3:]]
        touch: FormValues = {"nominal": nominal, "normal": face(form.get(f"n{at}", ""))}
        if any(value is not None for value in result):
            touch |= {"deviation": result[0]} if len(result) == 1 else {"measured": result}
        touches.append(touch)
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


def _pasted(text: str) -> list[FormValues]:
    if len(text) > MOST_LETTERS:
        raise Invalid.at("lines", _("the text is too long for {most} points").format(most=MOST_TOUCHES))
    return [line(row, number) for number, row in enumerate(text.splitlines(), 1) if row.strip()]


def line(row: str, number: int) -> FormValues:
    """A touch of one pasted line. Raises `Invalid` naming it.

    >>> line("10 10 0 +Z 0.012", 1)
    {'nominal': [10.0, 10.0, 0.0], 'normal': '+Z', 'deviation': 0.012}
    >>> line("20\\t0\\t-15\\t-Y\\t20\\t0,104\\t-15", 2)
    {'nominal': [20.0, 0.0, -15.0], 'normal': '-Y', 'measured': [20.0, 0.104, -15.0]}
    """
    plain = _signs(row)
    if "." not in plain:
        plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    plain = re.sub(r"[,;|]", " ", plain)
    faces = _FACE.findall(plain)
    before, _at, after = plain.partition(faces[0]) if len(faces) == 1 else (plain, "", "")
    numbers = [_numbers(part) for part in (before, after)]
    if len(faces) == 1 and None not in numbers:
        nominal, result = numbers[0] or [], numbers[1] or []
        normal: str | list[float] = faces[0].upper().replace(" ", "")
    else:
        every = numbers[0] or []
        nominal, normal, result = every[:3], every[3:6], every[6:]
    if len(nominal) != 3 or len(normal) not in (2, 3) or len(result) not in (1, 3):
        raise Invalid.at(
            "lines",
            _("line {number} is not a valid point: {row}").format(number=number, row=repr(row.strip()[:60])),
            do=_("Write one point per line: X Y Z, the face such as +Z, and the deviation or the probed X Y Z."),
        )
    return {"nominal": nominal, "normal": normal} | (
        {"deviation": result[0]} if len(result) == 1 else {"measured": result}
    )


def _signs(row: str) -> str:
    """Ordinary signs and blanks."""
    return "\n".join(plain_text(part) for part in row.split("\n"))


def _numbers(text: str) -> list[float] | None:
    if has_broken_number(text):
        return None
    parts = text.split()
    return [float(part) for part in parts] if all(_NUMBER.fullmatch(part) for part in parts) else None


def _pairs(form: Mapping[str, str], name: str) -> FormValues:
    return {
        "nominal": [length(form.get(f"{name}_{axis}")) for axis in "xy"],
        "measured": [length(form.get(f"{name}_m{axis}")) for axis in "xy"],
    }


def _hole(form: Mapping[str, str], at: int) -> FormValues:
    """A hole: its centre as the control says it, or touches, one a line."""
    hole: FormValues = {"nominal": [length(form.get(f"h{at}_{axis}")) for axis in "xy"]}
    centre = [length(form.get(f"h{at}_m{axis}")) for axis in "xy"]
    if any(value is not None for value in centre):
        hole["centre"] = centre
    text = form.get(f"h{at}_touches", "")
    if text.strip():
        hole["touches"] = [_place(row, number, at) for number, row in enumerate(text.splitlines(), 1) if row.strip()]
        hole["tip"] = length(form.get("tip")) or 0.0
        hole["inside"] = form.get(f"h{at}_side") != "outside"
    return hole


def _place(row: str, number: int, hole: int) -> list[float]:
    plain = _signs(row)
    if "." not in plain:
        plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    numbers = _numbers(re.sub(r"[,;|]", " ", plain))
    if numbers is None or len(numbers) != 2:
        wrong = _("line {number} is not a valid point: {row}").format(number=number, row=repr(row.strip()[:60]))
        raise Invalid(
            f"{wrong}.", _("Write X and Y of one point per line."), errors=[FieldError(f"h{hole}_touches", wrong)]
        )
    return numbers


# --- pallets, once more


def pallet(form: Mapping[str, str]) -> PalletIn:
    """A pallet and a part on it, as typed. Raises `Invalid`."""
    place, turn = [length(form.get(f"pose_{axis}")) for axis in AXES], length(form.get("pose_turn"))
    given = any(value is not None for value in (*place, turn))
    pose = {"shift": [0.0 if value is None else value for value in place], "rotation": turn or 0.0}
    return typed(PalletIn, form, pose=pose if given else None)


# --- what is wrong, where it was typed


def at_fields(error: InbandError, lines: list[str]) -> dict[str, str]:
    """Messages by the field of the form or the line of the grid."""

    def at(field: str, message: str) -> tuple[str, str]:
        folder, _dot, rest = field.partition(".")
        name, _bracket, index = folder.rstrip("]").partition("[")
        if index and name in {"touches", "side", "holes"}:
            number = int(index)
            text = f"{field_words(rest)}: {message}" if rest else message
            if name == "touches":
                return lines[number] if number < len(lines) else "lines", text
            return f"{name}{number + 1}", text
        if name == "characteristics":
            return f"as_{rest}", message
        return name if name in {"base", "table", "pose", "leave_out"} else folder, message

    return by_field(error, at)


def field_words(field: str) -> str:
    """A part of a touch as the grid calls it.

    >>> field_words("nominal[1]"), field_words("measured[0]")
    ('Y', 'measured X')
    """
    name, _bracket, index = field.rstrip("]").partition("[")
    axis = "XYZ"[int(index)] if index.isdigit() and int(index) < 3 else ""
    words = {
        "nominal": axis,
        "measured": _("measured {axis}").format(axis=axis),
        "centre": _("centre {axis}").format(axis=axis),
        "normal": _("face"),
        "deviation": _("deviation"),
    }
    return words.get(name, name) or _("nominal place")


# --- filled in like another one


def like(kind: str, inputs: Mapping[str, Any]) -> dict[str, str]:
    """The form as another alignment was typed, what was found left out: the same part, clamped again."""
    form = blank(kind)
    form["found"] = "measured" if any("measured" in touch for touch in inputs.get("touches", ())) else "deviation"
    touches = inputs.get("touches", ())[:MOST_ROWS]
    form["rows"] = str(max(ROWS, len(touches)))
    for at, touch in enumerate(touches):
        form |= {f"{axis}{at}": plain(value) for axis, value in zip(AXES, touch["nominal"], strict=True)}
        form[f"n{at}"] = face_word(touch["normal"])
    if touches:
        form |= {f"n{at}": "" for at in range(len(touches), ROWS)}
    for name, entries in (("s", inputs.get("side", ())), ("h", inputs.get("holes", ()))):
        for at, entry in enumerate(entries, 1):
            form |= {f"{name}{at}_{axis}": plain(value) for axis, value in zip("xy", entry["nominal"], strict=True)}
            if entry.get("tip"):
                form["tip"] = plain(entry["tip"])
    if inputs.get("tip"):
        form["tip"] = plain(inputs["tip"])
    if inputs.get("repeatability"):
        form["repeatability"] = f"{inputs['repeatability'] * 1000:.6g}"
    if "work_offset" in inputs:
        form["work_offset"] = inputs["work_offset"]
    if table := inputs.get("table"):
        form |= {"table": "true", "table_axis": table["axis"], "table_sense": "" if table["clockwise"] else "counter"}
        form |= {f"table_{axis}": plain(value) for axis, value in zip("xy", table["centre"], strict=True)}
    form["solve_for"] = next((name for name, value in UNKNOWNS.items() if value == inputs.get("solve_for")), "")
    return form


def face_word(normal: Any) -> str:
    """A stored normal as it is typed."""
    for axis, name in enumerate("XYZ"):
        if abs(abs(normal[axis]) - 1) < 1e-12:
            return ("+" if normal[axis] > 0 else "-") + name
    return " ".join(plain(value) for value in normal)


def plain(value: float) -> str:
    """A stored number as it is typed."""
    return f"{value:.9g}"
