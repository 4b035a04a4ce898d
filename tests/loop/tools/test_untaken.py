"""Corrections that a machine does not take: an alarm for each tool, which names the cause and ends by itself."""

from typing import Any

import psycopg
import pytest
from sqlalchemy.orm import Session

from app.jobs.actions import run_jobs
from app.loop.tools.untaken import Watch
from tests.loop.connections.test_heartbeat import ago, beat
from tests.shop import Person, Shop, unique

STEP = 240.0  # s between two runs
HELD: dict[str, Any] = {"tool_memory": 3, "number": 1, "reason": "Tool memory 3 has no location."}


class Runs:
    """The job of a server that has been up for a while."""

    def __init__(self, shop: Shop) -> None:
        self.shop, self.now = shop, 0.0
        self.watch = Watch(1800.0, 5, lambda: self.now)

    def __call__(self, times: int = 9, step: float = STEP) -> list[dict[str, Any]]:
        for _ in range(times):
            self.now += step
            run_jobs(self.shop.server.database, [self.watch.job()])
        return [alarm for alarm in self.shop.alarms() if alarm["kind"] == "corrections_not_taken"]


@pytest.fixture
def runs(shop: Shop) -> Runs:
    return Runs(shop)


def waited(shop: Shop, minutes: int) -> None:
    """Let the pending corrections of this machine be as old as that."""
    age_corrections(shop.server.database.dsn, shop.machine, minutes)


def age_corrections(dsn: str, machine: str, minutes: int) -> None:
    with psycopg.connect(dsn) as connection:
        connection.execute("SET session_replication_role = replica")  # else it is refused: a correction is a fact
        connection.execute(
            "UPDATE correction SET created_at = now() - make_interval(mins => %s)"
            " WHERE machine_id = (SELECT id FROM machine WHERE key = %s)",
            [minutes, machine],
        )


def test_parts_that_are_cut_long_after_a_correction_raise_an_alarm(shop: Shop, runs: Runs) -> None:
    """A mailbox that nobody takes, or a machine that asks for none: without a bridge, too."""
    shop.read(6, measured_at=ago(minutes=50))
    waited(shop, 50)
    assert runs() == [], "no part since: the machine stands still"
    shop.read(6, measured_at=ago(minutes=1))
    [alarm] = runs(1)
    assert alarm["tool_memory"] == 3
    assert "does not take correction 1 of tool 3" in alarm["text"]
    assert "part program" in alarm["what_to_do"]
    assert [each["count"] for each in runs(1)] == [1]
    shop.correction(1, "applied")
    assert runs(1) == []
    ended = shop.call("GET", f"/alarms/{alarm['id']}")
    assert (ended["state"], ended["outcome"][0]["code"]) == ("acknowledged", "corrections_taken")


def test_parts_out_of_tolerance_stop_the_machine_that_takes_nothing(shop: Shop, runs: Runs) -> None:
    """What was counted in is not in the offset: the next part is out as well. Once it is taken, the loop goes on."""
    shop.read(9, measured_at=ago(minutes=50), correction_in_effect=0)
    waited(shop, 50)
    on_its_way = shop.read(9, measured_at=ago(minutes=1), correction_in_effect=0)
    assert (on_its_way["action"], on_its_way["reason"]["code"]) == ("none", "within_zero_range")
    [alarm] = runs()
    assert "asks the machine to stop" in alarm["text"]
    answer = shop.read(9, correction_in_effect=0)
    assert (answer["action"], answer["reason"]["code"], answer["correction"]) == ("stop", "not_taken", None)
    assert f"does not take the corrections of this tool (alarm {alarm['id']})" in answer["reason"]["text"]
    assert shop.read(8, correction_in_effect=0)["action"] == "none", "in tolerance"
    shop.acknowledge(alarm["id"], "noted")
    assert shop.read(9, correction_in_effect=0)["action"] == "stop", "an answer brings no correction into the offset"
    shop.correction(1, "applied")
    assert shop.read(9, correction_in_effect=1)["action"] == "correct"
    assert shop.read(9, correction_in_effect=1)["action"] == "none", "the next one is on its way, not left"


def test_corrections_in_a_row_raise_it_sooner(shop: Shop, runs: Runs) -> None:
    for size in (6, 12, 18, 24, 30):  # each is decided as if the corrections before it were in the offset
        shop.read(size)
    waited(shop, 6)
    [alarm] = runs(3)
    assert "5 corrections of tool 3" in alarm["text"]
    shop.acknowledge(alarm["id"], "noted")
    assert runs(3) == [], "it is not reported again for the same ones"


@pytest.mark.parametrize("kind", ["dprnt", "folder", "mtconnect", "text"])
def test_a_bridge_that_carries_no_corrections_is_named(shop: Shop, runs: Runs, kind: str) -> None:
    for size in (6, 12, 18, 24, 30):
        shop.read(size)
    waited(shop, 6)
    beat(shop, kind=kind, locations=[], carries_decisions=False)
    [alarm] = runs(3)
    assert "5 corrections of tool 3" in alarm["text"]
    assert "Its bridge carries no corrections" in alarm["text"]


def test_what_the_bridge_says_of_the_control_is_in_the_alarm(shop: Shop, runs: Runs) -> None:
    """Where it writes offsets itself: why the control lets it not."""
    for size in (6, 12, 18, 24, 30):
        shop.read(size)
    waited(shop, 6)
    beat(shop, locations=[{"tool_memory": 3}], detail="Correction 1 waits: tool 3 is in use.")
    [alarm] = runs(3)
    assert "Its bridge says: Correction 1 waits: tool 3 is in use. Meanwhile" in alarm["text"]


def test_what_the_bridge_says_of_other_tools_is_not_in_the_alarm(shop: Shop, runs: Runs) -> None:
    for size in (6, 12, 18, 24, 30):
        shop.read(size)
    waited(shop, 6)
    other = HELD | {"tool_memory": 4, "reason": "Correction 9 is for tool memory 4, which has no location."}
    said = "The date of the control is wrong."
    beat(shop, locations=[{"tool_memory": 3}], held_back=[other], detail=f"{said} {other['reason']}")
    [alarm] = runs(3)
    assert f"Its bridge says: {said} Meanwhile" in alarm["text"]


def test_what_the_bridge_holds_back_is_reported_at_once_with_its_reason(shop: Shop, runs: Runs) -> None:
    shop.read(6)
    beat(shop, held_back=[HELD], hold_all=True)
    assert runs(2) == [], "on hold by command"
    beat(shop, held_back=[HELD, HELD | {"tool_memory": 4}])
    [alarm] = runs(1)
    assert "reaches the machine: Tool memory 3 has no location. Meanwhile" in alarm["text"]
    assert shop.call("GET", f"/machines/{shop.machine}/connection")["held_back"][0] == HELD
    beat(shop)
    assert runs(1) == []


def test_time_while_the_server_was_away_does_not_count(shop: Shop, runs: Runs) -> None:
    """A server that cannot be reached for an hour: what was cut meanwhile is sent when it is back, and then taken."""
    shop.read(6, measured_at=ago(minutes=70))
    waited(shop, 70)
    runs(9)
    shop.push([6.0] * 6, measured_at=[ago(minutes=60 - 10 * n) for n in range(6)])
    waited(shop, 70)
    assert runs(1, 3600.0) == []
    assert runs(1) == []
    assert len(runs(8)) == 1, "but from then on it does"


def test_set_up_warns_of_what_the_bridge_does_not_carry(shop: Shop, engineer: Person) -> None:
    parameters = shop.call("GET", f"/characteristics/{shop.characteristic}")["parameters"]

    def warned(memory: int, **more: Any) -> list[dict[str, Any]]:
        body: dict[str, Any] = {"key": unique("warned"), "name": "x", "machine": shop.machine, "unit": "mm"}
        given = parameters | {"tool_memory": memory} | more
        return list(shop.call("POST", "/characteristics", 201, **body, parameters=given)["warnings"])

    def codes(memory: int, **more: Any) -> list[str]:
        return [each["code"] for each in warned(memory, **more)]

    assert codes(7) == [], "no bridge"
    beat(shop, locations=[])
    [warning] = warned(7)
    assert (warning["code"], "carries no corrections" in warning["text"]) == ("not_mapped", True)
    assert codes(7, mode="measure_only") == []
    place = {"tool_memory": 3, "proved_at": ago(days=1)}
    beat(shop, locations=[place | {"corrected": False}])
    assert codes(3) == ["not_mapped"], "the bridge may make touch tests of it, and carries nothing"
    beat(shop, locations=[{"tool_memory": 3}])
    [warning] = warned(3)
    assert (warning["code"], f"plant.toml {shop.machine} 3" in warning["text"]) == ("not_proved", True)
    assert codes(3, mode="measure_only") == []
    beat(shop, locations=[{"tool_memory": 3, "proof_needed": False}])
    assert codes(3) == []
    beat(shop, locations=[place], carries_decisions=True)
    assert (codes(3), codes(8), codes(9, mode="measure_only")) == ([], ["not_mapped"], [])
    change: dict[str, Any] = {"parameters": {"tool_memory": 8}, "reason": "another turret"}
    [warning] = shop.call("PATCH", f"/characteristics/{shop.characteristic}", **change)["warnings"]
    assert (warning["code"], warning["field"]) == ("not_mapped", "parameters.tool_memory")
    assert f"[[machine.{shop.machine}.location]]" in warning["text"]
    beat(shop, locations=[place], carries_decisions=False)
    assert codes(3, mode="measure_only") == ["no_stop"], "a probe fault stops that machine by an alarm alone"
    page = engineer.open(f"/setup/characteristics/{shop.characteristic}")
    assert "has no location for tool memory 8" in page
    assert "cannot be stopped by Inband" in page


def test_in_a_plant_where_nothing_waits_there_is_nothing_to_do(session: Session) -> None:
    assert Watch(1800.0, 5).due(session) == []
