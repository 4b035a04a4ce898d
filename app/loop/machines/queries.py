"""Queries of machines, and the one lock that orders everything that happens to a machine."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from app.access.callers import Caller, Role
from app.errors import NotFound
from app.language.i18n import _
from app.loop.tables.machines import Machine, MachineState
from app.loop.tables.readings import Stream
from app.loop.tables.tools import OPEN, AverageMemory, Correction, Tool
from app.web.fields import is_slug


def find_machine(session: Session, key: str) -> Machine | None:
    """The machine with this key, if there is one."""
    return session.scalars(select(Machine).where(Machine.key == key)).one_or_none() if is_slug(key) else None


def machine_named(session: Session, key: str) -> Machine:
    """The machine with this key. Raises `NotFound`."""
    machine = find_machine(session, key)
    if machine is None:
        raise NotFound(
            _("There is no machine {key}.").format(key=repr(key[:64])),
            _("Check the key; GET /api/v1/machines lists them."),
        )
    return machine


def machine_for(session: Session, caller: Caller, key: str, role: Role) -> Machine:
    """The machine with this key, for its own key or a person with the role. Raises `NotFound`, `NotAllowed`."""
    machine = machine_named(session, key)
    caller.must_at(machine.id, role)
    return machine


def only_machine(session: Session, caller: Caller, key: str | None) -> int | None:
    """The machine to which a list is limited: the one asked for, else the caller's own. Raises as `machine_for` does."""
    return caller.only_machine if key is None else machine_for(session, caller, key, "viewer").id


def machine_of(session: Session, machine_id: int) -> Machine:
    """The machine that something belongs to."""
    return session.get_one(Machine, machine_id)


def key_is_taken(session: Session, key: str) -> bool:
    return session.scalar(select(Machine.id).where(Machine.key == key)) is not None


def machines(session: Session, after: str = "", limit: int | None = None, only: int | None = None) -> Sequence[Machine]:
    """All machines by key; ``only`` this one for the key of a machine."""
    query = select(Machine).where(Machine.key > after).order_by(Machine.key).limit(limit)
    return session.scalars(query if only is None else query.where(Machine.id == only)).all()


def machine_keys_by_id(session: Session) -> dict[int, str]:
    """The keys of all machines by their ids."""
    return {row.id: row.key for row in session.execute(select(Machine.id, Machine.key))}


def hold_machine(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the machine that a route names until the transaction ends (`app.web.etags`)."""
    lock_machines(session, [machine_named(session, given["machine"]).id])


def lock_machines(session: Session, machine_ids: Iterable[int]) -> dict[int, MachineState]:
    """Hold these machines until the transaction ends, always in the same order, and return their states.

    Anyone who changes anything of a machine (readings, corrections, tools, averages, alarms, parameters) does this first.
    It moves the versions of the machines: what the writers of readings remember of them is not true any more.
    """
    states = session.scalars(
        select(MachineState)
        .where(MachineState.machine_id.in_(sorted(set(machine_ids))))
        .order_by(MachineState.machine_id)
        .with_for_update()
        .execution_options(populate_existing=True)
    ).all()
    for state in states:
        state.version += 1
    session.flush()
    return {state.machine_id: state for state in states}


def last_tool_in_use(session: Session, machine: Machine) -> int:
    """The highest location of the tool memory that a characteristic, an offset, a sister tool or an open correction uses; 1
    where there is none.
    """
    changed = or_(Tool.offset != 0, Tool.changed_at.is_not(None))
    return max(
        session.scalar(select(func.max(Stream.tool_memory)).where(Stream.machine_id == machine.id)) or 1,
        session.scalar(select(func.max(Tool.number)).where(Tool.machine_id == machine.id, changed)) or 1,
        session.scalar(select(func.max(Tool.sister)).where(Tool.machine_id == machine.id)) or 1,
        session.scalar(
            select(func.max(Correction.tool_memory)).where(
                Correction.machine_id == machine.id, Correction.status.in_(OPEN)
            )
        )
        or 1,
    )


def last_average_in_use(session: Session, machine: Machine) -> int:
    """The highest location of the average memory that a characteristic or an empirical value uses; 1 where there is none."""
    used = or_(AverageMemory.empirical_value != 0, AverageMemory.average != 0)
    return max(
        session.scalar(select(func.max(Stream.average_memory)).where(Stream.machine_id == machine.id)) or 1,
        session.scalar(select(func.max(AverageMemory.location)).where(AverageMemory.machine_id == machine.id, used))
        or 1,
    )
