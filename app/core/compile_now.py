"""Compiles every loop of statistics and replays before the first page needs one; the compiler takes some fifteen seconds once."""

from collections.abc import Iterator

import numpy as np

from app.core.measured_gain import measured_effect
from app.core.parameters import Parameters
from app.core.replay import Policy, ReplayedCharacteristic, figures_of, run, without_events
from app.core.spc.cusum import cusum
from app.core.spc.ewma import ewma
from app.core.spc.mixture import fitted_two_normals
from app.core.spc.refusal import Floats
from app.core.spc.rules import NELSON, signals
from app.core.spc.shewhart import given


def compile_each() -> Iterator[None]:
    """Run each compiled loop of the core once on a few numbers, with the types that pages and jobs call it with; one a step.

    The loops of the writer are compiled by `app.loop.readings.writer.columnar.compile_now`.
    """
    saw: Floats = (np.arange(100) % 10 * 0.002).astype(np.float64)
    steps: Floats = (np.arange(100) // 9 * 0.002).astype(np.float64)
    parameters = Parameters(
        target=40.0,
        tolerance_width=0.016,
        zero_range=0.001,
        averaging_limit=0.005,
        wear_limit=0.3,
        confidence_limit=1.0,
    )
    policy = Policy((ReplayedCharacteristic(parameters, 1.0),))
    baseline = given(0.0, 1.0)
    for rule in NELSON:
        signals(saw, [rule]).sides(0)
        yield
    ewma(baseline, saw)
    yield
    cusum(baseline, saw)
    yield
    run(without_events(saw), policy)
    yield
    figures_of(without_events(saw), [policy])
    yield
    fitted_two_normals(saw[None])
    yield
    measured_effect(saw, steps, -1.0, saw < 0)
