"""Corrections that act earlier than they are counted, held against simulated tool lives: no false alarm, and a slow clock found."""

from math import exp

import numpy as np
import pytest
from numba import njit

import app.core.decision.loops  # noqa: F401 - compiles what `step` calls
from app.core.decision.step import BELIEVED, CORRECT, effect_of, rounded, step
from app.core.early import acts_early
from app.core.opposite_effect import LONGEST, expected_scatter
from tests.chance import runs
from tests.core.tool_lives import SETTINGS, rules_of

ROOM = 256  # corrections that may be on the way


@njit  # its random numbers are NumPy's old ones, seeded for each life
def life(rules, of, late, tolerance, watched):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201 - compiled
    """One tool life in closed loop: the part at which it was paused, or -1, and the parts out of tolerance up to then.

    late: a correction is counted so many parts after it acts. watched: it is judged. At part `wrong_from` the edge breaks: the
    size jumps by `wrong` standard deviations.
    """
    np.random.seed(of.seed)  # noqa: NPY002
    deviation, compensated, outstanding = np.zeros(LONGEST), np.zeros(LONGEST), np.zeros(LONGEST)
    count, begin, average, offset, pending, walk, since, out = 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0
    effect, by_hand, level = 0.0, 0.0, of.setting * of.sigma
    due, due_part, acting, counting, last = np.zeros(ROOM), np.zeros(ROOM, np.int64), 0, 0, 0
    for part in range(of.parts):
        if part == of.changed:
            level, since, effect, offset, by_hand = np.random.normal() * 5 * of.sigma, 0, 0.0, 0.0, 0.0  # noqa: NPY002
            pending, average, begin, acting, counting = 0.0, 0.0, count, last, last
        if part == of.edited:
            by_hand = np.random.normal() * 10 * of.sigma  # noqa: NPY002
            pending, average, begin, acting, counting = 0.0, 0.0, count, last, last
        if part == of.wrong_from:
            level += of.wrong * of.sigma
        while acting < last and due_part[acting % ROOM] <= part:
            effect, acting = effect + of.gain * effect_of(due[acting % ROOM], rules.factor), acting + 1
        while counting < last and due_part[counting % ROOM] + late <= part:
            offset, pending = rounded(offset + due[counting % ROOM]), rounded(pending - due[counting % ROOM])
            counting += 1
        walk += np.random.normal() * of.walk * of.sigma  # noqa: NPY002
        drift = of.wear * of.sigma * since + of.warm * of.sigma * (1 - exp(-part / of.tau))
        since += 1
        size = level + walk + drift + by_hand + effect + np.random.normal() * of.sigma  # noqa: NPY002
        size = rounded(np.rint(size / of.grid) * of.grid)
        out += abs(size) > tolerance
        if count == LONGEST:
            deviation[:-1], compensated[:-1] = deviation[1:].copy(), compensated[1:].copy()
            outstanding[:-1] = outstanding[1:].copy()
            count, begin = count - 1, max(0, begin - 1)
        deviation[count], compensated[count], outstanding[count] = size, offset, effect_of(pending, rules.factor)
        count += 1
        made = step(rules, average, 0.0, size, outstanding[count - 1], False, False, False, False, BELIEVED)
        average = made.average
        if made.action != CORRECT:
            continue
        seen = deviation[:count], compensated[:count], outstanding[:count]
        if watched and acts_early(*seen, rules.factor, begin, of.expected)[0] >= 0:
            return part, out
        pending = rounded(pending + made.amount)
        due[last % ROOM], due_part[last % ROOM] = made.amount, part + of.delay + 1
        last += 1
    return -1, out


@pytest.mark.parametrize("broken", [False, True])
@runs(1_000, 40_000)
def test_no_loop_whose_parts_are_counted_right_is_taken_for_one(runs: int, *, broken: bool) -> None:
    """As in `test_opposite_effect`, with wear of up to 1.5 standard deviations a part, and up to five parts on the way.

    broken: the edge breaks, as it may in the part that is cut with a correction first; of 40,000 such lives 5 are paused.
    """
    chance, paused = np.random.default_rng(7), []
    for _life in range(runs):
        of = np.zeros(1, SETTINGS)[0]
        of["sigma"] = 10 ** chance.uniform(-4, -2.5)
        zero = of["sigma"] * chance.choice([0, 0.5, 1, 2, 3, 4])
        limit = max(zero * 1.2, of["sigma"] * chance.choice([2, 3, 5, 10]))
        of["gain"], of["setting"] = chance.uniform(0.7, 1.3), chance.normal() * 4
        of["wear"] = chance.choice([0, 0.02, 0.1, 0.3, 1.5]) * chance.choice([-1, 1])
        of["warm"], of["tau"] = chance.uniform(-15, 15) * (chance.random() < 0.6), chance.uniform(10, 60)
        of["walk"], of["grid"] = chance.choice([0, 0.05, 0.2]), chance.choice([1e-6, 1e-4])
        of["expected"], of["delay"] = expected_scatter(zero, limit), chance.choice([1, 2, 3, 5])
        of["parts"], of["seed"] = 200, chance.integers(2**31)
        of["changed"], of["edited"] = chance.integers(20, 200, 2)
        if broken:
            of["wrong_from"], of["wrong"] = chance.integers(8, 200), chance.choice([-1, 1]) * 10 ** chance.uniform(1, 3)
        rules = rules_of(zero, limit, chance.choice([1, 2, 3, 5, 10]), chance.choice([-1, 1, 0.5, -0.5, 2]))
        if life(rules, of, 0, 1.0, True)[0] >= 0:
            paused.append(of)
    assert len(paused) <= (runs // 5_000 if broken else 0), paused


@pytest.mark.parametrize("delay", [0, 1])
@pytest.mark.parametrize("late", [1, 2, 5, 20, 100])
def test_a_clock_that_is_behind_is_found_before_parts_are_out(late: int, delay: int) -> None:
    """Tolerance ±8 µm, wear 0.5 µm a part, scatter 0.3 µm, R33 1 µm, R34 5 µm, k 1: 60 parts, twenty loops."""
    of = np.zeros(1, SETTINGS)[0]
    of["sigma"], of["gain"], of["wear"], of["grid"], of["tau"] = 0.0003, 1.0, 0.5 / 0.3, 1e-7, 1.0
    of["expected"], of["delay"], of["parts"] = expected_scatter(0.001, 0.005), delay, 60
    of["changed"] = of["edited"] = 1_000
    stopped, out, unwatched = [], [], []
    for seed in range(20):
        of["seed"] = seed
        rules = rules_of(0.001, 0.005, 1.0, -1.0)
        paused, until = life(rules, of, late, 0.008, True)
        stopped.append(paused)
        out.append(until)
        unwatched.append(life(rules, of, late, 0.008, False)[1])
    assert sum(part >= 0 for part in stopped) >= 19
    assert np.mean(unwatched) > 15
    assert np.mean(out) < np.mean(unwatched) / 3
