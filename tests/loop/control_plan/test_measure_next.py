"""The answer to a reading says which part to measure next, by the plan in force, and says the same when it is sent again."""

from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg
import pytest

from app.core.control_plan import Plan, Tightened, measure_next
from tests.loop.control_plan.test_control_plan import due, plan
from tests.shop import Shop

CHANGE, ALARM = Tightened.TOOL_CHANGE, Tightened.ALARM


@pytest.mark.parametrize(
    ("rules", "since", "said"),
    [
        ({"every": 5}, {}, 5),
        ({"every": 5, "after_change": 3}, {CHANGE: 2, ALARM: 0}, 1),
        ({"every": 5, "after_change": 3, "after_alarm": 1}, {CHANGE: 3, ALARM: 1}, 5),
        ({"after_alarm": 2}, {ALARM: 1}, 1),
        ({"after_alarm": 2}, {ALARM: 2}, None),
        ({"minutes": 20.0, "per_shift": True}, {ALARM: 0}, None),
    ],
)
def test_the_rule(rules: dict[str, Any], since: dict[Tightened, int], said: int | None) -> None:
    rule = Plan(**rules)
    assert measure_next(rule, since, late=False, measured=True) == said
    assert measure_next(rule, since, late=True, measured=True) is None
    assert measure_next(rule, since, late=False, measured=False) == (None if said is None else 1)


def stored(shop: Shop) -> int:
    """Rows that were written beside the readings of the machine."""
    with psycopg.connect(shop.server.database.dsn) as connection:
        found = connection.execute(
            "SELECT count(*) FROM reading_next n JOIN machine m ON m.id = n.machine_id WHERE m.key = %s",
            (shop.machine,),
        ).fetchone()
    assert found is not None
    return int(found[0])


def test_without_a_plan_by_parts_nothing_is_said_or_stored(shop: Shop) -> None:
    assert shop.read(0.1)["measure_next"] is None
    plan(shop, minutes=20.0, per_shift=True)
    assert [each["measure_next"] for each in shop.push([0.1, 9.0], answers=True)] == [None, None]
    assert stored(shop) == 0
    plan(shop, every=4)
    assert shop.read(0.1)["measure_next"] == 4
    plan(shop)
    assert (shop.read(0.1)["measure_next"], stored(shop)) == (None, 1)


def test_sent_again_it_is_the_first_answer_whatever_the_plan_says_by_now(shop: Shop) -> None:
    plan(shop, every=5)
    body: dict[str, Any] = {"characteristic": shop.characteristic, "measured": 40.0001, "key": "once"}
    first = shop.call("POST", "/readings", 201, **body)
    batch = shop.push([0.1] * 3, answers=True, key=["a", "b", "c"])
    plan(shop, every=2)
    assert shop.read(0.1)["measure_next"] == 2
    assert shop.call("POST", "/readings", 200, **body) == first
    assert shop.push([0.1] * 3, answers=True, key=["a", "b", "c"]) == batch
    assert shop.call("GET", f"/readings/{shop.characteristic}/1")["measure_next"] == first["measure_next"] == 5


def test_it_is_what_is_due_whether_decided_from_memory_or_from_what_is_loaded(shop: Shop) -> None:
    """Alarms of readings, a changed tool, a fault that the machine reports, single readings and batches."""
    plan(shop, every=10, after_alarm=3, after_change=2)
    said, planned = [], []

    def read(*micrometres: float) -> None:
        answers = [shop.read(micrometres[0])] if len(micrometres) == 1 else shop.push(micrometres, answers=True)
        said.append(answers[-1]["measure_next"])
        planned.append(due(shop)["every"])

    for _ in range(20):  # until the snapshot is taken for true again
        shop.read(0.1)
    for deviation in (0.1, 9.0, 0.1, 0.1, 0.1, 0.1):
        read(deviation)
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="worn")
    for batch in ([0.1], [0.1], [0.1, 9.0, 0.1], [0.1], [0.1, 0.1], [0.1] * 70):
        read(*batch)
    assert said == planned
    assert said == [10, 1, 1, 1, 10, 10, 1, 10, 1, 1, 10, 10]


def test_an_alarm_about_the_tool_tightens_all_that_it_cuts(shop: Shop) -> None:
    face = shop.another("face", average_memory=7, max_total=0.005)
    plan(shop, every=10, after_alarm=2)
    rows = [(shop.characteristic, 0.1), (face, 6.0), (shop.characteristic, 0.1), (shop.characteristic, 0.1)]
    readings = [{"characteristic": of, "measured": round(40 + value / 1000, 6)} for of, value in rows]
    answers = shop.admin.post("/api/v1/readings/batch?decisions=true", json=readings).json()["items"]
    assert [alarm["kind"] for each in answers for alarm in each["alarms"]] == ["offset_limit"]
    assert [each["measure_next"] for each in answers] == [10, None, 1, 10]


def test_a_fault_is_no_measurement_and_one_that_comes_late_says_nothing(shop: Shop) -> None:
    plan(shop, every=10)
    assert shop.read(0.1)["measure_next"] == 10
    fault = shop.read(2000.0)
    assert (fault["zone"], fault["measure_next"]) == ("probe_fault", 1)
    late = shop.read(0.1, measured_at=(datetime.now(UTC) - timedelta(hours=1)).isoformat())
    assert (late["late"], late["measure_next"]) == (True, None)
