"""The compiled run of quiet readings against `decide`, bit for bit."""

from dataclasses import replace

import hypothesis.strategies as st
import numpy as np
from hypothesis import given

from app.core.decision.decide import LoopState, decide
from app.core.decision.limits import ZONES
from app.core.decision.loops import FARTHEST, Quiet, Series, quiet_run, rows_of
from app.core.decision.step import CODES, Action, deviation_of
from app.core.parameters import Mode
from tests.chance import examples
from tests.core.conftest import SEAT

SERIES = [
    Series(SEAT, 0.0, 0.0, 0, 0),
    Series(replace(SEAT, weighting_factor=3.3), 0.0007, -0.0031, 1, 0),  # shares the memory of the first
    Series(replace(SEAT, average_memory=0), 0.0, 0.0, 2, 1),
    Series(replace(SEAT, mode=Mode.MEASURE_ONLY, weighting_factor=1), 0.0, 0.0012345, 0, 2),
    Series(replace(SEAT, zero_range=0.0, weighting_factor=1), 0.0, 0.0, 3, 3),
]

SIZES = st.one_of(
    st.floats(-0.009, 0.009),
    st.sampled_from([0.0, 0.001, -0.001, 0.0053, 0.0053004, 0.008, 0.00800049, 0.3, 1.0, -1.0, 2e7]),
    st.integers(-9000, 9000).map(lambda n: n / 1e6),
    st.integers(-9_000_000, 9_000_000).map(lambda n: (n + 0.5) / 1e9),  # between two picometres
)


@given(
    st.lists(st.tuples(SIZES, st.integers(-1, len(SERIES) - 1)), max_size=60),
    st.lists(st.floats(-0.001, 0.001), min_size=4, max_size=4),
)
@examples(400)
def test_what_it_decides_is_what_decide_decides(readings: list[tuple[float, int]], begun: list[float]) -> None:
    measured = np.array([SEAT.target + size for size, _lane in readings])
    lane = np.array([lane for _size, lane in readings], dtype=np.int64)
    sequences, averages, out = np.arange(10, 14), np.array(begun), Quiet.room(len(readings))
    end = quiet_run(0, measured, lane, rows_of(SERIES), sequences, averages, out)
    kept, numbers = list(begun), [10, 11, 12, 13]
    for i, (value, which) in enumerate(zip(measured.tolist(), lane.tolist(), strict=True)):
        if which < 0:
            assert end == i
            break
        parameters, empirical_value, outstanding, stream, memory, _quiet = SERIES[which]
        deviation = deviation_of(value, parameters.target, empirical_value)
        d = decide(parameters, LoopState(kept[memory]), deviation, outstanding=outstanding)
        if i == end:
            assert d.action is not Action.NONE or d.alarms or d.zone not in ZONES[:3] or abs(value) > FARTHEST / 2
            break
        numbers[stream] += 1
        assert (d.action, d.amount, d.alarms) == (Action.NONE, None, ())
        assert (
            *(out.sequence[i], out.deviation[i], out.decided[i], out.before[i], out.after[i]),
            *(ZONES[out.zone[i]], CODES[out.code[i]]),
        ) == (numbers[stream], d.deviation, d.decided, d.average_before, d.average_after, d.zone, d.code)
        assert not np.signbit(out.deviation[i]) or out.deviation[i] < 0
        if parameters.average_memory:
            kept[memory] = d.average_after
    else:
        assert end == len(readings)
    assert averages.tolist() == kept
    assert sequences.tolist() == numbers
