"""Keys that belong to machines, and the lookup of any key with the machine that it belongs to."""

from collections.abc import Sequence
from typing import cast

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.access.callers import Caller, Role
from app.access.keys import MachineOfKey, revoke_key
from app.access.tables import ApiKey
from app.loop.machines.queries import machine_named
from app.loop.tables.machines import Machine


def caller_of_key(session: Session, secret_hash: bytes) -> Caller | None:
    """The caller with this key; None if there is no such key, or it was revoked."""
    row = session.execute(
        select(ApiKey.id, ApiKey.name, ApiKey.role, ApiKey.machine_id, Machine.key)
        .outerjoin(Machine, Machine.id == ApiKey.machine_id)
        .where(ApiKey.secret_hash == secret_hash, ApiKey.revoked_at.is_(None))
    ).one_or_none()
    if row is None:
        return None
    if row.machine_id is not None:
        name = f"{row.key} (key {row.name})"
        return Caller("machine", name, machine_id=row.machine_id, machine=row.key, key_id=row.id)
    return Caller("key", f"key {row.name}", role=cast("Role", row.role), key_id=row.id)


def machine_keys(session: Session, machine_id: int, after: int = 0, limit: int | None = None) -> Sequence[ApiKey]:
    """The keys of one machine, revoked ones too."""
    return session.scalars(
        select(ApiKey).where(ApiKey.machine_id == machine_id, ApiKey.id > after).order_by(ApiKey.id).limit(limit)
    ).all()


def keys_by_machine(session: Session) -> dict[int, int]:
    """Number of valid keys of each machine, by the machine's id."""
    rows = session.execute(
        select(ApiKey.machine_id, func.count())
        .where(ApiKey.machine_id.is_not(None), ApiKey.revoked_at.is_(None))
        .group_by(ApiKey.machine_id)
    )
    return {machine_id: count for machine_id, count in rows if machine_id is not None}


def revoke_machine_key(session: Session, machine: str, key_id: int, actor: str) -> None:
    """Stop a key of a machine, as `revoke_key` does. Raises `NotFound`."""
    owner = machine_named(session, machine)
    revoke_key(session, key_id, actor, MachineOfKey(owner.id, owner.key))
