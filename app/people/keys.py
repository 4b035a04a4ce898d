"""API keys: the secrets that machines and programs call with, and the ring that knows them without asking each time.

A secret is 256 random bits, so its plain SHA-256 is as good as unguessable and the table holds no secret.
"""

import asyncio
import hashlib
import secrets
import time
import weakref
from typing import NamedTuple, cast

from sqlalchemy import event, func, select
from sqlalchemy.orm import Session

from app.audit.actions import record
from app.db.engine import Database
from app.errors import NotFound
from app.machines.tables import Machine
from app.people.callers import Caller, Role
from app.people.tables import ROLES, ApiKey
from app.web.fields import Text200
from app.web.i18n import _
from app.web.validation import checked

PREFIX = "inband_"
"""Makes a leaked key recognisable to people and scanners."""
KEPT = 1.0
"""Seconds an answer of the database is believed: so long may a key revoked in another process still work."""
AHEAD = 0.5
"""Age in seconds from which an answer is renewed in the background, so that a busy key never waits."""


def new_secret() -> str:
    """A secret nobody has had before."""
    return PREFIX + secrets.token_urlsafe(32)


def digest(secret: str) -> bytes:
    """What of a secret is stored."""
    return hashlib.sha256(secret.encode("utf-8", "surrogatepass")).digest()


def caller_of_key(session: Session, secret_hash: bytes) -> Caller | None:
    """Who calls with this key; None if there is no such key, or not any more."""
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


class NewKey(NamedTuple):
    """A key just made; the secret is told this once."""

    id: int
    secret: str


def add_key(session: Session, *, name: str, actor: str, role: str | None = None, machine: str | None = None) -> NewKey:
    """Make a key with a role, or one of a machine (named by its key).

    Raises `Invalid` for a name that cannot be used, `NotFound` for a machine that is not there.
    """
    name = checked(Text200, name, "name")
    if (role is None) == (machine is None) or role not in {None, *ROLES}:
        raise ValueError("a key has either a role or a machine")
    machine_id = None
    if machine is not None:
        machine_id = session.scalar(select(Machine.id).where(Machine.key == machine))
        if machine_id is None:
            raise NotFound(
                _("There is no machine {key}.").format(key=repr(machine)), _("GET /api/v1/machines lists them.")
            )
    secret = new_secret()
    key = ApiKey(secret_hash=digest(secret), name=name, role=role, machine_id=machine_id)
    session.add(key)
    session.flush()
    after = {"id": key.id, "name": name} | ({"role": role} if role else {})
    record(session, actor, "key made", _subject(machine), None, after)
    return NewKey(key.id, secret)


def revoke_key(session: Session, key_id: int, actor: str, machine: str | None = None) -> None:
    """A key stops working: in this process at once, in others within a second. Revoking twice is harmless.

    ``machine`` is whose key it must be; None for a key with a role. Raises `NotFound`.
    """
    owner = ApiKey.role.is_not(None) if machine is None else Machine.key == machine
    key = session.scalars(
        select(ApiKey).outerjoin(Machine, Machine.id == ApiKey.machine_id).where(ApiKey.id == key_id, owner)
    ).one_or_none()
    if key is None:
        raise NotFound(
            _("There is no key {id} here.").format(id=key_id), _("Look at the list of keys, which names their numbers.")
        )
    if key.revoked_at is None:
        key.revoked_at = session.scalar(select(func.now()))
        session.flush()
        record(session, actor, "key revoked", _subject(machine), {"id": key.id, "name": key.name}, None)
    keys_changed(session)


def _subject(machine: str | None) -> str:
    return "people" if machine is None else f"machine/{machine}"


class _Known(NamedTuple):
    caller: Caller
    since: float


class KeyRing:
    """The keys that called lately. One per process; used from its event loop only."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._known: dict[bytes, _Known] = {}
        self._renewing: dict[bytes, asyncio.Task[Caller | None]] = {}
        self._generation = 0
        _rings.add(self)

    async def lookup(self, secret: str) -> Caller | None:
        """Who calls with this secret; None if it is not known (any more).

        Raises the driver's OperationalError when the database is away and the key has not called within a second.
        """
        secret_hash = digest(secret)
        known = self._known.get(secret_hash)
        if known is not None:
            age = time.monotonic() - known.since
            if age < AHEAD:
                return known.caller
            if age < KEPT:
                self._renew(secret_hash)
                return known.caller
        return await asyncio.shield(self._renew(secret_hash))

    def forget(self) -> None:
        """Ask the database again for every key: one was revoked just now."""
        self._generation += 1
        self._known.clear()
        self._renewing.clear()

    def _renew(self, secret_hash: bytes) -> "asyncio.Task[Caller | None]":
        task = self._renewing.get(secret_hash)
        if task is None:
            task = asyncio.get_running_loop().create_task(self._ask(secret_hash, self._generation))
            self._renewing[secret_hash] = task
            task.add_done_callback(lambda done: self._renewed(secret_hash, done))
        return task

    def _renewed(self, secret_hash: bytes, task: "asyncio.Task[Caller | None]") -> None:
        if self._renewing.get(secret_hash) is task:
            del self._renewing[secret_hash]
        if not task.cancelled():
            task.exception()  # seen: whoever waits for it gets it; a renewal ahead of time just failed quietly

    async def _ask(self, secret_hash: bytes, generation: int) -> Caller | None:
        asked = time.monotonic()
        # Not among the threads of requests: when all of these are busy, readings are still let in.
        caller = await asyncio.to_thread(self._read, secret_hash)
        if generation == self._generation:
            if caller is None:
                self._known.pop(secret_hash, None)
            else:
                self._known[secret_hash] = _Known(caller, asked)
        return caller

    def _read(self, secret_hash: bytes) -> Caller | None:
        with self._database.begin() as session:
            return caller_of_key(session, secret_hash)


_rings: "weakref.WeakSet[KeyRing]" = weakref.WeakSet()


def keys_changed(session: Session) -> None:
    """When this session's transaction has been committed, no ring of this process believes what it knew before."""

    @event.listens_for(session, "after_commit", once=True)
    def forget_all(_session: Session) -> None:
        for ring in list(_rings):
            ring.forget()
