"""Setting parts aside, and deciding about each. The machine is not locked: no reading waits for a quarantine."""

from datetime import UTC, datetime
from typing import Literal

from sqlalchemy import func, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.affected import in_tolerance
from app.core.decision.step import rounded
from app.db.events import publish
from app.errors import Conflict, Invalid
from app.language.formatting import as_read, um
from app.language.i18n import _
from app.loop.characteristics.queries import characteristic_named
from app.loop.quarantine import queries, wording
from app.loop.quarantine.queries import Listed, PartRow, QuarantineRow
from app.loop.quarantine.schemas import SetAsideIn
from app.loop.quarantine.tables import Quarantine, QuarantinedPart
from app.loop.readings.by_hand.actions import must_be_mm
from app.web.created import Created

MOST_ROWS = 2_000


def set_aside(session: Session, given: SetAsideIn, caller: Caller) -> Created[QuarantineRow]:
    """Set the affected parts of an alarm aside; those that are already stay as they are, and those that came since are added.

    Raises `NotFound`; `Invalid` for an alarm about no parts, or with too many; `Conflict` where no part is affected.
    """
    found = queries.affected(session, given.alarm, given.doubt)
    if not found.rows:
        raise Conflict(
            _("Alarm {number} concerns no part that is not certainly good.").format(number=given.alarm),
            _("There is nothing to set aside."),
        )
    if len(found.rows) > MOST_ROWS:
        raise Invalid.at(
            "alarm",
            _("has {count} affected parts; at most {most} can be set aside in one list").format(
                count=len(found.rows), most=MOST_ROWS
            ),
            do=_("Measure one of the parts by hand: what was cut before a good one is not affected."),
        )
    machine = found.alarm.machine
    values = {
        "machine_id": machine.id,
        "alarm_id": given.alarm,
        "made_by": caller.name,
        "reason": given.reason,
        "guard": given.guard,
        "by_hand_only": given.by_hand_only,
    }
    made = session.scalar(insert(Quarantine).values(values).on_conflict_do_nothing().returning(Quarantine.id))
    quarantine = session.scalars(
        select(Quarantine)
        .where(Quarantine.machine_id == machine.id, Quarantine.alarm_id == given.alarm)
        .with_for_update()
    ).one()
    added = _add(session, quarantine, found.rows)
    if added:
        after = {"alarm": given.alarm, "parts": added, "guard": given.guard, "by_hand_only": given.by_hand_only}
        record(session, caller.name, "parts set aside", f"quarantine/{quarantine.id}", None, after, given.reason)
        _publish(session, machine.key, quarantine, "open")
    return Created(queries.quarantine(session, quarantine.id), again=made is None)


def _add(session: Session, quarantine: Quarantine, rows: list[Listed]) -> int:
    """Add the rows that are not in it; one that was not measured then, and is now, gets its reading. The number of both."""
    kept = queries.parts(session, quarantine)
    by_reading = {(row.part.characteristic_id, row.part.sequence) for row in kept if row.part.sequence}
    by_name = {(row.part.characteristic_id, row.part.part): row.part for row in kept if row.part.sequence is None}
    number = max((row.part.number for row in kept), default=0)
    changed = 0
    for row in rows:
        if row.sequence is not None and (row.characteristic.id, row.sequence) in by_reading:
            continue
        unmeasured = by_name.get((row.characteristic.id, row.part)) if row.part else None
        if unmeasured is not None and (row.sequence is None or unmeasured.status != "open"):
            continue
        if unmeasured is None:
            number += 1
            unmeasured = QuarantinedPart(
                machine_id=quarantine.machine_id,
                quarantine_id=quarantine.id,
                number=number,
                characteristic_id=row.characteristic.id,
            )
            session.add(unmeasured)
        _fill(unmeasured, row)
        changed += 1
    session.flush()
    return changed


def _fill(part: QuarantinedPart, row: Listed) -> None:
    known = row.known
    part.sequence, part.part, part.part_to, part.order = row.sequence, row.part, row.part_to, row.order
    part.offset, part.found = row.offset, row.found
    if known is not None:
        part.cut_at, part.tool_memory, part.cut_without = known.cut_at, known.tool, list(known.without)
        part.deviation, part.measured = known.deviation, known.measured


def decide(
    session: Session,
    number: int,
    part: int,
    status: Literal["released", "scrapped"],
    reason: str,
    caller: Caller,
    measured: float | None = None,
) -> PartRow:
    """Release or scrap a part. Raises `NotFound`; `Conflict` where that is decided already, saying by whom."""
    row = queries.quarantine(session, number)
    session.execute(select(Quarantine.id).where(Quarantine.id == number).with_for_update())
    found = queries.part(session, row.quarantine, part)
    kept = found.part
    if kept.status != "open":
        raise Conflict(
            _("Part {part} of quarantine {number} is decided already: {status}, {who}, {at}.").format(
                part=part,
                number=number,
                status=wording.status_word(kept.status),
                who=kept.decided_by,
                at=as_read(kept.decided_at, "minutes") if kept.decided_at else "–",
            ),
            _("There is nothing left to do."),
        )
    kept.status, kept.reason, kept.remeasured = status, reason, measured
    kept.decided_at, kept.decided_by = datetime.now(UTC), caller.name
    session.flush()
    after = {"status": status, "part": kept.part, "reading": kept.sequence, "measured": measured}
    subject = f"quarantine/{number}/{part}"
    record(session, caller.name, f"part {status}", subject, {"status": "open"}, after, reason)
    waiting = session.scalar(
        select(func.count()).where(
            QuarantinedPart.machine_id == kept.machine_id,
            QuarantinedPart.quarantine_id == number,
            QuarantinedPart.status == "open",
        )
    )
    _publish(session, row.machine.key, row.quarantine, "open" if waiting else "closed")
    return queries.part(session, row.quarantine, part)


def measure_again(session: Session, number: int, part: int, measured: float, reason: str, caller: Caller) -> PartRow:
    """Decide about a part by its size: in tolerance it is released, outside it is scrapped.

    Raises `Invalid` for a size nearer to a limit than the measuring uncertainty of the quarantine, for one in another unit than mm,
    and for a row of many parts.
    """
    quarantine = queries.quarantine(session, number).quarantine
    found = queries.part(session, quarantine, part)
    if found.part.part_to is not None:
        raise Invalid.at(
            "measured",
            _("is of one part, and this row is of many"),
            do=_("Release or scrap the row with a reason."),
        )
    parameters = characteristic_named(session, found.characteristic.key).parameters
    must_be_mm("measured", measured, parameters.target)
    deviation, guard = rounded(measured - parameters.target), quarantine.guard
    good = in_tolerance(deviation, parameters.tolerance, guard)
    if not good and guard and in_tolerance(deviation, parameters.tolerance, -guard):
        raise Invalid.at(
            "measured",
            _("lies within the measuring uncertainty {guard} of a limit: it does not decide").format(guard=um(guard)),
            do=_("Measure it more exactly, or release or scrap it with a reason."),
        )
    return decide(session, number, part, "released" if good else "scrapped", reason, caller, measured)


def _publish(session: Session, machine: str, quarantine: Quarantine, state: str) -> None:
    change = {"kind": "quarantine", "machine": machine, "characteristic": None, "id": quarantine.id}
    publish(session, change | {"alarm": quarantine.alarm_id, "state": state})
