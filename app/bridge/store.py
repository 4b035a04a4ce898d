"""The store: readings until the server has them, corrections on their way to the control, the quarantine. SQLite.

Everything is durable (WAL, ``synchronous=FULL``) when a call returns, but for what the server has taken: losing that note is
harmless, for a key that comes again is answered as before, so it goes with the next commit. Calls that come together share
one commit: a thread of its own takes whatever waits, writes it in one transaction, and lets all of them go on.
"""

import asyncio
import json
import queue
import sqlite3
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, suppress
from dataclasses import astuple
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

from app.bridge.guards import Known
from app.bridge.links import Decided, Order, Outcome, Position, Received
from app.bridge.store_lock import alone_with, in_words
from app.bridge.store_tables import (
    ADD,
    LATER_COLUMNS,
    REPORTED,
    SCHEMA,
    Added,
    Counts,
    Intent,
    Quarantined,
    Waiting,
    contradictions,
    in_effect,
)

T = TypeVar("T")
Job = tuple[Callable[[sqlite3.Connection], Any], Future[Any]]
NOTE: Final = "INSERT INTO fact (machine, name, value) VALUES (?, ?, ?) ON CONFLICT (machine, name) DO UPDATE SET value = excluded.value"
GIVE_UP: Final = (
    "DELETE FROM reading WHERE id IN (SELECT id FROM reading WHERE state = 'sent' ORDER BY sent_at, id LIMIT ?)"
)
GIVEN_UP, MOST_GIVEN_UP = 500, 20_000
"""Readings that the server has, deleted at a time while the store is full, and in one call: others wait for it."""
NUMBER: Final = "number"
"""In the body of a reading whose characteristic has no name: the number by which the control knows it."""
EMPTY: Final[Mapping[str, str]] = MappingProxyType({})
ANSWERS_KEPT: Final = 90 * 86_400.0  # s


class Store:
    """The store in one file. All methods may be called from any thread; those that are awaited, from one event loop."""

    def __init__(self, file: Path, largest: float = 500.0) -> None:
        """file: made if it is missing. largest: MB. Raises `StoreError`."""
        self.file = file
        self.largest = largest * 1e6
        self._noting = threading.Lock()
        self._sent: list[tuple[float, str, int]] = []
        self._notes: Future[Any] | None = None
        self._jobs: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            self._database = sqlite3.connect(file, isolation_level=None, check_same_thread=False, timeout=10)
            self._database.execute("PRAGMA journal_mode=WAL")
            self._database.execute("PRAGMA synchronous=FULL")
            self._database.executescript(SCHEMA)
            for table, column, kind in LATER_COLUMNS:
                with suppress(sqlite3.OperationalError):  # it is there
                    self._database.execute(f"ALTER TABLE {table} ADD COLUMN {column} {kind}")
        except (OSError, sqlite3.Error) as error:
            raise in_words(error, file, "opened") from error
        self._thread = threading.Thread(target=self._work, name="store", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Write what waits, and close."""
        self._jobs.put(None)
        self._thread.join()
        self._database.close()

    def alone(self) -> AbstractContextManager[None]:
        """Keep every other program from the controls while it lasts, as `alone_with`."""
        return alone_with(self.file)

    # --- readings

    async def add(self, machine: str, received: Sequence[Received]) -> Added:
        """Store readings of a machine and how far its ring is stored, durably.

        A key that is known stays as it is: nothing comes twice. Another size under it is another reading, which goes to the
        quarantine, as the server would refuse it; a reading that lies there and comes again is refused again.
        """
        now = time.time()

        def write(database: sqlite3.Connection) -> Added:
            rows = [
                (machine, each.key, json.dumps(each.body), "quarantined" if each.fault else "waiting", each.fault, now)
                for each in received
            ]
            before = database.total_changes
            database.executemany(ADD, rows)
            added = Added(database.total_changes - before, {})
            if added.new < len(rows):
                more = contradictions(database, machine, received, now)
                added = Added(added.new + more.new, more.refused)
            if last := received[-1].position:
                database.execute(
                    "INSERT INTO ring (machine, epoch, sequence, generation) VALUES (?, ?, ?, ?)"
                    " ON CONFLICT (machine) DO UPDATE SET epoch = excluded.epoch, sequence = excluded.sequence",
                    (machine, last.epoch, last.sequence, last.generation),
                )
            return added

        return await self._run(write) if received else Added(0, {})

    async def waiting(self, machine: str, most: int = 100) -> list[Waiting]:
        """The oldest readings that the server does not have yet."""
        rows = await self._run(
            lambda database: database.execute(
                "SELECT id, key, body, at, sent_at IS NOT NULL FROM reading WHERE machine = ? AND state = 'waiting'"
                " ORDER BY id LIMIT ?",
                (machine, most),
            ).fetchall()
        )
        return [Waiting(number, key, json.loads(body), at, bool(again)) for number, key, body, at, again in rows]

    async def sent(self, machine: str, numbers: Sequence[int]) -> None:
        """The server has these: seen by every later call, durable with the next commit. Raises `StoreError` if the last one failed."""
        if self._notes is not None and self._notes.done() and (error := self._notes.exception()):
            self._notes = None
            raise error
        now = time.time()
        with self._noting:
            self._sent += [(now, machine, number) for number in numbers]

    async def refuse(self, machine: str, number: int, reason: str) -> None:
        """Put one into the quarantine."""
        await self._run(
            lambda database: database.execute(
                "UPDATE reading SET state = 'quarantined', reason = ? WHERE machine = ? AND id = ?",
                (reason, machine, number),
            )
        )

    async def send_again(self, machine: str) -> int:
        """Let everything wait again that the server had: it went back in time. How many."""
        return await self._run(
            lambda database: (
                database.execute(
                    "UPDATE reading SET state = 'waiting' WHERE machine = ? AND state = 'sent'",
                    (machine,),
                ).rowcount
            )
        )

    async def quarantine(self, machine: str, most: int = 20) -> list[Quarantined]:
        """The quarantine, newest first."""
        rows = await self._run(
            lambda database: database.execute(
                "SELECT key, body, reason, at FROM reading WHERE machine = ? AND state = 'quarantined' ORDER BY id DESC LIMIT ?",
                (machine, most),
            ).fetchall()
        )
        return [Quarantined(key, json.loads(body), reason, at) for key, body, reason, at in rows]

    async def release(self, machine: str, key: str | None, *, drop: bool, named: Mapping[str, str] = EMPTY) -> int:
        """Send one of the quarantine (all with None) again, or drop it. How many.

        named: characteristics by the control's numbers: a reading whose number had no name gets it now, or stays.
        """
        chosen = "machine = ? AND state = 'quarantined'" + ("" if key is None else " AND key = ?")
        values = (machine,) if key is None else (machine, key)

        def write(database: sqlite3.Connection) -> int:
            if drop:
                return database.execute(f"DELETE FROM reading WHERE {chosen}", values).rowcount  # noqa: S608 - of two texts
            found = database.execute(f"SELECT id, body FROM reading WHERE {chosen}", values).fetchall()  # noqa: S608
            rows = []
            for number, text in found:
                body = json.loads(text)
                if (nameless := body.pop(NUMBER, None)) is not None:
                    body["characteristic"] = named.get(nameless)
                if nameless is None or nameless in named:
                    rows.append((json.dumps(body), number))
            database.executemany("UPDATE reading SET state = 'waiting', reason = NULL, body = ? WHERE id = ?", rows)
            return len(rows)

        return await self._run(write)

    async def counts(self, machine: str) -> Counts:
        """Numbers of waiting and quarantined readings, and since when the oldest waits."""
        rows = await self._run(
            lambda database: database.execute(
                "SELECT state, count(*), min(at) FROM reading WHERE machine = ? AND state <> 'sent' GROUP BY state",
                (machine,),
            ).fetchall()
        )
        found = {state: (number, oldest) for state, number, oldest in rows}
        waiting, oldest = found.get("waiting", (0, None))
        return Counts(waiting, oldest, found.get("quarantined", (0, None))[0])

    async def position(self, machine: str) -> Position:
        """The part of the machine's ring that is stored."""
        row = await self._run(
            lambda database: database.execute(
                "SELECT epoch, sequence, generation FROM ring WHERE machine = ?", (machine,)
            ).fetchone()
        )
        return Position(*row) if row else Position()

    async def accept_counters(self, machine: str) -> None:
        """Take whatever the control counts at the next contact as its new beginning: a person has looked."""
        await self._run(
            lambda database: database.execute(
                "UPDATE ring SET epoch = NULL, sequence = 0, generation = generation + 1 WHERE machine = ?", (machine,)
            )
        )

    async def tidy(self, keep: float) -> int:
        """Delete readings that the server has had for ``keep`` seconds (how many), and old answers to corrections."""
        now = time.time()

        def write(database: sqlite3.Connection) -> int:
            database.execute(
                "DELETE FROM intent WHERE state IN ('told', 'withdrawn') AND at < ?", (now - ANSWERS_KEPT,)
            )
            return database.execute("DELETE FROM reading WHERE state = 'sent' AND sent_at < ?", (now - keep,)).rowcount

        return await self._run(write)

    async def is_full(self) -> bool:
        """True if the store has reached its largest size. Space that was freed counts as free.

        What the server has is given up first, the oldest before the others: no machine stands still for that.
        """

        def over(database: sqlite3.Connection) -> bool:
            [pages], [free], [size] = (
                database.execute(f"PRAGMA {name}").fetchone() for name in ("page_count", "freelist_count", "page_size")
            )
            return bool((pages - free) * size >= self.largest)

        def look(database: sqlite3.Connection) -> bool:
            for _ in range(MOST_GIVEN_UP // GIVEN_UP):
                if not over(database) or not database.execute(GIVE_UP, (GIVEN_UP,)).rowcount:
                    break
            return over(database)

        return await self._run(look)

    # --- corrections

    async def intend(self, machine: str, order: Order, mapping: str) -> bool:
        """Note an order before the control hears of it; whether it may: not when the control has answered it.

        One that was withdrawn may be offered again, and one that is open may be about something else by now: by another
        mapping, or at a server that gives the number again.
        """

        def write(database: sqlite3.Connection) -> bool:
            database.execute(
                "INSERT INTO intent (machine, number, tool_memory, before, after, mapping, merged, state, at)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, 'open', ?) ON CONFLICT (machine, number) DO UPDATE SET state = 'open',"
                " tool_memory = excluded.tool_memory, before = excluded.before, after = excluded.after,"
                " mapping = excluded.mapping, merged = excluded.merged WHERE state = 'withdrawn' OR (state = 'open' AND"
                " (tool_memory, before, after, mapping, merged) IS NOT"
                " (excluded.tool_memory, excluded.before, excluded.after, excluded.mapping, excluded.merged))",
                (
                    *(machine, order.number, order.tool_memory, order.before, order.after, mapping),
                    *(json.dumps(order.merged), time.time()),
                ),
            )
            [state] = database.execute(
                "SELECT state FROM intent WHERE machine = ? AND number = ?", (machine, order.number)
            ).fetchone()
            return bool(state == "open")

        return await self._run(write)

    async def answered(self, machine: str, outcome: Outcome) -> int | None:
        """Note the control's answer; the tool memory that it is about if it is a new one.

        What the control holds there is known from here on.
        """

        def write(database: sqlite3.Connection) -> int | None:
            changed = database.execute(
                "UPDATE intent SET state = 'answered', applied = ?, held = ?, differs = ?, reason = ?,"
                " turn = (SELECT coalesce(max(turn), 0) + 1 FROM intent WHERE machine = ?)"
                " WHERE machine = ? AND number = ? AND state IN ('open', 'withdrawn') RETURNING tool_memory",
                (outcome.applied, outcome.offset, outcome.differs, outcome.reason, machine, machine, outcome.number),
            ).fetchone()
            if changed and outcome.offset is not None:
                database.execute(
                    "INSERT INTO location (machine, tool_memory, held, told)"
                    " SELECT machine, tool_memory, held, held FROM intent WHERE machine = ? AND number = ?"
                    " ON CONFLICT (machine, tool_memory) DO UPDATE SET held = excluded.held, told = excluded.held",
                    (machine, outcome.number),
                )
            return changed[0] if changed else None

        return await self._run(write)

    async def set_intent(self, machine: str, number: int, state: str) -> None:
        """`REPORTED` when the server has heard the answer, ``withdrawn`` when the control is no longer offered it."""
        await self._run(
            lambda database: database.execute(
                "UPDATE intent SET state = ? WHERE machine = ? AND number = ? AND state = ?",
                (state, machine, number, "answered" if state == REPORTED else "open"),
            )
        )

    async def intents(self, machine: str, state: str) -> list[Intent]:
        """Orders in a state: answered ones in the order of their answers, others by their number."""
        rows = await self._run(
            lambda database: database.execute(
                "SELECT number, tool_memory, before, after, merged, state, mapping, applied, held, differs, reason FROM intent"
                " WHERE machine = ? AND state = ? ORDER BY turn, number",
                (machine, state),
            ).fetchall()
        )
        return [
            Intent(
                Order(number, memory, before, after, tuple(json.loads(merged or "[]"))),
                found,
                mapping,
                None if applied is None else Outcome(number, bool(applied), held, reason or "", bool(differs)),
            )
            for number, memory, before, after, merged, found, mapping, applied, held, differs, reason in rows
        ]

    async def in_effect(self, machine: str, tool_memory: int, number: int) -> int | None:
        """The last correction of a location that was in its offset when ``number``, of any location, was the control's last one.

        None where nothing is known of it: corrections of several locations are not applied in the order of their numbers.
        """
        return await self._run(lambda database: in_effect(database, machine, tool_memory, number))

    async def applied(self, machine: str, tool_memory: int) -> set[int]:
        """The corrections of a location that the control itself has applied."""
        text = "SELECT number, merged FROM intent WHERE machine = ? AND tool_memory = ? AND applied = 1"
        rows = await self._run(lambda database: database.execute(text, (machine, tool_memory)).fetchall())
        return {int(each) for number, merged in rows for each in (number, *json.loads(merged or "[]"))}

    # --- decisions

    async def keep_decisions(self, machine: str, decided: Sequence[Decided]) -> None:
        """Keep decisions until the control has heard of them."""
        rows = [(machine, *astuple(each)) for each in decided]
        columns = "machine, key, characteristic, action, reason, measure_next"
        insert = f"INSERT INTO decision ({columns}) VALUES (?, ?, ?, ?, ?, ?) ON CONFLICT (machine, key) DO NOTHING"  # noqa: S608
        await self._run(lambda database: database.executemany(insert, rows))

    async def decisions(self, machine: str) -> list[Decided]:
        """The decisions that are kept, oldest first."""
        query = (
            "SELECT key, characteristic, action, reason, measure_next FROM decision WHERE machine = ? ORDER BY rowid"
        )
        return [
            Decided(*row) for row in await self._run(lambda database: database.execute(query, (machine,)).fetchall())
        ]

    async def carried(self, machine: str, keys: Sequence[str]) -> None:
        """The control has heard of these."""
        rows = [(machine, key) for key in keys]
        delete = "DELETE FROM decision WHERE machine = ? AND key = ?"
        await self._run(lambda database: database.executemany(delete, rows))

    # --- locations and facts

    async def known(self, machine: str) -> dict[int, Known]:
        """Offset and proof of each location."""
        rows = await self._run(
            lambda database: database.execute(
                "SELECT tool_memory, held, proved, proved_at FROM location WHERE machine = ?", (machine,)
            ).fetchall()
        )
        return {memory: Known(held, proved, proved_at) for memory, held, proved, proved_at in rows}

    async def held(self, machine: str, offsets: dict[int, float]) -> None:
        """Note the offsets that were read from the control."""
        await self._run(
            lambda database: database.executemany(
                "INSERT INTO location (machine, tool_memory, held) VALUES (?, ?, ?)"
                " ON CONFLICT (machine, tool_memory) DO UPDATE SET held = excluded.held",
                [(machine, memory, offset) for memory, offset in offsets.items()],
            )
        )

    async def unreported(self, machine: str, least: float) -> dict[int, float]:
        """Offsets whose last reading differs by more than ``least`` from what the server knows, without those on which a
        correction is open.
        """
        rows = await self._run(
            lambda database: database.execute(
                "SELECT tool_memory, held FROM location WHERE machine = ? AND held IS NOT NULL"
                " AND (told IS NULL OR abs(told - held) > ?) AND tool_memory NOT IN"
                " (SELECT tool_memory FROM intent WHERE machine = ? AND state IN ('open', 'answered'))",
                (machine, least, machine),
            ).fetchall()
        )
        return dict(rows)

    async def reported(self, machine: str, tool_memory: int, offset: float) -> None:
        """The server has heard which offset the control holds."""
        await self._run(
            lambda database: database.execute(
                "UPDATE location SET told = ? WHERE machine = ? AND tool_memory = ?", (offset, machine, tool_memory)
            )
        )

    async def prove(
        self, machine: str, tool_memory: int, mapping: str | None, fact: tuple[str, str] | None = None
    ) -> None:
        """Note that a touch test has proved a mapping; with None, that it has not; and a fact with it, name and value."""
        now = None if mapping is None else time.time()

        def write(database: sqlite3.Connection) -> None:
            database.execute(
                "INSERT INTO location (machine, tool_memory, proved, proved_at) VALUES (?, ?, ?, ?)"
                " ON CONFLICT (machine, tool_memory) DO UPDATE SET proved = excluded.proved, proved_at = excluded.proved_at",
                (machine, tool_memory, mapping, now),
            )
            if fact is not None:
                database.execute(NOTE, (machine, *fact))

        await self._run(write)

    async def fact(self, machine: str, name: str) -> str | None:
        """A fact that was noted, such as the server's time line; None if it was not."""
        row = await self._run(
            lambda database: database.execute(
                "SELECT value FROM fact WHERE machine = ? AND name = ?", (machine, name)
            ).fetchone()
        )
        return row[0] if row else None

    async def facts(self, name: str) -> dict[str, str]:
        """A fact of every machine that has it, also of one that the configuration does not name any more."""
        rows = await self._run(
            lambda database: database.execute("SELECT machine, value FROM fact WHERE name = ?", (name,)).fetchall()
        )
        return dict(rows)

    async def note(self, machine: str, name: str, value: str | None) -> None:
        """Note a fact; None forgets it."""
        await self._run(
            lambda database: (
                database.execute(NOTE, (machine, name, value))
                if value is not None
                else database.execute("DELETE FROM fact WHERE machine = ? AND name = ?", (machine, name))
            )
        )

    # --- the thread

    async def _run(self, job: Callable[[sqlite3.Connection], T]) -> T:
        done: Future[T] = Future()
        self._jobs.put((job, done))
        return await asyncio.wrap_future(done)

    def _work(self) -> None:
        ending = False
        while not ending:
            jobs = [self._jobs.get()]
            while not self._jobs.empty():
                jobs.append(self._jobs.get())
            ending = None in jobs
            self._together(self._what_was_sent() + [job for job in jobs if job is not None])

    def _what_was_sent(self) -> list[Job]:
        with self._noting:
            rows, self._sent = self._sent, []
        if not rows:
            return []
        self._notes = Future()
        statement = "UPDATE reading SET state = 'sent', sent_at = ?, reason = NULL WHERE machine = ? AND id = ?"
        return [(lambda database: database.executemany(statement, rows), self._notes)]

    def _together(self, jobs: list[Job]) -> None:
        """Do these in one transaction; if it fails, each by itself, so that one cannot take the others along."""
        try:
            results = self._transaction([job for job, _ in jobs])
        except Exception as error:  # noqa: BLE001 - handed to the one who waits for it
            if len(jobs) == 1:
                _settle(jobs[0][1], error=in_words(error, self.file))
                return
            for job in jobs:
                self._together([job])
            return
        for (_, done), result in zip(jobs, results, strict=True):
            _settle(done, result)

    def _transaction(self, jobs: list[Callable[[sqlite3.Connection], Any]]) -> list[Any]:
        self._database.execute("BEGIN IMMEDIATE")
        try:
            results = [job(self._database) for job in jobs]
            self._database.execute("COMMIT")
        except BaseException:
            with suppress(sqlite3.Error):
                self._database.execute("ROLLBACK")
            raise
        return results


def _settle(done: "Future[Any]", result: Any = None, error: BaseException | None = None) -> None:
    """Hand over a result; nobody waits any more where the task was cancelled."""
    if not done.set_running_or_notify_cancel():
        return
    if error is None:
        done.set_result(result)
    else:
        done.set_exception(error)
