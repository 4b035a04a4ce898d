"""Readers of many rows: across the borders of what they fetch at once, and with a hundred thousand readings."""

import asyncio
import csv
import io
import json
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from itertools import islice
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psycopg
import pytest
from sqlalchemy import text

from app.core.decision.limits import Zone
from app.core.period import Period
from app.db.engine import Database
from app.jobs.actions import run_jobs
from app.loop.characteristics import actions as characteristics
from app.loop.characteristics import queries as characteristics_now
from app.loop.characteristics.schemas import CharacteristicIn
from app.loop.readings import exporting, queries
from app.loop.readings import results_actions as results
from app.loop.readings.importing.actions import import_readings
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer import group_commit
from app.loop.summaries.queries import history, history_of, window_of
from app.loop.summaries.queries.window import Window
from app.loop.tables.readings import ResultReading
from app.views.shift import queries as shift
from bench.plant import PARAMETERS
from tests.databases import MANY, drop_database, in_database
from tests.forked import inband
from tests.loop.readings.importing.test_history import set_up
from tests.loops import in_thread, run
from tests.servers import RunServer

KEY = "long"
SOME_OR_ALL = [20_000, pytest.param(MANY, marks=pytest.mark.long)]
"""Numbers of readings where each of them takes its time; the smaller one is larger than what is taken at once anywhere."""


def borders(chunk: int) -> list[int]:
    """Numbers of rows at which a reader that takes `chunk` of them at once may break."""
    return [0, 1, chunk - 1, chunk, chunk + 1, 2 * chunk, 2 * chunk + 1]


@pytest.fixture(scope="module")
def client(many_readings: Database, run_server: RunServer) -> Iterator[httpx.Client]:
    """Of a server on that database."""
    with run_server(many_readings.dsn) as running:
        made = running.client(running.key())
        made.timeout = httpx.Timeout(60)
        yield made


def answered(client: httpx.Client, path: str, **query: Any) -> httpx.Response:
    answer = client.get(path, params=query)
    assert answer.status_code == 200, f"{path}: {answer.status_code} {answer.text[:300]}"
    return answer


def test_a_shift_among_them_is_found_by_its_block_ranges(many_readings: Database) -> None:
    with many_readings.begin() as session:
        last = session.scalars(text("SELECT max(measured_at) FROM reading")).one()
        period = Period(last - timedelta(hours=8), last)
        plan = "\n".join(session.scalars(text(f"EXPLAIN {shift.READINGS}"), shift.where_of(session, period, None)))
        made = sum(shift.made_in(session, period).values(), shift.Made())
        counted = text("SELECT count(*) FROM reading WHERE measured_at >= :start AND measured_at < :end")
        assert made.readings == session.scalars(counted, {"start": period.start, "end": period.end}).one() > 0
    assert "reading_received_idx" in plan
    assert "Seq Scan on reading" not in plan


class TestExport:
    @pytest.mark.parametrize("count", borders(10)[1:])
    def test_across_the_borders_of_what_is_fetched_at_once(
        self, many_readings: Database, monkeypatch: pytest.MonkeyPatch, count: int
    ) -> None:
        monkeypatch.setattr(exporting, "AT_ONCE", 10)
        with many_readings.begin() as session:
            entry = queries.entry_of(session, KEY)
            assert entry is not None
            numbers = [row["sequence"] for row in exporting.rows(session, entry, last=count)]
        assert numbers == list(range(MANY - count + 1, MANY + 1))

    def test_all_of_them_as_they_are_stored(self, many_readings: Database, tmp_path: Path) -> None:
        done = inband("export", "--characteristic", KEY, INBAND_DATABASE_URL=many_readings.dsn)
        assert done.returncode == 0, done.stderr
        assert f"{MANY} readings written" in done.stderr
        told = [
            (int(row["sequence"]), row["part"], float(row["measured"]), float(row["decided_deviation"]), row["zone"])
            for row in csv.DictReader(io.StringIO(done.stdout))
        ]
        assert told == stored(many_readings, "sequence, part, measured, decided, zone")


def stored(database: Database, columns: str, key: str = KEY) -> list[tuple[Any, ...]]:
    where = "(machine_id, characteristic_id) = (SELECT machine_id, id FROM characteristic WHERE key = %s)"
    with psycopg.connect(database.dsn) as connection:
        return connection.execute(
            f"SELECT {columns} FROM reading WHERE {where} ORDER BY sequence",  # noqa: S608 - our own words
            [key],
        ).fetchall()


def first_of_them(database: Database, count: int) -> Iterator[dict[str, Any]]:
    """The first readings, as they are exported."""
    with database.begin() as session:
        entry = queries.entry_of(session, KEY)
        assert entry is not None
        with closing(exporting.rows(session, entry)) as rows:
            yield from islice(rows, count)


class TestImport:
    @pytest.mark.parametrize("count", SOME_OR_ALL)
    def test_what_was_exported_comes_back_and_comes_once(
        self, many_readings: Database, tmp_path: Path, count: int
    ) -> None:
        key = f"again-{count}"
        with many_readings.begin() as session:
            parameters = PARAMETERS | {"tool_memory": 3}
            added = CharacteristicIn(key=key, name="Again", machine="lathe-long", parameters=parameters)
            characteristics.add_characteristic(session, added, "tests")
        file = tmp_path / "long.csv"
        with file.open("w") as target:
            exporting.write_csv(first_of_them(many_readings, count), target)
        layout = look(file, Wishes())
        summary = import_readings(many_readings, key, file, layout, actor="tests")
        assert (summary.stored, summary.first_sequence, summary.last_sequence) == (count, 1, count)
        same = "sequence, part, measured, measured_at, zone"
        assert stored(many_readings, same, key) == stored(many_readings, same)[:count]
        again = import_readings(many_readings, key, file, layout, actor="tests", dry_run=True)
        assert (again.stored, again.repeated) == (0, count)


class TestReplay:
    @pytest.mark.parametrize("count", SOME_OR_ALL)
    def test_every_line_is_decided(self, many_readings: Database, tmp_path: Path, count: int) -> None:
        file, parameters = tmp_path / "long.ndjson", tmp_path / "parameters.json"
        with file.open("w") as target:
            exporting.write_ndjson(first_of_them(many_readings, count), target)
        parameters.write_text(json.dumps(PARAMETERS))
        done = inband("replay", file, "--parameters", parameters)
        assert done.returncode == 0, done.stderr
        assert [json.loads(line)["sequence"] for line in done.stdout.splitlines()] == list(range(1, count + 1))


class TestBackup:
    def test_what_was_backed_up_comes_back(self, many_readings: Database, postgres: str, tmp_path: Path) -> None:
        file, empty = tmp_path / "long.dump", in_database(postgres, "restored_many")
        assert inband("backup", file, INBAND_DATABASE_URL=many_readings.dsn).returncode == 0
        with psycopg.connect(postgres, autocommit=True) as connection:
            connection.execute("CREATE DATABASE restored_many")
        restored = Database(empty, pool_size=1)
        try:
            done = inband("restore", file, INBAND_DATABASE_URL=restored.dsn)
            assert done.returncode == 0, done.stderr
            everything = "SELECT count(*), sum(hashtextextended(reading::text, 0)) FROM reading"
            with psycopg.connect(many_readings.dsn) as before, psycopg.connect(empty) as after:
                assert after.execute(everything).fetchone() == before.execute(everything).fetchone()
        finally:
            restored.close()
            drop_database(empty)


class TestWriters:
    """They take so many at once as well."""

    @pytest.mark.parametrize("count", borders(4)[1:])
    def test_readings_that_wait_are_all_stored(
        self, database: Database, monkeypatch: pytest.MonkeyPatch, count: int
    ) -> None:
        monkeypatch.setattr(group_commit, "MOST_AT_ONCE", 4)
        set_up(database)
        with database.begin() as session:
            entry = queries.entry_of(session, "shaft-d40")
            assert entry is not None

        async def pushed() -> list[Any]:
            running = group_commit.Writer(database)
            waiting = [
                running.submit(entry, ReadingIn(characteristic="shaft-d40", measured=39.992, key=f"part-{number}"))
                for number in range(count)
            ]
            running.start()
            outcomes = await asyncio.gather(*waiting)
            await running.stop()
            return outcomes

        outcomes = run(pushed())
        assert [outcome.sequence for outcome in outcomes] == list(range(1, count + 1))
        assert [key for (key,) in stored(database, "key", "shaft-d40")] == [f"part-{number}" for number in range(count)]

    @pytest.mark.parametrize("count", borders(3))
    def test_results_that_wait_all_become_readings(
        self, database: Database, monkeypatch: pytest.MonkeyPatch, count: int
    ) -> None:
        monkeypatch.setattr(results, "MOST_AT_ONCE", 3)
        set_up(database)
        with database.begin() as session:
            entry = queries.entry_of(session, "shaft-d40")
            assert entry is not None
            for number in range(count):
                session.add(
                    ResultReading(
                        machine_id=entry.machine_id,
                        characteristic_id=entry.characteristic_id,
                        key=f"part-{number}",
                        measured=39.992,
                        measured_at=datetime.now(UTC),
                    )
                )
        in_thread(lambda: results.push_results(database))
        in_thread(lambda: run_jobs(database, [results.JOB]))
        told = {key for (key,) in stored(database, "key", "shaft-d40")}
        assert told == {f"part-{number}" for number in range(count)}


class TestPages:
    @pytest.mark.parametrize("count", SOME_OR_ALL)
    @pytest.mark.parametrize("limit", [pytest.param(999, marks=pytest.mark.long), 1000])
    def test_every_reading_is_on_one_page(self, client: httpx.Client, limit: int, count: int) -> None:
        numbers: list[int] = []
        after: int | None = MANY - count
        while after is not None:
            page = answered(client, "/api/v1/readings", characteristic=KEY, after=after, limit=limit).json()
            numbers += [row["sequence"] for row in page["items"]]
            after = page["next"]
        assert numbers == list(range(MANY - count + 1, MANY + 1))

    @pytest.mark.parametrize("left", borders(10))
    def test_the_last_page_says_that_it_is_the_last(self, client: httpx.Client, left: int) -> None:
        page = answered(client, "/api/v1/readings", characteristic=KEY, after=MANY - left, limit=10).json()
        assert [row["sequence"] for row in page["items"]] == list(range(MANY - left + 1, MANY + 1))[:10]
        assert (page["next"] is None) == (left <= 10)


class TestHistory:
    @pytest.mark.parametrize("count", borders(history.BLOCK)[1:])
    def test_across_the_borders_of_its_blocks(self, many_readings: Database, count: int) -> None:
        with many_readings.begin() as session:
            here = characteristics_now.characteristic_named(session, KEY).characteristic
            for first in (1, history.BLOCK - 1, history.BLOCK, history.BLOCK + 1):
                found = history_of(session, here, Window(first, first + count - 1, MANY), ("deviation", "zone"))
                assert found["sequence"].tolist() == list(range(first, first + count))
                assert len(found["deviation"]) == len(found["zone"]) == count

    def test_all_of_them(self, many_readings: Database) -> None:
        with many_readings.begin() as session:
            here = characteristics_now.characteristic_named(session, KEY).characteristic
            found = history_of(session, here, window_of(session, here), ("measured", "zone"))
        zones = [zone.value for zone in Zone]
        told = [
            (measured, zones[zone]) for measured, zone in zip(found["measured"].tolist(), found["zone"], strict=True)
        ]
        assert told == stored(many_readings, "measured, zone")


WHOLE = {"last": MANY}
FIGURES = ("zones", "run", "histogram", "wear", "what-if", "control", "capability")


class TestEverythingOverAllOfThem:
    """Readings are some parts in a thousand beyond the limits: no view of them may lose one, or end in an error."""

    @pytest.mark.parametrize("name", FIGURES)
    def test_figures(self, client: httpx.Client, name: str) -> None:
        assert answered(client, f"/api/v1/characteristics/{KEY}/figures/{name}", **WHOLE).json()

    @pytest.mark.parametrize("name", ["statistics", "capability", "wear", "control", "rules/preview"])
    def test_numbers(self, client: httpx.Client, name: str) -> None:
        assert answered(client, f"/api/v1/characteristics/{KEY}/{name}", **WHOLE).json()

    def test_the_statistics_count_every_one(self, client: httpx.Client, many_readings: Database) -> None:
        told = answered(client, f"/api/v1/characteristics/{KEY}/statistics", **WHOLE).json()
        deviations = np.array(stored(many_readings, "deviation"))[:, 0]
        deviations = deviations[
            np.abs(deviations) < PARAMETERS["confidence_limit"]
        ]  # a fault of the probe is not a size
        assert told["count"] == MANY
        assert told["mean"] == pytest.approx(float(deviations.mean()), abs=1e-9)

    @pytest.mark.parametrize("form", ["json", "csv", "xlsx", "pdf"])
    def test_reports(self, client: httpx.Client, form: str) -> None:
        report = answered(client, f"/api/v1/characteristics/{KEY}/report.{form}", **WHOLE)
        assert len(report.content) > 1000

    @pytest.mark.parametrize(
        "page",
        [
            "",
            "/control",
            "/capability",
            pytest.param(
                "/what-if", marks=pytest.mark.long
            ),  # its figure and its numbers are asked for above and below
            "/report",
            "/rules",
        ],
    )
    def test_pages(self, client: httpx.Client, page: str) -> None:
        assert "Long" in answered(client, f"/characteristics/{KEY}{page}", last="all").text

    @pytest.mark.parametrize("form", ["csv", pytest.param("pdf", marks=pytest.mark.long)])
    def test_a_report_by_the_command(self, many_readings: Database, tmp_path: Path, form: str) -> None:
        file = tmp_path / f"long.{form}"
        done = inband("report", KEY, "--last", MANY, "-o", file, INBAND_DATABASE_URL=many_readings.dsn)
        assert done.returncode == 0, done.stderr
        assert file.stat().st_size > 1000

    def test_what_if(self, client: httpx.Client) -> None:
        body = {"averaging_limit": 0.006, "last": MANY}
        answer = client.post(f"/api/v1/characteristics/{KEY}/what-if", json=body)
        assert answer.status_code == 200, answer.text[:300]
