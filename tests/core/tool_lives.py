"""Simulated tool lives in closed loop, by the rules of the decision, with the guards that pause a tool for the gain of its corrections."""

from math import exp, inf
from typing import NamedTuple

import numpy as np
from numba import njit

import app.core.decision.loops  # noqa: F401 - compiles what `step` calls
from app.core.decision.step import BELIEVED, CORRECT, Rules, effect_of, rounded, step
from app.core.opposite_effect import LONGEST, expected_scatter, judge
from app.core.overshoot import judge_strong

OPPOSED, STRONG = 1, 2
SETTINGS = np.dtype(
    [
        (name, np.float64)
        for name in ("sigma", "gain", "wear", "warm", "tau", "walk", "grid", "expected", "setting", "wrong", "half")
    ]
    + [(name, np.int64) for name in ("delay", "changed", "edited", "wrong_from", "parts", "seed")]
)


class Life(NamedTuple):
    """A tool life. paused: 0, OPPOSED or STRONG; acted: corrections that had acted with the wrong gain; parts cut, and out of tolerance."""

    paused: int
    acted: int
    parts: int
    out: int


@njit  # its random numbers are NumPy's old ones, seeded for each life
def life(rules, of, least):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201 - compiled
    """One tool life in closed loop; what is in `Life`. least: of corrections that count as acted, mm of size."""
    np.random.seed(of.seed)  # noqa: NPY002
    deviation, compensated = np.zeros(LONGEST), np.zeros(LONGEST)
    count, begin, average, offset, total, pending, walk, since = 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    effect, by_hand, out = 0.0, 0.0, 0
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
        out += abs(size) > of.half
        made = step(rules, average, total, size, effect_of(pending, rules.factor), False, False, False, False, BELIEVED)
        average = made.average
        if made.action != CORRECT:
            continue
        newest, sums, limit = deviation[:count], compensated[:count], rules.averaging / 1e6
        if judge(newest, sums, rules.factor, begin, of.expected, limit)[0]:
            return OPPOSED, acted, part + 1, out
        if judge_strong(newest, sums, rules.factor, begin, of.expected, limit, of.half)[0]:
            return STRONG, acted, part + 1, out
        total, pending = rounded(total + made.amount), rounded(pending + made.amount)
        at = (head + waiting) % 16
        due[at], due_part[at] = made.amount, part + of.delay + 1
        waiting = min(waiting + 1, 16)
    return 0, acted, of.parts, out


def rules_of(zero_range: float, averaging_limit: float, k: float, factor: float) -> Rules:
    zero, averaging = round(zero_range * 1e6), round(averaging_limit * 1e6)
    far = 10_000_000
    return Rules(zero, averaging, far, 100 * far, 200 * far, k, factor, inf, inf, True, False, False, False)


def lives(count: int, seed: int, *, wrong: float | None = None, known: int = 30, delay: int = 0) -> list[Life]:
    """Simulated lives, with corrections of three standard deviations and more counted as acted.

    R33 is 0 to 4 standard deviations, R34 at least 2, k 1 to 10, wear up to 0.3, warming up by up to 15, a thermal walk of up to 0.2 a
    part, a gain of 0.7 to 1.3, rounding to 0.1 µm and less, up to 3 parts until a correction is in effect; a tool change and an edit
    by hand; half the tolerance is R34 to twice that. wrong: the gain from part `known` on, where the process is out by up to 10; each
    correction acts after `delay` parts.
    """
    chance, tolerances = np.random.default_rng(seed), np.random.default_rng([seed, 1])
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
        of["half"] = limit * tolerances.choice([1, 1.3, 2])
        of["expected"], of["delay"] = expected_scatter(zero, limit), chance.choice([0, 0, 1, 3])
        of["parts"], of["seed"], of["wrong_from"] = 200, chance.integers(2**31), 10_000
        of["changed"], of["edited"] = chance.integers(20, 200, 2)
        if wrong is not None:
            of["gain"], of["wrong"], of["wrong_from"], of["delay"] = 1.0, wrong, known, delay
            of["setting"], of["warm"] = chance.uniform(-10, 10), 0
            of["changed"] = of["edited"] = 10_000
        rules = rules_of(zero, limit, chance.choice([1, 2, 3, 5, 10]), chance.choice([-1, 1, 0.5, -0.5, 2]))
        found.append(Life(*life(rules, of, 3 * of["sigma"])))
    return found
