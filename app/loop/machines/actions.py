"""Setting up machines."""

from typing import Any

from sqlalchemy import func, literal, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.loop.machines import queries
from app.loop.machines.schemas import MachineChange, MachineIn
from app.loop.tables.machines import Machine, MachineState
from app.loop.tables.tools import AverageMemory, Tool

__all__ = ["MachineChange", "MachineIn", "add_machine", "change_machine"]

MAY_BE_NOTHING = {"corrections_expire_after", "signal_jitter"}


def add_machine(session: Session, machine: MachineIn, actor: str, *, simulated: bool = False) -> Machine:
    """Set up a machine with its empty tool memory (R10) and average memory (R11).

    simulated: it makes its readings up, and can be removed (`app.loop.machines.simulated_actions`). Raises `Conflict` for a key that is taken.
    """
    if queries.key_is_taken(session, machine.key):
        raise Conflict(
            _("There is a machine {key} already.").format(key=repr(machine.key)),
            _("Choose another key, or change the machine that is there."),
            errors=[FieldError("key", _("is taken"))],
        )
    created = Machine(**machine.model_dump(), simulated=simulated)
    session.add(created)
    session.flush()
    session.add(MachineState(machine_id=created.id))
    _add_locations(session, created)
    record(session, actor, "machine added", f"machine/{created.key}", None, machine.model_dump(exclude_defaults=True))
    publish(session, {"kind": "machine", "machine": created.key})
    return created


def _add_locations(session: Session, machine: Machine) -> None:
    """Make the locations of both memories that are not there yet. Those beyond the machine's number stay, out of sight."""
    for table, column, locations in (
        (Tool, Tool.number, machine.tool_locations),
        (AverageMemory, AverageMemory.location, machine.average_locations),
    ):
        numbers = select(literal(machine.id), func.generate_series(1, locations))
        session.execute(insert(table).from_select(["machine_id", column.key], numbers).on_conflict_do_nothing())


def _refuse_fewer(session: Session, machine: Machine, wanted: dict[str, Any]) -> None:
    """A location that is used stays."""
    errors = []
    for name, last in (
        ("tool_locations", queries.last_tool_in_use(session, machine)),
        ("average_locations", queries.last_average_in_use(session, machine)),
    ):
        if wanted.get(name, last) < last:
            errors.append(FieldError(name, _("location {last} is in use; say {last} or more").format(last=last)))
    if errors:
        raise Invalid.of(errors, _("Give the characteristics on it another location first, and set its offset to 0."))


def change_machine(session: Session, key: str, change: MachineChange, actor: str) -> Machine:
    """Give a machine another name, control, type or number of locations. Raises `NotFound`; `Invalid` for another key, or for
    fewer locations than are used.
    """
    machine = queries.machine_named(session, key)
    if change.key not in {None, key}:
        raise Invalid(
            _("The key of a machine cannot be changed, because programs refer to the machine by it."),
            _("Change the name instead, or set up another machine."),
            errors=[FieldError("key", _("cannot be changed"))],
        )
    if machine.simulated and change.name not in {None, machine.name}:
        raise Invalid.at("name", _("The name of a simulated machine says that it is one, so it stays"))
    sent = change.model_dump(exclude={"key"}, exclude_unset=True)
    changes = {name: value for name, value in sent.items() if value is not None or name in MAY_BE_NOTHING}
    before = {name: getattr(machine, name) for name in changes}
    if before == changes:
        return machine
    moves_locations = changes.keys() & {"tool_locations", "average_locations"}
    if moves_locations:
        queries.lock_machines(session, [machine.id])
        _refuse_fewer(session, machine, changes)
    for name, value in changes.items():
        setattr(machine, name, value)
    if moves_locations:
        session.flush()
        _add_locations(session, machine)
    record(session, actor, "machine changed", f"machine/{key}", before, changes)
    publish(session, {"kind": "machine", "machine": key})
    return machine
