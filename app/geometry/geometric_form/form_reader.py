"""Touches as people type or paste them: one a line; a blank line or one with Z begins the next section."""

import re
from collections.abc import Mapping
from typing import Any

from app.core.number_text import has_broken_number
from app.core.number_text import plain as plain_text
from app.errors import Invalid
from app.geometry.geometric_form.schemas import OF_POINTS, OF_SECTIONS, WITH_DATUM, WITH_LENGTH, FormIn
from app.language.i18n import _
from app.web.forms import length, read

HEAD = re.compile(
    r"\s*+(?:section\s*+\d*+)?\s*+[,:;]?\s*+(?:[Zz]\s*+[=:]?\s*+(?P<height>[-+−]?[\d.,]++)\s*+)?(?:mm)?\s*+:?\s*+",
    re.IGNORECASE,
)
NUMBER = re.compile(r"^[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d{1,2})?$")
MOST_LETTERS = 200_000


def sections(text: str, field: str) -> list[dict[str, Any]]:
    """Sections of touches: X and Y on a line each. Raises `Invalid` naming the line.

    >>> sections("z 10\\n1 2\\n3,5; 4\\n\\n5 6", "sections")
    [{'touches': [[1.0, 2.0], [3.5, 4.0]], 'height': 10.0}, {'touches': [[5.0, 6.0]]}]
    """
    found: list[dict[str, Any]] = []
    fresh = True
    for number, row in enumerate(text.splitlines(), start=1):
        if (head := HEAD.fullmatch(row)) is not None:
            fresh = True
            if head["height"]:
                found.append({"touches": [], "height": length(head["height"])})
                fresh = False
            continue
        if fresh:
            found.append({"touches": []})
            fresh = False
        found[-1]["touches"].append(_numbers(row, number, field))
    return [section for section in found if section["touches"]]


def points(text: str, field: str) -> list[list[float]]:
    """Points, one a line; blank lines count for nothing. Raises `Invalid` naming the line."""
    return [_numbers(row, number, field) for number, row in enumerate(text.splitlines(), start=1) if row.strip()]


def _numbers(row: str, number: int, field: str) -> list[float]:
    """The numbers of a line: parted by blanks, tabs, semicolons or commas, with decimal point or decimal comma."""
    plain = plain_text(row).strip("()[]")
    plain = re.sub(r",(?=\s)", ";", plain)
    if "." in plain or (";" not in plain and len(plain.split()) < 2):
        plain = plain.replace(",", ";")
    parts = [part for part in re.split(r"[;\s]+", plain.replace(",", ".")) if part]
    if has_broken_number(row) or not 2 <= len(parts) <= 3 or not all(NUMBER.match(part) for part in parts):
        raise Invalid.at(
            field,
            _("line {number} is not a valid point: {row}").format(number=number, row=repr(row[:60])),
            do=_("Write one point per line: X and Y, or X, Y and Z, in mm, with blanks between."),
        )
    return [float(part) for part in parts]


def fields(form: Mapping[str, str]) -> dict[str, Any]:
    """The form as the API takes it. Raises `Invalid` for a line that is not a valid point."""
    kind = form.get("kind", "")
    given = read(FormIn, form) | {"datum": None, "nominal": None}
    if kind not in WITH_LENGTH:
        given["length"] = None
    del given["sections"], given["points"]
    given |= _touched(form, "touches", in_points=_in_points(form, kind, "feature_as"))
    if kind in WITH_DATUM and form.get("datum", "").strip():
        given["datum"] = _touched(form, "datum", in_points=_in_points(form, kind, "datum_as"))
    if kind == "position":
        place = [length(form.get("nominal_x")), length(form.get("nominal_y"))]
        given["nominal"] = None if place == [None, None] else place
    return given


def _in_points(form: Mapping[str, str], kind: str, name: str) -> bool:
    if kind in OF_POINTS:
        return True
    return kind not in OF_SECTIONS and form.get(name) == "plane"


def _touched(form: Mapping[str, str], name: str, *, in_points: bool) -> dict[str, Any]:
    text = form.get(name, "")
    if len(text) > MOST_LETTERS:
        raise Invalid.at(name, _("the text is too long for 2000 points"))
    return {"points": points(text, name)} if in_points else {"sections": sections(text, name)}


def written(inputs: Mapping[str, Any]) -> str:
    """Stored touches as they would be typed.

    >>> written({"sections": [{"height": 10.0, "touches": [[1.0, 2.5]]}, {"height": 20.0, "centre": [0.0, 1.0]}]})
    'Z 10\\n1 2.5\\n\\nZ 20\\n0 1'
    """
    if inputs.get("points"):
        return "\n".join(_line(point) for point in inputs["points"])
    blocks = []
    for section in inputs.get("sections", ()):
        rows = [_line(touch) for touch in section.get("touches") or [section["centre"]]]
        height = section.get("height")
        blocks.append("\n".join([*([f"Z {_exact(height)}"] if height is not None else []), *rows]))
    return "\n\n".join(blocks)


def _line(point: list[float]) -> str:
    return " ".join(map(_exact, point))


def _exact(value: float) -> str:
    return f"{value:.15g}"
