"""Putting machines under maintenance, extending and ending it."""

from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, Invalid, NotAllowed
from app.language.formatting import as_read
from app.language.i18n import _
from app.loop.machines.queries import machine_named
from app.loop.maintenance import queries
from app.loop.maintenance.queries import MaintenanceRow
from app.loop.maintenance.schemas import ExtendIn, MaintenanceIn
from app.loop.maintenance.tables import Maintenance

USUAL = timedelta(hours=8)
"""Where no end is entered: a shift. A forgotten end does not leave people without notifications."""
OF_OPERATOR = timedelta(hours=24)
"""By then it is over where an operator has entered it."""
LONGEST, AHEAD = timedelta(days=62), timedelta(days=366)
LATE = timedelta(minutes=1)
"""A beginning that is so long ago counts as now: it was typed to the minute, or by another clock."""
TWICE = timedelta(seconds=30)
"""The same maintenance, entered again by the same person within this time, is one: a button was pressed twice."""


def enter_maintenance(session: Session, given: MaintenanceIn, caller: Caller) -> MaintenanceRow:
    """Enter when a machine, or each of them, is under maintenance; sent twice, it is one.

    Raises `NotFound` for the machine; `Invalid` for times that cannot be; `NotAllowed` for what takes an engineer; `Conflict`
    where other maintenance of the same machine overlaps with it.
    """
    machine = machine_named(session, given.machine) if given.machine else None
    queries.hold_all(session)
    now = datetime.now(UTC)
    begins = given.begins if given.begins is not None and given.begins > now else now
    ends = given.ends or begins + USUAL
    _check(given, begins, ends, now)
    if not caller.may("engineer"):
        _check_operator(given.machine, ends, now, stopping_anyway=given.stopping_anyway)
    other = queries.overlapping(session, machine.id if machine else None, begins, ends)
    if other is not None:
        if _is_same(other.maintenance, given, now, caller):
            return other
        raise _overlaps(other, _("Extend or end that one, or choose another time."))
    row = Maintenance(
        machine_id=machine.id if machine else None, begins=begins, ends=ends, reason=given.reason,
        stopping_anyway=given.stopping_anyway, entered_by=caller.name,
    )  # fmt: skip
    session.add(row)
    session.flush()
    session.refresh(row)
    made = MaintenanceRow(row, machine)
    record(session, caller.name, "maintenance entered", f"maintenance/{row.id}", None, _facts(made), given.reason)
    publish(session, _change(made, "entered"))
    return made


def _is_same(there: Maintenance, given: MaintenanceIn, now: datetime, caller: Caller) -> bool:
    """Tell if the same was entered by the same person a moment ago. What begins now, began then."""
    begins = given.begins if given.begins is not None and given.begins > now else there.begins
    entered = (there.entered_by, there.reason, there.stopping_anyway, there.begins, there.ends)
    sent = (caller.name, given.reason, given.stopping_anyway, begins, given.ends or begins + USUAL)
    return entered == sent and there.entered_at > now - TWICE


def _overlaps(other: MaintenanceRow, advice: str) -> Conflict:
    return Conflict(
        _("{name}: maintenance {number} from {begins} to {ends} overlaps with it.").format(
            name=other.name, number=other.maintenance.id, begins=_read(other.maintenance.begins),
            ends=_read(other.maintenance.over_at),
        ),
        advice,
    )  # fmt: skip


def _check(given: MaintenanceIn, begins: datetime, ends: datetime, now: datetime) -> None:
    """Refuse times that cannot be. Raises `Invalid`."""
    if given.begins is not None and given.begins < now - LATE:
        raise Invalid.at("begins", _("lies in the past; leave it out if it begins now"))
    if begins > now + AHEAD:
        raise Invalid.at("begins", _("lies more than a year ahead"))
    if ends <= begins:
        raise Invalid.at("ends", _("must come after {begins}, when it begins").format(begins=_read(begins)))
    _check_length(begins, ends)


def _check_length(begins: datetime, ends: datetime) -> None:
    if ends - begins > LONGEST:
        raise Invalid.at("ends", _("must come within {n} days").format(n=LONGEST.days))


def _check_operator(machine: str | None, ends: datetime, now: datetime, *, stopping_anyway: bool) -> None:
    """Refuse what takes an engineer. Raises `NotAllowed`."""
    if machine is None or not stopping_anyway or ends > now + OF_OPERATOR:
        raise NotAllowed(
            _(
                "An operator may put one machine under maintenance, for at most {n} h from now; notifications of alarms that stop "
                "it are still sent."
            ).format(n=OF_OPERATOR // timedelta(hours=1)),
            _("Anything beyond requires the Engineer role."),
        )


def end(session: Session, number: int, reason: str | None, caller: Caller) -> MaintenanceRow:
    """End maintenance now, or cancel what is planned: then alarms that are still active are announced.

    Raises `NotFound`; `Conflict` for what is over.
    """
    now = datetime.now(UTC)
    row = _not_over(session, number, now, _("There is nothing left to do."))
    entered = row.maintenance
    entered.ended_at, entered.ended_by = now, caller.name
    record(session, caller.name, "maintenance ended", f"maintenance/{number}", _facts(row), None, reason)
    publish(session, _change(row, "ended"))
    return row


def extend(session: Session, number: int, given: ExtendIn, caller: Caller) -> MaintenanceRow:
    """Move the end of maintenance to a later time; the end that it has already changes nothing.

    Raises `NotFound`; `Conflict` for what is over, or where other maintenance of the same machine begins before; `Invalid` for
    an end that is not later; `NotAllowed` for what takes an engineer.
    """
    now = datetime.now(UTC)
    row = _not_over(session, number, now, _("Enter maintenance again."))
    entered = row.maintenance
    if given.ends == entered.ends:
        return row
    if given.ends < entered.ends:
        raise Invalid.at(
            "ends",
            _("must come after {ends}, its end now; end it when the work is done").format(ends=_read(entered.ends)),
        )
    _check_length(entered.begins, given.ends)
    if not caller.may("engineer"):
        machine = row.machine.key if row.machine else None
        _check_operator(machine, given.ends, now, stopping_anyway=entered.stopping_anyway)
    if other := queries.overlapping(session, entered.machine_id, entered.ends, given.ends):
        raise _overlaps(other, _("Choose an earlier end, or cancel that one."))
    before = _facts(row)
    entered.ends = given.ends
    record(session, caller.name, "maintenance extended", f"maintenance/{number}", before, _facts(row), given.reason)
    publish(session, _change(row, "extended"))
    return row


def _not_over(session: Session, number: int, now: datetime, advice: str) -> MaintenanceRow:
    """Maintenance that runs or is planned; until the transaction ends no other request changes it. Raises `Conflict`."""
    queries.hold_all(session)
    row = queries.maintenance(session, number)
    if row.state(now) in {"over", "cancelled"}:
        ended_by = row.maintenance.ended_by
        by = _("by {name}").format(name=ended_by) if ended_by else _("by itself")
        raise Conflict(
            _("Maintenance {number} ended at {at}, {by}.").format(
                number=number, at=_read(row.maintenance.over_at), by=by
            ),
            advice,
        )
    return row


def _read(at: datetime) -> str:
    return as_read(at, "minutes")


def _facts(row: MaintenanceRow) -> dict[str, Any]:
    entered = row.maintenance
    return {
        "machine": row.machine.key if row.machine else None,
        "begins": entered.begins.isoformat(),
        "ends": entered.ends.isoformat(),
        "stopping_anyway": entered.stopping_anyway,
    }


def _change(row: MaintenanceRow, state: str) -> dict[str, Any]:
    of = {"machine": row.machine.key} if row.machine else {}
    return {"kind": "maintenance", **of, "id": row.maintenance.id, "state": state}
