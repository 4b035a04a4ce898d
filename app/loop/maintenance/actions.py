"""Putting machines under maintenance, and ending it."""

from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, Invalid, NotAllowed
from app.language.i18n import _
from app.language.numbers import as_read
from app.loop.machines.queries import machine_named
from app.loop.maintenance import queries
from app.loop.maintenance.queries import MaintenanceRow
from app.loop.maintenance.schemas import MaintenanceIn
from app.loop.maintenance.tables import Maintenance

USUAL = timedelta(hours=8)
"""Where no end is entered: a shift. Nobody is left without notifications because an end was forgotten."""
OF_OPERATOR = timedelta(hours=24)
"""By then it is over where an operator has entered it."""
LONGEST, AHEAD = timedelta(days=62), timedelta(days=366)
LATE = timedelta(minutes=1)
"""A beginning that is so long ago counts as now: it was typed to the minute, or by another clock."""


def enter_maintenance(session: Session, given: MaintenanceIn, caller: Caller) -> MaintenanceRow:
    """Say when a machine, or each of them, is under maintenance.

    Raises `NotFound` for the machine; `Invalid` for times that cannot be; `NotAllowed` for what takes an engineer; `Conflict`
    where the same machine is under maintenance at a moment of it already.
    """
    machine = machine_named(session, given.machine) if given.machine else None
    queries.hold_all(session)
    now = datetime.now(UTC)
    begins = given.begins if given.begins is not None and given.begins > now else now
    ends = given.ends or begins + USUAL
    _check(given, begins, ends, now)
    if not caller.may("engineer"):
        _check_operator(given, ends, now)
    other = queries.overlapping(session, machine.id if machine else None, begins, ends)
    if other is not None:
        raise Conflict(
            _("{name}: maintenance {number} from {begins} to {ends} overlaps with it.").format(
                name=other.name, number=other.maintenance.id, begins=_read(other.maintenance.begins),
                ends=_read(other.maintenance.over_at),
            ),
            _("End that one first, or choose another time."),
        )  # fmt: skip
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


def _check(given: MaintenanceIn, begins: datetime, ends: datetime, now: datetime) -> None:
    """Refuse times that cannot be. Raises `Invalid`."""
    if given.begins is not None and given.begins < now - LATE:
        raise Invalid.at("begins", _("lies in the past; leave it out if it begins now"))
    if begins > now + AHEAD:
        raise Invalid.at("begins", _("lies more than a year ahead"))
    if ends <= begins:
        raise Invalid.at("ends", _("must come after {begins}, when it begins").format(begins=_read(begins)))
    if ends - begins > LONGEST:
        raise Invalid.at("ends", _("must come within {n} days").format(n=LONGEST.days))


def _check_operator(given: MaintenanceIn, ends: datetime, now: datetime) -> None:
    """Refuse what takes an engineer. Raises `NotAllowed`."""
    if given.machine is None or not given.stopping_anyway or ends > now + OF_OPERATOR:
        raise NotAllowed(
            _(
                "An operator puts one machine under maintenance that is over within {n} h; alarms that stop it are notified all "
                "the same."
            ).format(n=OF_OPERATOR // timedelta(hours=1)),
            _("Everything beyond takes the role engineer."),
        )


def end(session: Session, number: int, reason: str | None, caller: Caller) -> MaintenanceRow:
    """End maintenance now, or cancel what is planned: then alarms that are still active are announced.

    Raises `NotFound`; `Conflict` for what is over.
    """
    queries.hold_all(session)
    row = queries.maintenance(session, number)
    now, entered = datetime.now(UTC), row.maintenance
    if row.state(now) in {"over", "cancelled"}:
        by = _("by {name}").format(name=entered.ended_by) if entered.ended_by else _("by itself")
        raise Conflict(
            _("Maintenance {number} ended at {at}, {by}.").format(number=number, at=_read(entered.over_at), by=by),
            _("There is nothing left to do."),
        )
    entered.ended_at, entered.ended_by = now, caller.name
    record(session, caller.name, "maintenance ended", f"maintenance/{number}", _facts(row), None, reason)
    publish(session, _change(row, "ended"))
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
