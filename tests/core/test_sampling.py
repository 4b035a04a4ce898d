"""The proposal of 1 in n: its risk against a simulation, and what it never does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.decision.step import average_of
from app.core.sampling import CHOICES, Hindrance, Process, proposal, risk, saved
from app.core.spc.capability import Limits

GOOD = Process(Limits(-0.008, 0.008), 0.0005, 0.0012, 0.00001, 5_000, 0, stable=True, signals=0, index_low=1.8)
processes = st.builds(
    Process,
    st.sampled_from([Limits(-0.008, 0.008), Limits(None, 0.01), Limits(-0.004, None)]),
    st.floats(-0.01, 0.01),
    st.floats(0, 0.01),
    st.none() | st.floats(0, 0.001),
    st.integers(0, 100_000),
    st.integers(0, 50),
    st.sampled_from([True, False, None]),
    st.integers(0, 3),
    st.none() | st.floats(0, 4),
    st.floats(1, 20),
)


@given(processes, st.integers(1, 120))
def test_the_risk_never_falls_where_fewer_parts_are_measured(process: Process, every: int) -> None:
    assert 0 <= risk(process, every) <= risk(process, every + 1) + 1e-6
    assert risk(process, 1) == 0


@given(processes, st.integers(1, 120), st.floats(1, 20))
def test_the_risk_never_falls_with_the_weighting_of_the_average(process: Process, every: int, more: float) -> None:
    slower = process._replace(weighting=process.weighting * more)
    assert risk(process, every) <= risk(slower, every) + 1e-6
    assert risk(slower, 1) == 0


@pytest.mark.parametrize(("k", "every"), [(1, 10), (4, 1), (4, 2), (8, 10)])
def test_the_offset_stays_behind_the_wear_as_far_as_decisions_let_it(k: int, every: int) -> None:
    """One cycle of the loop itself, long after its begin: parts wear by 1, the average corrects by all that it holds."""
    size = 0.0
    for _measured in range(300):
        size -= average_of(0.0, size, k)
        unmeasured = [size + part for part in range(1, every)]
        size += every
    behind = (k - 1) * (every - 1)
    assert unmeasured == pytest.approx(
        [part + behind + (k - 1) for part in range(1, every)]
    )  # (k - 1): the mean has it


@given(processes, st.floats(0, 1e6))
def test_more_than_one_only_of_a_stable_capable_process_and_within_the_risk(process: Process, most: float) -> None:
    found = proposal(process, most)
    if found.every > 1:
        assert process.stable
        assert process.signals == 0
        assert process.index_low is not None
        assert process.index_low >= 1.33
        assert process.readings >= 100
        assert found.ppm <= most
        assert found.hindrances == ()
    assert proposal(process._replace(stable=False), most).every == 1
    assert proposal(process._replace(index_low=1.0), most).every == 1
    assert found.every >= proposal(process, most / 2).every


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"stable": None}, Hindrance.UNSTABLE),
        ({"signals": 1}, Hindrance.OPEN_SIGNAL),
        ({"index_low": None}, Hindrance.NOT_CAPABLE),
        ({"readings": 99}, Hindrance.FEW_READINGS),
        ({"wear": None}, Hindrance.WEAR_UNKNOWN),
    ],
)
def test_it_says_why_every_part_is_measured(change: dict[str, object], why: Hindrance) -> None:
    assert proposal(GOOD).every > 1
    assert proposal(GOOD._replace(**change)).hindrances == (why,)  # type: ignore[arg-type]


def test_the_risk_is_that_of_a_simulation() -> None:
    """Parts are cut and drift until one of n is measured and corrected; sudden events throw them out until then."""
    process = GOOD._replace(mean=0.0, sigma=0.002, wear=0.0004, readings=200, jumps=1)
    every, rng = 10, np.random.default_rng(7)
    blocks, rate = 40_000, 1.5 / 201
    drift = 0.0004 * np.arange(1, every)
    sizes = drift + rng.normal(0.0, 0.002, (blocks, every - 1))
    out = np.abs(sizes) > 0.008
    event = rng.random((blocks, every)) < rate  # at the part, so that from it on all go out until one is measured
    thrown = np.logical_or.accumulate(event, axis=1)[:, : every - 1]
    simulated = (out | thrown).sum() / (blocks * every) * 1e6
    assert risk(process, every) == pytest.approx(simulated, rel=0.15)
    assert risk(process, every) > simulated, "it errs to the safe side"


def test_wear_narrows_it_and_seconds_are_saved() -> None:
    intervals = [proposal(GOOD._replace(wear=wear)).every for wear in (0.0, 0.0001, 0.0005, 0.005)]
    assert intervals == sorted(intervals, reverse=True)
    assert intervals[0] > intervals[-1] == 1
    assert proposal(GOOD._replace(readings=1_000_000), 1e6).every == CHOICES[-1]
    assert saved(1, 12.0) == 0
