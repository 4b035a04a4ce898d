"""Periodic jobs: every unit in a transaction of its own, by one process at a time, and taken over when that one ends."""

import asyncio
import logging
import threading
import time
from urllib.parse import urlsplit

import psycopg
import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.jobs.actions import WHOLE, DatabaseGone, PeriodicJob, Unit, run_jobs, whole
from app.jobs.queries import failures, runs
from app.jobs.runner import JobRunner
from tests.databases import in_database
from tests.loops import run

ADD = text("INSERT INTO machine (key, name, control) VALUES (:key, 'Lathe', 'other')")


JOB = "test_job"


class Units:
    """A job with some units, of which those in `broken` fail after having written."""

    def __init__(self, *names: str, broken: set[str] | None = None) -> None:
        self.names, self.broken = list(names), broken or set()
        self.tried: list[str] = []

    @property
    def job(self) -> PeriodicJob:
        return PeriodicJob(JOB, lambda _session: [Unit(f"machine/{name}", (name,)) for name in self.names], self._do)

    def _do(self, session: Session, unit: Unit) -> None:
        name = str(unit.key[0])
        self.tried.append(name)
        session.execute(ADD, {"key": f"{name}-{len(self.tried)}"})
        if name in self.broken:
            raise ValueError("broken tap")


def machines(database: Database) -> list[str]:
    with database.begin() as session:
        return list(session.scalars(text("SELECT key FROM machine ORDER BY key")))


def failing(database: Database) -> list[tuple[str, int, str]]:
    with database.begin() as session:
        return [(row.subject, row.failures, row.error) for row in failures(session)]


def wait_over(database: Database) -> None:
    with database.begin() as session:
        session.execute(text("UPDATE job_failure SET retry_at = now()"))


def test_a_unit_that_fails_is_rolled_back_recorded_and_logged_and_takes_no_other_along(
    database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    units = Units("a", "b", "c", broken={"b"})
    after = PeriodicJob("next_job", whole, lambda session, _unit: session.execute(ADD, {"key": "next"}))
    with caplog.at_level(logging.ERROR, "app.jobs"):
        run_jobs(database, [units.job, after])
    assert machines(database) == ["a-1", "c-3", "next"]
    assert failing(database) == [("machine/b", 1, "ValueError: broken tap")]
    (record,) = caplog.records
    assert f"{JOB} failed for machine/b" in record.getMessage()
    assert record.exc_info is not None
    with database.begin() as session:
        assert runs(session)[JOB].units == 3


def test_it_is_tried_again_after_growing_pauses_and_ends_by_itself(
    database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    units = Units("a", broken={"a"})
    pauses = []
    for _turn in range(9):
        run_jobs(database, [units.job])
        with database.begin() as session:
            pauses.append(
                session.scalars(text("SELECT extract(epoch FROM retry_at - last_at)::int FROM job_failure")).one()
            )
        tried = len(units.tried)
        run_jobs(database, [units.job])
        assert len(units.tried) == tried, "not before the pause is over"
        wait_over(database)
    assert pauses == [60, 120, 240, 480, 960, 1920, 3600, 3600, 3600]
    assert failing(database)[0][1] == 9
    units.broken.clear()
    with caplog.at_level(logging.INFO, "app.jobs"):
        run_jobs(database, [units.job])
    assert failing(database) == []
    assert "no longer fails for machine/a" in caplog.text


def test_what_fails_comes_last_and_what_is_not_due_any_more_has_ended(database: Database) -> None:
    units = Units("a", "b", broken={"a"})
    run_jobs(database, [units.job])
    wait_over(database)
    units.tried.clear()
    run_jobs(database, [units.job])
    assert units.tried == ["b", "a"]
    units.names.remove("a")
    run_jobs(database, [units.job])
    assert failing(database) == []


def test_a_job_that_cannot_list_what_is_due_is_recorded_as_a_whole(database: Database) -> None:
    broken = True

    def due(session: Session) -> list[Unit]:
        if broken:
            session.execute(text("SELECT nothing"))
        return []

    job = PeriodicJob(JOB, due, lambda *_: None)
    run_jobs(database, [job])
    ((subject, count, error),) = failing(database)
    assert (subject, count) == (WHOLE.subject, 1)
    assert error == 'column "nothing" does not exist'
    broken = False
    run_jobs(database, [job])
    assert failing(database) == []


def test_without_a_database_nothing_is_recorded_as_failing(database: Database) -> None:
    away = Database(in_database(database.dsn, "not-there"), pool_size=1)
    with pytest.raises(DatabaseGone):
        run_jobs(away, [Units("a").job])
    away.close()


class Count:
    """A job that counts how often it was done, and by which of two."""

    def __init__(self) -> None:
        self.done: list[str] = []

    def by(self, name: str) -> PeriodicJob:
        return PeriodicJob("count", whole, lambda _session, _unit: self.done.append(name))


async def _until(true: object, seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not true():  # type: ignore[operator]
        assert time.monotonic() < deadline
        await asyncio.sleep(0.01)


def test_of_two_processes_one_runs_the_jobs_and_the_other_takes_over(database: Database) -> None:
    count = Count()

    async def both() -> None:
        one = JobRunner(database, [count.by("one")], every=0.02)
        other = JobRunner(database, [count.by("other")], every=0.02)
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


def test_a_connection_that_breaks_is_made_again(database: Database, caplog: pytest.LogCaptureFixture) -> None:
    count = Count()
    cut = text(
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
        " WHERE application_name = 'inband-jobs' AND datname = current_database()"
    )

    async def interrupted() -> None:
        runner = JobRunner(database, [count.by("one")], every=0.02)
        runner.start()
        await _until(lambda: count.done)
        with database.begin() as session:
            assert session.scalars(cut).all() == [True]
        await _until(lambda: "interrupted" in caplog.text)
        before = len(count.done)
        await _until(lambda: len(count.done) > before)
        await runner.stop()

    with caplog.at_level(logging.WARNING, "app.jobs"):
        run(interrupted())


class CountingRunner(JobRunner):
    """Counts how often it tried to begin."""

    tries = 0

    async def _run_while_ours(self) -> None:
        self.tries += 1
        await super()._run_while_ours()


def test_an_outage_is_logged_when_it_begins_and_when_it_ends_not_at_each_try(
    database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    name = urlsplit(database.dsn).path[1:]
    count = Count()

    async def outage() -> None:
        runner = CountingRunner(database, [count.by("one")], every=0.02)
        with psycopg.connect(in_database(database.dsn, "postgres"), autocommit=True) as server:
            server.execute(f'ALTER DATABASE "{name}" ALLOW_CONNECTIONS false')
            runner.start()
            await _until(lambda: runner.tries >= 5)
            assert count.done == []
            server.execute(f'ALTER DATABASE "{name}" ALLOW_CONNECTIONS true')
        await _until(lambda: len(count.done) >= 2)
        await runner.stop()

    with caplog.at_level(logging.INFO, "app.jobs"):
        run(outage())
    begin, end = [record.getMessage() for record in caplog.records]
    assert begin.startswith("periodic jobs are interrupted: ")
    assert "not currently accepting connections" in begin
    assert end.startswith("periodic jobs go on after an interruption of ")


def test_stopping_waits_for_the_unit_that_is_being_done_and_begins_no_other(database: Database) -> None:
    begun, go_on, count = threading.Event(), threading.Event(), Count()

    def slow(session: Session, _unit: Unit) -> None:
        session.execute(ADD, {"key": "whole"})
        begun.set()
        assert go_on.wait(60)

    async def stopped() -> None:
        runner = JobRunner(
            database, [PeriodicJob("slow", lambda _session: [Unit("a"), Unit("b")], slow), count.by("next")]
        )
        runner.start()
        await _until(begun.is_set)
        ending = asyncio.create_task(runner.stop())
        await asyncio.sleep(0.05)
        assert not ending.done()
        go_on.set()
        await asyncio.wait_for(ending, 60)

    run(stopped())
    with database.begin() as session:
        assert session.scalar(text("SELECT count(*) FROM machine WHERE key = 'whole'")) == 1
    assert count.done == []
