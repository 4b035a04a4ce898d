"""The ring that knows keys without asking the database each time."""

import asyncio
import socket
import threading
import time
from contextlib import suppress
from typing import Any

import pytest
from sqlalchemy import text
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from app.access import actions
from app.access.keys import KEPT, KeyRing, MachineOfKey
from app.access.new_keys import digest
from app.db.engine import Database
from app.errors import NotFound
from app.loop.machines.keys import caller_of_key
from app.loop.tables.machines import Machine
from app.main import create_plant
from app.settings import Settings
from tests.loops import run


@pytest.fixture
def secret(database: Database) -> str:
    with database.begin() as session:
        return actions.add_key(session, name="night report", role="viewer", actor="tests").secret


def test_a_known_key_costs_no_query_and_an_unknown_one_is_nobody(database: Database, secret: str) -> None:
    async def look() -> None:
        ring = KeyRing(database, caller_of_key)
        first = await ring.lookup(secret)
        assert first is not None
        assert (first.kind, first.role, first.name) == ("key", "viewer", "key night report")
        ring._read = None  # type: ignore[method-assign, assignment]
        assert await ring.lookup(secret) is first
        assert await KeyRing(database, caller_of_key).lookup(secret + "x") is None

    run(look())


def test_many_callers_at_once_ask_once(database: Database, secret: str) -> None:
    async def look() -> int:
        ring, asked = KeyRing(database, caller_of_key), 0
        read = ring._read

        def counting(secret_hash: bytes) -> object:
            nonlocal asked
            asked += 1
            return read(secret_hash)

        ring._read = counting  # type: ignore[method-assign, assignment]
        await asyncio.gather(*(ring.lookup(secret) for _ in range(64)))
        return asked

    assert run(look()) == 1


def test_revoked_here_at_once_and_elsewhere_within_a_second(database: Database, secret: str) -> None:
    async def look() -> None:
        ring = KeyRing(database, caller_of_key)
        caller = await ring.lookup(secret)
        assert caller is not None
        assert caller.key_id is not None
        elsewhere = KeyRing(database, caller_of_key)
        elsewhere.forget = lambda: None  # type: ignore[method-assign] # as if in another process: it is not told
        await elsewhere.lookup(secret)
        with database.begin() as session:
            actions.revoke_key(session, caller.key_id, "tests")
            assert await ring.lookup(secret) is caller, "not yet: the revocation is not committed"
        assert await ring.lookup(secret) is None
        forgotten = time.monotonic() + KEPT
        while time.monotonic() < forgotten:
            await elsewhere.lookup(secret)
            await asyncio.sleep(0.01)
        assert await elsewhere.lookup(secret) is None

    run(look())


def test_a_key_is_revoked_by_whose_it_is(session: Session) -> None:
    """Who may revoke the keys of a machine may not revoke one with a role, nor the key of another machine."""
    lathe, mill = (Machine(key=key, name=key, control="other") for key in ("lathe-1", "mill-1"))
    session.add_all([lathe, mill])
    session.flush()
    of_role = actions.add_key(session, name="night report", role="admin", actor="tests")
    of_lathe = actions.add_key(session, name="cell", machine="lathe-1", actor="tests")
    for key, owner in ((of_role, lathe), (of_lathe, mill), (of_lathe, None)):
        with pytest.raises(NotFound):
            actions.revoke_key(session, key.id, "tests", None if owner is None else MachineOfKey(owner.id, owner.key))
        assert caller_of_key(session, digest(key.secret)) is not None
    actions.revoke_key(session, of_role.id, "tests")
    actions.revoke_key(session, of_lathe.id, "tests", MachineOfKey(lathe.id, lathe.key))
    for key in (of_role, of_lathe):
        assert caller_of_key(session, digest(key.secret)) is None


def test_without_a_database_a_key_is_not_taken_for_unknown(secret: str) -> None:
    away = Database("postgresql://nobody@127.0.0.1:9/nothing")
    with pytest.raises(OperationalError):
        run(KeyRing(away, caller_of_key).lookup(secret))
    away.close()


def test_of_many_keys_none_waits_for_another_while_the_database_hangs() -> None:
    """One that takes a second to hang up: whoever waits for a connection of somebody else waits thirty."""

    def hang_up() -> None:
        with suppress(OSError):
            while True:
                threading.Timer(1, silent.accept()[0].close).start()

    async def look() -> list[Any]:
        return await asyncio.gather(*(door.lookup(f"inband_{n}") for n in range(5)), return_exceptions=True)

    with socket.create_server(("127.0.0.1", 0)) as silent:
        threading.Thread(target=hang_up, daemon=True).start()
        where = f"postgresql://nobody@127.0.0.1:{silent.getsockname()[1]}/none?sslmode=disable&gssencmode=disable"
        door: Any = create_plant(Settings(database_url=where)).asgi
        while not hasattr(door, "lookup"):
            door = door.app
        assert {type(answer) for answer in run(look())} == {OperationalError}, "not the error of a pool that is empty"
        silent.shutdown(socket.SHUT_RDWR)


def test_the_last_use_is_noted_beside_the_request_once_a_minute(database: Database, secret: str) -> None:
    async def use() -> None:
        ring = KeyRing(database, caller_of_key)
        await ring.lookup(secret)
        await asyncio.gather(*ring._noting)
        ring.forget()
        await ring.lookup(secret)
        assert not ring._noting, "noted a moment ago"

    with database.begin() as session:
        assert session.scalar(text("SELECT last_used_at FROM api_key")) is None
    run(use())
    with database.begin() as session:
        assert session.scalar(text("SELECT now() - last_used_at < interval '1 minute' FROM api_key")) is True
        session.execute(text("UPDATE api_key SET last_used_at = now() - interval '1 hour', revoked_at = now()"))
    ring = KeyRing(database, caller_of_key)
    ring._write_use(1)
    with database.begin() as session:
        assert session.scalar(text("SELECT now() - last_used_at > interval '59 minutes' FROM api_key")) is True
