"""The plan that holds for an alarm, and the Pareto of causes."""

import pytest

from app.core.reaction import Handled, Scope, Trouble, most_specific, pareto

SEAT = Trouble("d40", "signal", ["nelson_2", "nelson_1"])
PLANS = [
    (Scope(), "any"),
    (Scope(kind="signal"), "kind"),
    (Scope(None, "signal", "nelson_2"), "rule"),
    (Scope(None, "signal", "nelson_1"), "latest rule"),
    (Scope("d40"), "characteristic"),
    (Scope("d40", "signal"), "characteristic and kind"),
    (Scope("d40", "signal", "nelson_2"), "characteristic and rule"),
    (Scope("d35", "signal", "nelson_1"), "elsewhere"),
    (Scope("d40", "tool_worn"), "another kind"),
]
ORDER = [
    "characteristic and rule", "characteristic and kind", "characteristic", "latest rule", "rule", "kind", "any",
]  # fmt: skip


@pytest.mark.parametrize("better", range(len(ORDER)))
def test_the_most_specific_plan_holds(better: int) -> None:
    left = [(scope, name) for scope, name in PLANS if name not in ORDER[:better]]
    assert most_specific(left, SEAT) == ORDER[better]
    assert most_specific(left[::-1], SEAT) == ORDER[better], "in whatever order they were written"


def test_no_plan_holds_for_an_alarm_that_none_is_for() -> None:
    assert most_specific([], SEAT) is None
    assert most_specific([(Scope("d40", "tool_worn"), "worn")], SEAT) is None
    assert most_specific([(Scope("d40"), "seat")], Trouble(None, "silent")) is None


def test_a_run_rule_says_more_than_the_kind_of_its_alarms() -> None:
    assert most_specific([(Scope(kind="signal"), "kind"), (Scope(rule="nelson_1"), "rule")], SEAT) == "rule"


def test_causes_come_by_frequency_and_those_without_last() -> None:
    shares = pareto(
        [
            *(Handled(None, 10.0, None) for _alarm in range(5)),
            Handled(7, 30.0, 90.0),
            Handled(3, 60.0, None),
            Handled(3, 120.0, 300.0),
            Handled(3, 600.0, 700.0),
        ]
    )
    assert [(each.cause, each.alarms, round(each.sum, 4)) for each in shares] == [
        (3, 3, round(3 / 9, 4)),
        (7, 1, round(4 / 9, 4)),
        (None, 5, 1.0),
    ]
    assert (shares[0].acknowledged, shares[0].recovered, shares[0].recovering) == (120.0, 500.0, 2)
    assert (shares[2].acknowledged, shares[2].recovered, shares[2].recovering) == (10.0, None, 0)
    assert pareto([]) == []
