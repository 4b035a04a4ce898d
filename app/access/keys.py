"""API keys: adding one, ending one, and the ring that knows their callers without asking each time."""

import asyncio
import logging
import time
import weakref
from collections.abc import Callable
from typing import NamedTuple

from sqlalchemy import event, func, select, text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.access.new_keys import NewKey, digest, insert_key, subject_of
from app.access.tables import ApiKey
from app.db.engine import Database, driver_connection
from app.errors import NotFound
from app.language.i18n import _

CallerOfKey = Callable[[Session, bytes], Caller | None]
KEPT = 1.0
"""Seconds an answer of the database is believed: so long may a key revoked in another process still work."""
NOTED = 60.0
"""Seconds between two notes that a key was used; by each process."""
AHEAD = 0.5
"""Age in seconds from which an answer is renewed in the background, so that a busy key never waits."""

_NO_DISK = text("SELECT set_config('synchronous_commit', 'off', true)")
_USED = text("""
UPDATE api_key SET last_used_at = now()
WHERE id = :id AND revoked_at IS NULL AND (last_used_at IS NULL OR last_used_at < now() - interval '50 seconds')
""")

log = logging.getLogger(__name__)


class MachineOfKey(NamedTuple):
    """A machine whose key it is: its id and its own key, by which people name it."""

    id: int
    key: str


def add_key(session: Session, *, name: str, actor: str, role: str | None = None, machine: str | None = None) -> NewKey:
    """Make a key in the transaction of a session; see `insert_key`."""
    return insert_key(driver_connection(session), name=name, actor=actor, role=role, machine=machine)


def revoke_key(session: Session, key_id: int, actor: str, machine: MachineOfKey | None = None) -> None:
    """Stop a key: in this process at once, in others within a second. Revoking twice is harmless.

    ``machine`` is whose key it must be; None for a key with a role. Raises `NotFound`.
    """
    owner = ApiKey.role.is_not(None) if machine is None else ApiKey.machine_id == machine.id
    key = session.scalars(select(ApiKey).where(ApiKey.id == key_id, owner)).one_or_none()
    if key is None:
        raise NotFound(
            _("There is no key {id} here.").format(id=key_id), _("Look at the list of keys, which names their numbers.")
        )
    if key.revoked_at is None:
        key.revoked_at = session.scalar(select(func.now()))
        session.flush()
        record(
            session, actor, "key revoked", subject_of(machine and machine.key), {"id": key.id, "name": key.name}, None
        )
    keys_changed(session)


class _Known(NamedTuple):
    caller: Caller
    since: float


class KeyRing:
    """The keys that called lately. One per process; used from its event loop only."""

    def __init__(self, database: Database, caller_of_key: CallerOfKey) -> None:
        """caller_of_key: looks a key up by the hash of its secret; None for one that does not exist or was revoked."""
        self._database = database
        self._caller_of_key = caller_of_key
        self._known: dict[bytes, _Known] = {}
        self._renewing: dict[bytes, asyncio.Task[Caller | None]] = {}
        self._generation = 0
        self._noted: dict[int, float] = {}
        self._noting: set[asyncio.Task[None]] = set()
        _rings.add(self)

    async def lookup(self, secret: str) -> Caller | None:
        """Return the caller with this secret; None if it is not known (any more).

        Raises the driver's OperationalError when the database is unreachable and the key has not called within a second.
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
            task.exception()  # seen: anyone who waits for it gets it; a renewal ahead of time just failed quietly

    async def _ask(self, secret_hash: bytes, generation: int) -> Caller | None:
        since = time.monotonic()
        # Not among the threads of requests: when all of these are busy, readings are still let in.
        caller = await asyncio.to_thread(self._read, secret_hash)
        if caller is not None and caller.key_id is not None and since - self._noted.get(caller.key_id, -NOTED) >= NOTED:
            self._note(caller.key_id, since)
        if generation == self._generation:
            if caller is None:
                self._known.pop(secret_hash, None)
            else:
                self._known[secret_hash] = _Known(caller, since)
        return caller

    def _note(self, key_id: int, since: float) -> None:
        """Keep that a key was used, beside the request, which does not wait for it."""
        self._noted[key_id] = since
        task = asyncio.get_running_loop().create_task(asyncio.to_thread(self._write_use, key_id))
        self._noting.add(task)
        task.add_done_callback(self._noting.discard)

    def _write_use(self, key_id: int) -> None:
        try:
            with self._database.begin() as session:
                session.execute(_NO_DISK)
                session.execute(_USED, {"id": key_id})
        except SQLAlchemyError as error:
            log.debug("the last use of key %d was not noted: %s", key_id, error)
            self._noted.pop(key_id, None)

    def _read(self, secret_hash: bytes) -> Caller | None:
        with self._database.begin() as session:
            return self._caller_of_key(session, secret_hash)


_rings: "weakref.WeakSet[KeyRing]" = weakref.WeakSet()


def keys_changed(session: Session) -> None:
    """Make every key ring of this process look again once this session's transaction is committed."""

    @event.listens_for(session, "after_commit", once=True)
    def forget_all(_session: Session) -> None:
        for ring in list(_rings):
            ring.forget()
