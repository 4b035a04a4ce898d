"""A simulated machine, for trying an empty plant: set up in one go, and removed again with everything that it has left.

What a real machine has measured stays. Of a simulated one nothing is a fact, so it alone goes, and the record of changes says so. The
triggers that protect facts are left out of that one transaction, which only a superuser of the database can do: where the server has
a role of its own, and where the tables lie on several nodes, no simulated machine is offered.
"""

from typing import Any

from sqlalchemy import delete, func, literal, select, text
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.keys import keys_changed
from app.db.base import Base
from app.db.events import publish
from app.errors import Conflict, NotFound
from app.language.i18n import _
from app.loop.machines import actions, queries
from app.loop.machines.schemas import MachineIn
from app.loop.tables.machines import Machine

_MAY_GO = text("""
SELECT current_setting('is_superuser')::bool AND NOT EXISTS (SELECT FROM pg_extension WHERE extname = 'citus')
""")
_ALONE = text("LOCK TABLE machine IN SHARE ROW EXCLUSIVE MODE")
_HELD = text("SELECT FROM machine WHERE id = :id FOR UPDATE")


def simulated_machine(session: Session) -> Machine | None:
    """The simulated machine, if there is one."""
    return session.scalars(select(Machine).where(Machine.simulated)).first()


def may_be_removed(session: Session) -> bool:
    """Tell if a simulated machine could be removed from this database."""
    return bool(session.scalar(_MAY_GO))


def add_simulated_machine(session: Session, machine: MachineIn, actor: str) -> Machine:
    """Set up a simulated machine on an empty plant. Raises `Conflict` where there is a machine, or it could not be removed."""
    session.execute(_ALONE)  # of two at once, the second finds the machine of the first
    if queries.machines(session, limit=1):
        raise Conflict(
            _("A simulated machine is for an empty plant, and this one has a machine."),
            _("Try it on a server of its own: inband demo --data-dir FOLDER."),
        )
    if not may_be_removed(session):
        raise Conflict(
            _("A simulated machine could not be removed again from this database, so none is set up."),
            _("Try it on a server of its own: inband demo --data-dir FOLDER."),
        )
    return actions.add_machine(session, machine, actor, simulated=True)


def remove_simulated_machine(session: Session, actor: str) -> dict[str, int]:
    """Remove the simulated machine with its characteristics, readings, corrections, alarms and keys.

    Return the number of rows that went, by table. Raises `NotFound` where there is none, `Conflict` where it cannot be done.
    """
    machine = simulated_machine(session)
    if machine is None:
        raise NotFound(_("There is no simulated machine."), _("The plant's page shows the machines that there are."))
    if not may_be_removed(session):
        raise Conflict(_("The role that serves may not remove anything."), _("A superuser of the database may."))
    queries.lock_machines(session, [machine.id])
    key, name, machine_id = machine.key, machine.name, machine.id
    session.execute(
        _HELD, {"id": machine_id}
    )  # what refers to it alone, such as a note, waits, and then finds no machine
    session.execute(text("SET LOCAL session_replication_role = replica"))  # without triggers, which keep facts
    gone = {}
    for of in Base.metadata.sorted_tables:  # those of Inband, not all that a database may hold beside them
        if "machine_id" in of.c:
            removed = of.delete().where(of.c.machine_id == machine_id).returning(literal(1).label("one")).cte()
            gone[of.name] = session.scalar(select(func.count()).select_from(removed)) or 0
    session.execute(delete(Machine).where(Machine.id == machine_id).execution_options(synchronize_session=False))
    session.execute(text("SET LOCAL session_replication_role = origin"))
    session.expunge(machine)
    before: dict[str, Any] = {"name": name} | {name: count for name, count in gone.items() if count}
    record(session, actor, "simulated machine removed", f"machine/{key}", before, None)
    publish(session, {"kind": "machine", "machine": key})
    keys_changed(session)
    return gone
