"""What somebody wants in a report: the period, which sections, on which paper, in which time zone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from zoneinfo import ZoneInfo

from app.errors import FieldError, Invalid
from app.formats import values
from app.paper.content import Paper
from app.web.i18n import _

LAST = 1_000
"""Readings of a report for which no period was named."""


EVERYTHING = 2**62
"""More readings than there can be: `all`."""


class SectionName(StrEnum):
    """The sections, in the order in which they stand."""

    NUMBERS = "numbers"
    CAPABILITY = "capability"
    CHART = "chart"
    CONTROL = "control"
    WEAR = "wear"
    CORRECTIONS = "corrections"
    ALARMS = "alarms"
    TOOLS = "tools"
    PARAMETERS = "parameters"
    EXCLUDED = "excluded"
    DECISIONS = "decisions"


def _in_every_zone(moment: datetime) -> bool:
    """Whether a report can write it in any time zone: the first and the last day of the calendar it cannot."""
    try:
        _around = [moment.astimezone(UTC) + timedelta(days=way) for way in (-1, 1)]
    except OverflowError:
        return False
    return True


@dataclass(frozen=True)
class Wishes:
    """What a report is made of. `last`: only the last so many readings; of them those measured from `start` to `end`."""

    start: datetime | None = None
    end: datetime | None = None
    last: int | None = None
    sections: Sequence[SectionName] = field(default=tuple(SectionName))
    paper: Paper = Paper.A4
    zone: str = "UTC"

    def __post_init__(self) -> None:
        """Raises `Invalid` for a period that runs backwards and for a time zone that there is not."""
        errors = []
        if self.start is not None and self.end is not None and self.start > self.end:
            message = _("{start} is later than `to` {end}; exchange the two").format(
                start=self.start.isoformat(), end=self.end.isoformat()
            )
            errors.append(FieldError("from", message))
        errors += [
            FieldError(name, _("lies outside the years 1 to 9999"))
            for name, at in (("from", self.start), ("to", self.end))
            if at is not None and not _in_every_zone(at)
        ]
        try:
            values.zone_named(self.zone)
        except (values.Unreadable, ValueError) as error:
            errors.append(FieldError("timezone", str(error)))
        if errors:
            raise Invalid(
                "; ".join(f"{error.field}: {error.message}" for error in errors),
                _("Correct the named fields and send it again."),
                errors=errors,
            )

    @property
    def newest(self) -> int | None:
        """How many of the last readings are looked at; where nothing is said, `LAST` of them."""
        return LAST if self.last is None and self.start is None and self.end is None else self.last


def section_names(given: Sequence[str]) -> tuple[SectionName, ...]:
    """Sections by name, in their order; none named means all. Raises `Invalid`."""
    unknown = [name for name in given if name not in set(SectionName)]
    if unknown:
        message = _("there is no section {name}; there are {names}").format(
            name=repr(unknown[0][:40]), names=", ".join(SectionName)
        )
        raise Invalid(
            f"section: {message}.",
            _("Name only these sections, or none for all of them."),
            errors=[FieldError("section", message)],
        )
    return tuple(name for name in SectionName if not given or name in given)


def typed(fields: Mapping[str, str], sections: Sequence[str]) -> Wishes:
    """As people type it: moments without an offset are those of their time zone. Raises `Invalid`, naming every field."""
    errors: list[FieldError] = []
    zone: ZoneInfo | None = None
    try:
        zone = values.zone_named(fields.get("timezone", "").strip() or "UTC")
    except (values.Unreadable, ValueError) as error:
        errors.append(FieldError("timezone", str(error)))
    found: dict[str, datetime | None] = {}
    for name in ("from", "to"):
        given = fields.get(name, "").strip()
        try:
            found[name] = values.moment(given, zone) if given else None
        except values.Unreadable as error:
            errors.append(FieldError(name, str(error)))
    last = fields.get("last", "").strip()
    if last and last != "all" and not (last.isascii() and last.isdigit() and 0 < int(last) < 10**15):
        errors.append(FieldError("last", _("must be a whole number from 1 on, or `all`")))
    paper = fields.get("paper", "").strip() or Paper.A4
    if paper not in set(Paper):
        errors.append(FieldError("paper", _("must be one of: {names}").format(names=", ".join(Paper))))
    if errors:
        detail = "; ".join(f"{error.field}: {error.message}" for error in errors)
        raise Invalid(detail, _("Correct the named fields."), errors=errors)
    return Wishes(
        start=found.get("from"),
        end=found.get("to"),
        last=EVERYTHING if last == "all" else int(last) if last else None,
        sections=section_names(sections),
        paper=Paper(paper),
        zone=zone.key if zone else "UTC",
    )
