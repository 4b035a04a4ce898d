"""Published numbers, each with its source in cases/published.json."""

import json
from pathlib import Path
from typing import Any

import pytest

from app.core.compensation import Action, State, average_of, decide
from app.core.parameters import mean_nominal, read

CASES: dict[str, list[dict[str, Any]]] = json.loads((Path(__file__).parent / "cases/published.json").read_text("utf-8"))


def named(kind: str) -> list[Any]:
    return [pytest.param(case, id=case["name"]) for case in CASES[kind]]


@pytest.mark.parametrize("case", named("decisions"))
def test_the_decisions_are_those_that_were_published(case: dict[str, Any]) -> None:
    parameters, _warnings = read(case["parameters"])
    average = 0.0
    for deviation, expected, corrected in zip(
        case["deviations_um"], case["averages_um"], case["corrected"], strict=True
    ):
        decision = decide(parameters, State(average), deviation / 1000)
        assert (decision.action is Action.CORRECT) == corrected
        reached = decision.size_error if decision.size_error is not None else decision.average_after
        assert reached == pytest.approx(expected / 1000, abs=case["tolerance"])
        if corrected:
            assert decision.amount == pytest.approx(-expected / 1000, abs=case["tolerance"])
            assert decision.average_after == 0.0
        average = decision.average_after


@pytest.mark.parametrize("case", named("mean_nominal"))
def test_l75_gives_the_mean_of_the_tolerance(case: dict[str, Any]) -> None:
    assert mean_nominal(case["nominal"], case["upper_deviation"], case["lower_deviation"]) == pytest.approx(
        (case["target"], case["tolerance_width"]), abs=1e-9
    )


@pytest.mark.parametrize("case", named("ewma"))
def test_the_running_average_is_an_ewma_with_lambda_one_over_k(case: dict[str, Any]) -> None:
    average = case["start"]
    for value, expected in zip(case["values"], case["averages"], strict=True):
        average = average_of(average, value, case["weighting_factor"])
        assert average == pytest.approx(expected, abs=case["tolerance"])
