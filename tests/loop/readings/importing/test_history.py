"""Files into a real database: all or nothing, once, and without touching the machine of today."""

import csv
import json
import resource
import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest
from sqlalchemy import text

from app.access.callers import Caller
from app.db.connections import LIMITS
from app.db.engine import Database
from app.errors import Conflict, Invalid, NotFound
from app.loop.characteristics import actions as characteristics
from app.loop.characteristics.schemas import CharacteristicIn
from app.loop.machines import actions as machines
from app.loop.machines import queries as machine_queries
from app.loop.machines.schemas import MachineIn
from app.loop.readings import queries
from app.loop.readings.importing.actions import import_readings
from app.loop.readings.importing.history import Flawed, Summary
from app.loop.readings.importing.layout import Wishes, look
from app.loop.tools import actions as offsets
from app.web.openapi import example_of
from tests.forked import Forked, inband
from tests.loop.readings.record import history, rows
from tests.loop.readings.writer.test_broken import until
from tests.loops import in_thread
from tests.shop import Shop

PARAMETERS = example_of("CharacteristicIn")["parameters"]


@pytest.fixture
def plant(database: Database) -> Database:
    set_up(database)
    return database


def set_up(database: Database) -> None:
    with database.begin() as session:
        machines.add_machine(session, MachineIn(key="lathe-1", name="Lathe 1", control="sinumerik"), "tests")
        for key, parameters in (("shaft-d40", PARAMETERS), ("shaft-d41", PARAMETERS | {"average_memory": 0})):
            characteristics.add_characteristic(
                session,
                CharacteristicIn(key=key, name="Bearing seat", machine="lathe-1", parameters=dict(parameters)),
                "tests",
            )


def table(path: Path, values: list[float], *, begin: str = "2026-03-02T06:00:00+01:00", **columns: list[str]) -> Path:
    start = datetime.fromisoformat(begin)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["measured_at", "measured", *columns])
        for at, value in enumerate(values):
            writer.writerow([(start + timedelta(minutes=at)).isoformat(), value, *(c[at] for c in columns.values())])
    return path


def run(database: Database, path: Path, characteristic: str = "shaft-d40", **options: Any) -> Summary:
    wishes = options.pop("wishes", Wishes())
    return import_readings(database, characteristic, path, look(path, wishes), actor="tests", **options)


def scalar(database: Database, sql: str) -> Any:
    with database.begin() as session:
        return session.execute(text(sql)).scalar()


def stored(database: Database, characteristic: str = "shaft-d40") -> list[dict[str, Any]]:
    with database.begin() as session:
        entry = queries.entry_of(session, characteristic)
        assert entry is not None
        return queries.answers(session, entry, queries.latest(session, entry, None, 1000)[::-1])


VALUES = [39.992, 39.9935, 39.9981, 40.004, 40.35, 41.2, 39.9925]


def test_a_file_is_judged_line_by_line_and_corrects_nothing(plant: Database, tmp_path: Path) -> None:
    summary = run(plant, table(tmp_path / "a.csv", VALUES))
    assert (summary.lines, summary.stored, summary.repeated) == (7, 7, 0)
    assert summary.zones == {"zero": 2, "average": 1, "full": 1, "oversize": 1, "wear": 1, "probe_fault": 1}
    found = stored(plant)
    assert [r["sequence"] for r in found] == list(range(1, 8))
    assert [r["measured"] for r in found] == VALUES
    assert {r["action"] for r in found} == {"none"}
    assert {r["reason"]["code"] for r in found} == {"imported"}
    assert "corrects nothing" in found[2]["reason"]["text"]
    assert scalar(plant, "SELECT (SELECT count(*) FROM correction) + (SELECT count(*) FROM alarm)") == 0
    assert scalar(plant, "SELECT count(*) FROM tool_event") == 0
    assert scalar(plant, "SELECT count(*) FROM average_memory WHERE average <> 0") == 0
    assert scalar(plant, "SELECT count(*) FROM stream WHERE paused_by IS NOT NULL") == 0
    assert scalar(plant, "SELECT sum(sequence - sequence_at_tool_change) FROM stream") == 0, "parts of today's tool"
    assert scalar(plant, "SELECT actor FROM audit_entry WHERE action = 'readings imported'") == "tests"


def test_it_has_a_running_average_of_its_own(plant: Database, tmp_path: Path) -> None:
    run(plant, table(tmp_path / "a.csv", [39.994, 39.994, 39.996]))
    assert [r["average_after"] for r in stored(plant)] == pytest.approx([0.001, 0.0015, 0.00275])
    run(plant, table(tmp_path / "a.csv", [39.994, 39.994, 39.996]), "shaft-d41")
    assert [r["average_after"] for r in stored(plant, "shaft-d41")] == [0, 0, 0], "R11 = 0 keeps none"


def test_the_same_file_again_stores_nothing_twice(plant: Database, tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", VALUES)
    run(plant, path)
    again = run(plant, path.rename(tmp_path / "renamed.csv"))
    assert (again.stored, again.repeated) == (0, 7)
    assert len(stored(plant)) == 7


def test_keys_of_the_file_are_kept_and_a_longer_file_adds_only_what_is_new(plant: Database, tmp_path: Path) -> None:
    keys = [f"k{at}" for at in range(7)]
    run(plant, table(tmp_path / "a.csv", VALUES[:4], key=keys[:4]))
    summary = run(plant, table(tmp_path / "b.csv", VALUES, key=keys))
    assert (summary.stored, summary.repeated, summary.first_sequence, summary.last_sequence) == (3, 4, 5, 7)
    assert [r["key"] for r in stored(plant)] == keys


def test_a_key_with_another_value_is_named_with_its_line_and_nothing_is_stored(plant: Database, tmp_path: Path) -> None:
    run(plant, table(tmp_path / "a.csv", VALUES[:2], key=["k0", "k1"]))
    with pytest.raises(Flawed) as refusal:
        run(plant, table(tmp_path / "b.csv", [39.9, 39.95, 39.96, 39.97], key=["k7", "k1", "k8", "k8"]))
    assert [(f.line, f.value) for f in refusal.value.flaws] == [(3, "k1"), (5, "k8")]
    assert "reading 2" in refusal.value.flaws[0].reason
    assert "line 4" in refusal.value.flaws[1].reason
    assert len(stored(plant)) == 2


def test_one_bad_line_keeps_all_others_out_and_every_bad_line_is_named(plant: Database, tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", VALUES)
    lines = path.read_text().splitlines()
    lines[3] = "2026-03-02T06:02:00+01:00,about 40"
    lines[5] = "yesterday,39.99"
    path.write_text("\n".join(lines))
    with pytest.raises(Flawed) as refusal:
        run(plant, path)
    assert [(f.line, f.column, f.value) for f in refusal.value.flaws] == [
        (4, "measured", "about 40"),
        (6, "measured_at", "yesterday"),
    ]
    assert stored(plant) == []
    assert scalar(plant, "SELECT sequence FROM stream ORDER BY 1 DESC LIMIT 1") == 0


def test_a_dry_run_says_what_would_happen_and_stores_nothing(plant: Database, tmp_path: Path) -> None:
    summary = run(plant, table(tmp_path / "a.csv", VALUES), dry_run=True)
    assert summary.stored == 7
    assert stored(plant) == []


def test_values_in_another_unit_are_noticed(plant: Database, tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", [39992.0, 39993.5])
    with pytest.raises(Invalid, match=r"from the target 39\.992 mm") as refusal:
        run(plant, path)
    assert "name their unit" in (refusal.value.what_to_do or "")
    run(plant, path, wishes=Wishes(unit="um"))
    assert [r["measured"] for r in stored(plant)] == [39.992, 39.9935]


def test_values_beyond_a_natural_limit_are_not_called_far_from_the_target(plant: Database, tmp_path: Path) -> None:
    """They are probe faults as well, and 0.003 is not more than 1 mm from 0."""
    limits = {"nominal": 0.0, "upper_deviation": 0.0, "lower_deviation": -0.02, "natural_limit": "upper"}
    given = CharacteristicIn(
        key="sink",
        name="Sink mark",
        machine="lathe-1",
        parameters=PARAMETERS | limits | {"tool_memory": 0, "average_memory": 0},
    )
    with plant.begin() as session:
        characteristics.add_characteristic(session, given, "tests")
    with pytest.raises(Invalid, match=r"beyond the natural limit 0 mm, .* line 2 with 0\.003 mm") as refusal:
        run(plant, table(tmp_path / "a.csv", [0.003, 0.004]), "sink")
    assert "R36" not in str(refusal.value)


def test_older_readings_are_late_and_the_plant_still_shows_the_newest(plant: Database, tmp_path: Path) -> None:
    run(plant, table(tmp_path / "a.csv", [39.9925], begin="2026-05-01T06:00:00Z"))
    run(plant, table(tmp_path / "b.csv", [39.998, 39.999], begin="2026-03-01T06:00:00Z"))
    assert [r["late"] for r in stored(plant)] == [False, True, True]
    assert scalar(plant, "SELECT last_measured FROM stream WHERE sequence = 3") == 39.9925


def test_touches_are_kept_and_checked(plant: Database, tmp_path: Path) -> None:
    with plant.begin() as session:
        characteristics.change_characteristic(
            session,
            "shaft-d40",
            characteristics.CharacteristicChange(
                parameters={"variant": "indexed", "repeats": 2, "points": 2}, reason="t"
            ),
            "tests",
        )
    path = tmp_path / "a.ndjson"
    good = {"touches": [[39.998, 39.9982], [39.9979, 39.9981]], "measured_at": "2026-03-02T06:00:00Z"}
    path.write_text(json.dumps(good) + "\n" + json.dumps(good | {"touches": [[39.998]]}) + "\n")
    with pytest.raises(Flawed) as refusal:
        run(plant, path)
    assert [(f.line, f.column) for f in refusal.value.flaws] == [(2, "touches")]
    path.write_text(json.dumps(good) + "\n")
    with plant.begin() as session:
        of = {"form_of": {"characteristic": "shaft-d40", "result": "run_out"}, "parameters": {"R40": 0.01}}
        form = CharacteristicIn.model_validate({"key": "d40-run-out", "name": "Run-out", "machine": "lathe-1"} | of)
        characteristics.add_characteristic(session, form, "tests")
    [note] = run(plant, path).notes
    assert "the characteristics of form (d40-run-out) get no readings" in note
    assert [row["measured"] for row in stored(plant)] == [39.99805], "of the diameter alone"
    assert scalar(plant, "SELECT touches FROM reading_touches") == good["touches"]
    with plant.begin() as session:  # sides 39.9981 and 39.9980; of the repeats 0.2 µm each: sqrt((2 + 2) / 2) * 0.1 µm
        found = session.execute(
            text("SELECT run_out, repeat_range, repeat_deviation, rejected FROM reading_results")
        ).one()
    assert tuple(found) == (0.00005, 0.0002, 0.000141421, None)


def test_parameters_changed_in_the_middle_stop_it(plant: Database, tmp_path: Path) -> None:
    count = 0

    def change_at_the_third() -> None:
        nonlocal count
        count += 1
        if count == 3:
            with plant.begin() as session:
                change = characteristics.CharacteristicChange(parameters={"zero_range": 0.002}, reason="t")
                characteristics.change_characteristic(session, "shaft-d40", change, "ana")

    with pytest.raises(Conflict, match="ana has changed the parameters"):
        run(plant, table(tmp_path / "a.csv", VALUES), progress=change_at_the_third)
    assert stored(plant) == []


def test_an_empirical_value_changed_in_the_middle_stops_it(plant: Database, tmp_path: Path) -> None:
    count = 0

    def change_at_the_third() -> None:
        nonlocal count
        count += 1
        if count == 3:
            with plant.begin() as session:
                lathe = machine_queries.machine_named(session, "lathe-1")
                offsets.set_empirical_value(session, lathe, 5, 0.002, "compared with the CMM", Caller("person", "ana"))

    with pytest.raises(Conflict, match=r"from \+0\.0 µm to \+2\.0 µm"):
        run(plant, table(tmp_path / "a.csv", VALUES), progress=change_at_the_third)
    assert stored(plant) == []


def test_an_unknown_characteristic_is_named(plant: Database, tmp_path: Path) -> None:
    with pytest.raises(NotFound, match="'shaft-d99'"):
        run(plant, table(tmp_path / "a.csv", VALUES), "shaft-d99")


def test_live_readings_go_through_the_same_door_as_any(plant: Database, tmp_path: Path) -> None:
    def live(path: Path) -> Summary:
        return in_thread(lambda: run(plant, path, live=True))

    summary = live(table(tmp_path / "a.csv", [39.992, 39.9981]))
    assert (summary.stored, summary.corrections) == (2, 1)
    assert stored(plant)[1]["correction"]["amount"] == -0.0061
    assert live(tmp_path / "a.csv").repeated == 2
    with pytest.raises(Flawed) as refusal:
        live(table(tmp_path / "b.csv", [39.99, 39.99], correction_in_effect=["1", "7"]))
    assert [(f.line, f.column) for f in refusal.value.flaws] == [(3, "correction_in_effect")]
    with pytest.raises(Invalid, match="10000 lines"):
        live(table(tmp_path / "c.csv", [39.99] * 10_001))


def test_summaries_for_charts_are_those_of_readings_pushed_one_by_one(plant: Database, tmp_path: Path) -> None:
    values = [39.992 + (at * 37 % 11 - 5) / 1000 for at in range(300)]
    for part in range(3):
        run(plant, table(tmp_path / f"{part}.csv", values[part * 100 : part * 100 + 100]))
    checks = """
        SELECT count(*) FROM reading_summary b JOIN LATERAL (
            SELECT count(*) n, min(deviation) lo, max(deviation) hi FROM reading r
            WHERE r.machine_id = b.machine_id AND r.characteristic_id = b.characteristic_id
              AND r.sequence > b.block << b.level AND r.sequence <= (b.block + 1) << b.level
        ) r ON r.n = b.count AND r.lo = b.minimum AND r.hi = b.maximum
    """
    assert scalar(plant, checks) == 9 + 2  # blocks of 32 and of 128
    assert scalar(plant, "SELECT count(*) FROM reading_summary") == 11


@pytest.mark.parametrize("count", [20_000, pytest.param(200_000, marks=pytest.mark.long)])
def test_a_long_file_takes_little_memory(plant: Database, tmp_path: Path, count: int) -> None:
    path = table(tmp_path / "long.csv", [39.992 + at % 17 / 1000 for at in range(count)], begin="2020-01-01T00:00:00Z")
    run(plant, table(tmp_path / "short.csv", [39.992] * 1000))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert run(plant, path).stored == count
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 40_000 * count / 200_000 + 10_000, f"{grown} kB more for {count} lines"
    assert scalar(plant, "SELECT max(sequence) FROM reading") == count + 1000


HELD_UP = """SELECT 1 FROM pg_stat_activity WHERE application_name = 'inband-readings' AND datname = current_database()
    AND wait_event_type = 'Lock'"""


def test_the_machine_goes_on_while_its_past_is_imported(
    shop: Shop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.db.engine.LIMITS", LIMITS.replace("lock_timeout=10s", "lock_timeout=60s"))
    path = table(tmp_path / "long.csv", [39.992 + at % 9 / 1000 for at in range(2_000)], begin="2020-01-01T00:00:00Z")
    dsn, staged = shop.server.database.dsn, 0

    def live_at_every_hundredth() -> None:
        """While its lines are judged, which is what takes the time, nobody waits for the import."""
        nonlocal staged
        staged += 1
        if staged % 100 == 0:
            shop.read(0.0, key=f"live-{staged}")

    database = Database(dsn, pool_size=1)
    importing = threading.Thread(
        target=run, args=(database, path, shop.characteristic), kwargs={"progress": live_at_every_hundredth}
    )
    with psycopg.connect(dsn) as holding:
        holding.execute("LOCK TABLE audit_entry IN EXCLUSIVE MODE")  # the last that an import writes, under the lock
        importing.start()
        until(lambda: rows(dsn, "SELECT 1 FROM pg_locks WHERE relation = 'audit_entry'::regclass AND NOT granted"))
        assert len(history(dsn, shop.characteristic)) == 20, "every line was judged, and no machine waited"
        with ThreadPoolExecutor(1) as pool:
            held_up = pool.submit(push_live, shop)
            until(lambda: rows(dsn, HELD_UP))
            holding.rollback()
            answer = held_up.result()
    importing.join()
    database.close()
    assert (answer.status_code, answer.json()["sequence"]) == (201, 2_021), answer.text
    sequences = [reading["sequence"] for reading in history(dsn, shop.characteristic)]
    assert sequences == list(range(1, 2_022))


def push_live(shop: Shop) -> httpx.Response:
    """A reading as a machine sends it, and sends it again."""
    reading = {"characteristic": shop.characteristic, "measured": 40.0, "key": "held up"}
    return shop.machine_client.post("/api/v1/readings", json=reading)


def test_killed_in_the_middle_nothing_of_it_is_there_and_it_can_be_repeated(plant: Database, tmp_path: Path) -> None:
    path = table(tmp_path / "long.csv", [39.992] * 10_000, begin="2020-01-01T00:00:00Z")
    command = ["import", str(path), "--characteristic", "shaft-d40", "--database-url", plant.dsn]
    waiting = "SELECT 1 FROM pg_stat_activity WHERE datname = current_database() AND wait_event_type = 'Lock'"
    with psycopg.connect(plant.dsn) as holding:
        holding.execute("LOCK TABLE audit_entry IN EXCLUSIVE MODE")  # the last that an import writes
        process = Forked(command, tmp_path / "said")
        until(lambda: rows(plant.dsn, waiting))
        process.kill()
        assert process.wait() < 0
    assert scalar(plant, "SELECT count(*) FROM reading") == 0
    done = inband(*command)
    assert done.returncode == 0, done.stderr
    assert scalar(plant, "SELECT count(*) FROM reading") == 10_000
    assert scalar(plant, "SELECT max(sequence) FROM reading") == 10_000


def test_now_is_the_time_of_readings_that_have_none(plant: Database, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("measured\n39.992\n")
    run(plant, path)
    assert abs(stored(plant)[0]["measured_at"] - datetime.now(UTC)) < timedelta(minutes=1)
