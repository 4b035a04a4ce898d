from collections.abc import Callable
from math import copysign

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from app.core.decision.decide import LoopState, ReadingAlarm, decide, outstanding_effect
from app.core.decision.limits import Zone
from app.core.decision.step import Action, Code, average_of, deviation_of
from app.core.parameters import Mode, Parameters, WearPolicy, read
from tests.core.conftest import SHAFT

Made = Callable[..., Parameters]
sizes = st.floats(-10, 10)
factors = st.floats(1, 50)


@given(st.lists(sizes, min_size=1, max_size=50), factors)
def test_the_average_never_leaves_the_range_of_its_inputs(deviations: list[float], k: float) -> None:
    average = 0.0
    for deviation in deviations:
        average = average_of(average, deviation, k)
    assert min(0.0, *deviations) <= average <= max(0.0, *deviations)


@given(sizes, sizes, factors)
@example(3e-05, 3e-05, 3.0)  # 2.9999999999999997e-05 by the formula
def test_the_average_lies_between_the_old_one_and_the_deviation(old: float, deviation: float, k: float) -> None:
    assert min(old, deviation) <= average_of(old, deviation, k) <= max(old, deviation)


@given(sizes, sizes)
def test_k_1_takes_the_last_reading_whole(old: float, deviation: float) -> None:
    assert average_of(old, deviation, 1) == deviation


@given(sizes, sizes, factors)
def test_the_average_is_symmetric(old: float, deviation: float, k: float) -> None:
    assert average_of(-old, -deviation, k) == -average_of(old, deviation, k)


TABLE = [
    # deviation µm, M before -> zone, action, code, size error, M after, signals
    (0.6, 0.4, Zone.ZERO, Action.NONE, Code.WITHIN_ZERO_RANGE, None, 0.5, ()),
    (1.0, 0.4, Zone.ZERO, Action.NONE, Code.WITHIN_ZERO_RANGE, None, 0.7, ()),
    (1.2, 0.4, Zone.AVERAGE, Action.NONE, Code.AVERAGE_KEPT, None, 0.8, ()),
    (5.3, 0.4, Zone.AVERAGE, Action.CORRECT, Code.AVERAGED_DEVIATION, 2.85, 0.0, ()),
    (6.1, 1.2, Zone.FULL, Action.CORRECT, Code.FULL_DEVIATION, 6.1, 0.0, ()),
    (8.0, 1.2, Zone.FULL, Action.CORRECT, Code.FULL_DEVIATION, 8.0, 0.0, ()),
    (9.0, 1.2, Zone.OVERSIZE, Action.CORRECT, Code.OUT_OF_TOLERANCE, 9.0, 0.0, (ReadingAlarm.OVERSIZE,)),
    (-9.0, 1.2, Zone.UNDERSIZE, Action.CORRECT, Code.OUT_OF_TOLERANCE, -9.0, 0.0, (ReadingAlarm.UNDERSIZE,)),
    (300.0, 1.2, Zone.WEAR, Action.HOLD, Code.TOOL_WORN_HELD, 300.0, 1.2, (ReadingAlarm.TOOL_WORN,)),
    (-999.0, 1.2, Zone.WEAR, Action.HOLD, Code.TOOL_WORN_HELD, -999.0, 1.2, (ReadingAlarm.TOOL_WORN,)),
    (1000.0, 1.2, Zone.PROBE_FAULT, Action.STOP, Code.PROBE_FAULT, None, 1.2, (ReadingAlarm.PROBE_FAULT,)),
]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row[0]} µm")
def test_the_table_of_zones(
    shaft: Made, row: tuple[float, float, Zone, Action, Code, float | None, float, tuple[ReadingAlarm, ...]]
) -> None:
    deviation, before, zone, action, code, size_error, after, signals = row
    decision = decide(shaft(), LoopState(before / 1000), deviation / 1000)
    assert (decision.zone, decision.action, decision.code, decision.alarms) == (zone, action, code, signals)
    assert decision.average_after == pytest.approx(after / 1000)
    if size_error is None:
        assert decision.amount is None
    else:
        assert decision.size_error == pytest.approx(size_error / 1000)
        assert decision.amount == pytest.approx(-size_error / 1000)


@pytest.mark.parametrize(
    ("factor", "surface", "inside"),
    [
        (-1.0, "diameter", False),
        (-1.0, "diameter", True),
        (-0.5, "radius", False),
        (-1.0, "length", False),
        (-0.5, "milled", False),
        (0.5, "milled", True),
    ],
)
@pytest.mark.parametrize("error", [0.0061, -0.0072])
def test_a_correction_brings_the_next_part_to_the_target(
    shaft: Made, factor: float, surface: str, inside: bool, error: float
) -> None:
    """Effect of an offset on the machine, from its geometry, not from our formula."""

    def size(offset: float) -> float:
        move = {
            "diameter": offset,
            "length": offset,
            "radius": 2 * offset,
            "milled": -2 * offset if inside else 2 * offset,
        }
        return 39.992 + error + move[surface]

    decision = decide(shaft(factor=factor), LoopState(), deviation_of(size(0.0), 39.992))
    assert decision.amount is not None
    assert size(decision.amount) == pytest.approx(39.992, abs=1e-9)


def test_without_a_memory_location_k_damps_to_a_kth(shaft: Made) -> None:
    """R11 = 0: M_old is always 0."""
    parameters = shaft(average_memory=0, weighting_factor=2)
    decision = decide(parameters, LoopState(0.9), 0.004)
    assert decision.average_before == 0.0
    assert decision.size_error == pytest.approx(0.002)
    kept = decide(parameters, LoopState(0.9), 0.0015)
    assert (kept.code, kept.average_after) == (Code.AVERAGE_KEPT, 0.0)


def test_while_paused_it_is_judged_but_nothing_is_corrected(shaft: Made) -> None:
    decision = decide(shaft(), LoopState(0.0012, paused=True), 0.0061)
    assert (decision.zone, decision.action, decision.code) == (Zone.FULL, Action.NONE, Code.PAUSED)
    assert decision.amount is None
    assert decision.average_after == 0.0012


@pytest.mark.parametrize("deviation", [0.009, -0.009, 0.4])
def test_a_part_out_of_tolerance_that_nothing_brings_back_stops_the_machine(shaft: Made, deviation: float) -> None:
    """Paused, or at the largest sum: the next parts are out as well."""
    paused = LoopState(0.0012, paused=True)
    decision = decide(shaft(), paused, deviation)
    assert (decision.action, decision.code, decision.amount) == (Action.STOP, Code.PAUSED, None)
    assert decision.average_after == 0.0012
    assert decision.alarms
    assert decide(shaft(), paused, deviation, previous_tool=True).action is Action.NONE, "of the offset before"
    assert decide(shaft(), paused, deviation, outstanding=-deviation).action is Action.NONE, "corrected since"
    assert decide(shaft(mode=Mode.MEASURE_ONLY.value), paused, deviation).action is Action.NONE, "as without a pause"
    limited = decide(shaft(max_total=0.001), LoopState(), deviation)
    assert (limited.action, limited.code) == (Action.STOP, Code.OFFSET_LIMIT)


def test_measure_only_runs_the_average_and_alarms_but_never_corrects(shaft: Made) -> None:
    for parameters in (shaft(mode=Mode.MEASURE_ONLY.value), shaft(tool_memory=0)):
        decision = decide(parameters, LoopState(0.0), 0.009)
        assert (decision.action, decision.amount, decision.code) == (Action.NONE, None, Code.MEASURE_ONLY)
        assert decision.average_after == pytest.approx(0.0045)
        assert decision.alarms == (ReadingAlarm.OVERSIZE,)
        broken = decide(parameters, LoopState(0.0012), 0.4)
        assert (broken.action, broken.average_after) == (Action.NONE, 0.0012), "the wear zone leaves the average"


def test_wear_may_be_released_at_once(shaft: Made) -> None:
    decision = decide(shaft(wear_policy=WearPolicy.RELEASE.value), LoopState(0.0012), 0.4)
    assert (decision.action, decision.code) == (Action.CORRECT, Code.TOOL_WORN_RELEASED)
    assert decision.amount == pytest.approx(-0.4)
    assert decision.average_after == 0.0012


@given(st.floats(0.0011, 0.29), st.sampled_from([-1.0, -0.5, 0.5]), st.floats(0.0001, 0.5))
def test_no_step_is_larger_than_max_step(size: float, factor: float, max_step: float) -> None:
    parameters = read(SHAFT | {"factor": factor, "max_step": max_step, "weighting_factor": 1})[0]
    for deviation in (size, -size):
        decision = decide(parameters, LoopState(), round(deviation, 6))
        assert decision.amount is not None
        assert abs(decision.amount) <= max_step + 1e-9
        assert copysign(1, decision.amount) == copysign(1, factor * deviation)
        if not decision.clamped:
            assert decision.amount == pytest.approx(factor * round(deviation, 6), abs=1e-9)


def test_beyond_max_total_the_tool_is_not_corrected_any_more(shaft: Made) -> None:
    parameters = shaft(max_total=0.02)
    assert decide(parameters, LoopState(total=-0.0139), 0.0061).action is Action.CORRECT
    stopped = decide(parameters, LoopState(total=-0.014), 0.0061)
    assert (stopped.action, stopped.amount, stopped.code) == (Action.NONE, None, Code.OFFSET_LIMIT)
    assert ReadingAlarm.OFFSET_LIMIT in stopped.alarms
    back = decide(parameters, LoopState(total=-0.0199), -0.0061)
    assert back.action is Action.CORRECT
    lowered = decide(parameters, LoopState(total=-0.05), -0.0061)
    assert lowered.action is Action.CORRECT, "towards zero is allowed even from beyond"
    across = decide(parameters, LoopState(total=-0.03), -0.06)
    assert across.action is Action.CORRECT, "and through it, as long as it ends no further away"
    further = decide(parameters, LoopState(total=-0.03), -0.060001)
    assert further.code is Code.OFFSET_LIMIT


def test_what_max_total_refuses_leaves_the_average_as_without_a_correction(shaft: Made) -> None:
    """In the averaging zone it goes on; in full, nothing of the reading is in it."""
    for deviation, after in ((0.005, 0.0045), (0.0061, 0.004)):
        decision = decide(shaft(max_total=0.001), LoopState(0.004), deviation)
        assert decision.code is Code.OFFSET_LIMIT
        assert decision.average_after == pytest.approx(after)


@given(
    st.floats(-0.29, 0.29).map(lambda d: round(d, 6)),
    st.lists(st.floats(-0.05, 0.05).map(lambda a: round(a, 6)), min_size=1, max_size=4),
    st.sampled_from([-1.0, -0.5, 0.5]),
)
def test_a_part_cut_with_the_old_offset_is_decided_as_if_it_had_the_new_one(
    deviation: float, issued: list[float], factor: float
) -> None:
    parameters = read(SHAFT | {"factor": factor})[0]
    effect = outstanding_effect(issued, factor)
    decision = decide(parameters, LoopState(), deviation, outstanding=effect)
    as_if = decide(parameters, LoopState(), round(deviation + effect, 9))
    assert decision.deviation == deviation, "the raw deviation is what is stored"
    assert (decision.zone, decision.action, decision.amount, decision.average_after) == (
        as_if.zone,
        as_if.action,
        as_if.amount,
        as_if.average_after,
    )


def test_the_same_error_seen_again_before_the_correction_took_effect_corrects_nothing(shaft: Made) -> None:
    for factor in (-1.0, -0.5, 0.5):
        parameters = shaft(factor=factor)
        first = decide(parameters, LoopState(), 0.0061)
        assert first.amount is not None
        again = decide(parameters, LoopState(), 0.0061, outstanding=outstanding_effect([first.amount], factor))
        assert (again.decided, again.zone, again.action) == (0.0, Zone.ZERO, Action.NONE)


def test_a_bad_part_is_reported_even_when_its_error_has_been_corrected_since(shaft: Made) -> None:
    decision = decide(shaft(), LoopState(), 0.0095, outstanding=-0.0095)
    assert (decision.zone, decision.action, decision.good) == (Zone.ZERO, Action.NONE, False)
    assert decision.alarms == (ReadingAlarm.OVERSIZE,)


def test_a_good_part_is_not_called_bad_because_of_a_correction_still_to_come(shaft: Made) -> None:
    decision = decide(shaft(), LoopState(), -0.0017, outstanding=0.02)
    assert (decision.zone, decision.action, decision.good) == (Zone.OVERSIZE, Action.CORRECT, True)
    assert decision.alarms == ()


def test_a_probe_fault_is_recognised_by_the_raw_deviation(shaft: Made) -> None:
    decision = decide(shaft(), LoopState(), 1.0, outstanding=-0.9)
    assert (decision.zone, decision.action) == (Zone.PROBE_FAULT, Action.STOP)


@pytest.mark.parametrize(
    ("deviation", "signals"),
    [
        (0.0061, ()),
        (0.009, (ReadingAlarm.OVERSIZE,)),
        (0.4, (ReadingAlarm.OVERSIZE,)),  # the worn tool is gone; the part is scrap all the same
        (-0.4, (ReadingAlarm.UNDERSIZE,)),
    ],
)
def test_a_part_of_the_tool_before_says_nothing_about_this_one(
    shaft: Made, deviation: float, signals: tuple[ReadingAlarm, ...]
) -> None:
    decision = decide(shaft(), LoopState(0.0012), deviation, previous_tool=True)
    assert (decision.action, decision.amount, decision.average_after) == (Action.NONE, None, 0.0012)
    assert (decision.code, decision.alarms) == (Code.BEFORE_TOOL_CHANGE, signals)


def test_a_rejected_part_corrects_nothing_unless_it_may(shaft: Made) -> None:
    decision = decide(shaft(), LoopState(), 0.009, accepted=False)
    assert (decision.action, decision.code) == (Action.NONE, Code.REJECTED)
    assert ReadingAlarm.ACCEPTANCE in decision.alarms
    allowed = decide(shaft(rejected_may_correct=True), LoopState(), 0.009, accepted=False)
    assert allowed.action is Action.CORRECT


@given(st.lists(st.integers(-9000, 9000), max_size=60), factors)
def test_the_decisions_are_those_of_the_mirrored_deviations_mirrored(sizes_nm: list[int], k: float) -> None:
    parameters = read(SHAFT | {"weighting_factor": k})[0]
    one = other = 0.0
    for size in sizes_nm:
        a, b = decide(parameters, LoopState(one), size / 1e6), decide(parameters, LoopState(other), -size / 1e6)
        assert a.action is b.action
        assert (a.amount is None) == (b.amount is None)
        if a.amount is not None and b.amount is not None:
            assert a.amount == -b.amount
        one, other = a.average_after, b.average_after
        assert one == -other


def test_no_minus_zero_leaves_the_core(shaft: Made) -> None:
    assert copysign(1, deviation_of(39.992, 39.992)) == 1
    assert copysign(1, outstanding_effect([0.0], -1)) == 1
    assert copysign(1, outstanding_effect([], -1)) == 1
