"""Characteristics and the versions of their parameters. Never writes."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, Float, Integer, func, select
from sqlalchemy.orm import Session, aliased

from app.access.callers import Caller, Role
from app.core.parameters import Parameters
from app.db.text import holds_words
from app.errors import NotFound
from app.language.i18n import _
from app.loop.machines.queries import lock_machines
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.connections import Connection
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import Tool
from app.web.fields import is_slug


class CurrentCharacteristic(NamedTuple):
    """A characteristic as it is now. mapped: what the machine's bridge may write to; None without a bridge.

    source: the key of the characteristic whose form it is; None for all others. carries_decisions: whether the bridge brings `stop`
    and `hold` to the control; None without one that says so.
    """

    characteristic: Characteristic
    machine: Machine
    version: ParametersVersion
    mapped: Sequence[Mapping[str, Any]] | None = None
    source: str | None = None
    carries_decisions: bool | None = None

    @property
    def parameters(self) -> Parameters:
        return Parameters.from_dict(self.version.parameters)


_Source = aliased(Characteristic)
_CURRENT = (
    select(Characteristic, Machine, ParametersVersion, Connection.locations, _Source.key, Connection.carries_decisions)
    .join(Machine, Machine.id == Characteristic.machine_id)
    .outerjoin(_Source, (_Source.machine_id == Characteristic.machine_id) & (_Source.id == Characteristic.form_of))
    .outerjoin(Connection, Connection.machine_id == Machine.id)
    .join(Stream, (Stream.machine_id == Characteristic.machine_id) & (Stream.characteristic_id == Characteristic.id))
    .join(
        ParametersVersion,
        (ParametersVersion.machine_id == Stream.machine_id)
        & (ParametersVersion.characteristic_id == Stream.characteristic_id)
        & (ParametersVersion.version == Stream.parameters_version),
    )
)


def characteristic_named(session: Session, key: str) -> CurrentCharacteristic:
    """The characteristic with this key. Raises `NotFound`."""
    current = found(session, key)
    if current is None:
        raise NotFound(
            _("There is no characteristic {key}.").format(key=repr(key[:64])),
            _("Check the key; GET /api/v1/characteristics lists them."),
        )
    return current


def found(session: Session, key: str) -> CurrentCharacteristic | None:
    """The characteristic with this key, if there is one."""
    row = session.execute(_CURRENT.where(Characteristic.key == key)).one_or_none() if is_slug(key) else None
    return None if row is None else CurrentCharacteristic(*row)


def forms(session: Session, characteristic: Characteristic) -> list[CurrentCharacteristic]:
    """The characteristics whose readings are results of this one's, in the order they were set up."""
    of_it = _CURRENT.where(
        Characteristic.machine_id == characteristic.machine_id, Characteristic.form_of == characteristic.id
    )
    return [CurrentCharacteristic(*row) for row in session.execute(of_it.order_by(Characteristic.id))]


def hold_characteristic(session: Session, given: Mapping[str, Any]) -> None:
    """Hold the machine of the characteristic that a route names until the transaction ends (`app.web.etags`)."""
    lock_machines(session, [characteristic_named(session, given["characteristic"]).machine.id])


def characteristic_for(session: Session, caller: Caller, key: str, role: Role) -> CurrentCharacteristic:
    """The characteristic with this key, for the key of its machine or a person with the role.

    Raises `NotFound`, `NotAllowed`.
    """
    current = characteristic_named(session, key)
    caller.must_at(current.machine.id, role)
    return current


def correcting(session: Session, machine_id: int, tool_memory: int) -> list[CurrentCharacteristic]:
    """The characteristics that correct the offset of this tool, by key."""
    on_it = _CURRENT.where(Stream.machine_id == machine_id, Stream.tool_memory == tool_memory)
    rows = session.execute(on_it.order_by(Characteristic.key))
    return [each for row in rows if not (each := CurrentCharacteristic(*row)).parameters.measures_only]


def key_is_taken(session: Session, key: str) -> bool:
    return session.scalar(select(Characteristic.id).where(Characteristic.key == key)) is not None


_IN_FORCE = ParametersVersion.parameters
ORDERS: dict[str, ColumnElement[Any]] = {
    "key": Characteristic.key.expression,
    "name": func.lower(Characteristic.name),
    "machine": func.lower(Machine.name),
    "part": func.lower(Characteristic.part),
    "target": _IN_FORCE["target"].astext.cast(Float),
    "tolerance": _IN_FORCE["tolerance_width"].astext.cast(Float),
    "tool": _IN_FORCE["tool_memory"].astext.cast(Integer),
    "mode": _IN_FORCE["mode"].astext,
    "version": ParametersVersion.version.expression,
}
"""What lists of characteristics are sorted by."""


def characteristics(
    session: Session,
    *,
    machine_id: int | None = None,
    named: str = "",
    after: str = "",
    by: str = "key",
    skip: int = 0,
    limit: int | None = None,
) -> list[CurrentCharacteristic]:
    """Characteristics of one machine or of all, by key or by another one of `ORDERS`, the largest first after a minus.

    `named`: those in whose name, key, part or machine these words are found.
    """
    order = ORDERS[by.removeprefix("-")]
    query = _CURRENT.where(Characteristic.key > after).offset(skip).limit(limit)
    query = query.order_by(order.desc().nulls_last() if by.startswith("-") else order.nulls_last(), Characteristic.key)
    names = (Characteristic.name, Characteristic.key, Characteristic.part, Machine.name, Machine.key)
    query = query.where(*holds_words(named, *names))
    if machine_id is not None:
        query = query.where(Characteristic.machine_id == machine_id)
    return [CurrentCharacteristic(*row) for row in session.execute(query)]


def versions(
    session: Session, characteristic: Characteristic, *, before: int | None = None, limit: int | None = None
) -> Sequence[ParametersVersion]:
    """The versions of its parameters, newest first."""
    query = (
        select(ParametersVersion)
        .where(
            ParametersVersion.machine_id == characteristic.machine_id,
            ParametersVersion.characteristic_id == characteristic.id,
        )
        .order_by(ParametersVersion.version.desc())
        .limit(limit)
    )
    return session.scalars(query if before is None else query.where(ParametersVersion.version < before)).all()


def target_before(session: Session, current: CurrentCharacteristic) -> float | None:
    """Return the target of the version before the one in force, mm; None of the first."""
    number = current.version.version - 1
    before = session.get(ParametersVersion, (current.machine.id, current.characteristic.id, number))
    return None if before is None else Parameters.from_dict(before.parameters).target


def parameters_of(session: Session, machine_id: int, characteristic_id: int, version: int) -> Parameters:
    """The parameters that a reading was judged by. Asked for once per session, for they never change."""
    book: dict[tuple[int, int, int], Parameters] = session.info.setdefault("parameters", {})
    key = (machine_id, characteristic_id, version)
    if key not in book:
        book[key] = Parameters.from_dict(
            session.scalars(
                select(ParametersVersion.parameters).where(
                    ParametersVersion.machine_id == machine_id,
                    ParametersVersion.characteristic_id == characteristic_id,
                    ParametersVersion.version == version,
                )
            ).one()
        )
    return book[key]


def parts_cut(session: Session, machine_id: int, number: int) -> int:
    """Return the parts cut with the tool in this location since it was changed."""
    counted = select(func.max(Stream.sequence - Stream.sequence_at_tool_change)).where(
        Stream.machine_id == machine_id, Stream.tool_memory == number
    )
    earlier = select(Tool.parts_kept).where(Tool.machine_id == machine_id, Tool.number == number)
    return (session.scalar(counted) or 0) + (session.scalar(earlier) or 0)
