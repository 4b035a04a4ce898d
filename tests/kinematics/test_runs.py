"""Runs in their four forms, limits of the control, entering and putting back, on a running server."""

from typing import Any

import pytest

from app.readings.actions import push_waiting
from tests.conftest import Server
from tests.kinematics.bench import NAMES, RADIUS, TRUE, axis, protocol, touched
from tests.shop import Shop

RUNS = "/kinematics/runs"


@pytest.fixture
def shop(server: Server) -> Shop:
    return Shop(server)


def take(shop: Shop, status: int = 201, **run: Any) -> Any:
    return shop.call("POST", RUNS, status, machine=shop.machine, **run)


def plan(shop: Shop, **wanted: Any) -> Any:
    return shop.call("PUT", f"/machines/{shop.machine}/kinematics", **({"reason": "acceptance"} | wanted))


def errors_of(run: Any) -> list[float]:
    return [run["axes"][0]["errors"][name]["value"] for name in NAMES]


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

    def test_a_damaged_string_is_read_as_far_as_it_goes(self, shop: Shop) -> None:
        run = take(shop, results={"QS146": "0.01234567 -0.0123456 0.00123456"})
        assert set(run["axes"][0]["errors"]) == {"EX0C", "EY0C", "EA0C"}
        assert run["not_understood"] == ["QS146: four numbers are needed, 3 came"]
        assert "QS146" not in run["parameters"]

    @pytest.mark.parametrize("language", ["de", "en", "sl"])
    def test_protocols(self, shop: Shop, language: str) -> None:
        run = take(shop, protocol=protocol(language))
        c = next(each for each in run["axes"] if each["axis"] == "C")
        assert c["scatter_after"] in {0.0021, 0.0019}
        assert set(c["errors"]) == set(NAMES)
        if language == "de":
            assert run["measured_at"] == "2026-11-21T06:42:10Z"
            assert [note for note in run["not_understood"] if "Nachtschicht" in note]
            assert len(c["positions"]) == 4
            assert c["position_after"] == [250.0123, -0.0081, -120.0]

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


class TestKinematics:
    def test_entered_backed_up_and_put_back(self, shop: Shop) -> None:
        first = take(shop, axes=[axis()])
        shop.call("POST", f"{RUNS}/{first['run']}/enter", reason="Monthly check")
        second = take(shop, axes=[axis((0.002, 0.0, 0.0, 0.0))])
        shop.call("POST", f"{RUNS}/{second['run']}/enter", reason="Warm now")
        backups = shop.call("GET", f"/machines/{shop.machine}/kinematics/backups")["items"]
        assert [(each["version"], each["run"]) for each in backups] == [
            (1, None), (2, first["run"]), (3, second["run"]),
        ]  # fmt: skip
        assert backups[0]["errors"] == {}
        assert backups[1]["errors"]["EX0C"] == pytest.approx(0.0123, abs=0.001)
        assert backups[2]["errors"]["EX0C"] == pytest.approx(0.0143, abs=0.001)
        restored = shop.call(
            "POST", f"/machines/{shop.machine}/kinematics/backups/2/restore", 201, reason="Worse than before"
        )
        assert (restored["version"], restored["restores"], restored["errors"]) == (4, 2, backups[1]["errors"])
        path = f"/machines/{shop.machine}/kinematics/backups"
        assert "in effect" in shop.call("POST", f"{path}/4/restore", 409, reason="again")["detail"]
        shop.call("POST", f"{path}/9/restore", 404, reason="none")
        actions = [
            each["action"] for each in shop.call("GET", "/audit?limit=1000")["items"] if shop.machine in each["subject"]
        ]
        assert {"kinematics changed", "kinematics put back"} <= set(actions)

    def test_of_two_who_enter_one_is_told(self, shop: Shop) -> None:
        one, two = take(shop, axes=[axis()]), take(shop, axes=[axis(seed=2)])
        shop.call("POST", f"{RUNS}/{two['run']}/enter", reason="mine")
        assert "already" in shop.call("POST", f"{RUNS}/{two['run']}/enter", 409, reason="mine")["detail"]
        assert "changed since" in shop.call("POST", f"{RUNS}/{one['run']}/enter", 409, reason="mine")["detail"]
        assert shop.call("GET", f"{RUNS}/{one['run']}")["overtaken"] is True

    def test_heads_have_kinematics_of_their_own(self, shop: Shop) -> None:
        one = take(shop, axes=[axis()], head="Fork 1")
        two = take(shop, axes=[axis((0.02, 0, 0, 0))], head="Fork 2")
        shop.call("POST", f"{RUNS}/{one['run']}/enter", reason="x")
        assert shop.call("POST", f"{RUNS}/{two['run']}/enter", reason="x")["status"] == "entered"
        assert len(shop.call("GET", f"{RUNS}?machine={shop.machine}&head=Fork 1")["items"]) == 1


class TestDoor:
    def test_a_key_is_taken_once(self, shop: Shop) -> None:
        run: dict[str, Any] = {"machine": shop.machine, "axes": [axis()], "key": "452:1"}
        first = shop.call("POST", RUNS, 201, **run)
        assert shop.call("POST", RUNS, 200, **run) == first
        assert shop.call("POST", RUNS, 409, **run | {"axes": [axis(seed=3)]})["run"] == first["run"]

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


class TestDrift:
    def series(self, shop: Shop, *errors: float) -> list[Any]:
        return [
            take(shop, axes=[axis((e, 0, 0, 0), seed=n)], measured_at=f"2026-10-{n + 1:02}T06:00:00Z")
            for n, e in enumerate(errors)
        ]

    def test_a_trend_an_alarm_and_its_end(self, shop: Shop) -> None:
        plan(shop, limits={"EX0C": 0.01})
        self.series(shop, 0.001, 0.003, 0.006, 0.008, 0.011)
        (alarm,) = shop.alarms()
        assert alarm["kind"] == "kinematics_drift"
        assert "EX0C" in alarm["text"]
        state = shop.call("GET", f"/machines/{shop.machine}/kinematics")
        found = next(each for each in state["drift"] if each["name"] == "EX0C")
        assert found["beyond"] is True
        assert found["slope_per_day"] == pytest.approx(0.0025, abs=0.0005)
        assert found["slope_low"] > 0
        figure = shop.call("GET", f"/machines/{shop.machine}/kinematics/drift-figure?value=EX0C")
        assert figure["data"][-1]["marker"]["symbol"][-1] == "triangle-up"
        last = shop.call("GET", f"{RUNS}?machine={shop.machine}")["items"][-1]
        shop.call("POST", f"{RUNS}/{last['run']}/enter", reason="Monthly")
        assert shop.alarms() == []
        take(shop, axes=[axis((0.001, 0, 0, 0))], measured_at="2026-10-07T06:00:00Z")
        found = shop.call("GET", f"/machines/{shop.machine}/kinematics")["drift"][0]
        assert found["name"] == "EX0C"
        assert found["true"] == pytest.approx(0.012, abs=0.002)  # what was entered is no movement of the axis
        assert found["last"] == pytest.approx(0.001, abs=0.001)

    def test_two_runs_side_by_side(self, shop: Shop) -> None:
        old, new = self.series(shop, 0.001, 0.011)
        for a, b in ((old, new), (new, old)):
            found = shop.call("GET", f"{RUNS}/{a['run']}/comparison?with={b['run']}")
            assert (found["before"], found["after"]) == (old["run"], new["run"])
        x = next(each for each in found["changes"] if each["name"] == "EX0C")
        assert x["difference"] == pytest.approx(0.01, abs=0.0015)
        assert x["moved"] is True
        assert x["enter"] == new["axes"][0]["errors"]["EX0C"]["value"]
        y = next(each for each in found["changes"] if each["name"] == "EY0C")
        assert abs(y["difference"]) < 0.001
        figure = shop.call("GET", f"{RUNS}/{old['run']}/comparison-figure?with={new['run']}&theme=dark")
        assert len(figure["layout"]["annotations"]) == 4
        other = Shop(shop.server)
        foreign = take(other, axes=[axis()])
        shop.call("GET", f"{RUNS}/{old['run']}/comparison?with={foreign['run']}", 422)

    def test_values_become_readings(self, shop: Shop) -> None:
        shop.add(
            f"{shop.machine}-ex0c",
            target=0.0,
            tolerance_width=0.02,
            tool_memory=0,
            average_memory=0,
            mode="measure_only",
        )
        plan(shop, characteristics={"EX0C": f"{shop.machine}-ex0c"})
        run = take(shop, axes=[axis()])
        with shop.server.database.begin() as session:
            push_waiting(session)
        readings = shop.call("GET", f"/readings?characteristic={shop.machine}-ex0c")["items"]
        assert [each["key"] for each in readings] == [f"kinematics:{run['run']}:EX0C"]
        assert readings[0]["measured"] == pytest.approx(run["axes"][0]["errors"]["EX0C"]["value"], abs=1e-9)
        shop.call(
            "PUT", f"/machines/{shop.machine}/kinematics", 422, reason="x", characteristics={"EX0C": "no-such-thing"}
        )

    def test_diagrams(self, shop: Shop) -> None:
        run = take(shop, axes=[axis(both=True)])["run"]
        figure = shop.call("GET", f"{RUNS}/{run}/figure?axis=C&letter=Y")
        assert [trace["meta"] for trace in figure["data"]] == ["measured", "measured", "optimised", "optimised"]
        assert figure["layout"]["yaxis"]["title"]["text"] == "EYC, µm"
        shop.call("GET", f"{RUNS}/{run}/figure?axis=A&letter=Y", 422)
