"""The rounds: every chore in a transaction of its own, by one process at a time, and taken over when that one ends."""

import asyncio
import logging
import threading
import time

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.rounds import Chore, Rounds, go_round
from tests.loops import run

ADD = text("INSERT INTO machine (key, name, control) VALUES (:key, 'Lathe', 'other')")


def _add(key: str) -> Chore:
    return Chore(f"add {key}", lambda session: session.execute(ADD, {"key": key}))


def _fail(session: Session) -> None:
    session.execute(ADD, {"key": "half"})
    raise ValueError("broken tap")


def test_a_chore_that_fails_is_rolled_back_logged_by_name_and_takes_no_other_with_it(
    database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.ERROR, "app.rounds"):
        go_round(database, [_add("before"), Chore("the broken one", _fail), _add("after")])
    with database.begin() as session:
        assert session.scalars(text("SELECT key FROM machine ORDER BY key")).all() == ["after", "before"]
    assert [record.getMessage().rpartition(": ")[2] for record in caplog.records] == ["the broken one"]
    assert "broken tap" in caplog.text


def test_a_chore_that_has_done_a_part_is_done_again_in_a_transaction_of_its_own(database: Database) -> None:
    waiting = ["one", "two", "three"]
    done: list[int] = []

    def part(session: Session) -> bool:
        if not waiting:
            return False
        done.append(session.scalars(text("SELECT txid_current()")).one())
        session.execute(ADD, {"key": waiting.pop()})
        return True

    go_round(database, [Chore("in parts", part)])
    assert len(set(done)) == 3
    with database.begin() as session:
        assert session.scalars(text("SELECT key FROM machine ORDER BY key")).all() == ["one", "three", "two"]


class Count:
    """A chore that counts how often it was done, and by which of two."""

    def __init__(self) -> None:
        self.done: list[str] = []

    def by(self, name: str) -> Chore:
        return Chore("count", lambda _session: self.done.append(name))


async def _until(true: object, seconds: float = 10) -> None:
    deadline = time.monotonic() + seconds
    while not true():  # type: ignore[operator]
        assert time.monotonic() < deadline
        await asyncio.sleep(0.01)


def test_of_two_processes_one_goes_the_rounds_and_the_other_takes_over(database: Database) -> None:
    count = Count()

    async def both() -> None:
        one = Rounds(database, [count.by("one")], every=0.02)
        other = Rounds(database, [count.by("other")], every=0.02)
        one.start()
        await _until(lambda: len(count.done) >= 2)
        other.start()
        await asyncio.sleep(0.2)
        assert set(count.done) == {"one"}
        await one.stop()
        await _until(lambda: count.done[-1] == "other")
        await other.stop()

    run(both())
    said = count.done
    assert said == sorted(said, key=("one", "other").index), "they went at the same time"


def test_a_connection_that_breaks_is_made_anew(database: Database, caplog: pytest.LogCaptureFixture) -> None:
    count = Count()
    cut = text(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
        " WHERE application_name = 'inband-rounds' AND datname = current_database()"
    )

    async def interrupted() -> None:
        rounds = Rounds(database, [count.by("one")], every=0.02)
        rounds.start()
        await _until(lambda: count.done)
        with database.begin() as session:
            assert session.scalars(cut).all() == [True]
        await _until(lambda: "interrupted" in caplog.text)
        before = len(count.done)
        await _until(lambda: len(count.done) > before)
        await rounds.stop()

    with caplog.at_level(logging.WARNING, "app.rounds"):
        run(interrupted())


def test_stopping_waits_for_the_chore_that_is_being_done_and_begins_no_other(database: Database) -> None:
    begun, go_on, count = threading.Event(), threading.Event(), Count()

    def slow(session: Session) -> None:
        session.execute(ADD, {"key": "whole"})
        begun.set()
        assert go_on.wait(10)

    async def stopped() -> None:
        rounds = Rounds(database, [Chore("slow", slow), count.by("next")])
        rounds.start()
        await _until(begun.is_set)
        ending = asyncio.create_task(rounds.stop())
        await asyncio.sleep(0.05)
        assert not ending.done()
        go_on.set()
        await asyncio.wait_for(ending, 10)

    run(stopped())
    with database.begin() as session:
        assert session.scalar(text("SELECT count(*) FROM machine WHERE key = 'whole'")) == 1
    assert count.done == []
