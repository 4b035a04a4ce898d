"""Form reader of calibrations: points, sections, pairs pasted from a spreadsheet, plans."""

from collections.abc import Mapping
from typing import Any

from app.core.calibration import SECTIONS
from app.errors import Invalid
from app.language.formatting import as_typed
from app.language.i18n import _
from app.loop.calibration.places import PlaceRow
from app.loop.calibration.schemas import GaugeIn, PairIn, RingIn, RingSectionIn
from app.web.forms import BETWEEN, by_field, lengths, read, typed, whole

NUMBERS = ("gauge_size", "zero_range", "averaging_limit", "confidence_limit", "weighting_factor", "path_factor")
RING_NUMBERS = ("nominal", "upper_deviation", "lower_deviation", "radius_term")
KEPT = ("surface", "probe_type", "axis", "direction", "tool_memory")
LENGTHS = ("zero_range", "averaging_limit", "confidence_limit", "path_factor")
SIDES, NUMBERED = ("plus", "minus"), range(1, SECTIONS + 1)
IN_SECTIONS = tuple(f"sections[{number - 1}].{side}" for number in NUMBERED for side in SIDES)
MOST_LINES = 500


def gauge(form: Mapping[str, str], location: int) -> GaugeIn:
    """A gauge calibration as typed.

    Raises `Invalid`, also without a touch: who types has forgotten it, and the probe is not to blame.
    """
    if not lengths(form.get("touches")):
        raise Invalid.at("touches", _("is empty; type a size in mm for each touch"))
    return typed(GaugeIn, form, average_memory=location)


def ring(form: Mapping[str, str], tool: int) -> RingIn:
    """A ring calibration as typed; sections left empty were not touched. Raises `Invalid`."""
    sections = [read(RingSectionIn, {side: form.get(f"{side}_{at}", "") for side in SIDES}) for at in NUMBERED]
    touched = [{side: x for side, x in section.items() if x is not None} for section in sections]
    return typed(RingIn, form, tool_memory=tool, sections=[section for section in touched if section])


def pairs(form: Mapping[str, str]) -> list[PairIn]:
    """The pasted lines as pairs: two columns, machine (or number of the reading) and external gauge.

    Raises `Invalid` that names the line.
    """
    characteristic = form.get("characteristic", "").strip()
    made = []
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
        first: dict[str, Any] = {"machine_value": columns[0]}
        if characteristic:
            first = {"sequence": whole(BETWEEN.split(line.strip())[0])}
        made.append(typed(PairIn, form, external_value=columns[1], **first))
    return made


def at_fields(error: Invalid) -> dict[str, str]:
    """Errors by the field of the form: all points are in one field, so the number of each wrong one is named."""

    def at(field: str, message: str) -> tuple[str, str]:
        if not field.startswith("touches["):
            return field, message
        number = int(field.removeprefix("touches[").partition("]")[0]) + 1
        return "touches", _("Touch {n}: {what}").format(n=number, what=message)

    return by_field(error, at)


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
