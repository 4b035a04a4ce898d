"""Which machines there are, and the one lock that orders everything that happens to a machine."""

from collections.abc import Iterable, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.errors import NotFound
from app.machines.tables import Machine, MachineState
from app.web.fields import is_slug
from app.web.i18n import _


def find_machine(session: Session, key: str) -> Machine | None:
    """The machine with this key, if there is one."""
    return session.scalars(select(Machine).where(Machine.key == key)).one_or_none() if is_slug(key) else None


def machine_named(session: Session, key: str) -> Machine:
    """The machine with this key. Raises `NotFound`."""
    found = find_machine(session, key)
    if found is None:
        raise NotFound(
            _("There is no machine {key}.").format(key=repr(key[:64])),
            _("Check the key; GET /api/v1/machines lists them."),
        )
    return found


def machine_of(session: Session, machine_id: int) -> Machine:
    """The machine that something belongs to."""
    return session.get_one(Machine, machine_id)


def key_is_taken(session: Session, key: str) -> bool:
    return session.scalar(select(Machine.id).where(Machine.key == key)) is not None


def machines(session: Session, after: str = "", limit: int = 1000, only: int | None = None) -> Sequence[Machine]:
    """All machines by key; ``only`` this one for the key of a machine."""
    query = select(Machine).where(Machine.key > after).order_by(Machine.key).limit(limit)
    return session.scalars(query if only is None else query.where(Machine.id == only)).all()


def machine_keys_by_id(session: Session) -> dict[int, str]:
    """The keys of all machines by their ids."""
    return {row.id: row.key for row in session.execute(select(Machine.id, Machine.key))}


def lock_machines(session: Session, machine_ids: Iterable[int]) -> dict[int, MachineState]:
    """Hold these machines until the transaction ends, always in the same order, and return their states.

    Whoever changes anything of a machine (readings, corrections, tools, averages, alarms, parameters) does this first.
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
