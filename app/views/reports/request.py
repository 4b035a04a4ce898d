"""Request for a report: its period, sections, paper and time zone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from zoneinfo import ZoneInfo

from app.core.context import Chosen, ContextField
from app.core.period import ALWAYS, Period
from app.core.spc import USUAL_READINGS
from app.errors import FieldError, Invalid
from app.files.documents.content import Paper
from app.files.formats import cell_values, periods
from app.language.i18n import _
from app.language.times import plant_zone
from app.quality.capability.kinds import SigmaBy

LAST = USUAL_READINGS
"""Readings of a report for which no period was named."""


EVERYTHING = 2**62
"""More readings than there can be: `all`."""


class SectionName(StrEnum):
    """The sections, in the order in which they stand."""

    SUMMARY = "summary"
    NUMBERS = "numbers"
    CAPABILITY = "capability"
    CHART = "chart"
    CONTROL = "control"
    WEAR = "wear"
    CORRECTIONS = "corrections"
    ALARMS = "alarms"
    CAUSES = "causes"
    QUARANTINE = "quarantine"
    NOTES = "notes"
    TOOLS = "tools"
    PARAMETERS = "parameters"
    EXCLUDED = "excluded"
    DECISIONS = "decisions"


def _in_every_zone(moment: datetime) -> bool:
    """Tell if a report can write it in any time zone: not on the first and the last day of the calendar."""
    try:
        _around = [moment.astimezone(UTC) + timedelta(days=way) for way in (-1, 1)]
    except OverflowError:
        return False
    return True


@dataclass(frozen=True)
class ReportRequest:
    """Request for a report. `last`: only the last N readings; of them those measured in the period.

    context: only of readings with these values in their context; without `last` and period of all of them.
    """

    period: Period = ALWAYS
    last: int | None = None
    sections: Sequence[SectionName] = field(default=tuple(SectionName))
    paper: Paper = Paper.A4
    zone: str = field(default_factory=lambda: plant_zone().key)
    sigma_by: SigmaBy = SigmaBy.NEIGHBOURS
    context: Chosen = ()

    def __post_init__(self) -> None:
        """Raises `Invalid` for a period that runs backwards and for a time zone that there is not."""
        periods.in_order(self.period)
        errors = [
            FieldError(name, _("lies outside the years 1 to 9999"))
            for name, at in zip(periods.NAMES, self.period, strict=True)
            if at is not None and not _in_every_zone(at)
        ]
        try:
            cell_values.zone_named(self.zone)
        except (cell_values.Unreadable, ValueError) as error:
            errors.append(FieldError("timezone", str(error)))
        if errors:
            raise Invalid.of(errors, _("Correct the named fields and send it again."))

    @property
    def newest(self) -> int | None:
        """Number of the last readings in the report; `LAST` where nothing else was asked for."""
        return LAST if self.last is None and not self.period.bounded and not self.context else self.last


def zone_or_plants(name: str | None) -> ZoneInfo:
    """The time zone of this name; the plant's without one, or where there is no such zone, which the request then says."""
    try:
        return cell_values.zone_named(name) if name else plant_zone()
    except (cell_values.Unreadable, ValueError):
        return plant_zone()


def section_names(names: Sequence[str]) -> tuple[SectionName, ...]:
    """Sections by name, in their order; none named means all. Raises `Invalid`."""
    unknown = [name for name in names if name not in set(SectionName)]
    if unknown:
        raise Invalid.at(
            "section",
            _("there is no section {name}; there are {names}").format(
                name=repr(unknown[0][:40]), names=", ".join(SectionName)
            ),
            do=_("Name only these sections, or none for all of them."),
        )
    return tuple(name for name in SectionName if not names or name in names)


def context_of(said: Mapping[str, str]) -> Chosen:
    """The context by the names of its fields, an empty one asks for nothing. Raises `Invalid`, naming every field."""
    chosen = tuple((field, value) for field in ContextField if (value := said.get(field.value, "").strip()))
    errors = [
        FieldError(f"context.{field.value}", _("is not a number of a nest: a whole number from 0 to 999999"))
        for field, value in chosen
        if field is ContextField.NEST and not (value.isascii() and value.isdigit() and len(value) <= 6)
    ]
    errors += [
        FieldError(f"context.{field.value}", _("must be one line of at most 128 characters"))
        for field, value in chosen
        if len(value) > 128 or any(ord(sign) < 32 or ord(sign) == 127 for sign in value)
    ]
    errors += [
        FieldError(
            "context",
            _("there is no field {name}; there are {names}").format(
                name=repr(name[:40]), names=", ".join(ContextField)
            ),
        )
        for name in said
        if name not in set(ContextField)
    ]
    if errors:
        raise Invalid.of(errors, _("Correct the named fields."))
    return chosen


def typed(fields: Mapping[str, str], sections: Sequence[str], context: Chosen = ()) -> ReportRequest:
    """As people type it: moments without an offset are those of the named time zone, else the plant's. Raises `Invalid`, naming every field."""
    errors: list[FieldError] = []
    if not context:
        try:
            context = context_of({field.value: fields.get(f"context.{field.value}", "") for field in ContextField})
        except Invalid as error:
            errors += error.errors
    zone: ZoneInfo | None = None
    try:
        zone = cell_values.zone_named(fields.get("timezone", "").strip() or plant_zone().key)
    except (cell_values.Unreadable, ValueError) as error:
        errors.append(FieldError("timezone", str(error)))
    period = ALWAYS
    try:
        period = periods.period_of(fields, zone)
    except Invalid as error:
        errors += error.errors
    last = fields.get("last", "").strip()
    if last and last != "all" and not (last.isascii() and last.isdigit() and 0 < int(last) < 10**15):
        errors.append(FieldError("last", _("must be a whole number from 1 on, or `all`")))
    paper = fields.get("paper", "").strip() or Paper.A4
    if paper not in set(Paper):
        errors.append(FieldError("paper", _("must be one of: {names}").format(names=", ".join(Paper))))
    if errors:
        raise Invalid.of(errors, _("Correct the named fields."))
    return ReportRequest(
        period=period,
        last=EVERYTHING if last == "all" else int(last) if last else None,
        sections=section_names(sections),
        paper=Paper(paper),
        zone=zone.key if zone else plant_zone().key,
        context=context,
    )
