"""The store: durable when a call returns, nothing twice, one that fails takes no other along."""

import asyncio
import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from app.bridge.links import Order, Outcome, Position, Received
from app.bridge.slots import reading_of
from app.bridge.store import Store
from app.bridge.store_lock import StoreError
from app.bridge.store_tables import REPORTED, Added
from app.core.ring import Slot
from app.simulators.controls.model import Model
from tests.bridge.plant import machine
from tests.loops import run

M = "lathe-1"


def received(sequence: int, fault: str | None = None) -> Received:
    body = {"characteristic": "c", "measured": 40.0 + sequence / 1000}
    return Received(f"{M}:7:{sequence}", body, Position(7, sequence), fault)


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "deeper" / "store.sqlite3")


def test_readings_wait_in_their_order_until_they_are_sent(store: Store) -> None:
    async def story() -> None:
        assert (await store.add(M, [received(1), received(2), received(3, "no size")])).new == 3
        assert (await store.add(M, [received(2), received(4)])).new == 1, "a known key is not stored again"
        assert await store.position(M) == Position(7, 4)
        rows = await store.waiting(M)
        assert [row.key for row in rows] == [f"{M}:7:1", f"{M}:7:2", f"{M}:7:4"]
        assert await store.waiting("another") == []
        await store.sent(M, [rows[0].id])
        await store.refuse(M, rows[1].id, "409")
        counts = await store.counts(M)
        assert (counts.waiting, counts.quarantined) == (1, 2)
        assert counts.oldest == pytest.approx(time.time(), abs=60)
        assert [each.reason for each in await store.quarantine(M)] == ["no size", "409"]

    run(story())


def test_another_size_under_a_known_key_is_not_passed_over(store: Store) -> None:
    """Such as where a control that prints got its variables back from an archive, and counts again."""

    async def story() -> None:
        await store.add(M, [received(1), received(2)])
        other = replace(received(1), body={"characteristic": "c", "measured": 40.5})
        assert (await store.add(M, [other, received(2), received(3)])).new == 2
        assert (await store.add(M, [other])).new == 0
        assert list((await store.add(M, [received(2), other])).refused) == [1], "as often as it comes"
        [kept] = await store.quarantine(M)
        assert (kept.key, kept.body["measured"]) == (f"{M}:7:1:40.5", 40.5)
        assert "came with 40.001 before, and with 40.5 now" in kept.reason
        assert [row.body["measured"] for row in await store.waiting(M)] == [40.001, 40.002, 40.003]

    run(story())


def test_what_the_server_had_is_kept_sent_again_and_deleted_in_time(store: Store) -> None:
    async def story() -> None:
        await store.add(M, [received(1), received(2)])
        await store.sent(M, [row.id for row in await store.waiting(M)])
        assert await store.tidy(keep=3600) == 0
        assert await store.send_again(M) == 2
        assert len(await store.waiting(M)) == 2
        await store.sent(M, [row.id for row in await store.waiting(M)])
        assert await store.tidy(keep=-1) == 2
        assert await store.position(M) == Position(7, 2), "how far the ring is stored is known without the readings"

    run(story())


def test_the_quarantine_is_sent_again_or_dropped(store: Store) -> None:
    async def story() -> None:
        await store.add(M, [received(1, "a"), received(2, "b"), received(3, "c")])
        assert await store.release(M, f"{M}:7:2", drop=False) == 1
        assert [row.key for row in await store.waiting(M)] == [f"{M}:7:2"]
        assert await store.release(M, None, drop=True) == 2
        assert await store.quarantine(M) == []

    run(story())


def test_a_reading_whose_number_had_no_name_is_sent_once_it_has_one(store: Store) -> None:
    async def story() -> None:
        slot = Slot(1, 9, 40.0, 0, 1, 3, 0)
        await store.add(M, [reading_of(machine(Model()), slot, Position(7, 1), None), received(2, "a")])
        assert await store.release(M, None, drop=False, named={"1": "shaft"}) == 1
        assert [each.key for each in await store.quarantine(M)] == [f"{M}:7:1"]
        assert await store.release(M, None, drop=False, named={"9": "bore"}) == 1
        row = (await store.waiting(M))[0]
        assert row.body == {"characteristic": "bore", "measured": 40.0, "correction_in_effect": 0, "part": "1"}

    run(story())


def test_counters_that_were_accepted_name_new_readings(store: Store) -> None:
    async def story() -> None:
        await store.add(M, [received(5)])
        await store.accept_counters(M)
        assert await store.position(M) == Position(None, 0, 1)

    run(story())


def test_an_answer_counts_once_and_makes_the_offset_known(store: Store) -> None:
    async def story() -> None:
        order = Order(18, 3, 0.02, 0.014)
        await store.intend(M, order, "abc")
        assert await store.answered(M, Outcome(18, True, 0.014))
        assert not await store.answered(M, Outcome(18, True, 0.014))
        assert not await store.answered(M, Outcome(99, True, 0.5)), "a number that was never offered is no answer"
        [intent] = await store.intents(M, "answered")
        assert (intent.order, intent.mapping) == (order, "abc")
        assert intent.outcome is not None
        assert intent.outcome.applied
        assert (await store.known(M))[3].offset == 0.014
        assert not await store.intend(M, order, "abc")
        await store.set_intent(M, 18, REPORTED)
        assert not await store.intend(M, order, "abc")
        assert await store.intents(M, "open") == [], "what was answered is not offered again"

    run(story())


@pytest.mark.parametrize("withdrawn", [True, False])
def test_a_correction_that_is_offered_again_is_what_it_is_now(store: Store, *, withdrawn: bool) -> None:
    """A restored server gives its number anew, for another tool; or the mapping was changed while the bridge was ended."""

    async def story() -> None:
        await store.intend(M, Order(18, 3, 0.02, 0.014), "abc")
        if withdrawn:
            await store.set_intent(M, 18, "withdrawn")
        order = Order(18, 4, 0.0, 0.01)
        await store.intend(M, order, "def")
        assert [(each.order, each.mapping) for each in await store.intents(M, "open")] == [(order, "def")]
        await store.answered(M, Outcome(18, True, 0.01))
        assert {memory: known.offset for memory, known in (await store.known(M)).items()} == {4: 0.01}

    run(story())


def test_an_offset_is_reported_once_and_not_while_a_correction_is_open(store: Store) -> None:
    async def story() -> None:
        await store.held(M, {3: 0.02})
        assert await store.unreported(M, 0.0005) == {3: 0.02}
        await store.reported(M, 3, 0.02)
        await store.held(M, {3: 0.0203})
        assert await store.unreported(M, 0.0005) == {}
        await store.intend(M, Order(1, 3, 0.02, 0.03), "abc")
        await store.held(M, {3: 0.03})
        assert await store.unreported(M, 0.0005) == {}
        await store.answered(M, Outcome(1, True, 0.03))
        await store.set_intent(M, 1, REPORTED)
        assert await store.unreported(M, 0.0005) == {}
        await store.held(M, {3: 0.05})
        assert await store.unreported(M, 0.0005) == {3: 0.05}

    run(story())


def test_a_store_of_an_installed_bridge_is_read_and_goes_on(tmp_path: Path) -> None:
    """It holds which answers and offsets the server knows; forgotten, they would be reported again."""
    file = tmp_path / "store.sqlite3"
    with closing(sqlite3.connect(file)) as database:
        database.executescript("""
            CREATE TABLE intent (
                machine TEXT NOT NULL, number INTEGER NOT NULL, tool_memory INTEGER NOT NULL, before REAL NOT NULL,
                after REAL NOT NULL, mapping TEXT NOT NULL,
                state TEXT NOT NULL CHECK (state IN ('open', 'answered', 'told', 'withdrawn')), applied INTEGER, held REAL,
                differs INTEGER, reason TEXT, at REAL NOT NULL, PRIMARY KEY (machine, number));
            CREATE TABLE location (
                machine TEXT NOT NULL, tool_memory INTEGER NOT NULL, held REAL, told REAL, proved TEXT, proved_at REAL,
                PRIMARY KEY (machine, tool_memory));
            INSERT INTO intent VALUES ('lathe-1', 18, 3, 0, 0.01, 'abc', 'told', 1, 0.01, 0, '', 0);
            INSERT INTO intent VALUES ('lathe-1', 19, 4, 0, 0.02, 'abc', 'answered', 1, 0.02, 0, '', 0);
            INSERT INTO location VALUES ('lathe-1', 3, 0.01, 0.01, 'abc', 0);
            INSERT INTO location VALUES ('lathe-1', 4, 0.02, 0.0, 'abc', 0);
            """)
    store = Store(file)

    async def story() -> None:
        assert not await store.intend(M, Order(18, 3, 0.0, 0.01), "abc")
        assert [each.order.number for each in await store.intents(M, REPORTED)] == [18]
        await store.set_intent(M, 19, REPORTED)
        assert [each.order.number for each in await store.intents(M, REPORTED)] == [18, 19]
        assert await store.unreported(M, 0.0005) == {4: 0.02}
        await store.reported(M, 4, 0.02)
        assert await store.unreported(M, 0.0005) == {}

    run(story())
    store.close()


def test_one_call_that_fails_takes_no_other_along(store: Store) -> None:
    async def story() -> None:
        together = await asyncio.gather(
            store.add(M, [received(1)]),
            store.note(M, "name", b"\xff"),  # type: ignore[arg-type]
            store._run(lambda database: database.execute("SELECT * FROM nowhere")),
            store.add("another", [received(1)]),
            return_exceptions=True,
        )
        assert together[0] == together[3] == Added(1, {})
        assert isinstance(together[2], StoreError)

    run(story())


def test_a_store_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    file = tmp_path / "store.sqlite3"
    file.write_bytes(b"no database at all, but long enough to be looked at" * 100)
    with pytest.raises(
        StoreError, match=r"cannot be opened: file is not a database\. It is damaged, or another program's"
    ):
        Store(file)
    locked = Store(tmp_path / "locked.sqlite3")
    locked._database.execute("PRAGMA busy_timeout = 50")
    other = sqlite3.connect(locked.file, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(StoreError, match="cannot be written"):
        run(locked.add(M, [received(1)]))
    other.execute("ROLLBACK")
    assert run(locked.add(M, [received(1)])).new == 1, "it goes on once it can"


def test_a_full_disk_is_said_and_what_was_stored_stays(tmp_path: Path) -> None:
    async def story() -> None:
        store = Store(tmp_path / "store.sqlite3")
        store._database.execute("PRAGMA max_page_count = 30")
        stored = 0
        with pytest.raises(StoreError, match=r"The disk of .* is full: free space"):
            while True:
                await store.add(M, [received(stored + 1)])
                stored += 1
        assert len(await store.waiting(M, 5000)) == stored
        store._database.execute("PRAGMA max_page_count = 100000")
        assert (await store.add(M, [received(stored + 1)])).new == 1, "it goes on once there is room"

    run(story())


def test_a_note_of_what_the_server_has_that_fails_is_reported_with_the_next(store: Store) -> None:
    async def story() -> None:
        await store.add(M, [received(1)])
        [row] = await store.waiting(M)
        store._database.execute("CREATE TRIGGER no BEFORE UPDATE ON reading BEGIN SELECT RAISE(ABORT, 'no'); END")
        await store.sent(M, [row.id])
        assert await store.waiting(M) == [row], "it takes no other call along, and the reading is sent again"
        with pytest.raises(StoreError, match="cannot be written: no"):
            await store.sent(M, [row.id])
        store._database.execute("DROP TRIGGER no")
        await store.sent(M, [row.id])
        assert await store.waiting(M) == []

    run(story())


def test_a_full_store_is_seen_and_room_that_was_freed_counts(tmp_path: Path) -> None:
    store = Store(tmp_path / "store.sqlite3", largest=0.2)

    async def story() -> None:
        assert not await store.is_full()
        await store.add(M, [received(sequence) for sequence in range(1, 3000)])
        assert await store.is_full()
        rows = await store.waiting(M, 5000)
        await store.sent(M, [row.id for row in rows])
        await store.tidy(keep=-1)
        assert not await store.is_full()

    run(story())


def test_readings_that_the_server_has_do_not_make_a_store_full(tmp_path: Path) -> None:
    """They are kept for a server that goes back in time, as far as there is room; the machine goes on."""
    store = Store(tmp_path / "store.sqlite3", largest=0.2)

    async def story() -> None:
        await store.add(M, [received(sequence) for sequence in range(1, 3000)])
        rows = await store.waiting(M, 2800)
        await store.sent(M, [row.id for row in rows])
        assert not await store.is_full()
        kept = await store.send_again(M)
        assert 0 < kept < 2800
        waiting = await store.waiting(M, 5000)
        assert [row.id for row in waiting] == list(range(2801 - kept, 3000)), (
            "the oldest were given up, none that waits"
        )

    run(story())


def test_one_program_at_a_time_works_with_the_controls(tmp_path: Path) -> None:
    store, other = Store(tmp_path / "store.sqlite3"), Store(tmp_path / "store.sqlite3")
    with store.alone():
        with pytest.raises(StoreError, match="Another program works with the controls"), other.alone():
            pass
        run(other.note(M, "hold", "x"))  # commands go on
    with other.alone():
        pass


WRITER = """
import asyncio, sys
from pathlib import Path
from app.bridge.links import Position, Received
from app.bridge.store import Store

async def main():
    store = Store(Path(sys.argv[1]))
    for sequence in range(1, 100_000):
        await store.add("lathe-1", [Received(f"k{sequence}", {}, Position(7, sequence))])
        print(sequence, flush=True)

asyncio.run(main())
"""


def test_what_was_said_to_be_stored_is_there_after_a_kill(tmp_path: Path) -> None:
    file = tmp_path / "store.sqlite3"
    with subprocess.Popen([sys.executable, "-c", WRITER, str(file)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        said = 0
        while said < 50:
            said = int(process.stdout.readline())
        os.kill(process.pid, signal.SIGKILL)
        said = max([said, *map(int, process.stdout.read().split())])

    async def story() -> None:
        store = Store(file)
        assert (await store.position(M)).sequence >= said
        assert len(await store.waiting(M, 100_000)) == (await store.position(M)).sequence

    run(story())
