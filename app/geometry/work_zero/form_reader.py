"""Touches as people type or paste them, and the form as the API takes it.

A pasted line is a touch: ``-X -353.012``, ``X -353.012 Y -181.25 -X``, or two numbers, X and Y. Or the text is what the
printed macros keep: ``R1=-353.012`` to ``R4``, ``#501`` to ``#505``, with ``#508`` and ``#2`` for Z.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from app.core.number_text import has_broken_number
from app.errors import InbandError, Invalid
from app.geometry.work_zero.schemas import MOST_TOUCHES, OTHER_NAMES, RECORDS, FixtureIn, ZeroIn
from app.language.i18n import _
from app.web.forms import by_field, characteristics_typed, length, read, typed

ROWS = 6
SHOWN_ROWS = 4  # the others are opened where they are needed
MOST_LETTERS = 20_000
RESULTS = ("x", "y", "z", "diameter", "length", "width")
SIGN = {"\N{MINUS SIGN}": "-", "\N{EN DASH}": "-"}

# In which direction the tip goes, touch by touch, where nobody says otherwise.
APPROACHES: dict[str, tuple[str, ...]] = {
    "bore": ("-X", "+X", "-Y", "+Y", "", ""),
    "boss": ("+X", "-X", "+Y", "-Y", "", ""),
    "pocket": ("-X", "+X", "-Y", "+Y", "", ""),
    "web": ("+X", "-X", "+Y", "-Y", "", ""),
    "corner": ("+X", "+Y", "", "", "", ""),
}
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)"
_RECORD = re.compile(rf"(?<![\w.#])(R[1-4]|#50[1245]|#508|#2)(?:\s*+[=:]\s*+|\s++)({_NUMBER})(?![\w.])", re.IGNORECASE)
_APPROACH = re.compile(r"(?<!\S)([+-])\s?([XY])(?![\w.])", re.IGNORECASE)
_WORD = re.compile(rf"(?<![\w.])([XY])\s*+[=:]?\s*+({_NUMBER})(?![\w.])", re.IGNORECASE)
_BARE = re.compile(rf"(?<![\w.])({_NUMBER})(?![\w.])")


def blank(kind: str) -> dict[str, str]:
    """The form as it is offered for this kind."""
    directions = APPROACHES.get(kind, APPROACHES["pocket"])
    return {f"approach{at}": direction for at, direction in enumerate(directions, 1)} | {"work_offset": "G54"}


def like(inputs: Mapping[str, Any], kind: str, /, **more: str | None) -> dict[str, str]:
    """The form as another zero was typed, its touches left out: the same thing is measured again."""
    form = blank(kind) | {name: value or "" for name, value in more.items()}
    for name in ("tip", "feeler", "tool_length"):
        if inputs.get(name):
            form[name] = f"{inputs[name]:.9g}"
    if inputs.get("repeatability"):
        form["repeatability"] = f"{inputs['repeatability'] * 1000:.6g}"
    for at, touch in enumerate((inputs.get("touches") or [])[:ROWS], 1):
        form[f"approach{at}"] = touch.get("approach") or ""
    return form


def fields(form: Mapping[str, str]) -> tuple[dict[str, Any], list[str]]:
    """The form as the API takes it, and by touch the field in which it was typed. Raises `Invalid` for a line that is none."""
    values = read(ZeroIn, form)
    del values["touches"], values["records"]
    values["characteristics"] = characteristics_typed(form, RESULTS) or None
    touches: list[dict[str, Any]] = []
    typed_in: list[str] = []
    for at in range(1, ROWS + 1):
        x, y = length(form.get(f"x{at}")), length(form.get(f"y{at}"))
        if x is None and y is None:
            continue
        touches.append(_touch(x, y, form.get(f"approach{at}", "").strip()))
        typed_in.append(f"touch{at}")
    text = form.get("lines", "")
    if len(text) > MOST_LETTERS:
        raise Invalid.at("lines", _("the text is too long for {most} points").format(most=MOST_TOUCHES))
    records = _records(text)
    if records and not touches:
        return values | records, ["lines"] * 4
    pasted = _lines(text)
    touches += pasted
    typed_in += ["lines"] * len(pasted)
    return values | {"touches": touches}, typed_in


def _touch(x: Any, y: Any, approach: str) -> dict[str, Any]:
    values = {"x": x, "y": y, "approach": approach.replace("\N{MINUS SIGN}", "-") or None}
    return {name: value for name, value in values.items() if value is not None}


def _plain(text: str) -> str:
    """Signs as signs, and commas as points where they are decimal commas."""
    for sign, plain in SIGN.items():
        text = text.replace(sign, plain)
    rows = []
    for row in text.splitlines():
        if "." not in row:
            row = re.sub(r"(?<=\d),(?=\d)", ".", row)  # noqa: PLW2901 - the row, cleaned
        rows.append(re.sub(r"[,;\t|]", " ", row))
    return "\n".join(rows)


def _records(text: str) -> dict[str, Any]:
    """Values that the printed macros keep, by their name there; nothing where the text has none."""
    records: dict[str, Any] = {}
    for name, number in _RECORD.findall(_plain(text)):
        records[OTHER_NAMES.get(name.upper(), name.upper())] = float(number)
    return records if any(name in RECORDS for name in records) else {}


def _lines(text: str) -> list[dict[str, Any]]:
    return [_line(row, number) for number, row in enumerate(_plain(text).splitlines(), 1) if row.strip()]


def _line(row: str, number: int) -> dict[str, Any]:
    """A touch of one line. Raises `Invalid` naming it.

    >>> _line("-X -353.012", 1), _line("X 12.5 Y -3 +Y", 2)
    ({'x': -353.012, 'approach': '-X'}, {'x': 12.5, 'y': -3.0, 'approach': '+Y'})
    >>> _line("1.5 2", 3)
    {'x': 1.5, 'y': 2.0}
    """
    directions = [sign + axis.upper() for sign, axis in _APPROACH.findall(row)]
    rest = "?" if has_broken_number(row) else _APPROACH.sub(" ", row)
    named = {axis.lower(): float(value) for axis, value in _WORD.findall(rest)}
    bare = [float(value) for value in _BARE.findall(_WORD.sub(" ", rest))]
    left_over = _BARE.sub(" ", _WORD.sub(" ", rest)).strip()
    if not left_over and len(directions) < 2:
        approach = directions[0] if directions else ""
        if named and not bare:
            return _touch(named.get("x"), named.get("y"), approach)
        if not named and len(bare) == 2:
            return _touch(bare[0], bare[1], approach)
        if not named and len(bare) == 1 and approach:
            along_x = approach.endswith("X")
            return _touch(bare[0] if along_x else None, None if along_x else bare[0], approach)
    raise Invalid.at(
        "lines",
        _("line {number} is not a valid point: {row}").format(number=number, row=repr(row.strip()[:60])),
        do=_("Write one point per line: -X -353.012, or X and Y. Or paste R1 to R4."),
    )


def watch(form: Mapping[str, str]) -> FixtureIn:
    """The settings of a fixture as typed. Raises `Invalid`."""
    more = {} if form.get("basis", "").strip() == "frozen" else {"reference": None}
    return typed(FixtureIn, form, characteristics=characteristics_typed(form, RESULTS), **more)


def at_fields(error: InbandError, typed_in: Sequence[str] = ()) -> dict[str, str]:
    """Messages by the field of the form."""

    def at(field: str, message: str) -> tuple[str, str]:
        folder, _dot, rest = field.partition(".")
        name, _bracket, index = folder.rstrip("]").partition("[")
        if name == "touches" and index:
            number = int(index)
            line = typed_in[number] if number < len(typed_in) else "lines"
            return line, f"{rest.upper()}: {message}" if rest and line != "lines" else message
        if name == "characteristics":
            return f"as_{rest}", message
        return "lines" if folder in {"records", *RECORDS} else "leave_out" if name == "leave_out" else folder, message

    return by_field(error, at)
