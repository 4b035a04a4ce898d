"""Runs in their four forms, limits of the control, and the door, on a running server."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from tests.databases import NewDatabase
from tests.geometry.rotary_axes.bench import NAMES, RADIUS, RUNS, TRUE, axis, enter, plan, protocol, take, touched
from tests.in_process import in_process
from tests.servers import Server
from tests.shop import Person, Shop


def errors_of(run: Any) -> list[float]:
    return [run["axes"][0]["errors"][name]["value"] for name in NAMES]


class TestImplausible:
    def test_an_axis_100_metres_off_waits_until_somebody_has_acknowledged_it(self, shop: Shop) -> None:
        run = take(shop, results={"Q143": 0.0134, "QS146": "99999.1234 -0.0123456 2.00123456 -0.0012345"})
        assert [each["code"] for each in run["warnings"]] == ["axis_far_off", "axis_leans_far"]
        assert "EX0C = 99999.123" in run["warnings"][0]["text"]
        assert {each["field"] for each in run["warnings"]} == {"results.QS146"}
        assert run["parameters"] == {"Q143": 0.0134}
        protocol = f"/api/v1{RUNS}/{run['run']}/protocol.csv"
        assert "QS146" not in shop.admin.get(protocol).text
        assert run["status"] == "to_confirm"
        assert "implausibly far from the position" in enter(shop, run, 409)["detail"]
        viewer = Person(shop.server, "viewer")
        page = viewer.open(f"/kinematics/runs/{run['run']}")
        assert "implausibly far from the position" in page
        assert "<code>QS146" not in page
        assert "To enter" not in page
        assert "Values to enter" not in page
        assert "before it is confirmed" in page
        path = f"{RUNS}/{run['run']}/acknowledge"
        shop.call("POST", path, 403, shop.machine_client, reason="x")
        seen = shop.call("POST", path, reason="a new table")
        assert (seen["status"], seen["confirmed"]["reason"]) == ("confirmed", "a new table")
        assert seen["warnings"] == run["warnings"]
        assert seen["parameters"]["QS146"].startswith("99999.1234")
        assert "QS146" in shop.admin.get(protocol).text
        assert "<code>QS146" in viewer.open(f"/kinematics/runs/{run['run']}")
        shop.call("POST", path, 409, reason="again")

    def test_the_limits_are_those_of_the_machine(self, server: Server) -> None:
        shop = Shop(server)
        shop.call("PATCH", f"/machines/{shop.machine}", plausible_axis_shift=0.01)
        assert take(shop, results={"Q149": 0.02})["warnings"][0]["code"] == "ball_far_off"
        assert take(shop, results={"Q149": 0.005})["warnings"] == []

    def test_a_manual_is_no_protocol(self, shop: Shop) -> None:
        lines = [f"Page {n}: the cycle measures the ball and writes what it finds." for n in range(40)]
        manual = "\n".join(
            [
                *lines,
                'QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345"',
                "Calibration sphere radius: 12.5 mm",
                "Axis C",
                "Backlash: 0.001",
            ]
        )
        told = take(shop, 422, protocol=manual)
        assert told["errors"][0]["field"] == "protocol"
        assert "no protocol" in told["detail"]


class TestForms:
    def test_centres(self, shop: Shop) -> None:
        run = take(shop, axes=[axis(both=True, backlash=0.002)], program="452.h", backlash_angle=0.5)
        assert (run["form"], run["status"], run["reason"]["code"]) == ("centres", "measured", "measured")
        assert errors_of(run) == pytest.approx(TRUE, abs=0.002)
        c = run["axes"][0]
        assert c["backlash"]["value"] == pytest.approx(0.002, abs=0.0005)
        assert c["scatter_after"] < 0.001 < c["scatter_before"]
        assert (c["points"], c["start_angle"], c["end_angle"], len(c["positions"])) == (6, -90, 180, 12)
        assert run["parameters"]["Q143"] == c["scatter_before"]
        assert len(run["parameters"]["QS146"]) == 43
        assert abs(run["offsets"]["X"]) < 0.001
        assert shop.call("GET", f"{RUNS}/{run['run']}") == run
        again = shop.call("POST", f"{RUNS}/{run['run']}/recompute")
        assert again["same"] is True
        assert again["axes"] == run["axes"]

    def test_touches(self, shop: Shop) -> None:
        run = take(shop, axes=[touched()], ball_radius=RADIUS)
        assert run["form"] == "touches"
        assert errors_of(run) == pytest.approx(TRUE, abs=1e-5)
        assert [ball["radius"] for ball in run["balls"]] == [RADIUS] * 6
        assert run["given"]["axes"][0]["positions"][0]["touches"]

    def test_result_parameters_as_fields_and_as_text(self, shop: Shop) -> None:
        text = "0.01234567 -0.0123456 0.00123456 -0.0012345"
        sent = take(shop, results={"Q143": 0.0134, "Q146": 0.0021, "Q149": 0.0005, "QS146": text})
        pasted = take(shop, pasted=f'Q143 = 0,0134\nQ146 = 0.0021\nQ149 = 0.0005\nQS146 = "{text}"')
        assert sent["axes"] == pasted["axes"]
        assert errors_of(sent) == [0.01234567, -0.0123456, 0.00123456, -0.0012345]
        assert sent["parameters"] == {"Q143": 0.0134, "Q146": 0.0021, "Q149": 0.0005, "QS146": text}
        assert sent["not_understood"] == []

    def test_of_a_damaged_string_nothing_is_guessed(self, shop: Shop) -> None:
        run = take(shop, results={"Q143": 0.0134, "QS146": "0.01234567 -0.0123456 0.00123456"})
        assert run["axes"][0]["errors"] == {}
        assert run["not_understood"] == [
            "QS146: four numbers are needed, 3 received; it is not clear which is missing, so none is used"
        ]
        assert "QS146" not in run["parameters"]
        assert "no position error" in enter(shop, run, 409)["detail"]
        take(shop, 422, results={"QS146": "0.01234567 -0.0123456 0.00123456"})
        take(shop, 422, results={"Q143": True})
        assert "no axis was measured" in take(shop, 422, results={"Q141": -1.0, "Q144": -1})["detail"]
        one = take(shop, results={"QS146": "0.01234567 xxxxxxxxxx 0.00123456 -0.0012345"})
        assert set(one["axes"][0]["errors"]) == {"EX0C", "EA0C", "EB0C"}

    @pytest.mark.parametrize("language", ["de", "en", "sl"])
    def test_protocols(self, shop: Shop, language: str) -> None:
        run = take(shop, protocol=protocol(language))
        c = next(each for each in run["axes"] if each["axis"] == "C")
        assert c["scatter_after"] in {0.0021, 0.0019}
        assert set(c["errors"]) == set(NAMES)
        if language == "de":
            assert run["measured_at"] == "2026-11-21T06:42:10Z"
            assert (run["tool"], run["kinematics"]) == ("TOUCH_PROBE", "MILL5_AC")
            assert [note for note in run["not_understood"] if "Nachtschicht" in note]
            assert len(c["positions"]) == 4
            assert c["position_after"] == [250.0123, -0.0081, -120.0]

    def test_what_is_not_said_is_no_correction_by_zero(self, shop: Shop) -> None:
        (axis,) = take(shop, protocol="<h2>Axis C</h2><p>Backlash: 0.001</p>")["axes"]
        assert (axis["errors"], axis["correction"]) == ({}, None)
        (axis,) = take(shop, results={"Q143": 0.01})["axes"]
        assert axis["correction"] is None
        number = take(shop, protocol="<h2>Axis C</h2><p>EX0C: 0.004</p>")["run"]
        assert shop.call("GET", f"{RUNS}/{number}")["axes"][0]["correction"] == [0.004, 0.0, 0.0]

    def test_words_of_the_plant(self, new_database: NewDatabase, tmp_path: Path) -> None:
        protocol = "<h2>Asse C</h2><p>Gioco medio: 0,002</p>"
        (tmp_path / "words.toml").write_text('[axis]\nlabels = ["asse"]\n[backlash]\nlabels = ["Gioco medio"]')
        with in_process(new_database(), rotary_words=tmp_path / "words.toml") as server:
            shop = Shop(server)
            (axis,) = take(shop, protocol=protocol)["axes"]
            assert axis["backlash"]["value"] == 0.002
            engineer = Person(server, "engineer")
            fields = {"machine": shop.machine, "as": "protocol", "protocol": protocol}
            assert "Everything was understood" in engineer.send("/kinematics/new", 200, **fields, do="look")

    def test_a_label_that_is_not_known_is_named_with_what_adds_it(self, shop: Shop) -> None:
        protocol = "<h2>Asse C</h2><p>Gioco medio: 0,002</p>"
        advice = take(shop, 422, protocol=protocol)["what_to_do"]
        assert "here “Asse C”, “Gioco medio”, are added with a file that INBAND_ROTARY_WORDS names" in advice
        engineer = Person(shop.server, "engineer")
        fields = {"machine": shop.machine, "as": "protocol"}
        assert "INBAND_ROTARY_WORDS" in engineer.send("/kinematics/new", 422, **fields, protocol=protocol)
        seen = engineer.send("/kinematics/new", 200, **fields, protocol="C axis\nBacklash: 0.1\nGioco: 1")
        assert "/help/how-to/rotary-axes#add-words-of-a-protocol" in seen
        assert "INBAND_ROTARY_WORDS" in engineer.open("/help/how-to/rotary-axes")

    def test_the_clock_of_the_control(self, shop: Shop) -> None:
        run = take(shop, protocol=protocol("de"), timezone="Europe/Ljubljana")
        assert run["measured_at"] == "2026-11-21T05:42:10Z"
        problem = take(shop, 422, protocol=protocol("de"), timezone="Ljubljana")
        assert problem["errors"][0]["field"] == "timezone"
        assert "Europe/Belgrade" in problem["errors"][0]["message"]

    def test_places_that_contradict_the_corrections(self, shop: Shop) -> None:
        run = take(
            shop,
            protocol="<h2>C axis</h2><p>Corrections: X 0.01 Y 0 Z 0</p><p>Position before: X 250 Y 0 Z 0</p>"
            "<p>Position after: X 249.99 Y 0 Z 0</p>",
        )
        assert run["axes"][0]["errors"]["EX0C"]["value"] == -0.01  # where the kinematics went, not what was called so
        assert "but the corrections are" in run["not_understood"][0]

    def test_the_ball_alone(self, shop: Shop) -> None:
        run = take(shop, shift={"nominal": [0.0, 0.0, 0.0], "centre": [0.012, -0.003, 0.001]})
        assert run["offsets"] == {"X": 0.012, "Y": -0.003, "Z": 0.001}
        assert run["parameters"] == {"Q147": 0.012, "Q148": -0.003, "Q149": 0.001}

    @pytest.mark.parametrize(
        ("run", "field"),
        [
            ({}, "body"),
            ({"axes": [axis()], "pasted": "Q143 = 1"}, "body"),
            ({"axes": [axis(), axis()]}, "body"),
            ({"axes": [axis() | {"positions": axis()["positions"][:2]}]}, "axes[0].positions"),
            ({"axes": [axis() | {"ball": [0.0, 0.1, 5.0]}]}, "axes[0].positions"),
            ({"axes": [{"axis": "C", "positions": [{"angle": 1.0}]}]}, "axes[0].positions[0]"),
            ({"axes": [{"axis": "C", "positions": [{"angle": 1, "touches": [[0, 0, 0]] * 4}]}]}, "axes[0].positions[0].touches"),
            ({"results": {"Q999": 1.0}}, "results"),
            ({"results": {"Q143": "x"}}, "results.Q143"),
            ({"results": {"QS146": 5.0}}, "results.QS146"),
            ({"results": {"QS146": "x"}}, "results"),
            ({"results": {}}, "results"),
            ({"pasted": "hello"}, "pasted"),
            ({"protocol": "<h1>Rechnung</h1>"}, "protocol"),
            ({"protocol": "<" * 100_000}, "protocol"),
        ],
    )  # fmt: skip
    def test_what_says_nothing_is_refused_and_not_kept(self, shop: Shop, run: Any, field: str) -> None:
        problem = take(shop, 422, **run)
        assert next(error["field"] for error in problem["errors"]).startswith(field) or field == "body", problem
        assert problem["detail"]
        assert shop.call("GET", f"{RUNS}?machine={shop.machine}")["items"] == []


class TestLimits:
    def test_a_wrong_ball_refuses_and_is_recorded(self, shop: Shop) -> None:
        plan(shop, ball_radius=RADIUS, max_dev_cal_ball=0.01)
        run = take(shop, axes=[touched(radius=RADIUS + 0.011)])
        assert (run["status"], run["reason"]["code"], run["axes"]) == ("refused", "max_dev_cal_ball", [])
        assert "12.5110" in run["reason"]["text"]
        problem = shop.call("POST", f"{RUNS}/{run['run']}/enter", 409, reason="all the same")
        assert "refused" in problem["detail"]
        assert take(shop, axes=[touched(radius=RADIUS + 0.01)])["status"] == "measured"

    def test_a_large_change_waits_to_be_confirmed(self, shop: Shop) -> None:
        plan(shop, max_modification=0.012)
        run = take(shop, axes=[axis()])
        assert (run["status"], run["reason"]["code"]) == ("to_confirm", "max_modification")
        number = run["run"]
        assert "onfirm" in shop.call("POST", f"{RUNS}/{number}/enter", 409, reason="now")["what_to_do"]
        confirmed = shop.call("POST", f"{RUNS}/{number}/confirm", reason="After the collision")
        assert confirmed["status"] == "confirmed"
        assert confirmed["confirmed"]["reason"] == "After the collision"
        assert "already" in shop.call("POST", f"{RUNS}/{number}/confirm", 409, reason="me too")["detail"]
        assert shop.call("POST", f"{RUNS}/{number}/enter", reason="done")["status"] == "entered"

    def test_confirmed_at_once_by_a_person_but_not_by_a_machine(self, shop: Shop) -> None:
        plan(shop, max_modification=0.012)
        run: dict[str, Any] = {"machine": shop.machine, "axes": [axis()], "confirm": "New head"}
        assert shop.call("POST", RUNS, 201, **run)["status"] == "confirmed"
        assert shop.call("POST", RUNS, 201, client=shop.machine_client, **run)["status"] == "to_confirm"

    def test_an_axis_that_leans_too_much(self, shop: Shop) -> None:
        plan(shop, max_modification_angle=0.002)
        run = take(shop, axes=[axis()])
        assert run["status"] == "to_confirm"
        assert "EA0C" in run["reason"]["text"]


class TestDoor:
    def test_a_key_is_taken_once(self, shop: Shop) -> None:
        run: dict[str, Any] = {"machine": shop.machine, "axes": [axis()], "key": "452:1"}
        first = shop.call("POST", RUNS, 201, **run)
        assert shop.call("POST", RUNS, 200, **run) == first
        assert shop.call("POST", RUNS, 409, **run | {"axes": [axis(seed=3)]})["run"] == first["run"]
        timed: dict[str, Any] = {"machine": shop.machine, "results": {"Q143": 1.0}, "key": "452:3"}
        first = shop.call("POST", RUNS, 201, **timed, measured_at="2026-11-21T06:00:00Z")
        timed["results"] = {"Q143": 1}
        assert shop.call("POST", RUNS, 200, **timed, measured_at="2026-11-21T07:00:00+01:00") == first

    def test_of_the_same_sent_at_once_one_is_kept(self, shop: Shop) -> None:
        body = {"machine": shop.machine, "axes": [axis()], "key": "452:2"}
        with ThreadPoolExecutor(5) as pool:
            answers = list(pool.map(lambda _n: shop.machine_client.post(f"/api/v1{RUNS}", json=body), range(5)))
        assert sorted(each.status_code for each in answers) == [200, 200, 200, 200, 201]
        assert len({each.json()["run"] for each in answers}) == 1
        assert len(shop.call("GET", f"{RUNS}?machine={shop.machine}")["items"]) == 1

    def test_recomputed_from_what_was_sent(self, shop: Shop) -> None:
        """Touches, text and protocol alike, after the limits were changed."""
        plan(shop, ball_radius=RADIUS, max_dev_cal_ball=0.5)
        made = [
            take(shop, axes=[touched(radius=RADIUS + 0.1)]),
            take(shop, pasted='QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345"'),
            take(shop, protocol=protocol("sl")),
            take(shop, shift={"nominal": [0.0, 0.0, 0.0], "centre": [0.012, -0.003, 0.001]}),
        ]
        plan(shop, ball_radius=RADIUS, max_dev_cal_ball=0.001)
        for run in made:
            again = shop.call("POST", f"{RUNS}/{run['run']}/recompute")
            assert (again["same"], again["outcome"]) == (True, "measured")
            assert (again["axes"], again["offsets"]) == (run["axes"], run["offsets"])

    def test_machines_push_their_own_runs_only(self, shop: Shop, server: Server) -> None:
        other = Shop(server)
        run: dict[str, Any] = {"machine": shop.machine, "axes": [axis()]}
        made = shop.call("POST", RUNS, 201, client=shop.machine_client, **run)
        shop.call("POST", RUNS, 403, client=other.machine_client, **run)
        shop.call("GET", f"{RUNS}/{made['run']}", 403, client=other.machine_client)
        shop.call("POST", f"{RUNS}/{made['run']}/enter", 403, client=shop.machine_client, reason="x")
        assert shop.call("GET", RUNS, client=other.machine_client)["items"] == []

    def test_pages_of_the_list(self, shop: Shop) -> None:
        made = [take(shop, axes=[axis(seed=n)])["run"] for n in range(3)]
        first = shop.call("GET", f"{RUNS}?machine={shop.machine}&limit=2")
        second = shop.call("GET", f"{RUNS}?machine={shop.machine}&limit=2&after={first['next']}")
        assert [each["run"] for each in first["items"] + second["items"]] == made
        assert second["next"] is None
