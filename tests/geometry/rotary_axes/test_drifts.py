"""Drift over the runs: trend, limits, alarm, two runs side by side, values that become readings; heads among them."""

import time
from typing import Any

import pytest

from tests.geometry.rotary_axes.bench import RUNS, axis, plan, take
from tests.shop import Person, Shop


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

    def test_runs_seconds_apart_say_nothing_of_a_day(self, shop: Shop) -> None:
        for n, error in enumerate((0.001, 0.003, 0.002, 0.004, 0.003)):
            take(shop, axes=[axis((error, 0, 0, 0), seed=n)], measured_at=f"2026-10-01T06:00:0{n}Z")
        drifts = shop.call("GET", f"/machines/{shop.machine}/kinematics")["drift"]
        assert {each["slope_per_day"] for each in drifts} == {None}

    def test_a_run_that_waits_to_be_confirmed_counts_in_no_drift(self, shop: Shop) -> None:
        """A sphere that stands 1.5 mm off moves no axis; confirmed, it counts."""

        def found() -> Any:
            drifts = shop.call("GET", f"/machines/{shop.machine}/kinematics")["drift"]
            return next(each for each in drifts if each["name"] == "EX0C")

        plan(shop, max_modification=0.05)
        self.series(shop, 0.001, 0.003, 0.006, 0.008, 0.011)
        before = found()
        wild = take(shop, axes=[axis((1.5, 0, 0, 0), seed=9)], measured_at="2026-10-09T06:00:00Z")
        assert wild["status"] == "to_confirm"
        assert found()["slope_per_day"] == before["slope_per_day"]
        assert found()["last"] == pytest.approx(1.5, abs=0.01)
        assert "A run that waits to be confirmed does not count" in found()["text"]
        figure = shop.call("GET", f"/machines/{shop.machine}/kinematics/drift-figure?value=EX0C")
        assert "to be confirmed" in str(figure["data"][-1])
        shop.call("POST", f"{RUNS}/{wild['run']}/confirm", reason="The axis was hit")
        assert found()["slope_per_day"] > 10 * before["slope_per_day"]

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
        assert "enter" in figure["layout"]["annotations"][0]["text"]
        shop.call("POST", f"{RUNS}/{new['run']}/enter", reason="Monthly")
        figure = shop.call("GET", f"{RUNS}/{old['run']}/comparison-figure?with={new['run']}")
        (said, *_others) = (each["text"] for each in figure["layout"]["annotations"])
        assert said.startswith("moved +")  # what moved is seen also when there is nothing left to enter
        assert "enter" not in said
        other = Shop(shop.server)
        foreign = take(other, axes=[axis()])
        shop.call("GET", f"{RUNS}/{old['run']}/comparison?with={foreign['run']}", 422)

    def at_once(self, shop: Shop, count: int) -> list[Any]:
        """The readings, long before the round of the next minute; one that is at it just now may have them for a moment."""
        readings: list[Any] = []
        until = time.monotonic() + 4
        while len(readings) < count and time.monotonic() < until:
            readings = shop.call("GET", f"/readings?characteristic={shop.machine}-ex0c")["items"]
        return readings

    def test_values_become_readings_at_once(self, shop: Shop, operator: Person) -> None:
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
        (reading,) = self.at_once(shop, 1)
        assert reading["key"] == f"kinematics:{run['run']}:EX0C"
        assert reading["measured"] == pytest.approx(run["axes"][0]["errors"]["EX0C"]["value"], abs=1e-9)
        typed = {
            "machine": shop.machine,
            "as": "pasted",
            "pasted": 'QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345"',
        }
        operator.send("/kinematics/new", 200, **typed)
        assert self.at_once(shop, 2)[-1]["measured"] == pytest.approx(0.01234567, abs=1e-9)
        shop.call(
            "PUT", f"/machines/{shop.machine}/kinematics", 422, reason="x", characteristics={"EX0C": "no-such-thing"}
        )

    def test_diagrams(self, shop: Shop) -> None:
        run = take(shop, axes=[axis(both=True)])["run"]
        figure = shop.call("GET", f"{RUNS}/{run}/figure?axis=C&letter=Y")
        assert [trace["meta"] for trace in figure["data"]] == ["measured", "measured", "optimised", "optimised"]
        assert figure["layout"]["yaxis"]["title"]["text"] == "EYC, µm"
        shop.call("GET", f"{RUNS}/{run}/figure?axis=A&letter=Y", 422)


class TestHeads:
    """Fork 2 is matched to the reference head, ball and preset untouched, and only A is measured with it."""

    def test_one_head_against_the_reference_head(self, shop: Shop) -> None:
        plan(shop, reference_head="Fork 1", limits={"EX0C": 0.01})
        take(shop, axes=[axis((0.001, 0, 0, 0))], head="Fork 1")
        other = take(shop, axes=[axis((0.021, 0, 0, 0), seed=3)], head="Fork 2")
        one, two = shop.call("GET", f"/machines/{shop.machine}/kinematics")["heads"]
        assert (one["head"], one["reference"], one["changes"]) == ("Fork 1", True, [])
        assert (two["head"], two["reference"], two["run"], two["version"]) == ("Fork 2", False, other["run"], 0)
        x = next(each for each in two["changes"] if each["name"] == "EX0C")
        assert (x["difference"], x["moved"]) == (pytest.approx(0.02, abs=0.002), True)
        assert x["enter"] == pytest.approx(0.021, abs=0.001)
        shop.call("POST", f"{RUNS}/{other['run']}/enter", reason="Matched")
        take(shop, axes=[axis((0.0, 0, 0, 0), seed=4)], head="Fork 2")
        one, two = shop.call("GET", f"/machines/{shop.machine}/kinematics")["heads"]
        x = next(each for each in two["changes"] if each["name"] == "EX0C")
        assert abs(x["after"]) < 0.001, "what was entered belongs to the head"
        assert (one["version"], two["version"]) == (0, 2)

    def test_an_alarm_of_one_head_is_not_ended_by_another(self, shop: Shop) -> None:
        plan(shop, limits={"EX0C": 0.01})
        take(shop, axes=[axis((0.021, 0, 0, 0))], head="Fork 2")
        take(shop, axes=[axis((0.001, 0, 0, 0))], head="Fork 1")
        (alarm,) = shop.alarms()
        assert "head Fork 2" in alarm["text"]
        take(shop, axes=[axis((0.001, 0, 0, 0))], head="Fork 2")
        assert shop.alarms() == []

    def test_drift_of_the_head_that_is_asked_for(self, shop: Shop) -> None:
        take(shop, axes=[axis((0.021, 0, 0, 0))], head="Fork 2")
        path = f"/machines/{shop.machine}/kinematics"
        assert shop.call("GET", path)["drift"] == []
        found = {each["name"]: each["last"] for each in shop.call("GET", f"{path}?head=Fork 2")["drift"]}
        assert found["EX0C"] == pytest.approx(0.021, abs=0.001)

    def test_a_run_of_last_month_raises_no_alarm_of_today(self, shop: Shop) -> None:
        plan(shop, limits={"EX0C": 0.01})
        take(shop, axes=[axis((0.001, 0, 0, 0))], measured_at="2025-11-02T06:00:00Z")
        take(shop, axes=[axis((0.021, 0, 0, 0))], measured_at="2025-10-02T06:00:00Z")
        assert shop.alarms() == []
