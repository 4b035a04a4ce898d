"""The next calibration that is due, and its alarm, raised once."""

from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg
import pytest

from app.jobs.actions import run_jobs
from app.loop.calibration.jobs import JOB, overdue
from tests.loop.calibration.test_calibrations import calibrate, ring
from tests.shop import Person, Shop


def plan(shop: Shop, what: str = "averages/5", **body: Any) -> Any:
    return shop.call("PUT", f"/machines/{shop.machine}/{what}/calibration-plan", **body)


def go_round(shop: Shop) -> int:
    """Number of places that an alarm was raised for."""
    with shop.server.database.begin() as session:
        due = len(overdue(session))
    run_jobs(shop.server.database, [JOB])
    return due


def place(shop: Shop, memory: str = "average_memory", number: int = 5) -> Any:
    items = shop.call("GET", "/calibration")["items"]
    return next(each for each in items if each["machine"] == shop.machine and each[memory] == number)


def days_pass(shop: Shop, days: float) -> None:
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute(
            "UPDATE calibration_plan SET since = since - make_interval(secs => %s) WHERE machine_id = "
            "(SELECT id FROM machine WHERE key = %s)",
            [days * 86400, shop.machine],
        )


def test_a_location_that_is_measured_with_is_listed_without_a_plan(shop: Shop) -> None:
    found = place(shop)
    assert (found["state"], found["due_parts"], found["last"]) == ("never", None, None)
    assert found["characteristics"] == [shop.characteristic]
    assert go_round(shop) == 0


def test_by_parts(shop: Shop) -> None:
    for _ in range(3):
        shop.read(0.1)
    assert plan(shop, due_parts=10)["parts"] == 0  # what was measured before the plan does not count
    states = []
    for _ in range(10):
        shop.read(0.1)
        states.append(place(shop)["state"])
    assert states == ["never"] * 8 + ["due_soon", "overdue"]
    assert go_round(shop) == 1
    (alarm,) = shop.alarms()
    assert alarm["kind"] == "calibration_overdue"
    assert "for 10 parts" in alarm["text"]
    assert "R11 = 5" in alarm["text"]


def test_it_is_raised_once_and_again_only_after_the_next_calibration(shop: Shop) -> None:
    plan(shop, due_parts=1)
    shop.read(0.1)
    assert [go_round(shop), go_round(shop)] == [1, 0]
    (alarm,) = shop.alarms()
    shop.acknowledge(alarm["id"], "noted")
    assert go_round(shop) == 0
    assert place(shop)["state"] == "overdue"
    calibrate(shop, touches=[199.852])
    assert (place(shop)["state"], place(shop)["parts"]) == ("calibrated", 0)
    shop.read(0.1)
    assert go_round(shop) == 1
    calibrate(shop, touches=[199.852])
    assert shop.alarms() == []
    (first, second) = shop.alarms("acknowledged")
    assert (first["comment"], second["outcome"][0]["code"]) == ("looked at", "calibrated")


def test_by_days(shop: Shop) -> None:
    plan(shop, due_days=7.0)
    days_pass(shop, 6.5)
    assert (place(shop)["state"], go_round(shop)) == ("due_soon", 0)
    days_pass(shop, 1)
    assert (place(shop)["state"], go_round(shop)) == ("overdue", 1)
    assert "for 7 days" in shop.alarms()[0]["text"]


def test_one_that_comes_late_does_not_make_the_last_one_older(shop: Shop) -> None:
    plan(shop, due_days=7.0)
    now = datetime.now(UTC)
    calibrate(shop, touches=[199.852], calibrated_at=now.isoformat())
    calibrate(shop, touches=[199.852], calibrated_at=(now - timedelta(days=8)).isoformat())
    assert (place(shop)["state"], go_round(shop)) == ("calibrated", 0)


def test_a_refused_calibration_does_not_count(shop: Shop) -> None:
    plan(shop, due_parts=1)
    shop.read(0.1)
    go_round(shop)
    calibrate(shop, touches=[205.0])
    assert place(shop)["state"] == "overdue"
    assert {alarm["kind"] for alarm in shop.alarms()} >= {"calibration_overdue"}
    plan(shop, due_parts=100)
    assert place(shop)["state"] == "refused"


def test_what_waits_to_be_accepted_says_so(shop: Shop) -> None:
    calibrate(shop)
    assert place(shop)["state"] == "proposed"


def test_a_probe_is_due_by_whatever_its_machine_measures(shop: Shop) -> None:
    shop.add(f"{shop.characteristic}-b", average_memory=6)
    plan(shop, "tools/32", due_parts=2)
    shop.read(0.1)
    shop.read(0.1, f"{shop.characteristic}-b")
    assert (place(shop, "tool_memory", 32)["parts"], go_round(shop)) == (1, 0)
    shop.read(0.1)
    assert go_round(shop) == 1
    assert "R10 = 32" in shop.alarms()[0]["text"]
    operator = Person(shop.server, "operator")
    address = f"/calibration/{shop.machine}/probes/32"
    assert f'href="{address}"' in operator.open(f"/alarms?machine={shop.machine}")
    assert "R10 = 32" in operator.open(address)
    assert "due: 2 parts cut, limit 2" in operator.open(f"/calibration?machine={shop.machine}")
    ring(shop)
    assert shop.alarms() == []


def test_accepting_pairs_counts_as_a_calibration(shop: Shop) -> None:
    plan(shop, due_parts=1)
    shop.read(0.1)
    go_round(shop)
    averages = f"/machines/{shop.machine}/averages/5"
    for value in (40.0018, 40.0022, 40.002, 40.0019, 40.0021):
        shop.call("POST", f"{averages}/pairs", 201, machine_value=value, external_value=40.0, instrument="CMM")
    shop.call("POST", f"{averages}/suggestion/accept", 201, reason="compared")
    assert shop.alarms() == []
    assert place(shop)["state"] == "calibrated"


@pytest.mark.parametrize("what", ["averages/0", "averages/21", "tools/33"])
def test_a_place_that_is_none(shop: Shop, what: str) -> None:
    shop.call("PUT", f"/machines/{shop.machine}/{what}/calibration-plan", 404, due_parts=5)


def test_charts(shop: Shop) -> None:
    averages = f"/machines/{shop.machine}/averages/5/calibration-figure"
    assert shop.call("GET", averages)["data"] == []
    calibrate(shop)
    shop.call("POST", f"/machines/{shop.machine}/calibrations/1/accept", reason="x")
    calibrate(shop, touches=[199.8725])
    calibrate(shop, touches=[205.0])
    figure = shop.call("GET", averages)
    traces = {trace["meta"]: trace for trace in figure["data"]}
    assert [round(y, 6) for y in traces["accepted"]["y"]] == [20.0]
    assert [round(y, 6) for y in traces["unchanged"]["y"]] == [20.5]
    assert traces["value"]["y"] == [0.0, 20.0, 20.0]
    low, high = figure["layout"]["yaxis"]["range"]
    assert low < traces["refused"]["y"][0] < high < 100  # drawn at the edge, not 5 mm away
    assert traces["averaging"]["y"] == [10.0, 30.0, 30.0]
    ring(shop)
    ring(shop, sections=[{"plus": 24.1, "minus": -24.1}])
    figure = shop.call("GET", f"/machines/{shop.machine}/tools/32/calibration-figure?theme=dark")
    traces = {trace["meta"]: trace for trace in figure["data"]}
    assert traces["proposed"]["y"] == [12.0]
    assert len(traces["section 1"]["y"]) == 2
    assert len(traces["section 3"]["y"]) == 1
