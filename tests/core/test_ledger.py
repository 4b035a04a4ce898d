"""The ledger: what it claims, and that it never claims a saving on pure noise."""

from dataclasses import replace

import numpy as np
import pytest

from app.core.ledger import Tally, Worth, tally, together
from app.core.parameters import Mode, Parameters, read
from app.core.replay import Policy, ReplayedCharacteristic, run, without_events
from tests.shop import PARAMETERS

SHAFT: Parameters = read(PARAMETERS)[0]


def both_ways(free: "np.ndarray[tuple[int], np.dtype[np.float64]]", parameters: Parameters) -> Tally:
    """A course as a loop has corrected it, against the course itself."""
    trace = without_events(free)
    lane = ReplayedCharacteristic(parameters, -1 / parameters.factor)
    only = lane._replace(parameters=replace(parameters, mode=Mode.MEASURE_ONLY))
    measured, figures = run(trace, Policy((only,)))
    corrected, _of_loop = run(trace, Policy((lane,), delay=1))
    without, truly = (np.abs(np.round(each.deviation, 6)) > 0.008 for each in (measured, corrected))
    found = tally(without, truly, np.zeros(len(free), np.bool_))
    assert found.without == figures.rejects
    return found


@pytest.mark.parametrize("sigma", [0.003, 0.006])
def test_nothing_is_saved_on_pure_noise(sigma: float) -> None:
    """A loop that corrects every part of a process that only scatters: never a saving, and a cost where there are rejects."""
    nervous = replace(SHAFT, zero_range=0.0, averaging_limit=0.0001, weighting_factor=1.0)
    verdicts = []
    for seed in range(20):
        free = np.random.default_rng(seed).normal(0, sigma, 1 + 50 * (seed + 1))
        verdicts += [both_ways(free, parameters).worth for parameters in (SHAFT, nervous)]
    assert Worth.SAVED not in verdicts
    if sigma >= 0.004:
        assert Worth.COST in verdicts


def test_wear_that_is_corrected_is_a_saving() -> None:
    free = np.random.default_rng(1).normal(0, 0.001, 1000) + np.tile(np.arange(200) * 0.0002, 5)
    found = both_ways(free, SHAFT)
    assert found.worth is Worth.SAVED
    assert found.net > 500
    assert found.low is not None
    assert found.low < found.net


def test_what_was_spoiled_and_what_was_late_is_counted_apart() -> None:
    none = np.zeros(100, np.bool_)
    first = np.arange(100) < 10
    found = tally(none, first, first & (np.arange(100) < 3))
    assert (found.saved, found.spoiled, found.late, found.net) == (0, 10, 3, -10)


def test_together_without_an_interval_of_each_claims_nothing() -> None:
    assert together([Tally(60, 9, 0, 9, 0, 0, 1.0, 2.0), Tally(20, 2, 0, 2, 0, 0)]).worth is Worth.NEITHER
    assert together([]).net == 0
