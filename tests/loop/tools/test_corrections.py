"""The life of a correction over HTTP, on a real server: every transition, good and bad, and who may make it."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest

from tests.shop import Shop


def pending(shop: Shop) -> int:
    number: int = shop.read(6.0)["correction"]["number"]
    return number


def held(shop: Shop) -> int:
    number: int = shop.read(350.0)["correction"]["number"]
    return number


def awaiting(shop: Shop) -> int:
    shop.add(f"{shop.characteristic}-a", mode="approval", tool_memory=4, average_memory=6)
    correction = shop.read(6.0, f"{shop.characteristic}-a")["correction"]
    assert correction["status"] == "awaiting_approval"
    number: int = correction["number"]
    return number


class TestApplied:
    def test_a_confirmed_correction_moves_the_offset_and_the_sum(self, shop: Shop) -> None:
        number = pending(shop)
        before = shop.correction(number)
        assert (before["status"], before["amount"], before["offset_expected"]) == ("pending", -0.006, -0.006)
        assert before["reason"]["code"] == "full_deviation"
        assert before["size_error"] == 0.006
        assert before["sequence"] == 1
        after = shop.correction(number, "applied", client=shop.machine_client)
        assert (after["status"], after["offset_after"], after["offset_expected"]) == ("applied", -0.006, None)
        assert after["applied_at"] is not None
        assert after["applied_by"].startswith(shop.machine)
        tool = shop.tool()
        assert (tool["offset"], tool["total"], tool["open_corrections"]) == (-0.006, -0.006, [])
        assert tool["last_correction"]["number"] == number
        assert tool["characteristics"] == [shop.characteristic]
        assert shop.alarms() == []

    def test_confirming_twice_is_harmless(self, shop: Shop) -> None:
        number = pending(shop)
        first = shop.correction(number, "applied", offset_after=-0.006)
        again = shop.correction(number, "applied", offset_after=-0.006)
        assert again == first == shop.correction(number, "applied")
        assert shop.tool()["offset"] == -0.006

    def test_another_offset_the_second_time_is_refused(self, shop: Shop) -> None:
        number = pending(shop)
        shop.correction(number, "applied")
        problem = shop.correction(number, "applied", 409, offset_after=0.5)
        assert "confirmed with the offset" in problem["detail"]
        assert shop.tool()["offset"] == -0.006
        assert shop.alarms() == []

    def test_a_different_offset_raises_an_alarm_and_becomes_the_known_one(self, shop: Shop) -> None:
        number = pending(shop)
        answer = shop.correction(number, "applied", offset_after=0.01)
        (alarm,) = shop.alarms()
        assert (alarm["kind"], alarm["tool_memory"], alarm["count"]) == ("offset_differs", 3, 1)
        assert "0.0100" in alarm["text"]
        assert "−0.0060" in alarm["text"]
        assert str(alarm["id"]) in answer["note"]
        assert (shop.tool()["offset"], shop.tool()["total"]) == (0.01, -0.006)
        shop.acknowledge(alarm["id"], "noted")
        shop.correction(pending(shop), "applied", offset_after=1.0)
        (again,) = shop.alarms()
        assert again["id"] != alarm["id"]
        assert "1.0000" in again["text"]

    def test_an_offset_reported_after_a_reading_has_confirmed_it_still_counts(self, shop: Shop) -> None:
        number = pending(shop)
        shop.read(0.0, correction_in_effect=number)
        assert shop.correction(number)["status"] == "applied"
        assert shop.correction(number, "applied", offset_after=-0.006)["offset_after"] == -0.006
        assert shop.alarms() == []
        number = shop.read(6.0, correction_in_effect=number)["correction"]["number"]
        shop.read(0.0, correction_in_effect=number)
        later = pending(shop)
        shop.correction(later, "applied")
        assert shop.tool()["offset"] == -0.018
        shop.correction(number, "applied", offset_after=0.1)  # expected -0.012
        assert shop.alarms()[0]["kind"] == "offset_differs"
        assert shop.tool()["offset"] == 0.094  # with the later one
        shop.correction(number, "applied", 409, offset_after=0.2)

    @pytest.mark.parametrize(("off", "alarms"), [(0.0005, 0), (-0.0005, 0), (0.000501, 1), (-0.000501, 1)])
    def test_a_control_may_round_by_half_a_micrometre(self, shop: Shop, off: float, alarms: int) -> None:
        shop.correction(pending(shop), "applied", offset_after=round(-0.006 + off, 6))
        assert len(shop.alarms()) == alarms
        assert shop.tool()["offset"] == round(-0.006 + off, 6)

    def test_expected_offsets_add_up_in_order(self, shop: Shop) -> None:
        shop.call("PUT", f"/machines/{shop.machine}/tools/3", offset=0.1, reason="set")
        first, second = shop.read(20.0)["correction"]["number"], shop.read(50.0)["correction"]["number"]
        shop.read(400.0)
        items = shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending&status=held")["items"]
        assert [item["number"] for item in items] == [first, second, second + 1]
        running = 0.1
        for item in items:
            running = round(running + item["amount"], 9)
            assert item["offset_expected"] == running

    @pytest.mark.parametrize(("make", "word"), [(held, "held"), (awaiting, "awaits approval")])
    def test_only_a_pending_one_can_be_applied(self, shop: Shop, make: Any, word: str) -> None:
        number = make(shop)
        problem = shop.correction(number, "applied", 409)
        assert word in problem["detail"]
        assert "pending corrections only" in problem["what_to_do"]
        assert shop.tool()["offset"] == 0.0

    def test_a_rejected_one_must_come_out_of_the_offset_again(self, shop: Shop) -> None:
        number = pending(shop)
        shop.correction(number, "rejected", reason="limit of the control")
        problem = shop.correction(number, "applied", 409)
        assert "limit of the control" in problem["detail"]
        assert "−6.0" in problem["what_to_do"]

    @pytest.mark.parametrize("fate", ["awaiting", "rejected", "fallen"])
    def test_what_a_machine_holds_with_one_that_may_not_be_in_pauses_the_tool(self, shop: Shop, fate: str) -> None:
        """Nobody at a machine reads the 409: without the alarm the same correction would be approved, and applied again."""
        if fate == "awaiting":
            number, tool = awaiting(shop), 4
        else:
            number, tool = pending(shop), 3
            if fate == "rejected":
                shop.correction(number, "rejected", reason="not now")
            else:
                shop.call("PUT", f"/machines/{shop.machine}/tools/3", offset=0.1, reason="set")
        for _again in range(2):
            problem = shop.correction(number, "applied", 409, client=shop.machine_client, offset_after=-0.0123)
        (alarm,) = shop.alarms()
        assert (alarm["kind"], alarm["tool_memory"], alarm["count"]) == ("offset_differs", tool, 1)
        assert problem["correction_status"] == ("rejected" if fate == "rejected" else "superseded")
        assert (shop.tool(tool)["offset"], shop.tool(tool)["paused_by"]) == (-0.0123, alarm["id"])
        shop.correction(number, "approve", 409, reason="as expected")

    def test_the_offset_expected_with_one_that_may_not_be_in_is_no_alarm(self, shop: Shop) -> None:
        number = pending(shop)
        shop.correction(number, "rejected", reason="not now")
        shop.correction(number, "applied", 409, client=shop.machine_client, offset_after=0.0)
        assert shop.alarms() == []

    @pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
    def test_several_applied_at_once_are_confirmed_in_whatever_order(self, shop: Shop, order: tuple[int, ...]) -> None:
        numbers = [shop.read(um)["correction"]["number"] for um in (6.0, 12.0, 18.0)]
        for at in order:
            answer = shop.correction(numbers[at], "applied", client=shop.machine_client, offset_after=-0.018)
            assert (answer["number"], answer["status"], answer["offset_after"]) == (numbers[at], "applied", -0.018)
        assert (shop.tool()["offset"], shop.tool()["total"]) == (-0.018, -0.018)
        assert [alarm["kind"] for alarm in shop.alarms()] == ["oversize"]

    def test_the_time_of_a_machine_whose_clock_is_ahead_is_now(self, shop: Shop) -> None:
        ahead = datetime.now(UTC) + timedelta(hours=2)
        answer = shop.correction(pending(shop), "applied", applied_at=ahead.isoformat())
        assert datetime.fromisoformat(answer["applied_at"]) <= datetime.now(UTC) + timedelta(seconds=1)

    @pytest.mark.parametrize(
        ("field", "value"),
        [
            ("offset_after", 1e300),
            ("offset_after", "0.1"),
            ("offset_after", True),
            ("applied_at", 1_700_000_000),
            ("applied_at", "2026-11-21T08:00:00"),
            ("applied_at", "1970-01-01T00:00:00Z"),
            ("applied_at", "9999-01-01T00:00:00Z"),
            ("offset", 1.0),
        ],
    )
    def test_bad_bodies_name_the_field_and_change_nothing(self, shop: Shop, field: str, value: Any) -> None:
        number = pending(shop)
        problem = shop.correction(number, "applied", 422, **{field: value})
        assert problem["errors"][0]["field"] == field
        assert shop.correction(number)["status"] == "pending"

    def test_nan_is_refused(self, shop: Shop) -> None:
        number = pending(shop)
        path = f"/api/v1/corrections/{shop.machine}/{number}/applied"
        headers = {"Content-Type": "application/json"}
        answer = shop.admin.post(path, content=b'{"offset_after": NaN}', headers=headers)
        assert answer.status_code == 422
        assert shop.correction(number)["status"] == "pending"


class TestDecided:
    def test_approve(self, shop: Shop) -> None:
        number = awaiting(shop)
        answer = shop.correction(number, "approve", reason="looked at the part")
        assert (answer["status"], answer["status_reason"]) == ("pending", "looked at the part")
        assert answer["decided_by"].startswith("key ")
        assert shop.correction(number, "applied")["status"] == "applied"

    def test_what_parts_measured_since_speak_against_is_not_released(self, shop: Shop) -> None:
        """One bad touch of 350 µm, and an edge that cuts well: released, it would spoil the next part."""
        number = shop.read(350.0)["correction"]["number"]
        shop.read(0.3)
        problem = shop.correction(number, "release", 409, reason="go on")
        assert "within the wear limit again" in problem["detail"]
        assert shop.correction(number)["status"] == "held"
        shop.correction(number, "rejected", reason="chip on the stylus")

    def test_release_says_that_the_alarm_is_still_active(self, shop: Shop) -> None:
        number = held(shop)
        (alarm,) = shop.alarms()
        answer = shop.correction(number, "release", reason="edge still good")
        assert answer["status"] == "pending"
        assert f"alarm {alarm['id']}" in answer["note"]
        assert shop.alarms()[0]["state"] == "active"

    @pytest.mark.parametrize("make", [pending, held, awaiting])
    def test_reject_what_is_not_applied(self, shop: Shop, make: Any) -> None:
        number = make(shop)
        assert shop.correction(number, "rejected", reason="no")["status"] == "rejected"
        problem = shop.correction(number, "rejected", 409, reason="no")
        assert problem["correction_status"] == "rejected"

    @pytest.mark.parametrize(
        ("make", "verb"),
        [(pending, "approve"), (pending, "release"), (held, "approve"), (awaiting, "release")],
    )
    def test_wrong_transitions_are_refused_in_words(self, shop: Shop, make: Any, verb: str) -> None:
        number = make(shop)
        before = shop.correction(number)
        problem = shop.correction(number, verb, 409, reason="x")
        assert problem["what_to_do"]
        assert shop.correction(number) == before

    @pytest.mark.parametrize("verb", ["approve", "release", "rejected"])
    def test_what_is_applied_stays(self, shop: Shop, verb: str) -> None:
        number = pending(shop)
        shop.correction(number, "applied")
        problem = shop.correction(number, verb, 409, reason="x")
        assert "applied already" in problem["detail"]
        assert shop.correction(number)["status"] == "applied"

    @pytest.mark.parametrize("verb", ["approve", "release", "rejected"])
    @pytest.mark.parametrize("body", [{}, {"reason": ""}, {"reason": "  "}, {"reason": 5}, {"reason": "x" * 1001}])
    def test_a_reason_is_required(self, shop: Shop, verb: str, body: dict[str, Any]) -> None:
        problem = shop.call("POST", f"/corrections/{shop.machine}/1/{verb}", 422, **body)
        assert problem["status"] == 422

    def test_rejecting_one_names_those_that_count_on_it(self, shop: Shop) -> None:
        first, second = shop.read(20.0)["correction"]["number"], shop.read(50.0)["correction"]["number"]
        held = shop.read(400.0)["correction"]["number"]
        note = shop.correction(first, "rejected", reason="x")["note"]
        assert f"Corrections {second}, {held} of the same tool" in note
        shop.correction(held, "rejected", reason="x")
        assert shop.correction(second, "rejected", reason="x")["note"] is None

    def test_a_newer_correction_supersedes_the_held_one(self, shop: Shop) -> None:
        number = held(shop)
        newer = shop.read(20.0)["correction"]["number"]
        problem = shop.correction(number, "release", 409, reason="x")
        assert f"superseded by correction {newer}" in problem["detail"]


class TestWhoMay:
    def test_a_machine_confirms_and_rejects_its_own(self, shop: Shop) -> None:
        shop.correction(pending(shop), "applied", client=shop.machine_client)
        number = pending(shop)
        shop.correction(number, "rejected", client=shop.machine_client, reason="offset limit of the control")

    @pytest.mark.parametrize(("make", "verb"), [(awaiting, "approve"), (held, "release")])
    def test_a_machine_neither_approves_nor_releases(self, shop: Shop, make: Any, verb: str) -> None:
        number = make(shop)
        shop.correction(number, verb, 403, client=shop.machine_client, reason="x")

    def test_another_machine_may_not(self, shop: Shop, server: Any) -> None:
        number = pending(shop)
        other = Shop(server).machine_client
        shop.correction(number, "applied", 403, client=other)
        shop.call("GET", f"/corrections/{shop.machine}/{number}", 403, client=other)
        shop.call("GET", f"/machines/{shop.machine}/corrections", 403, client=other)

    def test_viewers_look_only(self, shop: Shop, server: Any) -> None:
        number = pending(shop)
        viewer: httpx.Client = server.client(server.key("viewer"))
        assert shop.call("GET", f"/corrections/{shop.machine}/{number}", client=viewer)["status"] == "pending"
        shop.correction(number, "applied", 403, client=viewer)
        shop.correction(number, "rejected", 403, client=viewer, reason="x")

    def test_operators_decide(self, shop: Shop, server: Any) -> None:
        operator: httpx.Client = server.client(server.key("operator"))
        shop.correction(awaiting(shop), "approve", client=operator, reason="x")

    @pytest.mark.parametrize("number", ["0", "-1", "999", "99999999999999999999"])
    def test_unknown_numbers_are_404(self, shop: Shop, number: str) -> None:
        shop.call("GET", f"/corrections/{shop.machine}/{number}", 404)
        shop.call("POST", f"/corrections/{shop.machine}/{number}/applied", 404)

    def test_unknown_machines_are_404(self, shop: Shop) -> None:
        shop.call("GET", "/corrections/nowhere/1", 404)
        shop.call("GET", "/machines/nowhere/corrections", 404)


class TestList:
    def test_pages_oldest_first(self, shop: Shop) -> None:
        numbers = [shop.read(20.0 + 30 * i)["correction"]["number"] for i in range(3)]
        path = f"/machines/{shop.machine}/corrections"
        first = shop.call("GET", f"{path}?limit=2")
        assert [item["number"] for item in first["items"]] == numbers[:2]
        rest = shop.call("GET", f"{path}?limit=2&after={first['next']}")
        assert ([item["number"] for item in rest["items"]], rest["next"]) == (numbers[2:], None)
        assert shop.call("GET", f"{path}?status=applied") == {"items": [], "next": None}
        assert shop.call("GET", f"{path}?after={2**31 - 1}")["items"] == []
        shop.call("GET", f"{path}?status=nonsense", 422)
        shop.call("GET", f"{path}?limit=1001", 422)
        assert len(shop.call("GET", f"{path}?tool_memory=3")["items"]) == 3
        assert shop.call("GET", f"{path}?tool_memory=4")["items"] == []


def at_once(*calls: Any) -> list[httpx.Response]:
    with ThreadPoolExecutor(len(calls)) as pool:
        return [future.result() for future in [pool.submit(call) for call in calls]]


class TestAtOnce:
    def test_of_confirm_and_reject_one_wins(self, shop: Shop, server: Any) -> None:
        one, other = server.client(server.key()), server.client(server.key())
        for _turn in range(5):
            number = pending(shop)
            path = f"/api/v1/corrections/{shop.machine}/{number}"
            before = shop.tool()["offset"]
            confirmed, rejected = at_once(
                lambda path=path: one.post(f"{path}/applied"),
                lambda path=path: other.post(f"{path}/rejected", json={"reason": "no"}),
            )
            assert sorted([confirmed.status_code, rejected.status_code]) == [200, 409]
            expected = "applied" if confirmed.status_code == 200 else "rejected"
            assert shop.correction(number)["status"] == expected
            assert shop.tool()["offset"] == (round(before - 0.006, 9) if expected == "applied" else before)

    def test_two_confirmations_move_the_offset_once(self, shop: Shop, server: Any) -> None:
        clients = [server.client(server.key()) for _ in range(4)]
        number = pending(shop)
        path = f"/api/v1/corrections/{shop.machine}/{number}/applied"
        answers = at_once(*(lambda c=client: c.post(path) for client in clients))
        assert [answer.status_code for answer in answers] == [200] * 4
        assert len({answer.text for answer in answers}) == 1
        assert shop.tool()["offset"] == -0.006
