"""Entering what was measured by hand. It is kept beside the reading and changes nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.core.plausibility import looks_like_inches
from app.db.events import publish
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.readings import queries as readings
from app.loop.readings.by_hand.schemas import HandMeasurementIn
from app.loop.readings.records import Entry
from app.loop.tables.readings import HandMeasurement
from app.web.forms import length, parsed

FURTHEST = 10.0  # mm from the target; what lies further away was typed in another unit
LEAST_IN_INCHES = 1.0  # mm; a smaller target and its 25th part can both be meant


@dataclass(frozen=True)
class HandResult:
    """A size (mm), whether the part is good, or both."""

    measured: float | None
    good: bool | None
    comment: str | None = None


def must_be_mm(field: str, measured: float, target: float) -> None:
    """Raise `Invalid` for a size that was typed in another unit: no part is off by so much, and what follows is for ever."""
    values = {"measured": measured, "furthest": FURTHEST, "target": target}
    if abs(target) >= LEAST_IN_INCHES and looks_like_inches(measured, target):
        message = _("{measured:g} mm looks like {target:g} mm in inches")
    elif abs(measured - target) > FURTHEST:
        message = _("{measured:g} mm lies more than {furthest:g} mm from the target {target:g} mm")
    else:
        return
    raise Invalid.at(field, message.format(**values), do=_("Sizes are in mm, with a decimal point."))


def measure(
    session: Session,
    entry: Entry,
    sequence: int,
    result: HandResult,
    actor: str,
    *,
    alarm: int | None = None,
    fields: tuple[str, str] = ("measured", "verdict"),
) -> HandMeasurement:
    """Keep what was found beside a reading. ``fields``: what size and verdict are called where they came in.

    Raises `NotFound` for a reading that is not there; `Invalid` when nothing was found, or a size that cannot be meant.
    """
    reading = readings.record_of(session, entry, sequence)
    size, verdict = fields
    if result.measured is None and result.good is None:
        wrong = _("say the size in mm, the verdict, or both")
        raise Invalid(
            _("A measurement by hand says a size or a verdict."),
            _("Enter the measured size, or whether the part is good."),
            errors=[FieldError(size, wrong), FieldError(verdict, wrong)],
        )
    target = characteristics.parameters_of(
        session, entry.machine_id, entry.characteristic_id, reading.parameters_version
    ).target
    if result.measured is not None:
        must_be_mm(size, result.measured, target)
    measurement = HandMeasurement(
        machine_id=entry.machine_id,
        characteristic_id=entry.characteristic_id,
        sequence=sequence,
        actor=actor,
        measured=result.measured,
        good=result.good,
        comment=result.comment,
        alarm=alarm,
    )
    session.add(measurement)
    session.flush()
    record(
        session,
        actor,
        "measured by hand",
        f"reading/{entry.characteristic}/{sequence}",
        {"measured": reading.measured},
        {"by_hand": result.measured, "good": result.good},
        result.comment,
    )
    publish(session, entry.changed(sequence) | {"by_hand": True})
    return measurement


def measure_typed(
    session: Session, entry: Entry, sequence: int, form: Mapping[str, str], actor: str
) -> HandMeasurement:
    """The same from a form: a size with a decimal point or comma, a verdict, a comment; as the API takes them."""
    typed = {name: form.get(name, "").strip() for name in ("verdict", "comment")}
    given = parsed(HandMeasurementIn, {"measured": length(form.get("measured")), **typed})
    good = None if given.verdict is None else given.verdict == "good"
    return measure(session, entry, sequence, HandResult(given.measured, good, given.comment), actor)
