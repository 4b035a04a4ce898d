"""Maintenance of machines: running, planned, over. Never writes."""

from collections.abc import Iterable
from datetime import UTC, datetime
from typing import Literal, NamedTuple

from sqlalchemy import ColumnElement, func, or_, select, text
from sqlalchemy.orm import Session

from app.core import notify
from app.errors import NotFound
from app.language.i18n import _
from app.loop.maintenance.tables import Maintenance
from app.loop.tables.machines import Machine

State = Literal["planned", "running", "over", "cancelled"]
OVER_AT = func.coalesce(Maintenance.ended_at, Maintenance.ends)
_HOLD = text("SELECT pg_advisory_xact_lock(7291, 'maintenance'::regclass::oid::int4)")


class MaintenanceRow(NamedTuple):
    """Maintenance, and its machine; None: of all machines."""

    maintenance: Maintenance
    machine: Machine | None

    @property
    def name(self) -> str:
        """The name of what is under maintenance."""
        return _("All machines") if self.machine is None else self.machine.name

    def state(self, now: datetime) -> State:
        """Its state at a moment; cancelled: ended before it began."""
        row = self.maintenance
        if row.ended_at is not None and row.ended_at <= row.begins:
            return "cancelled"
        if row.over_at <= now:
            return "over"
        return "running" if row.begins <= now else "planned"


_ROWS = select(Maintenance, Machine).outerjoin(Machine, Machine.id == Maintenance.machine_id)


def hold_all(session: Session) -> None:
    """Wait until no other request enters, extends or ends maintenance, and keep it so until the transaction ends."""
    session.execute(_HOLD)


def maintenance(session: Session, number: int) -> MaintenanceRow:
    """Maintenance by its number. Raises `NotFound`."""
    row = session.execute(_ROWS.where(Maintenance.id == number).execution_options(populate_existing=True)).one_or_none()
    if row is None:
        raise NotFound(
            _("There is no maintenance {number}.").format(number=number),
            _("Check it; GET /api/v1/maintenance lists all."),
        )
    return MaintenanceRow(*row)


def _of(machine_id: int) -> ColumnElement[bool]:
    """The maintenance of a machine, that of all machines included."""
    return or_(Maintenance.machine_id == machine_id, Maintenance.machine_id.is_(None))


def all_maintenance(
    session: Session,
    *,
    machine_id: int | None = None,
    ahead: bool = False,
    before: int | None = None,
    limit: int = 100,
) -> list[MaintenanceRow]:
    """Maintenance, the last entered first. ahead: only what runs or is planned."""
    query = _ROWS.order_by(Maintenance.id.desc()).limit(limit)
    if machine_id is not None:
        query = query.where(_of(machine_id))
    if ahead:
        query = query.where(datetime.now(UTC) < OVER_AT)
    if before is not None:
        query = query.where(Maintenance.id < before)
    return [MaintenanceRow(*row) for row in session.execute(query)]


def running(session: Session, now: datetime, machine_id: int | None = None) -> list[MaintenanceRow]:
    """Maintenance that runs, of a machine or of any."""
    query = _ROWS.where(Maintenance.begins <= now, now < OVER_AT).order_by(OVER_AT.desc())
    return [
        MaintenanceRow(*row) for row in session.execute(query if machine_id is None else query.where(_of(machine_id)))
    ]


def overlapping(session: Session, machine_id: int | None, begins: datetime, ends: datetime) -> MaintenanceRow | None:
    """Maintenance of the same machine, or of all machines as well, with a moment in common; None: there is none."""
    same = Maintenance.machine_id.is_not_distinct_from(machine_id)
    row = session.execute(_ROWS.where(same, Maintenance.begins < ends, begins < OVER_AT).limit(1)).one_or_none()
    return None if row is None else MaintenanceRow(*row)


def withheld_since(session: Session, moments: Iterable[datetime]) -> list[notify.Maintenance]:
    """Maintenance that is not over, or was not at the first of these moments, as the core reads it."""
    first = min(moments, default=None)
    if first is None:
        return []
    columns = (Machine.key, Maintenance.begins, OVER_AT, Maintenance.stopping_anyway)
    query = select(*columns).select_from(Maintenance).outerjoin(Machine, Machine.id == Maintenance.machine_id)
    return [
        notify.Maintenance(*row) for row in session.execute(query.where(first < OVER_AT, Maintenance.begins < OVER_AT))
    ]
