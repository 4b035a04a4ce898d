"""A clock that is behind: corrections act before they are counted, and the tool is paused by the alarm that names the clock."""

from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import psycopg
import pytest

from tests.shop import Shop

FOLLOWS = {"weighting_factor": 1, "zero_range": 0.001, "averaging_limit": 0.005, "tolerance_width": 0.016}
PARTS = 60


class Machine:
    """A lathe that cuts a part a minute and applies each correction before the next; wear 0.5 µm a part, scatter 0.3 µm."""

    def __init__(self, shop: Shop, behind: timedelta, **more: Any) -> None:
        self.shop, self.behind = shop, behind
        self.key = shop.another("clock", tool_memory=4, average_memory=6, **FOLLOWS | more)
        self.start = datetime.now(UTC) - timedelta(minutes=PARTS + 5)
        self.chance, self.offset, self.sizes = np.random.default_rng(4), 0.0, list[float]()

    def part(self, **more: Any) -> Any:
        cut = self.start + timedelta(minutes=len(self.sizes))
        # factor -1: a larger offset makes the size larger
        size = 0.5 * len(self.sizes) + self.offset * 1000 + float(self.chance.normal(0, 0.3))
        self.sizes.append(size)
        says = {"machined_at": (cut - self.behind).isoformat()} | more
        answer = self.shop.read(round(size, 2), self.key, **says)
        if answer["correction"] and answer["action"] == "correct":
            self.offset = round(self.offset + answer["correction"]["amount"], 9)
            at = (cut + timedelta(seconds=20)).isoformat()
            self.shop.correction(answer["correction"]["number"], "applied", offset_after=self.offset, applied_at=at)
        return answer


@pytest.mark.parametrize("minutes", [2.5, 120])
def test_a_clock_that_is_behind_pauses_the_tool_before_parts_are_out(shop: Shop, minutes: float) -> None:
    """Without it 34 to 43 of 60 parts are out."""
    machine = Machine(shop, timedelta(minutes=minutes))
    while machine.part()["reason"]["code"] != "paused":
        assert len(machine.sizes) < 30
    assert all(abs(size) < 8 for size in machine.sizes)
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "early_effect"]
    assert "the time of cutting that the machine sends says" in alarm["text"]
    assert "the clock of the machine is behind" in alarm["text"]
    assert "Set the clock of the machine" in alarm["what_to_do"]
    assert shop.tool(4)["paused_by"] == alarm["id"]
    shop.acknowledge(alarm["id"], "noted")
    assert shop.tool(4)["paused_by"] is None
    machine.behind = timedelta()
    assert [machine.part()["action"] for _part in range(4)].count("correct") >= 1


def test_where_the_sizes_do_not_show_it_the_alarm_about_the_part_names_the_clock(shop: Shop) -> None:
    """With k 2 the loop follows wear by half, and no pause comes: half of the parts are out, and each alarm says what it may be."""
    machine = Machine(shop, timedelta(hours=3), weighting_factor=2)
    while "oversize" not in {each["kind"] for each in shop.alarms()}:
        machine.part()
        assert len(machine.sizes) < PARTS
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "oversize"]
    assert "By the time of cutting that the machine sends, the part was cut 3 h" in alarm["text"]
    assert "the clock of the machine is behind" in alarm["text"]


def test_a_part_that_is_out_with_a_clock_that_is_right_names_none(shop: Shop) -> None:
    machine = Machine(shop, timedelta())
    for _part in range(5):
        machine.part()
    machine.sizes.extend([0.0] * 30)  # it wore on meanwhile
    machine.start += timedelta(minutes=-30)
    assert machine.part()["alarms"]
    (alarm,) = [
        each for each in shop.alarms() if each["kind"] != "correction_in_doubt"
    ]  # that its times are of the past
    assert (alarm["kind"], "clock" in alarm["text"]) == ("oversize", False)


def test_a_clock_that_is_right_pauses_nothing(shop: Shop) -> None:
    machine = Machine(shop, timedelta())
    for _part in range(PARTS):
        assert machine.part()["reason"]["code"] != "paused"
    assert all(abs(size) < 4 for size in machine.sizes)


def test_a_number_that_is_behind_is_found_as_well(shop: Shop) -> None:
    """The machine sends the number of the last correction but the two before it."""
    machine, number = Machine(shop, timedelta()), 0
    while (answer := machine.part(correction_in_effect=max(0, number - 2), machined_at=None))["reason"][
        "code"
    ] != "paused":
        assert len(machine.sizes) < PARTS
        number = answer["correction"]["number"] if answer["correction"] else number
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "early_effect"]
    assert "the number that the machine sends says" in alarm["text"]


# --- a clock that is behind, on a machine whose readings come one by one, as they are measured


AGED = (
    "UPDATE reading SET received_at = received_at - %(by)s, measured_at = measured_at - %(by)s, machined_at = machined_at - %(by)s",
    "UPDATE correction SET created_at = created_at - %(by)s, applied_at = applied_at - %(by)s",
    "UPDATE stream SET last_measured_at = last_measured_at - %(by)s",
    "UPDATE tool SET reset_at = reset_at - %(by)s, changed_at = changed_at - %(by)s",
    "UPDATE machine_state SET version = version + 1",
)
OF_MACHINE = " WHERE machine_id = (SELECT id FROM machine WHERE key = %(machine)s)"


class Live:
    """The same lathe at its own pace: a part a minute, of which the server hears at once. Its time is moved in place of waiting.

    behind: its clock.
    """

    def __init__(self, shop: Shop, behind: timedelta) -> None:
        self.shop, self.behind = shop, behind
        self.key = shop.another("live", tool_memory=4, average_memory=6, **FOLLOWS | {"weighting_factor": 2})
        self.chance, self.offset, self.sizes, self.actions = np.random.default_rng(4), 0.0, list[float](), list[str]()

    def wait(self, seconds: float) -> None:
        """Let so much time pass: for the server all was as much longer ago."""
        with psycopg.connect(self.shop.server.database.dsn) as connection:
            connection.execute("SET session_replication_role = replica")  # else it is refused: they are facts
            for each in AGED:
                connection.execute(each + OF_MACHINE, {"by": timedelta(seconds=seconds), "machine": self.shop.machine})

    def part(self) -> None:
        """Cut a part, measure the one that comes out of the buffer, apply what the server wants."""
        self.wait(60)
        size = 0.5 * len(self.sizes) + self.offset * 1000 + float(self.chance.normal(0, 0.3))
        self.sizes.append(size)
        now = (datetime.now(UTC) - self.behind).isoformat()
        answer = self.shop.read(round(size, 2), self.key, machined_at=now, measured_at=now)
        self.actions.append(answer["action"])
        if answer["action"] == "correct":
            self.offset = round(self.offset + answer["correction"]["amount"], 9)
            self.shop.correction(answer["correction"]["number"], "applied")

    def named(self) -> list[Any]:
        return [each for each in self.shop.alarms() if each["kind"] == "early_effect"]

    @property
    def out(self) -> int:
        return sum(abs(size) > 8 for size in self.sizes)


def test_a_machine_whose_every_reading_is_as_late_is_paused_before_a_part_is_out(shop: Shop) -> None:
    """Of 60 parts 25 to 30 would be out: with k 2 the loop follows wear by half, and sizes show nothing."""
    live = Live(shop, timedelta(hours=3))
    while not live.named():
        live.part()
        assert len(live.sizes) < 15
    [alarm] = live.named()
    assert live.out == 0
    assert "the clock of the machine is behind" in alarm["text"]
    assert "the time of measuring that the machine sends" in alarm["text"]
    shop.acknowledge(alarm["id"], "noted")
    live.behind = timedelta()
    for _part in range(12):
        live.part()
    assert (live.out, live.named()) == (0, [])
    assert "correct" in live.actions[-6:]


def test_after_a_tool_change_a_clock_that_is_behind_is_named_as_well(shop: Shop) -> None:
    """Parts count as cut with the edge that went out, and nothing is corrected for as long as the clock is behind."""
    live = Live(shop, timedelta(hours=1))
    shop.call("POST", f"/machines/{shop.machine}/tools/4/change", offset=0.0, reason="worn")
    while not live.named():
        live.part()
        assert len(live.sizes) < 10
    [alarm] = live.named()
    assert "before tool 4 was changed" in alarm["text"]
