"""Parts already cut when a correction is issued come out with the old offset; they must not be corrected for again.

The lathe here makes parts that are too large by `error` + its offset and measures each some parts after it was cut.
"""

import random
from collections import deque
from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg
import pytest

from app.core.parameters import read
from tests.loop.readings.record import history, must_hold, must_replay
from tests.shop import PARAMETERS, Shop

pytestmark = pytest.mark.own_server  # the whole record of its database is held against the rules


class Lathe:
    """Cuts with its own offset; what lies between cutting and measuring is the pipeline."""

    def __init__(self, shop: Shop, error: float, delay: int) -> None:
        self.shop, self.error, self.delay = shop, error, delay
        self.offset, self.in_effect, self.known = 0.0, 0, set[int]()
        self.line: deque[tuple[float, int, datetime]] = deque()
        self.clock = datetime.now(UTC) - timedelta(hours=1)

    def apply(self, *, confirm: bool) -> None:
        """Put what is pending into the offset, oldest first, and tell the server if that is this machine's way."""
        self.clock += timedelta(seconds=1)
        for correction in self.shop.call("GET", f"/machines/{self.shop.machine}/corrections?status=pending")["items"]:
            if correction["number"] in self.known:
                continue
            self.known.add(correction["number"])
            self.offset += correction["amount"]
            self.in_effect = correction["number"]
            if confirm:
                at = self.clock.isoformat()
                self.shop.correction(correction["number"], "applied", applied_at=at)

    def cut(self) -> tuple[float, int, datetime] | None:
        """Cut a part; the one that leaves the pipeline, if any (size, correction in effect, when)."""
        self.clock += timedelta(seconds=10)
        self.line.append((40 + self.error + self.offset, self.in_effect, self.clock))
        return self.line.popleft() if len(self.line) > self.delay else None

    def measure(self, part: tuple[float, int, datetime], how: str) -> Any:
        """Push the reading of a part, with what this machine tells of when it was cut."""
        size, in_effect, machined_at = part
        told: dict[str, Any] = {}
        if how == "number":
            told["correction_in_effect"] = in_effect
        elif how == "time":
            told["machined_at"] = machined_at.isoformat()
        return self.shop.call(
            *("POST", "/readings", 201),
            characteristic=self.shop.characteristic,
            measured=round(size, 6),
            measured_at=self.clock.isoformat(),
            **told,
        )


@pytest.mark.parametrize("how", ["number", "time", "unconfirmed"])
@pytest.mark.parametrize("delay", [0, 1, 4])
def test_a_step_is_corrected_once_however_long_the_pipeline(shop: Shop, delay: int, how: str) -> None:
    """A step of 7 µm leads to one correction of 7 µm; every part of the pipeline says why it asks for no more."""
    lathe = Lathe(shop, 0.007, delay)
    answers = []
    for _part in range(delay + 8):
        part = lathe.cut()
        if part is not None:
            if how == "unconfirmed" and part[1]:  # the first part that was cut with it: so long it was outstanding
                shop.correction(1, "applied")
            answers.append(lathe.measure(part, how))
        lathe.apply(confirm=how == "time")
    corrections = [answer["correction"]["amount"] for answer in answers if answer["correction"]]
    assert corrections == [-0.007]
    assert round(lathe.offset, 9) == -0.007
    in_pipeline = answers[1 : delay + 1]
    for answer in in_pipeline:
        assert (answer["deviation"], answer["decided_deviation"], answer["outstanding"]) == (0.007, 0.0, [1])
        assert (answer["zone"], answer["action"]) == ("zero", "none")
        assert answer["reason"]["notes"] == ["outstanding"]
        assert "before correction 1 took effect: its deviation of 7.0 µm counts as 0.0 µm" in answer["reason"]["text"]
    for answer in answers[delay + 1 :]:
        assert (answer["deviation"], answer["outstanding"]) == (0.0, [])
    stored = history(shop.server.database.dsn, shop.characteristic)
    assert [reading["deviation"] for reading in stored] == [answer["deviation"] for answer in answers]
    assert shop.tool()["offset"] == -0.007
    must_hold(shop.server.database.dsn)


@pytest.mark.parametrize("how", ["number", "time"])
def test_a_wearing_tool_is_followed_without_overshoot(shop: Shop, how: str) -> None:
    """The tool wears by 0.4 µm a part and the parts scatter; the loop never goes further than what it has seen."""
    chance = random.Random(5)
    lathe = Lathe(shop, 0.0, 3)
    deviations = []
    for _part in range(60):
        lathe.error += 0.0004 + chance.uniform(-0.0005, 0.0005)
        part = lathe.cut()
        if part is not None:
            deviations.append(lathe.measure(part, how)["deviation"])
        lathe.apply(confirm=how == "time")
    assert min(deviations) > -0.005, "corrected twice, it would swing to the other side"
    assert max(deviations) < 0.008
    assert lathe.offset < -0.015
    must_hold(shop.server.database.dsn)


def test_the_published_example_over_http(shop: Shop) -> None:
    """Domain §3: R33 = 4 µm, k = 2; corrections by 4.625, 4.375 and 4.25 µm, each in effect before the next part."""
    name = f"{shop.characteristic}-e"
    shop.add(name, zero_range=0.004, averaging_limit=0.0133, tolerance_width=0.04, average_memory=1)
    averages, corrected, in_effect = [], [], 0
    for micrometres in (3, 5, 6, 2, 4, 5, 5, 3, 7, 7):
        answer = shop.read(micrometres, name, correction_in_effect=in_effect)
        amount = answer["correction"] and answer["correction"]["amount"]
        averages.append(round(-amount * 1000, 6) if amount else round(answer["average_after"] * 1000, 6))
        corrected.append(bool(amount))
        in_effect = answer["correction"]["number"] if amount else in_effect
        assert answer["outstanding"] == []
    assert averages == [1.5, 3.25, 4.625, 1, 2.5, 3.75, 4.375, 1.5, 4.25, 3.5]
    assert [at + 1 for at, each in enumerate(corrected) if each] == [3, 7, 9]
    parameters = read(PARAMETERS | {"zero_range": 0.004, "averaging_limit": 0.0133, "tolerance_width": 0.04})[0]
    assert must_replay(parameters, history(shop.server.database.dsn, name)) == 3


class TestWhatIsOutstanding:
    def test_corrections_add_up_to_what_was_seen(self, shop: Shop) -> None:
        """Two corrections on their way: the third part, cut before both, is judged with both."""
        shop.read(6.0)
        second = shop.read(14.0)
        assert (second["decided_deviation"], second["outstanding"]) == (0.008, [1])
        third = shop.read(14.0)
        assert (third["decided_deviation"], third["outstanding"], third["action"]) == (0.0, [1, 2], "none")

    def test_a_reading_confirms_the_corrections_it_was_cut_with(self, shop: Shop) -> None:
        shop.read(6.0)
        assert shop.correction(1)["status"] == "pending"
        answer = shop.read(0.0, correction_in_effect=1, measured_at="2026-11-21T08:00:00Z")
        confirmed = shop.correction(1)
        assert (confirmed["status"], confirmed["offset_after"]) == ("applied", -0.006)
        assert f"reading {shop.characteristic} {answer['sequence']}" in confirmed["applied_by"]
        assert (shop.tool()["offset"], shop.tool()["total"]) == (-0.006, -0.006)
        assert shop.correction(1, "applied")["offset_after"] == -0.006

    def test_it_confirms_nothing_of_another_tool(self, shop: Shop) -> None:
        other = f"{shop.characteristic}-o"
        shop.add(other, tool_memory=4, average_memory=6)
        shop.read(6.0)
        shop.read(6.0, other)
        shop.read(0.0, other, correction_in_effect=2)
        assert [shop.correction(number)["status"] for number in (1, 2)] == ["pending", "applied"]

    def test_a_part_out_of_tolerance_is_alarmed_though_the_correction_is_on_its_way(self, shop: Shop) -> None:
        shop.read(50.0)
        answer = shop.read(50.0)
        assert (answer["zone"], answer["action"]) == ("zero", "none")
        assert [alarm["kind"] for alarm in answer["alarms"]] == ["oversize"]
        assert answer["reason"]["notes"] == ["outstanding", "part_out_of_tolerance"]

    def test_a_probe_fault_is_one_whatever_is_outstanding(self, shop: Shop) -> None:
        shop.read(290.0)
        assert shop.read(1000.0)["zone"] == "probe_fault"

    def test_a_held_correction_is_not_outstanding_until_it_is_released(self, shop: Shop) -> None:
        shop.read(350.0)
        again = shop.read(350.0)
        assert (again["decided_deviation"], again["outstanding"]) == (0.35, [])
        assert [shop.correction(number)["status"] for number in (1, 2)] == ["superseded", "held"]
        shop.correction(2, "release", reason="Insert is fine")
        after = shop.read(350.0)
        assert (after["decided_deviation"], after["outstanding"], after["action"]) == (0.0, [2], "none")

    def test_a_rejected_correction_counts_no_more(self, shop: Shop) -> None:
        shop.read(7.0)
        shop.correction(1, "rejected", reason="Chip on the stylus")
        answer = shop.read(7.0)
        assert (answer["outstanding"], answer["correction"]["amount"]) == ([], -0.007)

    def test_parts_cut_before_a_tool_change_say_nothing_of_the_new_tool(self, shop: Shop) -> None:
        shop.read(7.0)
        cut = datetime.now(UTC).isoformat()
        shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="Worn")
        answer = shop.read(7.0, machined_at=cut)
        assert (answer["action"], answer["reason"]["code"]) == ("none", "before_tool_change")
        assert shop.read(7.0, machined_at=datetime.now(UTC).isoformat())["action"] == "correct"

    @pytest.mark.parametrize("dropped", ["tool changed", "rejected"])
    def test_a_part_that_names_one_dropped_since_was_cut_without_later_ones(self, shop: Shop, dropped: str) -> None:
        """When a correction was dropped says nothing of when it took effect."""
        other = f"{shop.characteristic}-o"
        shop.add(other, tool_memory=4, average_memory=6)
        shop.read(6.0)
        shop.read(6.0, other)
        shop.correction(2, "applied")
        if dropped == "rejected":
            shop.correction(1, "rejected", reason="Typed in by hand")
        else:
            shop.call("POST", f"/machines/{shop.machine}/tools/3/change", offset=0.0, reason="Worn")
        answer = shop.read(6.0, other, correction_in_effect=1)
        assert (answer["outstanding"], answer["action"]) == ([2], "none")


class TestByMachinedAt:
    def test_what_was_applied_after_the_part_was_cut_is_outstanding(self, shop: Shop) -> None:
        start = datetime.now(UTC) - timedelta(minutes=10)

        def at(minutes: int) -> str:
            return (start + timedelta(minutes=minutes)).isoformat()

        shop.read(6.0, machined_at=at(0))
        shop.correction(1, "applied", applied_at=at(2))
        before = shop.read(6.0, machined_at=at(1), measured_at=at(4))
        assert (before["decided_deviation"], before["outstanding"]) == (0.0, [1])
        after = shop.read(1.0, machined_at=at(3), measured_at=at(5))
        assert (after["decided_deviation"], after["outstanding"]) == (0.001, [])
        assert "machined_at" not in before["reason"]["text"]
        slow = shop.read(1.0, machined_at=at(-130))
        assert slow["outstanding"] == [1]
        assert "By the time of cutting that the machine sends, it was cut 2 h" in slow["reason"]["text"], (
            "a clock that is behind is named"
        )


class TestApproval:
    @pytest.fixture
    def asking(self, shop: Shop) -> Shop:
        """Each correction waits for a person."""
        change: dict[str, Any] = {"parameters": {"mode": "approval"}, "reason": "Try it out"}
        shop.call("PATCH", f"/characteristics/{shop.characteristic}", **change)
        return shop

    def test_what_awaits_approval_is_outstanding(self, asking: Shop) -> None:
        assert asking.read(6.0)["correction"]["status"] == "awaiting_approval"
        assert asking.read(6.0)["outstanding"] == [1]
        asking.correction(1, "approve", reason="Good")
        assert asking.read(6.0)["outstanding"] == [1]
        asking.correction(1, "applied")
        assert asking.read(0.0)["outstanding"] == []

    def test_what_awaits_approval_cannot_be_in_effect(self, asking: Shop) -> None:
        """The machine has applied a later correction of another tool; ours still waits for a person."""
        asking.read(6.0)
        other = f"{asking.characteristic}-o"
        asking.add(other, tool_memory=4, average_memory=6)
        asking.read(6.0, other)
        asking.correction(2, "applied")
        answer = asking.read(6.0, correction_in_effect=2)
        assert (answer["outstanding"], answer["action"]) == ([1], "none")
        assert asking.correction(1)["status"] == "awaiting_approval"

    def test_corrections_count_in_the_order_in_which_they_took_effect(self, asking: Shop) -> None:
        """Approved in the other order: the machine applies 2, then 1, and says each time which one was the last."""
        asking.read(6.0)
        assert asking.read(13.0)["correction"]["amount"] == -0.007
        asking.correction(2, "approve", reason="First this one")
        asking.correction(2, "applied")
        with_second = asking.read(6.0, correction_in_effect=2)
        assert (with_second["outstanding"], with_second["decided_deviation"]) == ([1], 0.0)
        asking.correction(1, "approve", reason="Then that one")
        still = asking.read(6.0, correction_in_effect=2)
        assert still["outstanding"] == [1]
        assert asking.correction(1)["status"] == "pending"
        asking.correction(1, "applied")
        late = asking.read(6.0, correction_in_effect=2)  # cut before the first one took effect, measured after
        assert (late["outstanding"], late["decided_deviation"]) == ([1], 0.0)
        with_both = asking.read(0.0, correction_in_effect=1)
        assert (with_both["outstanding"], with_both["decided_deviation"]) == ([], 0.0)
        assert not any(reading["correction"] for reading in (with_second, still, late, with_both))

    def test_one_confirmed_on_the_way_to_a_later_one_is_known_to_be(self, asking: Shop) -> None:
        """In the batch that confirms it as in readings after it: by a clock that is behind, the second came before the first."""
        other = f"{asking.characteristic}-o"
        asking.add(other, average_memory=6)
        asking.read(6.0)
        behind = datetime.now(UTC).isoformat()
        asking.correction(1, "approve", reason="Good")
        asking.read(13.0, other)
        asking.read(20.0, other)
        named: list[dict[str, Any]] = [{"correction_in_effect": 3, "machined_at": behind}, {"correction_in_effect": 2}]
        batch = [{"characteristic": other, "measured": 40.0} | each for each in named]
        answer = asking.machine_client.post("/api/v1/readings/batch?decisions=true", json=batch)
        assert answer.json()["items"][1]["outstanding"][:2] == [1, 3]
        assert asking.correction(1)["status"] == "applied"
        assert asking.read(0.0, other, correction_in_effect=2)["outstanding"][:2] == [1, 3]


def test_order_of_arrival_decides_and_late_readings_count_what_came_before_them(shop: Shop) -> None:
    shop.read(6.0, measured_at="2026-11-21T08:00:00Z")
    late = shop.read(6.0, measured_at="2026-11-21T07:00:00Z")
    assert (late["late"], late["outstanding"], late["action"]) == (True, [1], "none")


def test_the_same_sequence_whether_single_or_in_a_batch(shop: Shop) -> None:
    """Streaming equals batch: the same readings on another machine in one request."""
    chance = random.Random(9)
    readings = []
    for number in range(120):
        reading: dict[str, Any] = {"measured": round(40 + chance.gauss(0.001, 0.005), 6), "key": str(number)}
        if number % 3 == 0:
            reading["correction_in_effect"] = 0
        readings.append(reading)
    single = [shop.call("POST", "/readings", 201, characteristic=shop.characteristic, **each) for each in readings]
    other = Shop(shop.server)
    answer = other.admin.post(
        "/api/v1/readings/batch?decisions=true",
        json=[{"characteristic": other.characteristic} | reading for reading in readings],
    )
    assert answer.status_code == 201
    same = ("sequence", "measured", "deviation", "decided_deviation", "outstanding", "zone", "average_before")
    for one, two in zip(single, answer.json()["items"], strict=True):
        assert {name: one[name] for name in same} == {name: two[name] for name in same}
        assert (one["average_after"], one["action"], one["correction"]) == (
            two["average_after"],
            two["action"],
            two["correction"],
        )
        assert [alarm["kind"] for alarm in one["alarms"]] == [alarm["kind"] for alarm in two["alarms"]]
    assert {one["zone"] for one in single} >= {"zero", "average", "full", "oversize"}
    with psycopg.connect(shop.server.database.dsn) as connection:
        (kinds,) = connection.execute("SELECT count(DISTINCT machine_id) FROM correction").fetchone() or (0,)
    assert kinds >= 2
    must_hold(shop.server.database.dsn)
