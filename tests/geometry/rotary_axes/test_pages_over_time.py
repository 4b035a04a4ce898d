"""The pages that set runs beside each other: last month and today, heads, drift with limits and alarm."""

import re

import pytest

from tests.geometry.rotary_axes.bench import TRUE, axis, protocol
from tests.geometry.rotary_axes.walking import LAST_MONTH, QS, in_list, last_month, machine, take, words
from tests.shop import Person, Shop


class TestComparing:
    def test_a_protocol_of_last_month_and_of_today(self, shop: Shop, operator: Person) -> None:
        """Pages name the axis that moved, with what to enter and its sign."""
        today = protocol("de")
        then = take(shop, protocol=last_month())
        now = take(shop, protocol=today)
        for first, second in ((then, now), (now, then)):  # whichever is chosen first
            shown = words(operator.open(f"/kinematics/compare?run={first}&with={second}"))
            assert "1 value has moved EX0C C is offset in X: +8.2 µm – enter +0.0123 mm" in shown
            assert "EY0C −0.0081 mm" in shown
        assert f"with={then}" in operator.open(f"/kinematics/runs/{now}")  # one is led there
        figure = shop.call("GET", f"/kinematics/runs/{then}/comparison-figure?with={now}")
        assert "moved +8.2 µm" in " ".join(
            note["text"].replace("\N{NO-BREAK SPACE}", " ") for note in figure["layout"]["annotations"]
        )

    def test_what_the_control_took_over_by_itself_is_no_movement(self, shop: Shop, operator: Person) -> None:
        """Today's protocol begins where that of last month ended, though nobody has said that it was entered."""
        today = protocol("de")
        then = take(shop, protocol=last_month())
        moved = today.replace("X 250,0123 Y -0,0081", "X 250,0164 Y -0,0156").replace(
            "X 250,0000 Y 0,0000", "X 250,0041 Y -0,0075"
        )
        now = take(shop, protocol=moved)
        shown = words(operator.open(f"/kinematics/compare?run={then}&with={now}"))
        assert "treated as entered on the control in between (EX0C, EY0C, EA0C, EB0C)" in shown
        assert "EX0C C is offset in X +4.1 µm +16.4 µm +12.3 µm" in shown

    def test_what_was_entered_in_between_is_no_movement(self, shop: Shop, operator: Person) -> None:
        then = take(shop, results={"QS146": LAST_MONTH})
        operator.send(f"/kinematics/runs/{then}/enter", reason="Monthly check")
        now = take(shop, results={"QS146": "0.00020000 -0.0001000 0.00000000 0.00000000"})
        shown = words(operator.open(f"/kinematics/compare?run={now}"))
        assert "EX0C C is offset in X +4.1 µm +4.3 µm +0.2 µm" in shown
        assert "The scatter is unknown" in shown

    def test_heads_against_the_reference_head(self, shop: Shop, operator: Person, engineer: Person) -> None:
        engineer.send(machine(shop), reference_head="Kopf 1", reason="Matched heads")
        one = take(shop, axes=[axis()], head="Kopf 1")
        two = take(shop, axes=[axis((0.0223, *TRUE[1:]), seed=5)], head="Šarža 2")
        shown = words(operator.open(machine(shop)))
        assert re.search(r"Šarža 2 Run \d+ .*? EX0C \+(9|10)\.\d µm", shown)
        compared = words(operator.open(f"/kinematics/compare?run={one}&with={two}"))
        assert "Comparison of heads" in compared
        assert "value differs EX0C" in compared or "values differ EX0C" in compared

    def test_one_run_alone_is_compared_with_nothing(self, shop: Shop, operator: Person) -> None:
        run = take(shop, results={"QS146": QS})
        assert "These are one run" in operator.open(f"/kinematics/compare?run={run}")


class TestDrift:
    def test_limits_alarm_and_trend(self, shop: Shop, operator: Person, engineer: Person) -> None:
        text = engineer.send(machine(shop), limits="EX0C ±0,01\nbacklash.C = 0.003", reason="As accepted")
        assert "The limits are saved" in text
        for day in range(5):
            take(
                shop,
                results={"QS146": f"{0.002 + 0.001 * day + 0.00001 * (day % 2):.8f} 0.00000000 0.00000000 0.00000000"},
                measured_at=f"2026-11-{day + 1:02}T06:00:00Z",
            )
        shown = words(operator.open(machine(shop)))
        assert "it drifts" in shown
        assert re.search(r"limit in about \d+ days", shown)
        assert shop.alarms() == []
        take(shop, results={"QS146": "0.01234567 0.00000000 0.00000000 0.00000000"}, measured_at="2026-11-08T06:00:00Z")
        [alarm] = shop.alarms()
        assert alarm["kind"] == "kinematics_drift"
        shown = words(operator.open(machine(shop)))
        assert "EX0C C is offset in X: +12.3 µm , limit ±10 µm" in shown
        assert "beyond its limit" in in_list(operator, shop)

    @pytest.mark.parametrize(
        ("fields", "said"),
        [
            ({"limits": "EX0C"}, "a name and a value are needed"),
            ({"limits": "EX9Q 0.01"}, "there is no value"),
            ({"limits": "EX0C -1"}, "0"),
            ({"characteristics": "EX0C nowhere"}, "nowhere"),
            ({"ball_radius": "x"}, "number"),
        ],
    )
    def test_wrong_limits_are_said_and_still_there(
        self, shop: Shop, engineer: Person, fields: dict[str, str], said: str
    ) -> None:
        text = engineer.send(machine(shop), 422, reason="why not", **fields)
        assert said in text
        assert next(iter(fields.values())) in text
        assert "why not" in text
        assert shop.call("GET", f"/machines/{shop.machine}/kinematics")["limits"] == {}

    def test_operators_do_not_set_limits(self, shop: Shop, operator: Person) -> None:
        operator.send(machine(shop), 403, limits="EX0C 1", reason="x")
