"""Calibrations over HTTP: gauge and ring, what follows, what is refused, who may, and that nothing happens twice."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import psycopg
import pytest

from tests.shop import Person, Shop

GAUGE: dict[str, Any] = {
    "average_memory": 5,
    "gauge_size": 199.852,
    "touches": [199.870, 199.874, 199.872],
    "zero_range": 0.001,
    "averaging_limit": 0.01,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
}
RING: dict[str, Any] = {
    "tool_memory": 32,
    "nominal": 30.0,
    "upper_deviation": 0.01,
    "lower_deviation": -0.01,
    "radius_term": 6.0,
    "sections": [
        {"plus": 24.013, "minus": -23.991},
        {"plus": 24.014, "minus": -23.990},
        {"plus": 24.015, "minus": -23.989},
    ],
}


def calibrate(shop: Shop, status: int = 201, client: Any = None, **more: Any) -> Any:
    return shop.call("POST", f"/machines/{shop.machine}/calibrations", status, client, **(GAUGE | more))


def ring(shop: Shop, status: int = 201, **more: Any) -> Any:
    return shop.call("POST", f"/machines/{shop.machine}/calibrations/ring", status, **(RING | more))


def accept(shop: Shop, number: int, status: int = 200, reason: str = "stylus replaced", client: Any = None) -> Any:
    return shop.call("POST", f"/machines/{shop.machine}/calibrations/{number}/accept", status, client, reason=reason)


def value(shop: Shop, location: int = 5) -> float:
    found: float = shop.call("GET", f"/machines/{shop.machine}/averages/{location}")["empirical_value"]
    return found


class TestGauge:
    def test_l92_leaves_its_results_and_changes_nothing_until_somebody_accepts(self, shop: Shop) -> None:
        made = calibrate(shop, tool_memory=30)
        assert made["results"] == {"R42": 199.852, "R43": 199.872, "R44": 0.02, "R46": 5, "R47": 30, "R49": 0.01}
        assert (made["status"], made["action"], made["proposed"]) == ("proposed", "accept", 0.02)
        assert made["reason"]["code"] == "full_difference"
        assert "+20.0" in made["reason"]["text"]
        assert made["warnings"] == []
        assert value(shop) == 0.0
        shop.read(0.8)
        assert shop.average() != 0.0
        done = accept(shop, made["number"])
        assert done["status"] == "accepted"
        assert (done["accepted"]["reason"], done["accepted"]["automatic"]) == ("stylus replaced", False)
        assert (value(shop), shop.average()) == (0.02, 0.0)

    def test_decisions_use_the_accepted_value_and_say_so(self, shop: Shop) -> None:
        assert "empirical value" not in shop.read(0.5)["reason"]["text"]
        accept(shop, calibrate(shop)["number"])
        answer = shop.read(20.5)
        assert answer["deviation"] == 0.0005
        assert answer["reason"]["notes"] == ["empirical_value"]
        assert "empirical value 20.0 µm (R11 = 5)" in answer["reason"]["text"]

    def test_numbers_count_per_machine_and_the_list_has_them_all(self, shop: Shop) -> None:
        numbers = [calibrate(shop)["number"], ring(shop)["number"], calibrate(shop, average_memory=6)["number"]]
        assert numbers == [1, 2, 3]
        path = f"/machines/{shop.machine}/calibrations"
        page = shop.call("GET", f"{path}?limit=2")
        assert ([each["number"] for each in page["items"]], page["next"]) == ([1, 2], "2")
        assert [each["number"] for each in shop.call("GET", f"{path}?after=2")["items"]] == [3]
        assert [each["number"] for each in shop.call("GET", f"{path}?average_memory=6")["items"]] == [3]
        assert [each["number"] for each in shop.call("GET", f"{path}?tool_memory=32")["items"]] == [2]
        assert shop.call("GET", f"{path}/3")["average_memory"] == 6
        assert "numbered" in shop.call("GET", f"{path}/4", 404)["what_to_do"]

    def test_r_numbers_stand_in_place_of_names(self, shop: Shop) -> None:
        by_number: dict[str, Any] = {
            "R11": 5,
            "R32": 25,
            "R33": 0.001,
            "R34": 0.01,
            "R36": 1,
            "R29": 1,
            "R28": 1,
            "R27": 2,
        }
        codes: dict[str, Any] = {"R21": 0, "R23": 1, "R22": 2, "R30": 2, "R31": 1, "R47": 30}
        path = f"/machines/{shop.machine}/calibrations"
        made = shop.call("POST", path, 201, touches=[25.0, 25.0], **by_number, **codes)
        settings = made["settings"]
        assert (settings["surface"], settings["probe_type"], settings["axis"]) == ("groove", "radial", "Z")
        assert (settings["direction"], settings["zero_range"], made["tool_memory"]) == ("negative", 0.001, 30)
        assert made["status"] == "unchanged"
        twice = shop.call("POST", path, 422, touches=[25.0], **by_number, zero_range=0.001)
        assert "R33 and zero_range mean the same" in twice["errors"][0]["message"]
        shop.call("POST", path, 422, touches=[25.0], **by_number, R21=1, R23=1)

    def test_the_average_goes_on_between_calibrations_and_begins_again_with_a_new_value(self, shop: Shop) -> None:
        """k = 2 and R33 = 4 µm as in the published example: 3, 5, 6 µm make 1.5, 3.25 and 4.625 µm."""
        limits: dict[str, Any] = {"zero_range": 0.004, "averaging_limit": 0.0133}
        made = [calibrate(shop, touches=[199.852 + um / 1000], **limits) for um in (3, 5, 6)]
        assert [each["average"] for each in made] == [0.0015, 0.00325, 0.004625]
        assert [each["status"] for each in made] == ["unchanged", "unchanged", "proposed"]
        accept(shop, 3)
        after = calibrate(shop, touches=[199.852 + 0.004625 + 0.002], **limits)
        assert (after["average"], after["value_before"]) == (0.001, 0.004625)
        another = calibrate(shop, touches=[200.3], **limits)
        assert (another["reason"]["code"], another["status"]) == ("full_difference", "proposed")
        nobody_took_it = calibrate(shop, touches=[199.852 + 0.004625 + 0.001], **limits)
        assert (nobody_took_it["average"], nobody_took_it["proposed"]) == (0.001, None), "not half of another gauge"

    def test_by_itself_where_the_plan_says_so(self, shop: Shop) -> None:
        plan = f"/machines/{shop.machine}/averages/5/calibration-plan"
        shop.call("PUT", plan, acceptance="automatic")
        made = calibrate(shop, client=shop.machine_client)
        assert (made["status"], made["accepted"]["automatic"], made["action"]) == ("accepted", True, "none")
        assert value(shop) == 0.02
        assert calibrate(shop)["status"] == "unchanged"

    def test_warns_of_what_the_control_itself_would_not_take(self, shop: Shop) -> None:
        made = calibrate(shop, averaging_limit=0.2, confidence_limit=5.0, weighting_factor=6.0)
        assert [(warning["code"], warning["field"]) for warning in made["warnings"]] == [
            ("outside_range", name) for name in ("weighting_factor", "averaging_limit", "confidence_limit")
        ]
        assert [warning["text"].partition(" ")[0] for warning in made["warnings"]] == ["R29", "R34", "R36"]


class TestInches:
    """A calibration typed in inches is named, and never applied automatically."""

    @pytest.mark.parametrize(
        ("more", "words"),
        [
            ({"gauge_size": 1.5748, "touches": [40.001]}, "1.5748 mm looks like 40.0010 mm in inches"),
            ({"gauge_size": 40.0, "touches": [1.5748]}, "1.5748 mm looks like 40.0000 mm in inches"),
            ({"gauge_size": 1.5748, "touches": [1.5756]}, "1.5748 mm looks like 40.0000 mm in inches"),
        ],
    )
    def test_a_gauge(self, shop: Shop, more: dict[str, Any], words: str) -> None:
        """The last one is all in inches: the characteristic on R11 = 5 has 40 mm."""
        shop.call("PUT", f"/machines/{shop.machine}/averages/5/calibration-plan", acceptance="automatic")
        made = calibrate(shop, zero_range=0.0001, **more)
        assert words in made["warnings"][0]["text"].replace("\xa0", " ")
        assert made["warnings"][0]["code"] == "looks_like_inches"
        assert made["status"] != "accepted"
        assert value(shop) == 0.0
        assert shop.call("GET", f"/machines/{shop.machine}/calibrations/1")["warnings"] == made["warnings"]
        page = Person(shop.server, "operator").open(f"/calibration/{shop.machine}/averages/5")
        assert "in inches. All lengths are in mm" in page
        assert 'value="1.5748"' not in page  # the size is not offered again

    @pytest.mark.parametrize(
        ("more", "words"),
        [
            ({"nominal": 1.1811}, "1.1811 mm looks like 30.0020 mm"),
            ({"radius_term": 0.23622}, "0.2362 mm looks like 5.9980 mm"),
            ({"sections": [{"plus": 0.94539, "minus": -0.94451}]}, "0.9449 mm looks like 24.0000 mm"),
        ],
    )
    def test_a_ring(self, shop: Shop, more: dict[str, Any], words: str) -> None:
        made = ring(shop, **more)
        assert made["status"] == "refused"
        assert words in made["warnings"][0]["text"].replace("\xa0", " ")

    def test_a_ring_that_is_all_in_inches_is_held_against_the_one_before(self, shop: Shop) -> None:
        assert ring(shop)["warnings"] == []
        inches: dict[str, Any] = {
            "upper_deviation": 0.0004,
            "lower_deviation": -0.0004,
            "nominal": 1.1811,
            "radius_term": 0.23622,
        }
        made = ring(shop, sections=[{"plus": 0.94539, "minus": -0.94451}] * 3, **inches)
        assert "1.1811 mm looks like 30.0000 mm" in made["warnings"][0]["text"].replace("\xa0", " ")

    def test_a_value_that_no_probe_has_waits_for_a_person(self, shop: Shop) -> None:
        shop.call("PUT", f"/machines/{shop.machine}/averages/5/calibration-plan", acceptance="automatic")
        made = calibrate(shop, touches=[210.0], path_factor=50, confidence_limit=50)
        assert (made["status"], value(shop)) == ("proposed", 0.0)
        assert "no probe measures so far off" in made["warnings"][0]["text"]


class TestRefused:
    @pytest.mark.parametrize(
        ("more", "code", "words"),
        [
            ({"touches": [200.852]}, "probe_fault", "confidence limit ±1"),
            ({"touches": [199.852, 201.853], "confidence_limit": 3.0}, "window", "Touch 2"),
        ],
    )
    def test_it_is_kept_changes_nothing_and_stops_the_machine(
        self, shop: Shop, more: dict[str, Any], code: str, words: str
    ) -> None:
        good = calibrate(shop)["number"]
        made = calibrate(shop, client=shop.machine_client, **more)
        assert (made["status"], made["action"], made["proposed"]) == ("refused", "stop", None)
        assert made["reason"]["code"] == code
        assert words in made["reason"]["text"]
        assert shop.call("GET", f"/machines/{shop.machine}/calibrations/{good}")["status"] == "proposed"
        assert "refused" in accept(shop, made["number"], 409)["detail"]
        (alarm,) = shop.alarms()
        assert alarm["kind"] == "calibration_refused"
        assert "R11 = 5" in alarm["text"]
        assert words in alarm["text"]
        accept(shop, good)
        assert value(shop) == 0.02

    def test_the_next_good_one_ends_the_alarm(self, shop: Shop) -> None:
        calibrate(shop, touches=[201.0], client=shop.machine_client)
        calibrate(shop, touches=[201.0], client=shop.machine_client)
        (alarm,) = shop.alarms()
        assert alarm["count"] == 2
        calibrate(shop, average_memory=6)
        assert len(shop.alarms()) == 1
        calibrate(shop, touches=[199.852])
        assert shop.alarms() == []
        ended = shop.call("GET", f"/alarms/{alarm['id']}")
        assert (ended["action"], ended["outcome"][0]["code"]) == ("noted", "calibrated")

    @pytest.mark.parametrize(
        ("more", "field"),
        [
            ({"zero_range": 0.01}, "averaging_limit"),
            ({"averaging_limit": 1.0}, "confidence_limit"),
            ({"repeats": 2}, "touches"),
            ({"touches": ["199.852"]}, "touches[0]"),
            ({"touches": None}, "touches"),
            ({"R21": "1"}, "R21"),
            ({"R23": []}, "R23"),
            ({"average_memory": 0}, "average_memory"),
            ({"average_memory": 21}, "average_memory"),
            ({"weighting_factor": 0.5}, "weighting_factor"),
            ({"calibrated_at": "1999-01-01T00:00:00Z"}, "calibrated_at"),
            ({"spindle": 1}, "spindle"),
        ],
    )
    def test_what_is_no_calibration_is_not_stored(self, shop: Shop, more: dict[str, Any], field: str) -> None:
        problem = calibrate(shop, 422, **more)
        assert problem["errors"][0]["field"] == field
        assert shop.call("GET", f"/machines/{shop.machine}/calibrations")["items"] == []

    @pytest.mark.parametrize(
        ("more", "at"),
        [
            ({"touches": [199.852, None, 199.853]}, 2),
            ({"touches": [None]}, 1),
            ({"touches": []}, 1),
            ({"touches": [199.852], "repeats": 3}, 2),
        ],
    )
    def test_a_missing_touch_is_a_refused_calibration_with_an_alarm(
        self, shop: Shop, more: dict[str, Any], at: int
    ) -> None:
        good = calibrate(shop)["number"]
        made = calibrate(shop, client=shop.machine_client, key="once", **more)
        assert (made["status"], made["action"], made["reason"]["code"]) == ("refused", "stop", "no_touch")
        assert made["touches"] == more["touches"]
        assert (made["results"]["R43"], made["proposed"], made["settings"]["at"]) == (None, None, at)
        (alarm,) = shop.alarms()
        assert alarm["kind"] == "calibration_refused"
        assert f"Touch {at} is missing: the probe did not trigger." in alarm["text"]
        assert calibrate(shop, 200, client=shop.machine_client, key="once", **more) == made
        figure = shop.admin.get(f"/api/v1/machines/{shop.machine}/averages/5/calibration-figure")
        assert "Calibration refused" in figure.text
        accept(shop, good)
        assert value(shop) == 0.02


class TestRing:
    def test_the_offset_of_the_probe_follows_when_it_is_accepted(self, shop: Shop) -> None:
        tool = f"/machines/{shop.machine}/tools/32"
        shop.call("PUT", tool, offset=100.0, reason="as the control has it")
        made = ring(shop)
        assert (made["difference"], made["value_before"], made["proposed"]) == (0.012, 100.0, 100.012)
        assert made["settings"]["diameters"] == [30.002, 30.002, 30.002]
        assert (made["tool_memory"], made["average_memory"], made["status"]) == (32, None, "proposed")
        accept(shop, made["number"])
        assert shop.call("GET", tool)["offset"] == 100.012

    def test_macro_variables_stand_in_place_of_names(self, shop: Shop) -> None:
        macro: dict[str, Any] = {"#505": 30.0, "#506": 0.01, "#507": -0.01, "#502": 6.0}
        path = f"/machines/{shop.machine}/calibrations/ring"
        made = shop.call("POST", path, 201, tool_memory=32, sections=RING["sections"], **macro)
        assert made["difference"] == 0.012

    def test_both_refusals(self, shop: Shop) -> None:
        blocked = ring(shop, sections=[], first_move_triggered=True)
        assert (blocked["status"], blocked["reason"]["code"]) == ("refused", "not_a_bore")
        assert "not a bore" in blocked["reason"]["text"]
        wrong = ring(shop, sections=[RING["sections"][0], {"plus": 24.1, "minus": -24.1}])
        assert (wrong["status"], wrong["reason"]["code"], wrong["settings"]["at"]) == ("refused", "wrong_gauge", 2)
        assert "same height" in wrong["reason"]["text"]
        assert "30.1000" in wrong["reason"]["text"]

    def test_a_section_that_was_not_touched_is_refused_with_an_alarm(self, shop: Shop) -> None:
        for sections, at in (
            (RING["sections"][:2], 3),
            ([], 1),
            ([RING["sections"][0], RING["sections"][1] | {"minus": None}, RING["sections"][2]], 2),
        ):
            made = ring(shop, sections=sections)
            assert (made["status"], made["action"], made["reason"]["code"]) == ("refused", "stop", "no_touch")
            assert f"Section {at} was not touched on both sides" in made["reason"]["text"]
            assert f"Section {at} was not touched" in shop.alarms()[0]["text"]
        swapped = [{"plus": section["minus"], "minus": section["plus"]} for section in RING["sections"]]
        told = ring(shop, 422, sections=[RING["sections"][0], *swapped[1:]])
        assert [each["field"] for each in told["errors"]] == ["sections[1].plus", "sections[2].plus"]
        assert "exchanged" in told["detail"]
        nothing = {"nominal": 0, "upper_deviation": 0, "lower_deviation": 0, "radius_term": 0}
        told = ring(shop, 422, **nothing, sections=[{"plus": 0, "minus": 0}] * 3)
        assert told["errors"][0]["field"] == "nominal"
        assert ring(shop, 422, upper_deviation=-0.02)["errors"][0]["field"] == "upper_deviation"


class TestOnce:
    def test_a_key_names_one_calibration_for_ever(self, shop: Shop) -> None:
        first = calibrate(shop, key="cal:1")
        again = calibrate(shop, 200, key="cal:1")
        assert again == first
        problem = calibrate(shop, 409, key="cal:1", touches=[199.852])
        assert "other values" in problem["detail"]
        assert ring(shop, key="ring:1")["number"] == ring(shop, 200, key="ring:1")["number"]
        assert len(shop.call("GET", f"/machines/{shop.machine}/calibrations")["items"]) == 2

    def test_of_two_who_accept_at_once_one_wins_and_the_other_learns_who(self, shop: Shop) -> None:
        number = calibrate(shop)["number"]
        path = f"/api/v1/machines/{shop.machine}/calibrations/{number}/accept"
        clients = [shop.server.client(shop.server.key(role="operator")) for _ in range(8)]
        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(lambda client: client.post(path, json={"reason": "seen"}), clients))
        assert sorted(answer.status_code for answer in answers) == [200] + [409] * 7
        assert all("accepted by" in answer.json()["detail"] for answer in answers if answer.status_code == 409)
        changes = shop.call("GET", f"/audit?subject=average/{shop.machine}/5")["items"]
        assert [each["action"] for each in changes] == ["empirical value changed"]
        assert value(shop) == 0.02

    def test_an_overtaken_one_cannot_be_accepted(self, shop: Shop) -> None:
        first, second = calibrate(shop)["number"], calibrate(shop)["number"]
        assert "newer one" in accept(shop, first, 409)["detail"]
        shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.5, reason="by hand")
        assert accept(shop, second, 409)["calibration_status"] == "overtaken"
        confirmed = calibrate(shop, average_memory=6, touches=[199.852])["number"]
        assert "nothing to accept" in accept(shop, confirmed, 409)["detail"]

    def test_the_record_cannot_be_altered(self, shop: Shop) -> None:
        calibrate(shop)
        with (
            psycopg.connect(shop.server.database.dsn) as connection,
            pytest.raises(psycopg.errors.RaiseException, match="append-only"),
        ):
            connection.execute("UPDATE calibration SET difference = 0")


class TestWho:
    def test_machines_calibrate_themselves_and_nobody_else(self, shop: Shop) -> None:
        other = Shop(shop.server)
        calibrate(shop, client=shop.machine_client)
        calibrate(other, 403, client=shop.machine_client)
        accept(shop, 1, 403, client=shop.machine_client)

    def test_operators_accept_and_engineers_plan(self, shop: Shop) -> None:
        viewer, operator = (shop.server.client(shop.server.key(role=role)) for role in ("viewer", "operator"))
        calibrate(shop, 403, client=viewer)
        number = calibrate(shop, client=operator)["number"]
        accept(shop, number, 403, client=viewer)
        plan = f"/machines/{shop.machine}/averages/5/calibration-plan"
        shop.call("PUT", plan, 403, operator, due_parts=5)
        accept(shop, number, client=operator)
        shop.call("GET", "/calibration", client=viewer)
        shop.call("GET", "/calibration", 403, shop.machine_client)
