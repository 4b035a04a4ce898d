"""Large runs of readings: the pyramid gives what the readings themselves give, and loses no extreme."""

import itertools
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

import psycopg
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.core.period import ALWAYS, Period
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries
from app.loop.summaries.queries.chart_data import MOST_BLOCKS, MOST_READINGS, plan
from app.loop.summaries.queries.pyramid import BASE_LEVEL
from app.loop.summaries.queries.window import Window
from app.views.characteristic.figures import counting_edges, histogram_counts
from bench.plant import PARAMETERS
from bench.readings import fill
from tests.servers import Server
from tests.shop import Shop

pytestmark = pytest.mark.own_server  # very many readings that no machine has sent

COUNT = 200_123
BEGUN = datetime(2026, 1, 5, 6, tzinfo=UTC)  # the generator's; one reading a second


class Large(NamedTuple):
    session: Session
    current: CurrentCharacteristic
    extremes: dict[int, float]

    def window(self, **chosen: Any) -> Window:
        return queries.window_of(self.session, self.current.characteristic, **chosen)

    def numbers(self, window: Window) -> queries.Numbers:
        return queries.numbers_of(self.session, self.current.characteristic, window)


@pytest.fixture(scope="module")
def large(server: Server) -> Iterator[Large]:
    shop = Shop(server)
    body: dict[str, Any] = {
        "key": "large",
        "name": "large",
        "machine": shop.machine,
        "parameters": PARAMETERS | {"tool_memory": 3},
    }
    shop.call("POST", "/characteristics", 201, **body)
    with psycopg.connect(server.database.dsn, autocommit=True) as connection:
        extremes = fill(connection, "large", COUNT)
        connection.execute("VACUUM ANALYZE")
    with server.database.begin() as session:
        current = characteristics.characteristic_named(session, "large")
        for sequence in (1, 77, 100_000, COUNT):
            session.execute(
                text("INSERT INTO exclusion VALUES (:m, :c, :s, now(), 'tests', 'to see whether it is left out')"),
                {"m": current.machine.id, "c": current.characteristic.id, "s": sequence},
            )
        yield Large(session, current, extremes)


@given(first=st.integers(1, 40_000_000), count=st.one_of(st.integers(1, 5_000), st.integers(1, 40_000_000)))
def test_the_plan_reads_every_reading_once_and_not_many_rows(first: int, count: int) -> None:
    window = Window(first, first + count - 1, first + count - 1)
    blocks, runs = plan(window)
    covered = sorted(
        [((low << level) + 1, (high + 1) << level) for level, low, high in blocks if high >= low]
        + [run for run in runs if run[1] >= run[0]]
    )
    assert covered[0][0] == window.first
    assert covered[-1][1] == window.last
    assert all(before[1] + 1 == after[0] for before, after in itertools.pairwise(covered))
    rows = sum(high - low + 1 for _level, low, high in blocks)
    singles = sum(last - first + 1 for first, last in runs)
    assert rows <= MOST_BLOCKS + 6 * 10
    assert singles <= (MOST_READINGS if count <= MOST_READINGS else 2 * (1 << BASE_LEVEL))


class TestCourse:
    def test_it_is_every_reading_once(self, large: Large) -> None:
        course = queries.chart_data_of(large.session, large.current.characteristic, large.window())
        assert course.blocks
        assert course.readings
        assert sum(block.count for block in course.blocks) + len(course.readings) == COUNT
        assert [r.sequence for r in course.readings] == list(range(COUNT - len(course.readings) + 1, COUNT + 1))
        assert course.excluded == {COUNT}

    def test_no_extreme_is_lost(self, large: Large) -> None:
        course = queries.chart_data_of(large.session, large.current.characteristic, large.window())
        for sequence, deviation in large.extremes.items():
            (block,) = [block for block in course.blocks if block.first <= sequence <= block.last]
            assert deviation in {block.minimum, block.maximum}

    def test_the_means_are_of_the_parts_alone(self, large: Large) -> None:
        course = queries.chart_data_of(large.session, large.current.characteristic, large.window())
        rows = large.session.execute(
            text(
                "SELECT b.first, avg(deviation) FILTER (WHERE counts), count(*) FILTER (WHERE NOT counts) "
                "FROM unnest(CAST(:firsts AS bigint[]), CAST(:lasts AS bigint[])) AS b(first, last) "
                "JOIN reading r ON characteristic_id = :c AND sequence BETWEEN b.first AND b.last, "
                "LATERAL (SELECT zone <> 'probe_fault' AND NOT EXISTS (SELECT FROM exclusion e "
                "WHERE e.characteristic_id = r.characteristic_id AND e.sequence = r.sequence) AS counts) AS part "
                "GROUP BY b.first ORDER BY b.first"
            ),
            {
                "c": large.current.characteristic.id,
                "firsts": [block.first for block in course.blocks],
                "lasts": [block.last for block in course.blocks],
            },
        ).all()
        assert [mean.value for mean in course.means] == pytest.approx([row[1] for row in rows], abs=1e-12)
        assert [mean.left_out for mean in course.means] == [row[2] for row in rows]
        fault = next(at for at, block in enumerate(course.blocks) if block.maximum > 1)
        assert course.means[fault].left_out == 1
        block, mean = course.blocks[fault], course.means[fault].value or 0.0
        assert block.mean == pytest.approx((mean * (block.count - 1) + 1.7019) / block.count, abs=1e-12)
        assert sum(mean.left_out for mean in course.means) == 4  # the fault, and three that are excluded

    def test_a_window_between_blocks(self, large: Large) -> None:
        window = large.window(first=12_345, through=56_789)
        course = queries.chart_data_of(large.session, large.current.characteristic, window)
        places = [(b.first, b.last) for b in course.blocks] + [(r.sequence, r.sequence) for r in course.readings]
        places.sort()
        assert (places[0][0], places[-1][1]) == (12_345, 56_789)
        assert all(before[1] + 1 == after[0] for before, after in itertools.pairwise(places))


class TestFigure:
    @pytest.fixture
    def figure(self, large: Large, server: Server) -> dict[str, Any]:
        client = server.client(server.key())
        answer = client.get("/api/v1/characteristics/large/figures/zones?last=all&scale=true")
        assert answer.status_code == 200, answer.text
        return {trace["meta"]: trace for trace in answer.json()["data"] if "meta" in trace}

    def test_every_extreme_is_on_it_and_opens_its_block(self, large: Large, figure: dict[str, Any]) -> None:
        words = " ".join(figure["extremes"]["text"])
        assert all(f"{abs(deviation) * 1000:.1f}" in words for deviation in large.extremes.values())
        (faulty,) = [said for said in figure["mean"]["text"] if "701.9" in said]
        assert faulty.endswith("<br>without 1 that are probe faults or excluded<br>smallest −4.6 µm")
        assert re.fullmatch(r"/characteristics/large\?first=\d+&through=\d+", figure["extremes"]["customdata"][0])

    def test_of_thousands_of_corrections_some_are_shown_with_the_sum_of_all(
        self, large: Large, figure: dict[str, Any]
    ) -> None:
        shown = figure["corrections"]
        assert 100 < len(shown["x"]) < 300
        newest = COUNT // 97
        assert shown["x"][-1] == newest * 97
        since_change = newest - 200_000 // 97
        assert figure["offset"]["y"][-1] == pytest.approx(-0.4 * since_change, abs=0.5)
        assert min(figure["offset"]["y"]) < -180  # near the end of a tool's life

    def test_tool_changes_and_alarms_are_on_it(self, large: Large, figure: dict[str, Any]) -> None:
        words = figure["events"]["text"]
        assert sum("T3 changed" in text for text in words) == 4
        assert sum("Oversize" in text for text in words) == 5


class TestNumbers:
    @pytest.mark.parametrize(
        "bounds",
        [
            {},
            {"period": Period(BEGUN + timedelta(seconds=1_000.5))},
            {"period": Period(BEGUN + timedelta(seconds=33), BEGUN + timedelta(seconds=150_000))},
            {"period": Period(None, BEGUN + timedelta(seconds=100_000))},
        ],
    )
    def test_they_are_those_of_the_readings(self, large: Large, bounds: dict[str, Any]) -> None:
        found, period = large.numbers(replace(large.window(), **bounds)), bounds.get("period", ALWAYS)
        row = large.session.execute(
            text(
                "SELECT count(*), avg(d), stddev_samp(d), min(d), max(d), "
                "count(*) FILTER (WHERE abs(deviation) <= 0.008), count(correction), "
                "count(*) FILTER (WHERE zone = 'zero'), count(*) FILTER (WHERE zone = 'undersize'), "
                "count(*) FILTER (WHERE zone = 'probe_fault') "
                "FROM reading r, LATERAL (SELECT CASE WHEN abs(deviation) < 1 THEN deviation END) AS of_part(d) WHERE characteristic_id = :c AND measured_at >= :start AND measured_at < :end AND NOT EXISTS "
                "(SELECT FROM exclusion e WHERE e.characteristic_id = r.characteristic_id AND e.sequence = r.sequence)"
            ),
            {
                "c": large.current.characteristic.id,
                "start": period.start or BEGUN,
                "end": period.end or BEGUN + timedelta(days=1000),
            },
        ).one()
        assert found.count == row[0]
        assert found.mean == pytest.approx(row[1], rel=1e-9)
        assert found.standard_deviation == pytest.approx(row[2], rel=1e-9)
        assert (found.minimum, found.maximum) == (row[3], row[4])
        assert (found.in_tolerance, found.corrections) == (row[5], row[6])
        assert (found.zones["zero"], found.zones["undersize"]) == (row[7], row[8])
        assert (found.probe_faults, found.measured) == (row[9], row[0] - row[9])
        assert sum(found.zones.values()) == found.count
        assert found.in_tolerance < found.count

    def test_the_excluded_are_counted_apart(self, large: Large) -> None:
        assert large.numbers(large.window()).excluded == 4
        early = large.numbers(replace(large.window(), period=Period(None, BEGUN + timedelta(seconds=1_000))))
        assert (early.excluded, early.count) == (2, 997)

    def test_a_window_by_time_holds_all_that_was_measured_in_it(self, large: Large) -> None:
        window = large.window(period=Period(BEGUN + timedelta(seconds=99.5), BEGUN + timedelta(seconds=180_001)))
        assert (window.first, window.last) == (100, 180_000)
        assert large.window(period=Period(BEGUN + timedelta(days=365))).count == 0


def test_the_histogram_is_that_of_the_readings(large: Large) -> None:
    limits = large.current.parameters
    window = large.window(last=60_000)
    counts = queries.histogram_of(large.session, large.current.characteristic, window, counting_edges(limits))
    deviations = large.session.scalars(
        text(
            "SELECT deviation FROM reading WHERE characteristic_id = :c AND sequence BETWEEN :f AND :l AND abs(deviation) < 1"
        ),
        {"c": large.current.characteristic.id, "f": window.first, "l": COUNT - 1},  # the last is excluded
    ).all()
    assert sum(counts) == len(deviations)
    assert counts == histogram_counts(deviations, limits)


def test_the_writer_summarises_what_it_stores(server: Server) -> None:
    shop = Shop(server)
    readings = [
        {"characteristic": shop.characteristic, "measured": round(40 + ((n * 37) % 23 - 11) / 1000, 6)}
        for n in range(600)
    ]
    for start in (0, 250):  # blocks that end within a batch, and blocks of two batches
        batch = readings[start : start + 250] if start == 0 else readings[start:]
        assert shop.admin.post("/api/v1/readings/batch", json=batch).status_code == 201
    with server.database.begin() as session:
        current = characteristics.characteristic_named(session, shop.characteristic)
        where = {"c": current.characteristic.id}
        levels = session.execute(
            text("SELECT level, count(*) FROM reading_summary WHERE characteristic_id = :c GROUP BY 1 ORDER BY 1"),
            where,
        )
        assert [tuple(row) for row in levels] == [(5, 18), (7, 4), (9, 1)]
        stored = session.execute(
            text(
                "SELECT count, minimum, maximum, sum, sum_squares, corrections, zones FROM reading_summary "
                "WHERE characteristic_id = :c AND level = 9"
            ),
            where,
        ).one()
        own = session.execute(
            text(
                "SELECT count(*), min(deviation), max(deviation), sum(deviation), sum(deviation * deviation), "
                "count(correction) FROM reading WHERE characteristic_id = :c AND sequence <= 512"
            ),
            where,
        ).one()
        assert tuple(stored)[:6] == pytest.approx(tuple(own), abs=1e-15)
        assert sum(stored.zones) == 512
