"""Reader of the baseline form: a period, its subgroups, and runs of readings that are left out."""

import re
from collections.abc import Mapping
from typing import Any

from app.core.spc.quantity import Quantity
from app.errors import InbandError, Invalid
from app.language.i18n import _
from app.quality.baselines.schemas import PeriodIn
from app.web.forms import by_field, length, whole

WHOLE = ("first_sequence", "last_sequence", "group_size", "settle", "average_span")
NUMBERS = ("group_pause", "ewma_lambda", "ewma_width", "cusum_k", "cusum_h", "cusum_headstart")
LIMITS = ("centre", "sigma", "lower", "upper")
"""Limits that the customer gives; in the form their names begin with `limits.`."""
FIELDS = (
    "chart",
    "quantity",
    "grouping",
    "pooled",
    "ewma_exact",
    *WHOLE,
    *NUMBERS,
    "excluded",
    *(f"limits.{name}" for name in LIMITS),
)
_RUN = re.compile(r"(\d{1,15})(?:\s*[-\N{EN DASH}\N{HYPHEN}]\s*(\d{1,15}))?(?:[\s,;:]+(\S.*))?")


def period(form: Mapping[str, str]) -> dict[str, Any]:
    """The form as the fields of `PeriodIn`; what belongs to the other kinds of subgroup is not said. Raises `Invalid`."""
    fields: dict[str, Any] = {name: form.get(name) for name in ("chart", "quantity")}
    fields |= {name: whole(form.get(name)) for name in WHOLE}
    fields |= {name: length(form.get(name)) for name in NUMBERS}
    if form.get("ewma_exact"):
        fields["ewma_exact"] = form["ewma_exact"] == "true"
    if form.get("chart", "individuals") != "individuals":
        fields["grouping"] = form.get("grouping")
        fields["pooled"] = form.get("pooled") == "true"
    if fields.get("grouping") != "consecutive":
        fields["group_size"] = None
    if fields.get("grouping") != "pause":
        fields["group_pause"] = None
    if form.get("quantity") != Quantity.WEAR_RESIDUALS:
        fields["settle"] = None
    limits = {name: length(form.get(f"limits.{name}")) for name in LIMITS}
    said = {name: value for name, value in limits.items() if value is not None}
    return fields | {"excluded": runs(form.get("excluded", "")), "limits": said or None}


def runs(text: str) -> list[dict[str, Any]]:
    """One run of readings a line: a number, or two with a dash, and the reason. Raises `Invalid` that names the line.

    >>> runs("640-641 chip on the stylus")
    [{'first': 640, 'last': 641, 'reason': 'chip on the stylus'}]
    """
    runs = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        match = _RUN.fullmatch(line.strip())
        if match is None or match[3] is None:
            raise Invalid.at(
                "excluded",
                (
                    _("line {line} is no run of readings: write 640-641 and the reason")
                    if match is None
                    else _("line {line} has no reason; write it after the numbers")
                ).format(line=number),
            )
        runs.append({"first": int(match[1]), "last": int(match[2] or match[1]), "reason": match[3]})
    return runs


def at_fields(error: InbandError) -> dict[str, str]:
    """Errors by the field of the form: all runs share one field."""
    errors: dict[str, str] = {}
    for name, message in by_field(error).items():
        field = "excluded" if name.startswith("excluded") else name
        errors[field] = f"{errors[field]}. {message}" if field in errors else message
    return errors


def begun(given: PeriodIn | None) -> dict[str, str]:
    """Initial settings of the form."""
    usual = {
        name: field.default
        for name, field in PeriodIn.model_fields.items()
        if name in NUMBERS + WHOLE and field.default is not None and not field.is_required()
    }
    values = usual if given is None else {name: getattr(given, name) for name in usual}
    return {name: f"{value:g}" for name, value in values.items()}
