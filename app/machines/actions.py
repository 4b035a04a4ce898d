"""Setting up machines."""

from sqlalchemy import func, insert, literal, select
from sqlalchemy.orm import Session

from app.audit.actions import record
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.machines import queries
from app.machines.schemas import MachineChange, MachineIn
from app.machines.tables import Machine, MachineState
from app.offsets.tables import AverageMemory, Tool
from app.web.i18n import _

__all__ = ["MachineChange", "MachineIn", "add_machine", "change_machine"]

TOOL_LOCATIONS = 32
AVERAGE_LOCATIONS = 20
MAY_BE_NOTHING = {"corrections_expire_after", "signal_jitter"}


def add_machine(session: Session, machine: MachineIn, actor: str) -> Machine:
    """Set up a machine with its empty tool memory (R10 = 1-32) and average memory (R11 = 1-20).

    Raises `Conflict` for a key that is taken.
    """
    if queries.key_is_taken(session, machine.key):
        raise Conflict(
            _("There is a machine {key} already.").format(key=repr(machine.key)),
            _("Choose another key, or change the machine that is there."),
            errors=[FieldError("key", _("is taken"))],
        )
    made = Machine(**machine.model_dump())
    session.add(made)
    session.flush()
    session.add(MachineState(machine_id=made.id))
    for table, column, locations in (
        (Tool, Tool.number, TOOL_LOCATIONS),
        (AverageMemory, AverageMemory.location, AVERAGE_LOCATIONS),
    ):
        numbers = select(literal(made.id), func.generate_series(1, locations))
        session.execute(insert(table).from_select(["machine_id", column.key], numbers))
    record(session, actor, "machine added", f"machine/{made.key}", None, machine.model_dump(exclude_defaults=True))
    publish(session, {"kind": "machine", "machine": made.key})
    return made


def change_machine(session: Session, key: str, change: MachineChange, actor: str) -> Machine:
    """Give a machine another name or control. Raises `NotFound`; `Invalid` for another key."""
    machine = queries.machine_named(session, key)
    if change.key not in {None, key}:
        raise Invalid(
            _("The key of a machine stays for good, because programs call the machine by it."),
            _("Change the name instead, or set up another machine."),
            errors=[FieldError("key", _("cannot be changed"))],
        )
    said = change.model_dump(exclude={"key"}, exclude_unset=True)
    wanted = {name: value for name, value in said.items() if value is not None or name in MAY_BE_NOTHING}
    before = {name: getattr(machine, name) for name in wanted}
    if before == wanted:
        return machine
    for name, value in wanted.items():
        setattr(machine, name, value)
    record(session, actor, "machine changed", f"machine/{key}", before, wanted)
    publish(session, {"kind": "machine", "machine": key})
    return machine
