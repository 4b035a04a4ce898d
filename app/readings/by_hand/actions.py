"""Entering what was measured by hand. It is kept beside the reading and changes nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy.orm import Session

from app.audit.actions import record
from app.characteristics import queries as characteristics
from app.db.events import publish
from app.errors import FieldError, Invalid
from app.readings import queries as readings
from app.readings.by_hand.schemas import HandMeasurementIn
from app.readings.records import Entry
from app.readings.tables import HandMeasurement
from app.web.forms import length, parsed
from app.web.i18n import _

FURTHEST = 10.0  # mm from the target; what lies further away was typed in another unit


@dataclass(frozen=True)
class Found:
    """A size (mm), whether the part is good, or both."""

    measured: float | None
    good: bool | None
    comment: str | None = None


def measure(
    session: Session,
    entry: Entry,
    sequence: int,
    found: Found,
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
    if found.measured is None and found.good is None:
        wrong = _("say the size in mm, the verdict, or both")
        raise Invalid(
            _("A measurement by hand says a size or a verdict."),
            _("Enter the size that was found, or whether the part is good."),
            errors=[FieldError(size, wrong), FieldError(verdict, wrong)],
        )
    target = characteristics.parameters_of(
        session, entry.machine_id, entry.characteristic_id, reading.parameters_version
    ).target
    if found.measured is not None and abs(found.measured - target) > FURTHEST:
        wrong = _("{measured:g} mm lies more than {furthest:g} mm from the target {target:g} mm").format(
            measured=found.measured, furthest=FURTHEST, target=target
        )
        raise Invalid(
            f"{size}: {wrong}.", _("Sizes are in mm, with a decimal point."), errors=[FieldError(size, wrong)]
        )
    made = HandMeasurement(
        machine_id=entry.machine_id,
        characteristic_id=entry.characteristic_id,
        sequence=sequence,
        actor=actor,
        measured=found.measured,
        good=found.good,
        comment=found.comment,
        alarm=alarm,
    )
    session.add(made)
    session.flush()
    record(
        session,
        actor,
        "measured by hand",
        f"reading/{entry.characteristic}/{sequence}",
        {"measured": reading.measured},
        {"by_hand": found.measured, "good": found.good},
        found.comment,
    )
    publish(
        session,
        {
            "kind": "reading",
            "machine": entry.machine,
            "characteristic": entry.characteristic,
            "sequence": sequence,
            "by_hand": True,
        },
    )
    return made


def measure_typed(
    session: Session, entry: Entry, sequence: int, form: Mapping[str, str], actor: str
) -> HandMeasurement:
    """The same from a form: a size with a decimal point or comma, a verdict, a comment; as the API takes them."""
    typed = {name: form.get(name, "").strip() for name in ("verdict", "comment")}
    given = parsed(HandMeasurementIn, {"measured": length(form.get("measured")), **typed})
    good = None if given.verdict is None else given.verdict == "good"
    return measure(session, entry, sequence, Found(given.measured, good, given.comment), actor)
