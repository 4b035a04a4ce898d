import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import psycopg
import pytest
from sqlalchemy.exc import DBAPIError

from app import HOUSE
from app.cli.base import existing_url
from app.db import migrate
from app.db.migrate import MigrationError
from app.settings import Settings
from tests.databases import NewDatabase
from tests.db.first_program import ADMIN_KEY, ANA, MACHINE_KEY, move
from tests.servers import RunServer
from tests.waits import until


def test_tables_and_migrations_say_the_same(new_database: NewDatabase) -> None:
    assert migrate.differences(new_database()) == []


def test_an_empty_database_is_brought_to_the_head(empty_database: str) -> None:
    todo = migrate.pending(empty_database)
    assert todo
    assert migrate.current(empty_database) is None
    assert migrate.upgrade(empty_database) == todo
    assert migrate.current(empty_database) == migrate.head()
    assert migrate.pending(empty_database) == migrate.upgrade(empty_database) == []


TITLES = sorted(
    f"{number.group(1)} {text.splitlines()[0].strip(chr(34)).rstrip('.')}"
    for text in (file.read_text(encoding="utf-8") for file in (HOUSE / "migrations" / "versions").glob("*.py"))
    if (number := re.search(r'^revision = "(\d{4})"$', text, re.MULTILINE)) and number.group(1) > "0100"
)
"""Number and first line of each migration behind the first program's."""
Rows = dict[str, list[dict[str, Any]]]
ADDED: dict[str, dict[str, Any]] = {
    "machine": {
        "type": "other",
        "tool_locations": 32,
        "average_locations": 20,
        "plausible_turn": 5,
        "plausible_shift": 10,
        "plausible_axis_turn": 1,
        "plausible_axis_shift": 1,
        "simulated": False,
    },
    "machine_state": {"planned": False},
    "audit_entry": {"person_id": None, "key_id": None, "device_id": None},
    "person": {"pin_hash": None},
    "api_key": {"last_used_at": None},
    "correction": {"mapping": None},
    "baseline": {"shifts": None},
    "characteristic": {"form_of": None, "form": None},
    "alarm": dict.fromkeys(("cause", "corrective_action", "reaction_plan", "reaction_version")),
    "reading_results": {"straightness": None},
    "report_job": {"person_id": None, "key_id": None},
    "outlook": dict.fromkeys(("record_of", "lives", "tested", "held", "widening")),
}
"""Values that rows of the first program get in the columns that it did not have."""
ADDED_TABLES = {
    "warning_acknowledgement",
    "known_place",
    "job_run",
    "job_failure",
    "capability_verdict",
    "station_device",
    "wall_screen",
    "note",
    "badge",
    "reading_context",
    "reading_next",
    "connection",
    "touch_test",
    "import_mapping",
    "receiver",
    "notification_route",
    "receiver_group",
    "plant_calendar",
    "maintenance",
    "announced",
    "delivery",
    "quarantine",
    "quarantined_part",
    "control_plan",
    "present_context",
    "missed_measurement",
    "machine_run",
    "reaction_plan",
    "catalogue_entry",
    "thermal_expansion",
    "reaction_picture",
    "alarm_photo",
}


def rows_of(url: str) -> Rows:
    """Every row of every table as JSON; of outlooks without the reading they were made of, for they are made anew."""
    with psycopg.connect(url) as connection:
        tables = connection.execute("SELECT tablename FROM pg_tables WHERE schemaname = 'public'").fetchall()
        rows = {
            table: [row for (row,) in connection.execute(f"SELECT to_jsonb(t) - 'tableoid' FROM {table} t ORDER BY t")]  # noqa: S608
            for (table,) in tables
            if table != "alembic_version"
        }
    for outlook in rows["outlook"]:
        del outlook["sequence"]
    return rows


def test_a_database_of_the_first_program_is_brought_to_the_head_with_its_rows(first_program: str) -> None:
    before, todo = rows_of(first_program), migrate.pending(first_program)
    assert {table for table, rows in before.items() if rows} >= {
        "machine", "characteristic", "reading", "correction", "alarm", "audit_entry", "person", "api_key", "calibration",
        "gauge_study_revision", "work_zero", "alignment", "kinematics_run", "form_evaluation", "baseline", "outlook",
    }  # fmt: skip
    assert migrate.current(first_program) == migrate.SQUASHED, "whoever asks changes nothing"
    with ThreadPoolExecutor(4) as pool:
        done = list(pool.map(migrate.upgrade, [first_program] * 4))
    assert sorted(done) == [[], [], [], todo]
    assert todo == TITLES
    assert migrate.current(first_program) == migrate.head()
    assert migrate.differences(first_program) == []
    after = rows_of(first_program)
    assert {table: after.pop(table) for table in ADDED_TABLES} == {table: [] for table in ADDED_TABLES}
    for stream in before["stream"]:
        stream["gain_from"] = stream["sequence"]
    assert after == {table: [row | ADDED.get(table, {}) for row in rows] for table, rows in before.items()}


def test_the_first_program_gets_its_database_back(first_program: str) -> None:
    before = rows_of(first_program)
    migrate.upgrade(first_program)
    move(first_program, "0100")
    assert rows_of(first_program) == before
    with psycopg.connect(first_program) as connection:  # as it was free to do
        connection.execute("UPDATE reading SET part = 'SN-1' WHERE sequence = 1")
        connection.rollback()
    assert migrate.upgrade(first_program)
    assert migrate.differences(first_program) == []
    with (
        psycopg.connect(first_program) as connection,
        pytest.raises(psycopg.errors.RaiseException, match="append-only"),
    ):
        connection.execute("UPDATE reading SET part = 'SN-1' WHERE sequence = 1")


def test_each_migration_goes_there_and_back_with_the_rows_of_the_first_program(first_program: str) -> None:
    before, steps = rows_of(first_program), migrate.upgrade(first_program)
    at_head = rows_of(first_program)

    def back() -> Iterator[tuple[str, Rows]]:
        for revision, name in zip(["0100", *(line.split()[0] for line in steps)][-2::-1], steps[::-1], strict=True):
            assert migrate.downgrade(first_program, revision) == [name]
            assert migrate.current(first_program) == revision
            yield name, rows_of(first_program)

    there = dict(back())
    assert there[steps[0]] == before
    assert migrate.upgrade(first_program) == steps
    assert rows_of(first_program) == at_head
    for undone, rows in back():
        assert rows == there[undone], undone


def test_the_way_back_is_gone_as_a_whole_or_not_at_all(first_program: str) -> None:
    migrate.upgrade(first_program)
    with psycopg.connect(first_program, autocommit=True) as connection:
        connection.execute("INSERT INTO tool (machine_id, number) VALUES (1, 33)")
    before = rows_of(first_program)
    with pytest.raises(MigrationError, match=r"left as it was: locations beyond R10"):
        migrate.downgrade(first_program, "0100")
    assert (rows_of(first_program), migrate.current(first_program)) == (before, migrate.head())


def test_there_is_no_way_back_to_a_schema_that_never_was(first_program: str) -> None:
    migrate.upgrade(first_program)
    with pytest.raises(MigrationError, match=rf"no way back from {migrate.head()} to 0042, only to .*0101, 0100, 0018"):
        migrate.downgrade(first_program, "0042")


def test_an_answer_that_the_first_program_does_not_know_becomes_noted(first_program: str) -> None:
    migrate.upgrade(first_program)
    acknowledge = "UPDATE alarm SET acknowledged_at = now(), action = 'measured_by_hand' WHERE acknowledged_at IS NULL"
    with psycopg.connect(first_program, autocommit=True) as connection:
        assert connection.execute(acknowledge).rowcount
    move(first_program, "0100")
    assert {row["action"] for row in rows_of(first_program)["alarm"]} == {"tool_replaced", "noted"}


@pytest.mark.parametrize(
    "use",
    [
        "INSERT INTO tool (machine_id, number) VALUES (1, 33)",
        "INSERT INTO average_memory (machine_id, location) VALUES (1, 21)",
        """INSERT INTO parameters_version (machine_id, characteristic_id, version, parameters, created_by)
            SELECT 1, 1, 99, parameters || '{"feature": "tool"}', 'Ana' FROM parameters_version WHERE version = 1""",
    ],
)
def test_what_the_first_program_cannot_serve_is_not_given_back_to_it(first_program: str, use: str) -> None:
    migrate.upgrade(first_program)
    with psycopg.connect(first_program, autocommit=True) as connection:
        connection.execute(use)
    move(first_program, "0101")  # what came later goes by itself
    before = rows_of(first_program)
    with pytest.raises(DBAPIError, match="cannot serve"):
        move(first_program, "0100")
    assert (rows_of(first_program), migrate.current(first_program)) == (before, "0101")


def test_a_table_in_use_leaves_the_first_program_its_database(first_program: str) -> None:
    with psycopg.connect(first_program) as busy:
        busy.execute("LOCK TABLE audit_entry")
        with pytest.raises(MigrationError, match="left as it was"):
            migrate.upgrade(first_program)
    assert migrate.current(first_program) == migrate.SQUASHED
    assert migrate.upgrade(first_program)


def test_a_server_goes_on_where_the_first_program_stopped(first_program: str, run_server: RunServer) -> None:
    with run_server(first_program) as server:
        machine, admin = server.client(MACHINE_KEY), server.client(ADMIN_KEY)
        seen = {"action": "false_reading", "comment": "Chip on the stylus"}
        assert admin.post("/api/v1/alarms/4/acknowledge", json=seen).status_code == 200
        answer = machine.post("/api/v1/readings", json={"characteristic": "shaft-d40", "measured": 40.007}).json()
        assert (answer["sequence"], answer["correction"]["number"]) == (29, 7)
        for path in (
            "audit", "alarms", "readings?characteristic=shaft-d40", "characteristics/shaft-d40/wear", "gauge-studies/2",
            "characteristics/shaft-d40/capability", "characteristics/shaft-d40/baselines", "work-zeros/1", "alignments/1",
            "forms/1", "kinematics/runs/1", "machines/lathe-1/calibrations", "machines/lathe-1/averages/5/pairs", "reports",
        ):  # fmt: skip
            got = admin.get(f"/api/v1/{path}")
            assert got.status_code == 200, f"{path}: {got.text}"
        ana = server.client()
        ana.follow_redirects = True
        assert ana.post("/sign-in", data=ANA).status_code == 200
        for page in (
            "/", "/overview", "/alarms/2", "/characteristics/shaft-d40", "/characteristics/shaft-d40/report", "/gauges/2",
            "/work-zeros/1", "/alignments/1", "/forms/1", "/kinematics/runs/1", "/reports", "/setup/audit",
        ):  # fmt: skip
            assert ana.get(page).status_code == 200, page


@pytest.mark.parametrize(("revision", "last"), [("0017", migrate.SQUASHED), ("0121", migrate.FOLDED)])
def test_a_database_of_an_earlier_revision_is_left_alone(new_database: NewDatabase, revision: str, last: str) -> None:
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("UPDATE alembic_version SET version_num = %s", [revision])
    with pytest.raises(MigrationError, match=rf"revision {revision}.*goes on from.*{last}.*{migrate.CARRIERS[last]}"):
        migrate.upgrade(url)
    assert migrate.current(url) == revision


def test_of_processes_that_start_together_one_migrates(empty_database: str) -> None:
    with ThreadPoolExecutor(4) as pool:
        done = list(pool.map(migrate.upgrade, [empty_database] * 4))
    assert sorted(map(len, done)) == [0, 0, 0, len(max(done))]
    assert migrate.current(empty_database) == migrate.head()


def test_a_command_waits_for_the_server_that_migrates(new_database: NewDatabase) -> None:
    """`inband key add` beside a first `inband serve`: no talk of an older Inband."""
    url = new_database()
    with (
        psycopg.connect(url, autocommit=True) as server,
        psycopg.connect(url, autocommit=True) as looking,
        ThreadPoolExecutor(1) as pool,
    ):
        server.execute("SELECT pg_advisory_lock(%s)", [migrate.LOCK])
        server.execute("UPDATE alembic_version SET version_num = '0090'")
        command = pool.submit(_used, url)
        until(
            lambda: (
                looking.execute(
                    "SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND NOT granted"
                    " AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
                ).fetchone()
                == (1,)
            )
        )
        server.execute("UPDATE alembic_version SET version_num = %s", [migrate.head()])
        server.execute("SELECT pg_advisory_unlock(%s)", [migrate.LOCK])
        assert command.result(60) == migrate.head()


def _used(url: str) -> str | None:
    with existing_url(Settings(database_url=url)) as found:
        return migrate.current(found)


def test_a_database_of_a_newer_program_is_left_alone(new_database: NewDatabase) -> None:
    url = new_database()
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("UPDATE alembic_version SET version_num = 'from tomorrow'")
    with pytest.raises(MigrationError, match="newer"):
        migrate.upgrade(url)
    assert migrate.current(url) == "from tomorrow"
