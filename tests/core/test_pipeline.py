"""The value of knowing the corrections that a part was cut with: the same shift with and without it.

A tool wears, and once chips; between the cut and the probe lie some parts. *Naive*: every reading is taken as if all
corrections were in effect, as a loop does that knows nothing of its pipeline. The same seed makes the same scatter.
The numbers stand in docs/decisions/0025.
"""

from collections import deque

import numpy as np
import pytest

from app.core.decision.decide import LoopState, decide, outstanding_effect
from app.core.parameters import Parameters, WearPolicy

PARAMETERS = Parameters(
    target=0.0,
    tolerance_width=0.016,
    zero_range=0.0025,
    averaging_limit=0.0053,
    wear_limit=0.3,
    confidence_limit=1.0,
    weighting_factor=2,
    factor=-1,
    tool_memory=1,
    wear_policy=WearPolicy.RELEASE,  # a loop that runs away is not stopped by a person here
    average_memory=1,
)
PARTS, WEAR, SCATTER, SETTING, CHIP = 500, 0.00006, 0.001, 0.007, 0.010  # mm; the chip after half of the parts


def shift(
    delay: int, seed: int, *, aware: bool, setting: float = SETTING, chip: float = CHIP
) -> tuple[int, int, float]:
    """Parts out of tolerance, corrections issued, and the standard deviation of the sizes (mm) of one shift."""
    rng = np.random.default_rng(seed)
    state, offset, issued = LoopState(), 0.0, 0
    pipeline: deque[tuple[float, int]] = deque()  # a deviation, and the corrections it was cut with
    amounts: list[float] = []
    deviations = []
    for part in range(PARTS):
        truth = setting + WEAR * part + (chip if part >= PARTS // 2 else 0.0) + float(rng.normal(0.0, SCATTER))
        deviations.append(truth + offset)
        pipeline.append((round(truth + offset, 9), len(amounts)))
        if len(pipeline) <= delay:
            continue
        deviation, had = pipeline.popleft()
        to_come = outstanding_effect(amounts[had:], PARAMETERS.factor) if aware else 0.0
        decision = decide(PARAMETERS, state, deviation, outstanding=to_come)
        state = LoopState(decision.average_after)
        if decision.amount is not None:
            amounts.append(decision.amount)
            offset += decision.amount
            issued += 1
    scrap = sum(abs(deviation) > PARAMETERS.tolerance_width / 2 for deviation in deviations)
    return scrap, issued, float(np.std(deviations))


def mean_of(delay: int, *, aware: bool, **what: float) -> tuple[float, float, float]:
    scrap, issued, scatter = np.mean([shift(delay, seed, aware=aware, **what) for seed in range(40)], axis=0)
    return float(scrap), float(issued), float(scatter)


def test_without_a_pipeline_there_is_no_difference() -> None:
    assert all(shift(0, seed, aware=True) == shift(0, seed, aware=False) for seed in range(10))


# delay: scrap of 500 parts, mean of 40 shifts, (knowing the pipeline, naive): wear alone; with a setting error and a chip.
NUMBERS = {
    1: ((0.0, 0.0), (2.3, 165.2)),
    2: ((0.0, 2.7), (3.5, 453.8)),
    4: ((0.0, 202.4), (6.0, 492.8)),
    8: ((0.0, 397.5), (11.2, 490.3)),
}


@pytest.mark.parametrize("delay", NUMBERS)
def test_scrap_with_and_without_knowing_the_pipeline(delay: int) -> None:
    for numbers, what in zip(NUMBERS[delay], ({"setting": 0.0, "chip": 0.0}, {}), strict=True):
        aware, naive = mean_of(delay, aware=True, **what), mean_of(delay, aware=False, **what)
        assert (aware[0], naive[0]) == pytest.approx(numbers, abs=0.06)
        assert aware[0] <= 2 * delay + 3, "parts cut before anybody could know are all that is lost"
        assert aware[1] < naive[1], "nothing is corrected twice"
        assert aware[2] < naive[2]
