"""A tool whose own size corrects its offset: the sum of its corrections becomes factor x D, and stays there."""

import random
from dataclasses import replace

import numpy as np
import pytest

from app.core.decision.decide import LoopState, ReadingAlarm, decide
from app.core.decision.limits import Zone
from app.core.decision.step import Action, Code, effect_of, rounded
from app.core.parameters import Feature, Mode, Parameters
from app.core.replay import Policy, ReplayedCharacteristic, run, without_events

LENGTH = Parameters(
    target=120.0,
    tolerance_width=0.016,
    zero_range=0.001,
    averaging_limit=0.005,
    wear_limit=0.05,
    confidence_limit=1.0,
    weighting_factor=2,
    factor=1.0,
    tool_memory=5,
    average_memory=1,
    feature=Feature.TOOL,
)


def worn(chance: random.Random, parts: int) -> list[float]:
    """Lengths of a tool that wears by about 0.4 µm a part, with scatter and a chip now and then, mm."""
    level, sizes = 0.0, []
    for _ in range(parts):
        level -= chance.expovariate(1 / 0.0004) + (0.004 if chance.random() < 0.02 else 0.0)
        sizes.append(rounded(level + chance.gauss(0.0, 0.0004)))
    return sizes


def corrected(parameters: Parameters, sizes: list[float]) -> list[float]:
    """The correction that each size asks for, 0 for none: with all that were issued before, in effect or not."""
    total, average, amounts = 0.0, 0.0, []
    for size in sizes:
        made = decide(parameters, LoopState(average, total), size, outstanding=effect_of(total, parameters.factor))
        average = made.average_after
        amount = made.amount if made.action is Action.CORRECT else None
        amounts.append(amount or 0.0)
        total = rounded(total + (amount or 0.0))
        if made.zone is not Zone.WEAR:
            assert abs(size - total / parameters.factor) <= parameters.averaging_limit + 1e-9
    return amounts


@pytest.mark.parametrize("factor", [1.0, 2.0, -1.0, 0.5])
def test_the_sum_of_corrections_settles_at_the_deviation(factor: float) -> None:
    parameters = replace(LENGTH, factor=factor)
    for seed in range(40):
        assert any(corrected(parameters, worn(random.Random(seed), 60)))


@pytest.mark.parametrize("delay", [0, 1, 7])
def test_a_replay_decides_as_the_loop_does_whatever_the_delay(delay: int) -> None:
    """No size shows a correction, so when one takes effect makes no difference."""
    sizes = worn(random.Random(4), 80)
    result, _ = run(without_events(np.array(sizes)), Policy((ReplayedCharacteristic(LENGTH, -1.0),), delay))
    held = result.amount * (result.zone != list(Zone).index(Zone.WEAR))
    assert held.tolist() == corrected(LENGTH, sizes)
    assert result.deviation.tolist() == sizes


def test_worn_is_what_the_raw_deviation_says_and_good_what_is_corrected_for() -> None:
    corrected_for = decide(LENGTH, LoopState(), -0.03, outstanding=0.03)
    assert (corrected_for.zone, corrected_for.good, corrected_for.alarms) == (Zone.ZERO, True, ())
    out = decide(LENGTH, LoopState(), -0.03, outstanding=0.02)
    assert (out.good, out.alarms, out.amount) == (False, (ReadingAlarm.UNDERSIZE,), -0.01)
    spent = decide(LENGTH, LoopState(), -0.06, outstanding=0.04)
    assert (spent.zone, spent.action, spent.amount) == (Zone.WEAR, Action.HOLD, -0.02)
    known = decide(LENGTH, LoopState(), -0.06, outstanding=0.06)
    assert (known.zone, known.action, known.alarms) == (Zone.WEAR, Action.NONE, (ReadingAlarm.TOOL_WORN,))


def test_an_offset_that_somebody_has_set_is_not_corrected() -> None:
    for size in (-0.003, -0.007, -0.03, -0.06):
        made = decide(LENGTH, LoopState(), size, by_hand=True)
        assert (made.action, made.code) == (Action.NONE, Code.OFFSET_BY_HAND)


def test_a_jump_after_that_is_reported_and_says_nothing_to_the_average() -> None:
    made = decide(LENGTH, LoopState(0.002), -0.007, by_hand=True, jump=True)
    assert (made.action, made.code, made.average_after) == (Action.NONE, Code.IMPLAUSIBLE, 0.002)
    assert ReadingAlarm.IMPLAUSIBLE in made.alarms


def test_a_tool_that_is_only_measured_is_judged_by_its_size_alone() -> None:
    assert not replace(LENGTH, mode=Mode.MEASURE_ONLY).rules.of_tool
