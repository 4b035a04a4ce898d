"""Natural limits: the target is the limit, the tolerance lies on one side, and what lies beyond it is no measurement."""

from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from app.core.decision.decide import LoopState, ReadingAlarm, decide
from app.core.decision.limits import Zone
from app.core.decision.loops import Quiet, Series, quiet_run, rows_of
from app.core.decision.step import Code
from app.core.natural_limit import NaturalLimit, looks_natural
from app.core.parameters import ParameterError, Parameters, default_averaging_limit, read
from app.core.spc.capability import Limits, of_percentiles
from app.core.state import CharacteristicState, Known, drift, state_of

RUN_OUT: dict[str, Any] = {
    "R10": 0,
    "R42": 0,
    "R40": 0.0127,
    "R41": 0,
    "R33": 0.001,
    "R34": 0.004,
    "R37": 0.3,
    "R36": 1,
}


def run_out(**more: Any) -> Parameters:
    return read(RUN_OUT | more)[0]


def test_a_size_that_is_0_at_best_and_only_measured_has_a_natural_limit() -> None:
    p = run_out()
    assert [p.natural_limit.value, p.target, p.tolerance_width, p.half] == ["lower", 0, 0.0127, 0.0127]
    assert [*p.tolerance] == [None, 0.0127]
    assert [*p.sizes] == [0, 0.0127]
    assert p.limits.tolerance == 12_700
    assert run_out(R34=None).averaging_limit == pytest.approx(0.0127 * 2 / 3, abs=1e-9)
    assert default_averaging_limit(0.016) == round(0.016 / 3, 9)


@pytest.mark.parametrize(
    "said",
    [
        {"natural_limit": "none"},
        {"R10": 3, "factor": -1},  # something is corrected, so it has a sign
        {"R42": 10},
        {"R41": -0.001},
    ],
    ids=lambda said: next(iter(said)),
)
def test_others_have_none(said: dict[str, Any]) -> None:
    p = run_out(**said)
    assert p.natural_limit.value == "none"
    assert p.half == p.tolerance_width / 2
    assert p.target == pytest.approx(p.sizes[0] + p.half)


def test_an_upper_natural_limit_is_the_mirror() -> None:
    p = run_out(R42=100, R40=0, R41=-0.02, natural_limit="upper")
    assert [p.target, *p.tolerance, *p.sizes] == [100, -0.02, None, 99.98, 100]
    assert decide(p, LoopState(), 0.0011).code is Code.BEYOND_NATURAL_LIMIT
    assert decide(p, LoopState(), -0.021).alarms == (ReadingAlarm.UNDERSIZE,)


def test_no_offset_corrects_it() -> None:
    with pytest.raises(ParameterError) as refused:
        run_out(R10=3, factor=-1, natural_limit="lower")
    assert [problem.code for problem in refused.value.problems] == ["natural_corrected"]
    assert run_out(R10=3, mode="measure_only", natural_limit="lower").measures_only


def test_limits_are_ordered_by_the_whole_tolerance() -> None:
    assert run_out(R34=0.0127, R37=0.0127).averaging_limit == 0.0127  # R35, not R35/2
    with pytest.raises(ParameterError) as refused:
        run_out(R34=0.0128)
    assert refused.value.problems[0].data["outer"] == "R35"


def test_an_old_set_has_none_and_a_new_one_comes_back_as_it_was() -> None:
    stored = run_out().as_dict()
    assert Parameters.from_dict(stored) == run_out()
    del stored["natural_limit"]
    assert Parameters.from_dict(stored).natural_limit is NaturalLimit.NONE


@pytest.mark.parametrize(
    ("deviation", "zone", "good"),
    [
        (0.0, Zone.ZERO, True),
        (-0.001, Zone.ZERO, True),  # the scatter of measuring
        (-0.001001, Zone.PROBE_FAULT, False),  # no part can be there
        (0.0127, Zone.FULL, True),
        (0.012701, Zone.OVERSIZE, False),
        (0.3, Zone.WEAR, False),
        (1.0, Zone.PROBE_FAULT, False),
    ],
)
def test_zones_lie_on_one_side(deviation: float, zone: Zone, good: bool) -> None:
    decision = decide(run_out(), LoopState(), deviation)
    assert (decision.zone, decision.good, decision.amount) == (zone, good, None)


def test_the_compiled_loop_leaves_what_cannot_be_to_the_decision() -> None:
    measured = np.array([0.002, 0.0127, -0.0011, 0.003])
    quiet = quiet_run(
        0, measured, np.zeros(4, np.int64), rows_of([Series(run_out(), 0, 0, 0, -1)]), np.zeros(1, np.int64),
        np.zeros(1), Quiet.room(4),
    )  # fmt: skip
    assert quiet == 2


def known(trend: list[float]) -> Known:
    now = datetime(2026, 1, 1, tzinfo=UTC)
    return Known(run_out(), len(trend), "full", trend[-1], False, [], [], trend, now, now)


def test_readings_on_one_side_are_no_drift() -> None:
    assert state_of(known([0.002, 0.0035] * 6)) is CharacteristicState.MEASURE_ONLY
    assert drift([0.0041] * 7, run_out()) is CharacteristicState.DRIFTING_UP
    assert state_of(known([0.013] * 3)) is CharacteristicState.OVERSIZE
    assert state_of(known([-0.005])) is CharacteristicState.MEASURE_ONLY  # it says nothing about the part


def test_a_process_bounded_at_0_is_judged_above_alone() -> None:
    """Percentiles of |N(0, 1)| are roots of chi-square with one degree of freedom, which every table prints: 0.4549 for 50 %.

    By both sides the lower ratio is (X50 - 0)/(X50 - X0.135) = 1.0 whatever the process does.
    """
    low, median, high = (float(chi2.ppf(share, 1)) ** 0.5 for share in (0.00135, 0.5, 0.99865))
    assert (round(median**2, 4), round(high**2, 2)) == (0.4549, 10.27)
    both, upper = of_percentiles(low, median, high, Limits(None, 6.0))
    assert (both, round(upper, 4)) == (None, round((6 - 0.67449) / (3.20515 - 0.67449), 4))
    assert of_percentiles(low, median, high, Limits(0.0, 6.0))[1] == pytest.approx(1.0, abs=0.003)


def test_names_of_form() -> None:
    for name in (
        "Rundlauf A-B",
        "Run-out",
        "RUNOUT 2",
        "Roundness",
        "Geradheit",
        "Ra",
        "Rz16",
        "Flatness top",
    ):
        assert looks_natural(name), name
    for name in ("Diameter 40", "Radius", "Length", "Position X", "Bore around pin"):
        assert not looks_natural(name), name
