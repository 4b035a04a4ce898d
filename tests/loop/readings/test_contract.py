"""Single readings over HTTP: every field of every answer, and what is refused, as the contract says."""

from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest

from tests.loop.readings.record import counts, history, must_hold
from tests.shop import PARAMETERS, Shop

pytestmark = pytest.mark.own_server  # the whole record of its database is held against the rules

AT = "2026-11-21T08:15:02.120+01:00"


def refused(shop: Shop, status: int, client: httpx.Client | None = None, **body: Any) -> dict[str, Any]:
    """A reading that must be refused and leave no trace."""
    before = counts(shop.server.database.dsn)
    reading = {"characteristic": shop.characteristic, "measured": 40.001} | body
    problem = (client or shop.machine_client).post("/api/v1/readings", json=reading)
    assert problem.status_code == status, problem.text
    assert problem.headers["content-type"] == "application/problem+json"
    answer: dict[str, Any] = problem.json()
    assert answer["status"] == status
    assert {"type", "title", "status", "detail", "errors"} <= set(answer)
    assert answer["detail"]
    assert counts(shop.server.database.dsn) == before
    return answer


def fields(problem: dict[str, Any]) -> set[str]:
    return {error["field"] for error in problem["errors"]}


class TestZones:
    """One reading per zone: limits ±1, ±5, ±8, 300, 1000 µm; k = 2; factor −1."""

    def test_a_deviation_within_the_zero_range_is_averaged_only(self, shop: Shop) -> None:
        answer = shop.read(1.0, key="k1", part="SN-1", measured_at=AT)
        assert set(answer) == {
            *("characteristic", "sequence", "key", "part", "measured", "measured_at", "received_at", "late"),
            *(
                "deviation",
                "size",
                "decided_deviation",
                "outstanding",
                "zone",
                "results",
                "average_before",
                "average_after",
            ),
            *("action", "correction", "alarms", "reason", "parameters_version", "measure_next"),
        }
        assert datetime.fromisoformat(answer.pop("measured_at")) == datetime.fromisoformat(AT)
        assert abs(datetime.fromisoformat(answer.pop("received_at")) - datetime.now(UTC)) < timedelta(minutes=1)
        assert answer == {
            "characteristic": shop.characteristic,
            "sequence": 1,
            "key": "k1",
            "part": "SN-1",
            "measured": 40.001,
            "late": False,
            "deviation": 0.001,
            "size": 40.001,
            "decided_deviation": 0.001,
            "outstanding": [],
            "zone": "zero",
            "results": None,
            "average_before": 0.0,
            "average_after": 0.0005,
            "action": "none",
            "correction": None,
            "alarms": [],
            "reason": {
                "code": "within_zero_range",
                "text": "Deviation 1.0 µm is within the zero range 1.0 µm: no correction, the average is kept.",
                "notes": [],
            },
            "parameters_version": 1,
            "measure_next": None,
        }

    def test_an_average_within_the_zero_range_is_kept(self, shop: Shop) -> None:
        answer = shop.read(-1.001)
        assert (answer["zone"], answer["action"], answer["average_after"]) == ("average", "none", -0.0005005)
        assert answer["reason"]["code"] == "average_kept"
        assert shop.average() == -0.0005005

    def test_an_average_beyond_the_zero_range_corrects_and_begins_again(self, shop: Shop) -> None:
        shop.read(1.0)
        answer = shop.read(5.0)
        assert (answer["zone"], answer["action"]) == ("average", "correct")
        assert (answer["average_before"], answer["average_after"]) == (0.0005, 0.0)
        assert answer["correction"] == {"number": 1, "tool_memory": 3, "amount": -0.00275, "status": "pending"}
        assert answer["reason"]["code"] == "averaged_deviation"
        assert "2.75 µm" in answer["reason"]["text"]
        assert shop.average() == 0.0

    def test_beyond_the_averaging_limit_is_corrected_in_full(self, shop: Shop) -> None:
        shop.read(1.0)
        answer = shop.read(-8.0)
        assert (answer["zone"], answer["action"], answer["alarms"]) == ("full", "correct", [])
        assert answer["correction"] == {"number": 1, "tool_memory": 3, "amount": 0.008, "status": "pending"}
        assert (answer["average_before"], answer["average_after"]) == (0.0005, 0.0)
        assert answer["reason"]["code"] == "full_deviation"

    @pytest.mark.parametrize(("micrometres", "kind"), [(8.001, "oversize"), (-299.9, "undersize")])
    def test_out_of_tolerance_is_corrected_and_alarmed(self, shop: Shop, micrometres: float, kind: str) -> None:
        answer = shop.read(micrometres)
        assert (answer["zone"], answer["action"]) == (kind, "correct")
        assert answer["correction"]["amount"] == round(-micrometres / 1000, 9)
        (alarm,) = shop.alarms()
        assert answer["alarms"] == [{"id": alarm["id"], "kind": kind}]
        assert (alarm["kind"], alarm["characteristic"], alarm["sequence"]) == (kind, shop.characteristic, 1)

    def test_wear_holds_the_correction_for_the_operator(self, shop: Shop) -> None:
        shop.read(1.0)
        answer = shop.read(300.0)
        assert (answer["zone"], answer["action"]) == ("wear", "hold")
        assert answer["correction"] == {"number": 1, "tool_memory": 3, "amount": -0.3, "status": "held"}
        assert (answer["average_before"], answer["average_after"]) == (0.0005, 0.0005)
        assert [alarm["kind"] for alarm in answer["alarms"]] == ["tool_worn"]
        assert answer["reason"]["code"] == "tool_worn_held"
        assert "Correction 1 is held" in answer["reason"]["text"]
        assert shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"] == []

    def test_a_second_worn_reading_supersedes_the_first_and_counts_the_alarm(self, shop: Shop) -> None:
        first, second = shop.read(300.0), shop.read(310.0)
        assert second["outstanding"] == []
        assert second["correction"]["amount"] == -0.31
        assert first["alarms"] == second["alarms"]
        assert (shop.correction(1)["status"], shop.correction(1)["superseded_by"]) == ("superseded", 2)
        (alarm,) = shop.alarms()
        assert (alarm["count"], alarm["sequence"], alarm["last_sequence"]) == (2, 1, 2)

    def test_wear_is_released_at_once_where_that_is_the_policy(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-w"
        shop.add(name, wear_policy="release", average_memory=6)
        answer = shop.read(300.0, name)
        assert (answer["zone"], answer["action"]) == ("wear", "correct")
        assert answer["correction"]["status"] == "pending"
        assert answer["reason"]["code"] == "tool_worn_released"

    def test_of_a_probe_fault_that_fits_in_another_unit_the_reason_says_so(self, shop: Shop) -> None:
        shop.add("inches-d40", tool_memory=7, average_memory=7)
        fault = shop.call("POST", "/readings", 201, characteristic="inches-d40", measured=1.5748)
        assert fault["reason"]["notes"] == ["inches"]
        assert "As inches the value would fit" in fault["reason"]["text"]
        fault = shop.call("POST", "/readings", 201, characteristic="inches-d40", measured=39998.1)
        assert fault["reason"]["notes"] == ["micrometres"]
        assert "As µm the value would fit" in fault["reason"]["text"]
        plain = shop.call("POST", "/readings", 201, characteristic="inches-d40", measured=3.0)
        assert plain["reason"]["notes"] == []
        shop.add("typed-in-inches", tool_memory=8, average_memory=8, target=1.5748)
        fault = shop.call("POST", "/readings", 201, characteristic="typed-in-inches", measured=40.0)
        assert fault["reason"]["notes"] == ["target_in_inches"]

    def test_a_probe_fault_stops_and_pauses_until_acknowledged(self, shop: Shop) -> None:
        fault = shop.read(-1000.0)
        assert (fault["zone"], fault["action"], fault["correction"]) == ("probe_fault", "stop", None)
        (alarm,) = fault["alarms"]
        assert alarm["kind"] == "probe_fault"
        paused = shop.read(8.0)
        assert (paused["zone"], paused["action"], paused["correction"]) == ("full", "none", None)
        assert paused["reason"]["code"] == "paused"
        assert f"paused by alarm {alarm['id']}" in paused["reason"]["text"]
        again = shop.read(2000.0)
        assert (again["action"], again["alarms"]) == ("stop", [alarm])
        assert shop.average() == 0.0
        shop.acknowledge(alarm["id"], "noted")
        assert shop.read(8.0)["action"] == "correct"
        must_hold(shop.server.database.dsn)

    def test_without_a_tool_nothing_is_corrected(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-m"
        shop.add(name, tool_memory=0, average_memory=0)
        answer = shop.read(12.0, name)
        assert (answer["zone"], answer["action"], answer["correction"]) == ("oversize", "none", None)
        assert answer["reason"]["code"] == "measure_only"
        assert (answer["average_before"], answer["average_after"]) == (0.0, 0.0)

    def test_parameters_may_come_by_their_r_numbers(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-r"
        by_number = {"R10": 4, "R11": 0, "R42": 40, "R40": 0, "R41": -0.016, "R33": 0.001, "R34": 0.005}
        shop.call(
            "POST",
            "/characteristics",
            201,
            key=name,
            name="By R numbers",
            machine=shop.machine,
            unit="mm",
            parameters=by_number | {"R37": 0.3, "R36": 1, "R29": 4, "factor": -0.5},
        )
        answer = shop.call("POST", "/readings", 201, characteristic=name, measured=39.9989)
        assert answer["deviation"] == 0.0069  # target 39.992 by L75
        assert answer["correction"] == {"number": 1, "tool_memory": 4, "amount": -0.00345, "status": "pending"}
        answer = shop.call("POST", "/readings", 201, characteristic=name, measured=39.9962, correction_in_effect=1)
        assert (answer["zone"], answer["average_before"]) == ("average", 0.0)
        assert answer["correction"]["amount"] == -0.000525  # R11 = 0: D/k, no memory

    def test_a_new_version_of_the_parameters_judges_what_comes_after_it(self, shop: Shop) -> None:
        first = shop.read(3.0)
        shop.call(
            "PATCH", f"/characteristics/{shop.characteristic}", parameters={"zero_range": 0.004}, reason="Noisy machine"
        )
        second = shop.read(3.0, correction_in_effect=1)
        assert (first["parameters_version"], first["zone"]) == (1, "average")
        assert (second["parameters_version"], second["zone"]) == (2, "zero")
        record = shop.call("GET", f"/readings/{shop.characteristic}/1")
        assert (record["parameters_version"], record["reason"]) == (1, first["reason"])


class TestTouches:
    def test_repeats_are_averaged_at_the_point(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-t"
        shop.add(name, repeats=3, average_memory=0)
        answer = shop.call("POST", "/readings", 201, characteristic=name, touches=[[40.001, 40.002, 40.006]])
        assert (answer["measured"], answer["deviation"]) == (40.003, 0.003)
        detail = shop.call("GET", f"/readings/{name}/1")
        assert detail["touches"] == [[40.001, 40.002, 40.006]]
        assert detail["measured"] == 40.003

    def test_an_indexed_part_has_the_mean_of_both_sides(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-t"
        shop.add(name, variant="indexed", index=180, repeats=2, average_memory=0)
        answer = shop.call("POST", "/readings", 201, characteristic=name, touches=[[40.01, 40.012], [39.996, 39.994]])
        assert answer["measured"] == 40.003

    def test_two_points_measure_their_distance(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-t"
        shop.add(name, variant="two_point", average_memory=0)
        answer = shop.call("POST", "/readings", 201, characteristic=name, touches=[[-19.998], [20.006]])
        assert (answer["measured"], answer["zone"]) == (40.004, "average")

    @pytest.mark.parametrize(("variant", "points"), [("round", 3), ("along", 4)])
    def test_several_points_are_averaged(self, shop: Shop, variant: str, points: int) -> None:
        name = f"{shop.characteristic}-t"
        shop.add(name, variant=variant, points=points, average_memory=0)
        touches = [[40.0 + 0.002 * point] for point in range(points)]
        answer = shop.call("POST", "/readings", 201, characteristic=name, touches=touches)
        assert answer["measured"] == round(40 + 0.001 * (points - 1), 9)

    def test_n_of_m_sections_accept_a_part_and_a_rejected_one_corrects_nothing(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-t"
        shop.add(
            name,
            variant="along",
            points=3,
            accept={"n": 2, "m": 3},
            zero_range=0,
            weighting_factor=1,
            average_memory=0,
        )
        good = shop.call("POST", "/readings", 201, characteristic=name, touches=[[40.008], [39.992], [40.03]])
        assert (good["deviation"], good["zone"], good["action"]) == (0.01, "oversize", "correct")
        bad = shop.call(
            *("POST", "/readings", 201),
            characteristic=name,
            touches=[[40.0081], [40.0081], [39.99]],
            correction_in_effect=1,
        )
        assert (bad["action"], bad["correction"], bad["reason"]["code"]) == ("none", None, "rejected")
        assert "acceptance" in [alarm["kind"] for alarm in bad["alarms"]]
        problem = refused(shop, 422, characteristic=name)
        assert fields(problem) == {"touches"}

    @pytest.mark.parametrize(
        ("touches", "says"),
        [
            ([[40.0, 40.0]], "Points received: 1, expected: 2"),
            ([[40.0, 40.0], [40.0]], "Point 2: touches received 1, expected 2 (R27)"),
            ([[40.0, 40.0], [40.0, 41.5]], "Point 2, repeat 2: the touch at 41.5 mm lies more than 1"),
            ([], "Points received: 0"),
            ([[], []], "Point 1: touches received 0"),
        ],
    )
    def test_touches_that_are_missing_or_impossible_are_stored_as_a_fault(
        self, shop: Shop, touches: list[list[float]], says: str
    ) -> None:
        name = f"{shop.characteristic}-t"
        shop.add(name, variant="indexed", index=180, repeats=2, average_memory=0)
        told = shop.call("POST", "/readings", 201, characteristic=name, touches=touches)
        assert (told["zone"], told["action"], told["correction"]) == ("probe_fault", "stop", None)
        assert says in told["reason"]["text"]
        assert [alarm["kind"] for alarm in told["alarms"]] == ["probe_fault"]
        assert [each["sequence"] for each in shop.call("GET", f"/readings?characteristic={name}")["items"]] == [1]

    @pytest.mark.parametrize("touches", [[[40.0, 40.0]] * 3, [[40.0, 40.0], [40.0, 40.0, 40.0]]])
    def test_more_touches_than_there_can_be_are_refused_by_name(self, shop: Shop, touches: list[list[float]]) -> None:
        name = f"{shop.characteristic}-t"
        shop.add(name, variant="indexed", index=180, repeats=2, average_memory=0)
        assert fields(refused(shop, 422, shop.admin, characteristic=name, touches=touches, measured=None)) == {
            "touches"
        }
        assert shop.call("GET", f"/readings?characteristic={name}")["items"] == []


class TestKeys:
    def test_the_same_key_again_is_the_first_answer(self, shop: Shop) -> None:
        body = {"characteristic": shop.characteristic, "measured": 40.007, "key": "lathe:1", "part": "SN-1"}
        first = shop.machine_client.post("/api/v1/readings", json=body)
        shop.read(2.0)
        again = shop.machine_client.post("/api/v1/readings", json=body)
        assert (first.status_code, again.status_code) == (201, 200)
        assert first.json()["correction"]["status"] == "pending"
        assert again.json() == first.json()
        shop.correction(1, "applied")
        assert shop.machine_client.post("/api/v1/readings", json=body).json() == first.json()
        assert len(history(shop.server.database.dsn, shop.characteristic)) == 2

    def test_the_same_key_again_with_touches_is_the_first_answer_whatever_changed_since(self, shop: Shop) -> None:
        shop.call(
            "PATCH",
            f"/characteristics/{shop.characteristic}",
            parameters={"variant": "two_point", "repeats": 2},
            reason="t",
        )
        body: dict[str, Any] = {
            "characteristic": shop.characteristic,
            "touches": [[0.001, 0.003], [40, 40]],
            "key": "t",
        }
        first = shop.call("POST", "/readings", 201, **body)
        assert first["measured"] == 39.998
        change = {"variant": "single", "repeats": 1}
        shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters=change, reason="back")
        assert shop.call("POST", "/readings", 200, **body) == first
        batch = shop.machine_client.post("/api/v1/readings/batch?decisions=true", json=[body])
        assert (batch.status_code, batch.json()["repeated"], batch.json()["items"]) == (201, 1, [first])
        body["touches"] = [[0.001, 0.004], [40, 40]]
        shop.call("POST", "/readings", 409, **body)

    def test_the_same_key_with_another_value_is_a_conflict(self, shop: Shop) -> None:
        shop.read(7.0, key="lathe:1")
        problem = refused(shop, 409, measured=40.0071, key="lathe:1")
        assert fields(problem) == {"key"}
        assert "belongs to reading 1" in problem["detail"]

    @pytest.mark.parametrize("first", [{}, {"first_move_triggered": True}])
    def test_the_same_key_hides_no_probe_fault(self, shop: Shop, first: dict[str, Any]) -> None:
        triggered: dict[str, Any] = {"first_move_triggered": not first}
        shop.read(7.0, key="lathe:1", **first)
        assert fields(refused(shop, 409, measured=40.007, key="lathe:1", **triggered)) == {"key"}
        shop.call("POST", "/readings", 200, characteristic=shop.characteristic, measured=40.007, key="lathe:1", **first)
        one = {"characteristic": shop.characteristic, "measured": 40.007, "key": "lathe:2"}
        batch = shop.machine_client.post("/api/v1/readings/batch", json=[one | first, one | triggered])
        assert batch.status_code == 409

    def test_a_key_is_unique_per_characteristic_only(self, shop: Shop) -> None:
        other = f"{shop.characteristic}-b"
        shop.add(other, average_memory=6)
        assert shop.read(1.0, key="same")["sequence"] == 1
        assert shop.read(2.0, other, key="same")["sequence"] == 1

    def test_readings_without_a_key_are_each_a_reading(self, shop: Shop) -> None:
        assert [shop.read(0.0)["sequence"] for _ in range(3)] == [1, 2, 3]


class TestTimes:
    def test_a_reading_older_than_the_last_one_is_taken_in_the_order_of_arrival_and_said_to_be_late(
        self, shop: Shop
    ) -> None:
        first = shop.read(0.0, measured_at="2026-11-21T10:00:00Z")
        late = shop.read(1.0, measured_at="2026-11-21T09:59:59.999+00:00")
        third = shop.read(0.5, measured_at="2026-11-21T11:00:00+01:00")  # 10:00 UTC: not before the last one
        assert [reading["late"] for reading in (first, late, third)] == [False, True, False]
        assert (late["sequence"], late["average_before"]) == (2, 0.0)
        assert late["reason"]["notes"] == ["late"]
        assert "It came late" in late["reason"]["text"]
        items = shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"]
        assert [item["sequence"] for item in items] == [1, 2, 3]
        assert [item["late"] for item in items] == [False, True, False]

    def test_a_clock_that_was_ahead_makes_no_later_reading_late(self, shop: Shop) -> None:
        now = datetime.now(UTC)
        ahead = [shop.read(0.0, measured_at=(now + timedelta(hours=20, minutes=m)).isoformat()) for m in (0, 1)]
        batch = shop.push([0.0, 0.0], answers=True)
        right = shop.read(0.0, measured_at=datetime.now(UTC).isoformat())
        late = shop.read(0.0, measured_at=(now - timedelta(hours=1)).isoformat())
        assert [reading["late"] for reading in (*ahead, *batch, right, late)] == [False] * 5 + [True]

    def test_without_a_time_a_reading_was_measured_when_it_came(self, shop: Shop) -> None:
        answer = shop.read(0.0)
        assert answer["measured_at"] == answer["received_at"]

    def test_a_part_that_is_here_was_not_cut_after_now(self, shop: Shop) -> None:
        """A clock that is ahead would count each correction for parts that were cut without it."""
        ahead = (datetime.now(UTC) + timedelta(hours=2)).isoformat()
        for measured_at in (None, ahead):
            problem = refused(shop, 422, machined_at=ahead, measured_at=measured_at)
            assert fields(problem) == {"machined_at"}
            assert "is ahead of the server's clock. Set the machine's clock" in problem["detail"]
        assert shop.read(1.0, machined_at=(datetime.now(UTC) + timedelta(seconds=20)).isoformat())["sequence"] == 1
        assert shop.read(1.0, machined_at=ahead, correction_in_effect=0)["sequence"] == 2, "the number wins"

    @pytest.mark.parametrize(
        ("body", "field", "says"),
        [
            ({"measured_at": 1763709302}, "measured_at", "not a count of"),
            ({"measured_at": 1763709302120}, "measured_at", "not a count of"),
            ({"measured_at": "1763709302"}, "measured_at", "not a time with an offset"),
            ({"measured_at": "2026-11-21T08:15:02"}, "measured_at", "not a time with an offset"),
            ({"measured_at": "21.11.2026 08:15"}, "measured_at", "not a time with an offset"),
            ({"measured_at": "1970-01-21T09:55:09+00:00"}, "measured_at", "before the year 2000"),
            ({"measured_at": "2226-11-21T08:15:02Z"}, "measured_at", "ahead of the server's clock"),
            ({"machined_at": "2226-11-21T08:15:02Z"}, "machined_at", "ahead of the server's clock"),
            (
                {"measured_at": "2026-11-20T08:15:02Z", "machined_at": "2026-11-20T08:15:03Z"},
                "machined_at",
                "cannot be measured before it is machined",
            ),
        ],
    )
    def test_a_time_that_cannot_be_is_refused(self, shop: Shop, body: dict[str, Any], field: str, says: str) -> None:
        problem = refused(shop, 422, **body)
        assert fields(problem) == {field}
        assert says in problem["detail"]


class TestRefusals:
    @pytest.mark.parametrize(
        ("context", "says"),
        [
            ([], "A context is a JSON object"),
            ({"colour": "red"}, "There is no 'colour' in a context; there are: order, batch,"),
            ({"order": 7}, "order is not right: a text of 1 to 128 characters."),
            ({"nest": -1}, "nest is not right: a whole number from 0"),
            ({"events": ["a\nb"]}, "holds control characters"),
            ({"process": {"T": "warm"}}, "process is not right: an object of at most 100 numbers"),
            ({"fields": {"x": "1"}}, "fields is not right: an object of texts by field"),
        ],
    )
    def test_circumstances_that_cannot_be(self, shop: Shop, context: Any, says: str) -> None:
        problem = refused(shop, 422, context=context)
        assert fields(problem) == {"context"}
        assert says in problem["detail"]

    def test_a_correction_that_was_never_issued(self, shop: Shop) -> None:
        shop.read(7.0)
        problem = refused(shop, 422, correction_in_effect=2)
        assert fields(problem) == {"correction_in_effect"}
        assert "its last one is 1" in problem["detail"]
        assert shop.correction(1)["status"] == "pending"

    def test_the_key_of_another_machine(self, shop: Shop, server: Any) -> None:
        problem = refused(shop, 403, Shop(server).machine_client)
        assert "may not be used for another machine" in problem["detail"]

    def test_a_viewer_may_only_look(self, shop: Shop, server: Any) -> None:
        viewer = server.client(server.key("viewer"))
        assert "role operator" in refused(shop, 403, viewer)["detail"]
        assert viewer.get(f"/api/v1/readings?characteristic={shop.characteristic}").status_code == 200
        operator = server.client(server.key("operator"))
        assert shop.call("POST", "/readings", 201, operator, characteristic=shop.characteristic, measured=40)

    @pytest.mark.parametrize("header", ["Bearer inband_nobody", "Bearer", "Basic YTpi", "Bearer ÿ\x80"])
    def test_an_unknown_key(self, shop: Shop, server: Any, header: str) -> None:
        client = server.client()
        client.headers = httpx.Headers([(b"Authorization", header.encode("latin-1"))])
        refused(shop, 401, client)

    def test_no_key(self, shop: Shop, server: Any) -> None:
        refused(shop, 401, server.client())

    def test_a_revoked_key_is_unknown_at_once(self, shop: Shop, server: Any) -> None:
        made = shop.call("POST", f"/machines/{shop.machine}/keys", 201, name="second")
        client = server.client(made["secret"])
        assert client.post("/api/v1/readings", json={"characteristic": shop.characteristic, "measured": 40})
        shop.call("DELETE", f"/machines/{shop.machine}/keys/{made['id']}", 204)
        refused(shop, 401, client)

    def test_a_characteristic_that_is_not_there(self, shop: Shop) -> None:
        problem = refused(shop, 404, characteristic="nowhere")
        assert fields(problem) == {"characteristic"}
        assert refused(shop, 404, characteristic="Ø40 / ☃")["errors"]

    def test_a_characteristic_made_after_it_was_asked_for_is_found(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-later"
        refused(shop, 404, characteristic=name)
        shop.add(name)
        assert shop.read(0.0, name)["sequence"] == 1

    def test_both_or_neither_of_measured_and_touches(self, shop: Shop) -> None:
        assert "not both" in refused(shop, 422, touches=[[40.0]])["detail"]
        assert "needs measured" in refused(shop, 422, measured=None)["detail"]

    def test_everything_wrong_is_named_at_once(self, shop: Shop) -> None:
        problem = refused(shop, 422, characteristic=7, measured="40,001", part=[], colour="red", measured_at=0)
        assert fields(problem) == {"characteristic", "measured", "part", "colour", "measured_at"}
        assert problem["detail"].startswith("5 things are wrong")

    def test_too_large(self, shop: Shop) -> None:
        problem = refused(shop, 413, part="x" * 300_000)
        assert "/readings/batch" in problem["what_to_do"]

    def test_a_wrong_method_names_the_right_ones(self, shop: Shop) -> None:
        answer = shop.machine_client.put("/api/v1/readings", json={})
        assert answer.status_code == 405
        assert answer.headers["content-type"] == "application/problem+json"
        assert {method.strip() for method in answer.headers["allow"].split(",")} >= {"GET", "POST"}

    def test_zero_is_a_reading_and_not_an_absence(self, shop: Shop) -> None:
        name = f"{shop.characteristic}-z"
        shop.add(name, target=0.0, average_memory=0)
        answer = shop.call("POST", "/readings", 201, characteristic=name, measured=0.0, correction_in_effect=0)
        assert (answer["measured"], answer["deviation"], answer["zone"]) == (0.0, 0.0, "zero")
        assert shop.call("GET", f"/readings/{name}/1")["correction_in_effect"] == 0


class TestLookingUp:
    def test_pages_go_on_where_they_ended(self, shop: Shop) -> None:
        given = [shop.read(value) for value in (0.0, 0.5, 6.0, 350.0, 0.2)]
        path = f"/readings?characteristic={shop.characteristic}"
        whole = shop.call("GET", path)
        assert whole["next"] is None
        assert [{name: item[name] for name in given[0]} for item in whole["items"]] == given
        assert all(item["excluded"] is None for item in whole["items"])
        seen, after = [], 0
        while True:
            page = shop.call("GET", f"{path}&limit=2&after={after}", client=shop.machine_client)
            seen += page["items"]
            if page["next"] is None:
                break
            after = page["next"]
        assert seen == whole["items"]

    def test_one_reading_with_all_that_was_sent(self, shop: Shop) -> None:
        machined_at = "2026-11-21T07:00:00Z"
        given = shop.read(3.0, key="k", part="SN-1", measured_at=AT, machined_at=machined_at, correction_in_effect=0)
        detail = shop.call("GET", f"/readings/{shop.characteristic}/1")
        assert {name: detail[name] for name in given} == given
        assert datetime.fromisoformat(detail["machined_at"]) == datetime.fromisoformat(machined_at)
        assert (detail["correction_in_effect"], detail["touches"], detail["excluded"]) == (0, None, None)
        assert detail["context"] is None
        shop.call("GET", f"/readings/{shop.characteristic}/2", 404)
        shop.call("GET", f"/readings/{shop.characteristic}/0", 422)
        shop.call("GET", "/readings/nowhere/1", 404)

    def test_the_circumstances_of_a_reading(self, shop: Shop) -> None:
        context = {"order": "A-77", "nest": 2, "events": ["door opened"], "process": {"temperature, °C": 21.5}}
        shop.read(3.0, key="k", context=context)
        again: dict[str, Any] = {
            "characteristic": shop.characteristic,
            "measured": 40.003,
            "key": "k",
            "context": {"order": "B"},
        }
        shop.call("POST", "/readings", 200, **again)  # the first one stays
        batch = [{"characteristic": shop.characteristic, "measured": 40.0, "context": {"nest": at}} for at in (0, 1)]
        assert shop.admin.post("/api/v1/readings/batch", json=batch).status_code == 201
        found = [shop.call("GET", f"/readings/{shop.characteristic}/{number}")["context"] for number in (1, 2, 3)]
        assert [{name: value for name, value in each.items() if value is not None} for each in found] == [
            context,
            {"nest": 0},
            {"nest": 1},
        ]

    def test_another_machine_may_not_look(self, shop: Shop, server: Any) -> None:
        other = Shop(server).machine_client
        shop.read(0.0)
        shop.call("GET", f"/readings?characteristic={shop.characteristic}", 403, other)
        shop.call("GET", f"/readings/{shop.characteristic}/1", 403, other)

    def test_an_excluded_reading_stays_in_the_record(self, shop: Shop, server: Any) -> None:
        shop.read(5.0)
        path = f"/readings/{shop.characteristic}/1"
        detail = shop.call("POST", f"{path}/exclude", reason="Chip under the stylus")
        assert detail["excluded"]["reason"] == "Chip under the stylus"
        assert detail["excluded"]["by"]
        assert shop.call("GET", path) == detail
        problem = shop.call("POST", f"{path}/exclude", 409, reason="Again")
        assert "Chip under the stylus" in problem["detail"]
        shop.call("POST", f"/readings/{shop.characteristic}/2/exclude", 404, reason="There is none")
        shop.call("POST", f"{path}/exclude", 422, reason=" ")
        shop.call("POST", f"{path}/exclude", 403, server.client(server.key("viewer")), reason="May I?")
        assert shop.call("GET", f"/readings?characteristic={shop.characteristic}")["items"][0]["excluded"]

    def test_a_repeated_answer_is_the_first_one_after_an_exclusion_too(self, shop: Shop) -> None:
        first = shop.read(5.0, key="k")
        shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", reason="Chip")
        body: dict[str, Any] = {"characteristic": shop.characteristic, "measured": 40.005, "key": "k"}
        assert shop.call("POST", "/readings", 200, **body) == first


def test_the_shop_of_these_tests_is_what_they_say() -> None:
    assert (PARAMETERS["zero_range"], PARAMETERS["averaging_limit"], PARAMETERS["tolerance_width"]) == (
        0.001,
        0.005,
        0.016,
    )
