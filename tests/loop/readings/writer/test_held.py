"""Other work holds a machine for long: its readings wait or are refused, with a true sentence; everybody else goes on."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from time import monotonic
from typing import Any

import psycopg
import pytest
from starlette.requests import Request

from app.cli.base import explain
from app.db.connections import Connections
from app.db.engine import Database
from app.errors import Busy, OutcomeUnknown
from app.loop.characteristics import actions as characteristics
from app.loop.characteristics.schemas import CharacteristicIn
from app.loop.machines import actions as machines
from app.loop.machines.schemas import MachineIn
from app.loop.readings import queries
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.group_commit import MOST_QUEUES, Writer
from app.loop.readings.writer.pending import Stored, Verdict
from app.loop.readings.writer.retry import ReadingStore
from app.loop.readings.writer.transaction import CommitLost
from app.web.problems import unforeseen
from tests.loop.readings.record import rows
from tests.loop.readings.writer.test_broken import until
from tests.loops import run
from tests.shop import PARAMETERS

LONG, SHORT = (
    60.0,
    1.0,
)  # s of patience: where somebody gets what he waits for, however slow the computer is, and where not
WAITING = "SELECT 1 FROM pg_stat_activity WHERE datname = current_database() AND wait_event_type = 'Lock'"
EVENTS = "SELECT pg_advisory_xact_lock(7291, 'event'::regclass::oid::int4)"


def plant(database: Database, count: int = 2) -> list[Entry]:
    """So many machines, each with a characteristic."""
    with database.begin() as session:
        for number in range(count):
            machines.add_machine(session, MachineIn(key=f"lathe-{number}", name="Lathe", control="sinumerik"), "tests")
            added = CharacteristicIn(
                key=f"shaft-{number}", name="Seat", machine=f"lathe-{number}", parameters=dict(PARAMETERS)
            )
            characteristics.add_characteristic(session, added, "tests")
        found = [queries.entry_of(session, f"shaft-{number}") for number in range(count)]
    return [entry for entry in found if entry is not None]


def with_patience(database: Database, seconds: float) -> Database:
    return Database(database.dsn, pool_size=1, connections=Connections(database.dsn, seconds))


def waits(writer: Writer, seconds: float) -> None:
    """Readings from now on are waited for so long."""
    writer._patience = writer._store.connection.patience = seconds


@asynccontextmanager
async def writing(database: Database) -> AsyncIterator[Writer]:
    own = with_patience(database, LONG)
    writer = Writer(own)
    writer.start()
    yield writer
    await writer.stop()
    own.close()


def reading(entry: Entry, key: str) -> tuple[Entry, ReadingIn]:
    return entry, ReadingIn(characteristic=entry.characteristic, measured=40.0, key=key)


def sequence(outcome: object) -> int:
    assert isinstance(outcome, Verdict | Stored), outcome
    return outcome.sequence


async def holding(dsn: str, *entries: Entry) -> psycopg.AsyncConnection[Any]:
    """Another session, which has changed something of these machines and has not committed yet."""
    connection = await psycopg.AsyncConnection.connect(dsn)
    ids = [entry.machine_id for entry in entries]
    await connection.execute("SELECT 1 FROM machine_state WHERE machine_id = ANY(%s) FOR UPDATE", [ids])
    return connection


async def come_to(condition: Callable[[], Any]) -> None:
    await asyncio.to_thread(until, condition)


def keys(database: Database, entry: Entry) -> list[str]:
    query = "SELECT key FROM reading WHERE characteristic_id = %s ORDER BY sequence"
    return [key for (key,) in rows(database.dsn, query, entry.characteristic_id)]


def test_the_others_go_on_and_the_held_one_learns_the_truth(database: Database) -> None:
    one, other = plant(database)

    async def go() -> None:
        async with writing(database) as writer:
            await asyncio.gather(*(writer.submit(*reading(each, "0")) for each in (one, other)))
            connection = await holding(database.dsn, one)
            waits(writer, SHORT)
            refused = await writer.submit(*reading(one, "1"))
            assert isinstance(refused, Busy), refused
            assert (refused.status, refused.kind, refused.retry_after) == (503, "busy", 2)
            assert refused.detail.startswith("Other work has held the machine lathe-0 for longer")
            waits(writer, LONG)
            behind = [writer.submit(*reading(one, str(number))) for number in (1, 2, 3)]
            await come_to(lambda: rows(database.dsn, WAITING))
            for number in range(1, 31):
                assert isinstance(await writer.submit(*reading(other, str(number))), Verdict)
            assert not any(outcome.done() for outcome in behind), "the others have waited for it"
            assert keys(database, one) == ["0"], "it was said that nothing was stored"
            await connection.close()
            assert [sequence(outcome) for outcome in await asyncio.gather(*behind)] == [2, 3, 4]
            again = writer.submit(*reading(one, "3"))
            assert sequence(await again) == 4
            await come_to(lambda: not writer._held)
            assert sequence(await writer.submit(*reading(one, "4"))) == 5

    run(go())
    assert keys(database, one) == ["0", "1", "2", "3", "4"]
    assert keys(database, other) == [str(number) for number in range(31)]


def test_what_waits_when_the_writer_ends_is_stored(database: Database) -> None:
    (one,) = plant(database, 1)

    async def go() -> None:
        async with writing(database) as writer:
            connection = await holding(database.dsn, one)
            outcomes = [writer.submit(*reading(one, str(number))) for number in range(3)]
            await come_to(lambda: writer._held)
            ending = asyncio.ensure_future(writer.stop())
            await connection.close()
            await ending
            assert all(isinstance(outcome.result(), Verdict) for outcome in outcomes)

    run(go())
    assert keys(database, one) == ["0", "1", "2"]


def test_more_held_machines_than_are_waited_for_are_refused_at_once(database: Database) -> None:
    *held, other = plant(database, MOST_QUEUES + 3)

    async def go() -> None:
        async with writing(database) as writer:
            connection = await holding(database.dsn, *held)
            outcomes = [writer.submit(*reading(entry, "k")) for entry in held]
            done, waiting = await asyncio.wait(outcomes, return_when=asyncio.FIRST_COMPLETED)
            assert (len(done), len(waiting)) == (2, MOST_QUEUES)
            assert isinstance(await writer.submit(*reading(other, "k")), Verdict)
            await connection.close()
            await asyncio.wait(waiting)
            assert [type(outcome.result()) for outcome in outcomes].count(Busy) == 2
            refused = held[[isinstance(outcome.result(), Busy) for outcome in outcomes].index(True)]
            assert isinstance(await writer.submit(*reading(refused, "k")), Verdict)

    run(go())


def test_what_all_need_is_waited_for_and_refused_in_time(database: Database) -> None:
    (one,) = plant(database, 1)

    async def go() -> None:
        async with writing(database) as writer, await psycopg.AsyncConnection.connect(database.dsn) as connection:
            await connection.execute(EVENTS)
            outcome = writer.submit(*reading(one, "0"))
            await come_to(lambda: rows(database.dsn, WAITING))
            await asyncio.sleep(0.3)  # longer than others give way
            await connection.rollback()
            assert isinstance(await outcome, Verdict)
            await connection.execute(EVENTS)
            waits(writer, SHORT)
            refused = await writer.submit(*reading(one, "1"))
            assert isinstance(refused, Busy), refused
            assert "what this request needs" in refused.detail or "lathe-0" in refused.detail
            await connection.rollback()
            waits(writer, LONG)
            assert sequence(await writer.submit(*reading(one, "1"))) == 2

    run(go())
    assert keys(database, one) == ["0", "1"]


def lost_commit(
    database: Database, matter: Callable[[Database], AbstractAsyncContextManager[None]], patience: float = LONG
) -> Any:
    """The answer to how a commit ended of which nobody heard. matter: what is in the way when it is asked."""
    (one,) = plant(database, 1)

    async def go() -> Any:
        own = with_patience(database, patience)
        store = ReadingStore(own, {})
        outcomes = await store.store([reading(one, "k")])
        await store.close()
        async with matter(own):
            asking = asyncio.ensure_future(store._find_out(CommitLost(outcomes), monotonic() + patience))
        found = await asking
        await store.close()
        own.close()
        return found

    return run(go())


def test_how_a_commit_ended_is_asked_behind_a_lock(database: Database) -> None:
    @asynccontextmanager
    async def held_for_a_while(own: Database) -> AsyncIterator[None]:
        async with await psycopg.AsyncConnection.connect(own.dsn) as connection:
            await connection.execute("LOCK TABLE machine_state")
            yield
            await come_to(lambda: rows(own.dsn, WAITING))

    (found,) = lost_commit(database, held_for_a_while)
    assert isinstance(found, Verdict)


@pytest.mark.parametrize("heard", [True, False])
def test_how_a_commit_ended_is_asked_until_the_patience_is_over(database: Database, heard: bool) -> None:
    @asynccontextmanager
    async def silent_for_a_while(own: Database) -> AsyncIterator[None]:
        own.connections.silent = True
        yield
        await asyncio.sleep(0.5)
        own.connections.silent = not heard

    (found,) = lost_commit(database, silent_for_a_while, LONG if heard else SHORT)
    assert isinstance(found, Verdict if heard else OutcomeUnknown)


def test_nobody_who_waited_for_a_lock_is_informed_of_an_absent_database() -> None:
    request = Request({"type": "http", "method": "POST", "path": "/api/v1/machines", "headers": [], "state": {}})
    for error in (psycopg.errors.LockNotAvailable("timeout"), psycopg.errors.QueryCanceled("timeout")):
        answer = run(unforeseen(request, error))
        assert answer.status_code == 503
        assert b"urn:inband:problem:busy" in bytes(answer.body)
        assert "Other work holds what this command needs" in str(explain(error))
    assert "Is INBAND_DATABASE_URL right" in str(explain(psycopg.OperationalError("no route to host")))
