"""Control plans: what is due is said, what is missed is an alarm until the next reading, and is counted."""

from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import psycopg
import pytest

from app.jobs.actions import run_jobs
from app.loop.control_plan import actions, jobs, signs
from tests.servers import Server
from tests.shop import Person, Shop

WHY = "Agreed with quality"

HELD_LONG = """UPDATE control_plan SET since = now() - interval '2 days'
    WHERE machine_id = (SELECT id FROM machine WHERE key = %s)"""


@pytest.fixture
def other(shop: Shop) -> str:
    """Another characteristic of the same part, which is measured at every part."""
    return face_of(shop)


def face_of(shop: Shop) -> str:
    face = shop.another("face", tool_memory=7, average_memory=7)
    for key in (shop.characteristic, face):
        shop.call("PATCH", f"/characteristics/{key}", part="shaft-0815")
    return face


def plan(shop: Shop, status: int = 200, **rules: Any) -> Any:
    return shop.call("PUT", f"/characteristics/{shop.characteristic}/control-plan", status, reason=WHY, **rules)


def look(shop: Shop) -> list[dict[str, Any]]:
    """Let the job run; the active alarms."""
    run_jobs(shop.server.database, [jobs.JOB])
    return shop.alarms()


def due(shop: Shop) -> Any:
    (item,) = shop.call("GET", f"/due-measurements?machine={shop.machine}")["items"]
    return item


def missed(shop: Shop) -> list[Any]:
    items: list[Any] = shop.call("GET", f"/missed-measurements?characteristic={shop.characteristic}")["items"]
    return items


def cut(shop: Shop, other: str, *parts: str) -> None:
    for part in parts:
        shop.read(0.1, other, part=part)


def test_a_part_too_many_is_an_alarm_that_the_next_reading_ends(shop: Shop, other: str) -> None:
    cut(shop, other, "A1", "A2", "A3")
    plan(shop, every=2)
    shop.read(0.1, part="A4")
    cut(shop, other, "A4", "A5")
    assert (due(shop)["due"], due(shop)["next_in"], look(shop)) == ("later", 2, [])
    cut(shop, other, "A6")
    assert (due(shop)["due"], due(shop)["parts"], look(shop)) == ("due", 1, [])
    cut(shop, other, "A7")
    assert due(shop)["due"] == "missed"
    (alarm,) = look(shop)
    assert (alarm["kind"], alarm["characteristic"], alarm["count"]) == ("measurement_missed", shop.characteristic, 1)
    assert "2 parts or more" in alarm["text"]
    assert "1 in 2 parts" in alarm["text"]
    cut(shop, other, "A8")
    assert look(shop)[0]["count"] == 1, "once, however long it lasts"
    shop.read(0.1, part="A9")
    assert look(shop) == []
    (ended,) = shop.alarms("acknowledged")
    assert (ended["acknowledged_by"], ended["outcome"][0]["sequence"]) == ("inband", 2)
    (one,) = missed(shop)
    assert (one["by"], one["every"], one["after"], one["until"], one["parts"]) == ("parts", 2, 1, 2, 4)
    assert (look(shop), len(missed(shop))) == ([], 1), "looked at again it changes nothing"


def test_one_that_was_made_up_for_between_two_looks_is_counted_without_an_alarm(shop: Shop, other: str) -> None:
    plan(shop, every=1)
    shop.read(0.1, part="A1")
    cut(shop, other, "A1", "A2", "A3")
    shop.read(0.1, part="A3")
    assert look(shop) == []
    (one,) = missed(shop)
    assert (one["after"], one["until"], one["parts"]) == (1, 2, 1)


def test_acknowledging_does_not_raise_it_again(shop: Shop, other: str) -> None:
    plan(shop, every=1)
    cut(shop, other, "A1", "A2")
    (alarm,) = look(shop)
    shop.acknowledge(alarm["id"], "noted")
    cut(shop, other, "A3")
    assert look(shop) == []
    shop.read(0.1, part="A4")
    cut(shop, other, "A5", "A6")
    assert len(look(shop)) == 1, "another one"
    assert [one["parts"] for one in missed(shop)] == [1, 3]


def test_every_part_after_an_alarm_and_after_a_tool_change(shop: Shop, other: str) -> None:
    plan(shop, every=50, after_alarm=2, after_change=1)
    assert due(shop)["tightened"] is None, "the tool was never changed"
    shop.push([0.1, 0.1])
    assert (due(shop)["every"], due(shop)["tightened"]) == (50, None)
    shop.read(9.0)
    assert (due(shop)["every"], due(shop)["tightened"]) == (1, "alarm")
    cut(shop, other, "A1", "A2")
    assert {alarm["kind"] for alarm in look(shop)} == {"oversize", "measurement_missed"}
    shop.read(0.1)
    assert (due(shop)["tightened"], due(shop)["due"]) == ("alarm", "due")
    shop.read(0.1)
    assert due(shop)["tightened"] is None, "its own alarm tightens nothing"
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="worn")
    assert due(shop)["tightened"] == "tool_change"
    shop.read(0.1)
    assert due(shop)["tightened"] is None


def test_parts_that_were_cut_before_the_tool_change_are_judged_by_the_plan(shop: Shop, other: str) -> None:
    plan(shop, every=10, after_change=3)
    shop.read(0.1, part="A1")
    cut(shop, other, "A2", "A3", "A4", "A5", "A6")
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="worn")
    cut(shop, other, "A7")
    assert (due(shop)["due"], due(shop)["parts"], look(shop)) == ("due", 5, [])
    cut(shop, other, "A8")
    (alarm,) = look(shop)
    assert (alarm["kind"], missed(shop)[0]["every"]) == ("measurement_missed", 1)


def test_what_happens_to_the_tool_counts_by_its_time(shop: Shop, other: str) -> None:
    """Numbers of readings move with an import, and those of another characteristic are none of this one."""
    plan(shop, every=50, after_alarm=2, after_change=1)
    shop.push([0.1] * 5)
    shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="worn")
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute("UPDATE stream SET sequence_at_tool_change = sequence_at_tool_change + 7")
    assert due(shop)["tightened"] == "tool_change"
    shop.read(0.1)
    assert due(shop)["tightened"] is None
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute(
            "INSERT INTO alarm (machine_id, kind, tool_memory, sequence, last_sequence, data)"
            " SELECT id, 'machine_fault', 3, 1, 1, '{\"location\": \"receiver\"}' FROM machine WHERE key = %s",
            (shop.machine,),
        )
    assert due(shop)["tightened"] == "alarm"


def test_a_reading_that_comes_late_is_neither_the_newest_nor_the_end_of_a_gap(shop: Shop, other: str) -> None:
    plan(shop, every=1)
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute(HELD_LONG, (shop.machine,))
    begin = datetime.now(UTC) - timedelta(hours=1)

    def at(*minutes: int) -> list[str]:
        return [(begin + timedelta(minutes=each)).isoformat() for each in minutes]

    shop.push([0.1] * 4, other, part=["A1", "A2", "A3", "A4"], measured_at=at(1, 2, 3, 4))
    shop.push([0.1] * 3, part=["A1", "A2", "A3"], measured_at=at(1, 2, 3))
    assert look(shop) == []
    shop.read(0.1, part="A0", measured_at=at(0)[0])
    assert (due(shop)["due"], due(shop)["last_sequence"], look(shop)) == ("due", 3, [])
    shop.read(0.1, part="A4", measured_at=at(4)[0])
    assert (look(shop), missed(shop)) == ([], [])


def test_numbers_from_before_the_plan_are_not_missed(shop: Shop, other: str) -> None:
    shop.read(0.1, part="N1")
    cut(shop, other, "N2", "N9")
    plan(shop, every=2, numbered=True)
    cut(shop, other, "N10")
    assert (due(shop)["parts"], look(shop)) == (0, [])
    cut(shop, other, "N13")
    assert due(shop)["parts"] == 1, "numbers count from a reading under the plan on"


def test_by_minutes_and_by_shift_while_the_part_is_made(shop: Shop, other: str) -> None:
    plan(shop, minutes=20.0)
    with psycopg.connect(shop.server.database.dsn) as connection:  # it holds since yesterday
        connection.execute(HELD_LONG, (shop.machine,))
    noon = datetime.now(UTC) - timedelta(hours=26)
    shop.read(0.1, measured_at=noon.isoformat())
    moments = [(noon + timedelta(minutes=10 * at)).isoformat() for at in (1, 2)]
    shop.push([0.1, 0.1], other, measured_at=moments)
    assert look(shop) == []
    shop.read(0.1, other, measured_at=(noon + timedelta(minutes=30)).isoformat())
    (alarm,) = look(shop)
    assert "30 min" in alarm["text"]
    plan(shop, per_shift=True)
    assert look(shop) == [], "another plan ends it"
    assert missed(shop)[0]["until"] is None
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute(HELD_LONG, (shop.machine,))
    shop.read(0.1, other, measured_at=(noon + timedelta(hours=9)).isoformat())  # at least one shift on, and over
    assert "shift" in look(shop)[0]["text"]


def test_a_characteristic_alone_is_overdue_by_the_minutes_that_the_control_reports(shop: Shop) -> None:
    plan(shop, minutes=20.0)
    now = datetime.now(UTC)
    ran = "INSERT INTO machine_run SELECT id, %s, %s FROM machine WHERE key = %s"
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute(HELD_LONG, (shop.machine,))
        for begin, until in ((90, 45), (40, 35)):  # min ago; it ran before the reading too
            times = [now - timedelta(minutes=each) for each in (begin, until)]
            connection.execute(ran, (*times, shop.machine))
    shop.read(0.1, measured_at=(now - timedelta(minutes=55)).isoformat())
    assert (round(due(shop)["minutes"]), look(shop)) == (15, [])
    for running in (False, None, True):
        body: dict[str, Any] = {"version": "1", "state": "online", "waiting": 0, "running": running}
        shop.call("POST", f"/machines/{shop.machine}/heartbeat", client=shop.machine_client, **body)
    with psycopg.connect(shop.server.database.dsn) as connection:
        earlier = "UPDATE machine_run SET begin = begin - interval '8 minutes' WHERE begin > %s RETURNING begin"
        [began] = connection.execute(earlier, (now,)).fetchone() or ()
    (alarm,) = look(shop)
    assert "23 min" in alarm["text"]
    ring = shop.another("ring", tool_memory=7, average_memory=7)
    shop.read(0.1, ring, measured_at=(began + timedelta(minutes=3)).isoformat())
    (alarm,) = look(shop)
    assert "23 min" in alarm["text"], "the record keeps what was known when it was missed"
    assert round(due(shop)["minutes"]) == 18, "from that part on it may have run for that one"
    shop.read(0.1)
    assert look(shop) == []


def test_of_parts_that_nothing_tells_of_none_is_missed(shop: Shop, other: str) -> None:
    plan(shop, every=1)
    shop.push([0.1] * 3)
    assert (due(shop)["due"], due(shop)["parts"], look(shop)) == ("due", None, [])
    assert "not known" in due(shop)["text"]
    shop.call("PATCH", f"/characteristics/{other}", part="another part")
    cut(shop, other, "B1", "B2", "B3")
    assert look(shop) == [], "the machine makes another part now"


def test_without_a_part_nobody_knows_which_characteristics_are_of_one(shop: Shop, other: str) -> None:
    """Two workpieces on one machine, of which nobody has stated the names, are not taken for one."""
    plan(shop, every=1)
    for key in (shop.characteristic, other):
        shop.call("PATCH", f"/characteristics/{key}", part=None)
    cut(shop, other, "A1", "A2", "A3")
    shop.push([0.1] * 3, other)
    assert (due(shop)["parts"], look(shop)) == (None, [])
    assert "State it in Set-up" in due(shop)["text"]
    plan(shop, every=1, numbered=True)
    shop.push([0.1] * 3, other)
    shop.read(0.1, part="A4")
    cut(shop, other, "A5", "A6")
    assert due(shop)["parts"] == 1, "numbers of the machine tell"


def test_no_more_is_read_than_is_needed(shop: Shop, other: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signs, "FEW", 2)
    plan(shop, every=1)
    cut(shop, other, "A1", "A2", "A3", "A4", "A5", "A6")
    look(shop)
    assert missed(shop)[0]["parts"] == 5, "more than the newest few where all of these are since"
    monkeypatch.setattr(signs, "FURTHEST", 2)  # as if an import had brought the rest
    for part in ("A6", "A7", "A8"):
        shop.read(0.1, part=part)
    cut(shop, other, "A8")
    assert look(shop) == []
    assert len(missed(shop)) == 1


def test_one_that_fails_stops_no_other(shop: Shop, other: str, server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    plan(shop, every=1)
    neighbour = Shop(server)
    plan(neighbour, every=1)
    cut(neighbour, face_of(neighbour), "A1", "A2")
    cut(shop, other, "A1", "A2")

    def fails(session: Any, machine_id: int, characteristic_id: int) -> None:
        actions.check_plan(session, machine_id, characteristic_id)
        if failing == (machine_id, characteristic_id):
            raise RuntimeError("torn cable")

    with server.database.sessions() as session:
        failing = next(
            unit.key for unit in jobs.due(session) if unit.subject == f"characteristic/{shop.characteristic}"
        )
    monkeypatch.setattr(jobs, "check_plan", fails)
    assert look(shop) == []
    assert [alarm["kind"] for alarm in neighbour.alarms()] == ["measurement_missed"]


def test_a_plan_is_set_by_engineers_on_record_and_not_over_a_newer_one(shop: Shop, server: Server) -> None:
    here = f"/characteristics/{shop.characteristic}/control-plan"
    assert shop.call("GET", here)["text"] == "No control plan"
    engineer, operator = (server.client(server.key(role)) for role in ("engineer", "operator"))
    shop.call("PUT", here, 403, client=operator, every=5, reason=WHY)
    for wrong in ({"every": 0}, {"minutes": -1.0}, {"after_alarm": 1001}, {"often": 3}):
        assert plan(shop, 422, **wrong)["errors"][0]["field"] == next(iter(wrong))

    def put(every: int, tag: str) -> httpx.Response:
        return engineer.put(f"/api/v1{here}", json={"every": every, "reason": WHY}, headers={"If-Match": tag})

    seen = engineer.get(f"/api/v1{here}").headers["ETag"]
    assert [put(5, seen).status_code, put(6, seen).status_code] == [200, 412]
    assert shop.call("GET", here)["every"] == 5
    (entry,) = shop.call("GET", f"/audit?subject=characteristic/{shop.characteristic}&limit=1")["items"]
    assert (entry["action"], entry["after"]) == ("control plan set", {"every": 5})
    plan(shop)
    assert shop.call("GET", f"/due-measurements?machine={shop.machine}")["items"] == []


def test_its_page(shop: Shop, other: str, server: Server) -> None:
    here = f"/characteristics/{shop.characteristic}/control-plan"
    engineer = Person(server, "engineer")
    assert "no measurement is missed" in engineer.open(here)
    assert "Engineers set the plan" in Person(server, "operator").open(here)
    engineer.send(here, 422, every="many", reason=WHY)
    engineer.send(here, 422, every="5", reason="")
    assert "The control plan is set" in engineer.send(here, every="1", after_change="3", per_shift="true", reason=WHY)
    cut(shop, other, "A1", "A2")
    look(shop)
    page = engineer.open(here)
    assert "Measurement missed" in page
    assert "not yet" in page
    assert "each of the first 3 parts after a tool change" in page
    assert f'href="{here}"' in engineer.open(f"/characteristics/{shop.characteristic}")


def test_what_a_reading_must_say_is_asked_for_and_never_costs_the_reading(shop: Shop) -> None:
    shop.read(0.1)
    assert plan(shop, required_context=["nest", "order"])["required_context"] == ["order", "nest"]
    assert look(shop) == [], "what came before the plan lacks nothing"
    assert shop.read(0.2, context={"order": "A-1", "nest": 0})["sequence"] == 2
    assert look(shop) == []
    assert shop.read(0.3, context={"order": "A-1"})["sequence"] == 3, "stored all the same"
    shop.read(0.4, context={"order": "A-1", "nest": 2})
    (alarm,) = look(shop)
    assert (alarm["kind"], alarm["characteristic"]) == ("context_missing", shop.characteristic)
    assert "1 reading does not say" in alarm["text"]
    assert "nest" in alarm["text"]
    assert "order" not in alarm["text"]
    assert look(shop)[0]["count"] == 1, "no reading, no look"
    shop.push([0.5], context=[{"nest": 1}])
    shop.push([0.6])
    (alarm,) = look(shop)
    assert (alarm["count"], alarm["data"]) == (2, {"fields": ["order", "nest"], "readings": 3, "last": 6})
    assert "3 readings do not say" in alarm["text"]
    shop.read(0.5, context={"order": "A-1", "nest": 1})
    assert look(shop) == []
    (ended,) = shop.alarms("acknowledged")
    assert ended["outcome"][0]["sequence"] == 7


def test_an_alarm_happened_when_the_reading_that_raised_it_came(shop: Shop) -> None:
    """A plan counts readings from that moment on: one microsecond later and the reading itself would be before its alarm."""
    raised = None
    for count in (1, 2):
        came = shop.read(350.0)["received_at"]
        raised = raised or came
        (alarm,) = shop.alarms()
        assert (alarm["count"], alarm["raised_at"], alarm["last_at"]) == (count, raised, came)


def test_an_alarm_about_context_ends_with_the_rule(shop: Shop) -> None:
    plan(shop, required_context=["order"], every=1)
    shop.read(0.1)
    assert [alarm["kind"] for alarm in look(shop)] == ["context_missing"]
    plan(shop, every=1)
    assert look(shop) == []
    plan(shop, 422, required_context=["colour"])


def test_the_page_sets_what_a_reading_must_say_and_shows_what_lacks_it(shop: Shop, server: Server) -> None:
    engineer = Person(server, "engineer")
    path = f"/characteristics/{shop.characteristic}/control-plan"
    engineer.send(path, 200, reason=WHY, **{"required_context.order": "true", "required_context.batch": "true"})
    shop.read(0.1, context={"order": "A-1"})
    page = engineer.open(path)
    assert "Each reading says: order, batch." in page
    assert "1 reading since then lacks it: batch." in page
    engineer.send(path, reason=WHY, every="5")
    assert shop.call("GET", path)["required_context"] == []
