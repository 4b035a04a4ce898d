"""The guard against corrections of opposite effect, held against simulated tool lives: never a false pause, a wrong sign stopped."""

from math import exp, inf, sqrt

import numpy as np
import pytest
from numba import njit

import app.core.decision.loops  # noqa: F401 - compiles what `step` calls
from app.core.decision.step import BELIEVED, CORRECT, Rules, effect_of, rounded, step
from app.core.gain import LONGEST, expected_scatter, judge, overdone
from tests.chance import runs

SETTINGS = np.dtype(
    [
        (name, np.float64)
        for name in ("sigma", "gain", "wear", "warm", "tau", "walk", "grid", "expected", "setting", "wrong")
    ]
    + [(name, np.int64) for name in ("delay", "changed", "edited", "wrong_from", "parts", "seed")]
)


@njit  # its random numbers are NumPy's old ones, seeded for each life
def life(rules, of, least):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201 - compiled
    """One tool life in closed loop: if it was paused; how many corrections of `least` mm of size had acted with the wrong gain."""
    np.random.seed(of.seed)  # noqa: NPY002
    deviation, compensated = np.zeros(LONGEST), np.zeros(LONGEST)
    count, begin, average, offset, total, pending, walk, since = 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    effect, by_hand = 0.0, 0.0
    due, due_part, head, waiting = np.zeros(16), np.zeros(16, np.int64), 0, 0
    level, gain, acted = (0.0 if of.wrong_from == 0 else of.setting * of.sigma), of.gain, 0
    for part in range(of.parts):
        if part == of.changed:
            level, since, effect, offset, by_hand = np.random.normal() * 5 * of.sigma, 0, 0.0, 0.0, 0.0  # noqa: NPY002
            total, pending, waiting, average, begin = 0.0, 0.0, 0, 0.0, count
        if part == of.edited:
            by_hand = np.random.normal() * 10 * of.sigma  # noqa: NPY002
            total, pending, waiting, average, begin = offset, 0.0, 0, 0.0, count
        if part == of.wrong_from:
            gain, level = of.wrong, level + of.setting * of.sigma
        while waiting > 0 and due_part[head] <= part:
            offset = rounded(offset + due[head])
            effect += gain * effect_of(due[head], rules.factor)
            pending = rounded(pending - due[head])
            acted += due_part[head] > of.wrong_from + of.delay and abs(effect_of(due[head], rules.factor)) >= least
            head, waiting = (head + 1) % 16, waiting - 1
        walk += np.random.normal() * of.walk * of.sigma  # noqa: NPY002
        drift = of.wear * of.sigma * since + of.warm * of.sigma * (1 - exp(-part / of.tau))
        since += 1
        size = level + walk + drift + by_hand + effect + np.random.normal() * of.sigma  # noqa: NPY002
        size = rounded(np.rint(size / of.grid) * of.grid)
        if count == LONGEST:
            deviation[:-1], compensated[:-1] = deviation[1:].copy(), compensated[1:].copy()
            count, begin = count - 1, max(0, begin - 1)
        deviation[count], compensated[count] = size, offset
        count += 1
        made = step(rules, average, total, size, effect_of(pending, rules.factor), False, False, False, False, BELIEVED)
        average = made.average
        if made.action != CORRECT:
            continue
        if judge(deviation[:count], compensated[:count], rules.factor, begin, of.expected, rules.averaging / 1e6)[0]:
            return True, acted
        total, pending = rounded(total + made.amount), rounded(pending + made.amount)
        at = (head + waiting) % 16
        due[at], due_part[at] = made.amount, part + of.delay + 1
        waiting = min(waiting + 1, 16)
    return False, acted


def rules_of(zero_range: float, averaging_limit: float, k: float, factor: float) -> Rules:
    zero, averaging = round(zero_range * 1e6), round(averaging_limit * 1e6)
    far = 10_000_000
    return Rules(zero, averaging, far, 100 * far, 200 * far, k, factor, inf, inf, True, False, False, False)


def lives(
    count: int, seed: int, *, wrong: float | None = None, known: int = 30, delay: int = 0
) -> list[tuple[bool, int]]:
    """Simulated lives; what `life` returns for each, with corrections of three standard deviations and more.

    R33 is 0 to 4 standard deviations, R34 at least 2, k 1 to 10, wear up to 0.3, warming up by up to 15, a thermal walk of up to 0.2 a
    part, a gain of 0.7 to 1.3, rounding to 0.1 µm and less, up to 3 parts until a correction is in effect; a tool change and an edit
    by hand. wrong: the gain from part `known` on, where the process is out by up to 10; each correction acts after `delay` parts.
    """
    chance = np.random.default_rng(seed)
    found = []
    for _life in range(count):
        of = np.zeros(1, SETTINGS)[0]
        of["sigma"] = 10 ** chance.uniform(-4, -2.5)
        zero = of["sigma"] * (chance.choice([0, 0.5, 1, 2, 3, 4]) if wrong is None else chance.choice([1, 2, 3, 4]))
        limit = max(zero * 1.2, of["sigma"] * chance.choice([2, 3, 5, 10]))
        of["gain"], of["setting"] = chance.uniform(0.7, 1.3), chance.normal() * 4
        of["wear"] = chance.choice([0, 0.02, 0.1, 0.3]) * chance.choice([-1, 1])
        of["warm"], of["tau"] = chance.uniform(-15, 15) * (chance.random() < 0.6), chance.uniform(10, 60)
        of["walk"], of["grid"] = chance.choice([0, 0.05, 0.2]), chance.choice([1e-6, 1e-4])
        of["expected"], of["delay"] = expected_scatter(zero, limit), chance.choice([0, 0, 1, 3])
        of["parts"], of["seed"], of["wrong_from"] = 200, chance.integers(2**31), 10_000
        of["changed"], of["edited"] = chance.integers(20, 200, 2)
        if wrong is not None:
            of["gain"], of["wrong"], of["wrong_from"], of["delay"] = 1.0, wrong, known, delay
            of["setting"], of["warm"] = chance.uniform(-10, 10), 0
            of["changed"] = of["edited"] = 10_000
        rules = rules_of(zero, limit, chance.choice([1, 2, 3, 5, 10]), chance.choice([-1, 1, 0.5, -0.5, 2]))
        found.append(life(rules, of, 3 * of["sigma"]))
    return found


@runs(1_000, 100_000)
def test_no_tool_whose_corrections_act_is_ever_paused(runs: int) -> None:
    assert sum(paused for paused, _acted in lives(runs, 7)) == 0


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
    began = [(paused, acted) for paused, acted in lives(runs, 11, wrong=gain, known=known, delay=delay) if acted > 0]
    assert len(began) > 0.85 * runs
    for most, percent in zip((2, 3), STOPPED[delay, known], strict=True):
        chance = 4 * sqrt(percent * (100 - percent) / len(began))  # of few lives
        assert sum(paused and acted <= most for paused, acted in began) >= (percent - chance) / 100 * len(began)


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
