"""The guard against corrections of opposite effect, held against simulated tool lives: never a false pause, a wrong sign stopped."""

from math import sqrt

import numpy as np
import pytest

from app.core.decision.step import BELIEVED, CORRECT, step
from app.core.opposite_effect import overdone
from tests.chance import runs
from tests.core.tool_lives import OPPOSED, lives, rules_of


@runs(1_000, 100_000)
def test_no_tool_whose_corrections_act_is_ever_paused(runs: int) -> None:
    assert [life for life in lives(runs, 7) if life.paused] == []


# Per cent that are stopped when two, and when three corrections of more than three standard deviations have acted (gain.md);
# by parts until a correction acts, and parts that were known before.
STOPPED = {
    (0, 0): (85, 96), (0, 10): (97, 99.5), (0, 30): (99.2, 99.8),
    (1, 0): (85, 96), (1, 10): (95, 98.7), (1, 30): (98, 99.8),
    (3, 0): (89, 96), (3, 10): (93, 97.7), (3, 30): (97.4, 99),
}  # fmt: skip


@pytest.mark.parametrize("gain", [-1.0, -2.0])
@pytest.mark.parametrize(("delay", "known"), STOPPED)
@runs(300, 10_000)
def test_a_wrong_sign_is_stopped_by_the_second_correction(runs: int, delay: int, known: int, gain: float) -> None:
    began = [life for life in lives(runs, 11, wrong=gain, known=known, delay=delay) if life.acted > 0]
    assert len(began) > 0.85 * runs
    for most, percent in zip((2, 3), STOPPED[delay, known], strict=True):
        chance = 4 * sqrt(percent * (100 - percent) / len(began))  # of few lives
        assert sum(life.paused == OPPOSED and life.acted <= most for life in began) >= (percent - chance) / 100 * len(
            began
        )


def test_no_right_gain_is_far_too_strong_though_edges_break() -> None:
    """Loops of true gains of 0.7 to 1.3 with scatter, wear, chips, and an edge that breaks once in fifty parts."""
    chance = np.random.default_rng(8)
    for life_ in range(100):
        gain, sigma, delay = chance.uniform(0.7, 1.3), 0.0005, int(chance.integers(0, 3))
        rules = rules_of(sigma * float(chance.choice([1, 2, 3])), sigma * 6, float(chance.choice([1, 2, 5])), -1.0)
        level, offset, total, average, waiting = 0.0, 0.0, 0.0, 0.0, [0.0] * delay
        deviation: list[float] = []
        compensated: list[float] = []
        for _part in range(60):
            level += 0.1 * sigma + (sigma * chance.uniform(20, 100) if chance.random() < 0.02 else 0.0)
            chip = 20 * sigma if chance.random() < 0.02 else 0.0
            size = float(level + gain * offset + chance.normal(0, sigma) + chip)
            deviation.append(size)
            compensated.append(offset)
            made = step(rules, average, total, size, sum(waiting), False, False, False, False, BELIEVED)
            average, amount = made.average, made.amount if made.action == CORRECT else 0.0
            total += amount
            waiting.append(amount)
            offset += waiting.pop(0)
            found = overdone(np.array(deviation), np.array(compensated), -1.0, sigma)
            assert found is None, (life_, found)
