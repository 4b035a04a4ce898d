from dataclasses import replace

import pytest

from app.core.decision.decide import LoopState, decide
from app.core.decision.step import deviation_of
from app.core.parameters import read
from app.simulators.demo import plant
from app.simulators.demo.simulation import Machine, Probe


def story(seed: int, parts: int = 300) -> list[tuple[str, float, float, list[list[float]] | None]]:
    told = []
    for spec in plant.MACHINES:
        machine = Machine(spec, seed)
        for count in range(parts):
            if count == 100:
                machine.begin_live()
            machine.cut()
            told += [(p.feature.key, p.measured_at, p.size, p.touches) for p in machine.measure()]
            machine.rest()
    return told


def test_the_same_seed_tells_the_same_story() -> None:
    assert story(1) == story(1)


def test_another_seed_tells_another_story() -> None:
    assert story(1) != story(2)


def test_parts_are_measured_in_the_order_they_were_cut_one_to_four_parts_later() -> None:
    for spec in plant.MACHINES:
        machine = Machine(spec, 1)
        serials: list[int] = []
        for _count in range(200):
            machine.cut()
            for probe in machine.measure():
                assert 1 <= machine.serial - probe.part.serial <= 4
                assert probe.measured_at > probe.part.cut_at
                serials.append(probe.part.serial)
        assert serials == sorted(serials)
        assert set(serials) == set(range(1, max(serials) + 1)), "no part is lost"


def test_every_set_of_parameters_is_taken_by_the_core_without_a_warning() -> None:
    for spec in plant.MACHINES:
        for feature in spec.features:
            parameters, warnings = read(feature.parameters)
            assert warnings == [], f"{feature.key}: {warnings}"
            assert parameters.target == pytest.approx(feature.target)


def test_the_first_chip_reaches_the_wear_zone_and_does_not_look_like_a_probe_fault() -> None:
    for spec in plant.MACHINES:
        early, tool = spec.first_chip
        machine = Machine(spec, 1)
        machine.begin_live()
        seen: list[Probe] = []
        for _count in range(early + 5):
            machine.cut()
            seen += machine.measure()
        of_tool = [p for p in seen if p.feature.tool == tool]
        before = [abs(p.size - p.feature.target) for p in of_tool if p.part.serial < early]
        after = [abs(p.size - p.feature.target) for p in of_tool if p.part.serial > early]
        assert max(before) < 0.3
        assert after
        assert all(0.3 <= deviation < 1.0 for deviation in after)


CASES = {
    "lathe, X in diameter, outside": (plant.LATHE_OUTSIDE, -1.0),
    "lathe, X in diameter, inside": (plant.LATHE_INSIDE, -1.0),
    "lathe, X as radius, outside": (plant.LATHE_OUTSIDE_RADIUS, -0.5),
    "lathe, X as radius, inside": (plant.LATHE_INSIDE_RADIUS, -0.5),
    "length, face": (plant.LENGTH, -1.0),
    "milling radius, outside": (plant.MILLING_OUTSIDE, -0.5),
    "milling radius, inside": (plant.MILLING_INSIDE, 0.5),
}


def final_deviation(effect: plant.Effect, factor: float, parts: int = 25) -> float:
    """The mean size of the deviation after so many parts, corrected by the core part after part without delay."""
    feature = plant.Feature("f", "f", 1, effect, 50.0, 0.02, -0.02, factor=factor)
    spec = plant.Machine(
        "m", "m", "other", "p", 60.0, (0, 0), (plant.Tool(1, "t", 0.0001, 0.004, 9999),), (feature,), (9999, 1)
    )
    machine = Machine(spec, 1)
    machine.edges[1].bias = 0.015
    parameters = replace(read(feature.parameters)[0], confidence_limit=1e6, wear_limit=1e5)
    state, deviations = LoopState(), []
    for number in range(parts):
        machine.cut()
        (probe,) = machine.measure()
        deviation = deviation_of(probe.size, parameters.target)
        decision = decide(parameters, state, deviation)
        state = LoopState(decision.average_after)
        if decision.amount is not None:
            machine.edges[1].correct(number + 1, decision.amount)
        deviations.append(abs(deviation))
    return sum(deviations[-10:]) / 10


@pytest.mark.parametrize(("effect", "factor"), CASES.values(), ids=CASES.keys())
def test_with_the_factor_of_the_table_the_size_stays_with_the_wrong_sign_it_runs_away(
    effect: plant.Effect, factor: float
) -> None:
    assert final_deviation(effect, factor) < 0.003
    assert final_deviation(effect, -factor) > 1.0


def test_each_feature_of_the_plant_has_a_factor_that_removes_its_own_error() -> None:
    for spec in plant.MACHINES:
        for feature in spec.features:
            assert feature.factor * feature.effect.gain == -1.0
