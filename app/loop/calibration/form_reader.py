"""Form reader of calibrations: points, sections, pairs pasted from a spreadsheet, plans."""

import re
from collections.abc import Mapping
from typing import Any

from app.core.calibration import SECTIONS
from app.errors import Invalid
from app.language.i18n import _
from app.language.numbers import as_typed
from app.loop.calibration.places import PlaceRow
from app.web.forms import by_field, length, whole

NUMBERS = ("gauge_size", "zero_range", "averaging_limit", "confidence_limit", "weighting_factor", "path_factor")
RING_NUMBERS = ("nominal", "upper_deviation", "lower_deviation", "radius_term")
KEPT = ("surface", "probe_type", "axis", "direction", "tool_memory")
LENGTHS = ("zero_range", "averaging_limit", "confidence_limit", "path_factor")
IN_SECTIONS = tuple(f"sections[{number}].{side}" for number in range(SECTIONS) for side in ("plus", "minus"))
_BETWEEN = re.compile(r"[\s;]+")
MOST_LINES = 500


def lengths(text: str | None) -> list[float | str | None]:
    """Lengths in mm between blanks, semicolons or line ends, with a decimal point or comma.

    >>> lengths("199,852 199.8531")
    [199.852, 199.8531]
    """
    return [length(number) for number in _BETWEEN.split((text or "").strip()) if number]


def gauge(form: Mapping[str, str], location: int) -> dict[str, Any]:
    """The form of a gauge calibration as the API's fields.

    Raises `Invalid` without a touch: who types has forgotten it, and the probe is not to blame.
    """
    if not (touches := lengths(form.get("touches"))):
        raise Invalid.at("touches", _("is empty; type a size in mm for each touch"))
    return {
        "average_memory": location,
        "touches": touches,
        **{name: length(form.get(name)) for name in NUMBERS},
        **{name: form.get(name) for name in KEPT if name != "tool_memory"},
        "tool_memory": whole(form.get("tool_memory")),
    }


def ring(form: Mapping[str, str], tool: int) -> dict[str, Any]:
    """The form of a ring calibration as the API's fields; sections left empty were not touched."""
    sections = [
        {side: length(form.get(f"{side}_{number}")) for side in ("plus", "minus")} for number in range(1, SECTIONS + 1)
    ]
    return {
        "tool_memory": tool,
        **{name: length(form.get(name)) for name in RING_NUMBERS},
        "sections": [
            {side: value for side, value in section.items() if value is not None}
            for section in sections
            if any(value is not None for value in section.values())
        ],
        "first_move_triggered": form.get("first_move_triggered") == "true",
    }


def pairs(form: Mapping[str, str]) -> list[dict[str, Any]]:
    """The pasted lines as pairs: two columns, machine (or number of the reading) and external gauge.

    Raises `Invalid` that names the line.
    """
    characteristic = form.get("characteristic", "").strip()
    read = []
    lines = [(number, line) for number, line in enumerate(form.get("lines", "").splitlines(), 1) if line.strip()]
    if not lines or len(lines) > MOST_LINES:
        raise Invalid.at("lines", _("needs a line for each pair, {most} at most").format(most=MOST_LINES))
    for number, line in lines:
        columns = lengths(line)
        if len(columns) != 2 or not all(isinstance(number_read, float) for number_read in columns):
            raise Invalid.at(
                "lines",
                _("line {line}: two numbers are needed, not “{text}”").format(line=number, text=line.strip()[:60]),
            )
        pair: dict[str, Any] = {"external_value": columns[1], "instrument": form.get("instrument", "")}
        if characteristic:
            pair |= {"characteristic": characteristic, "sequence": whole(_BETWEEN.split(line.strip())[0])}
        else:
            pair["machine_value"] = columns[0]
        read.append(pair)
    return read


def at_fields(error: Invalid) -> dict[str, str]:
    """Errors by the field of the form: all points are in one field, so the number of each wrong one is named."""
    errors = by_field(error)
    touches = [(name, message) for name, message in errors.items() if name.startswith("touches[")]
    for name, message in touches:
        del errors[name]
        number = int(name.removeprefix("touches[").partition("]")[0]) + 1
        sentence = _("Touch {n}: {what}").format(n=number, what=message)
        errors["touches"] = f"{errors['touches']}. {sentence}" if "touches" in errors else sentence
    return errors


def plan(form: Mapping[str, str]) -> dict[str, Any]:
    """The form of a plan as the API's fields."""
    return {
        "due_parts": whole(form.get("due_parts")),
        "due_days": length(form.get("due_days")),
        "acceptance": form.get("acceptance"),
    }


def filled_in(row: PlaceRow, limits: Mapping[str, float]) -> dict[str, str]:
    """Initial values of the forms: the last calibration of this place, else the limits of a characteristic that uses it.

    A calibration that looks like inches is not offered again.
    """
    settings: dict[str, Any] = {}
    if row.last is not None and row.last.record.kind != "pairs" and not row.last.record.settings.get("warnings"):
        settings = dict(row.last.record.settings) | {"gauge_size": row.last.record.size}
    names = (*NUMBERS, *RING_NUMBERS) if settings else LENGTHS
    values = settings or limits
    begun = {name: as_typed(values[name]) for name in names if values.get(name) is not None}
    begun |= {name: str(settings[name]) for name in KEPT if settings.get(name) is not None}
    if row.plan is not None:
        begun |= {
            "due_parts": as_typed(row.plan.due_parts),
            "due_days": as_typed(row.plan.due_days),
            "acceptance": row.plan.acceptance,
        }
    return {"weighting_factor": "1", "path_factor": "1", "acceptance": "accept"} | begun
