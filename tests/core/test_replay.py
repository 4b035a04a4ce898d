"""Replays: the compiled loop against `decide`, worked examples, and what a map makes of them."""

from dataclasses import replace

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from app.core.control_plan import Plan, Tightened, measure_next
from app.core.decision.decide import LoopState, ReadingAlarm, decide
from app.core.decision.limits import ZONES, in_nanometres
from app.core.decision.loops import Mark, ProcessTrace, ReplayResult, _rounded
from app.core.decision.step import CODES, Code
from app.core.parameters import Feature, Mode, Parameters, WearPolicy
from app.core.replay import (
    Policy,
    ReplayedCharacteristic,
    agreement,
    figures_of,
    parts_of,
    rebuilt,
    run,
    sampled,
    without_events,
)
from bench.replay import followed
from tests.chance import examples
from tests.core.conftest import SEAT

EXAMPLE = replace(SEAT, target=10, tolerance_width=0.04, zero_range=0.004, averaging_limit=0.0133)


def micrometres(*values: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array(values) / 1000


SIZES = st.one_of(
    st.floats(-0.012, 0.012),
    st.floats(-1.5, 1.5),
    st.sampled_from([0.0, 0.001, -0.001, 0.0053, 0.0053004, 0.008, 0.00800049, 0.3, 1.0, -1.0]),
    st.integers(-9_000_000, 9_000_000).map(lambda n: (n + 0.5) / 1e9),  # between two picometres
)
LENGTHS = st.integers(0, 12_000).map(lambda n: n / 1e6)


@st.composite
def parameter_sets(draw: st.DrawFn) -> Parameters:
    r33 = draw(st.integers(0, 4000))
    r34 = draw(st.integers(r33 + 1, 8000))
    half = draw(st.integers(r34, 12_000))
    return replace(
        SEAT,
        zero_range=r33 / 1e6,
        averaging_limit=r34 / 1e6,
        tolerance_width=2 * half / 1e6,
        wear_limit=draw(st.sampled_from([0.012, 0.02, 0.3])),
        confidence_limit=draw(st.sampled_from([0.3, 1.0])),
        weighting_factor=draw(st.one_of(st.sampled_from([1.0, 2.0, 3.0]), st.floats(1, 30))),
        factor=draw(st.sampled_from([-1.0, -0.5, 0.5, 1.0, -1 / 3, 0.7])),
        average_memory=draw(st.sampled_from([0, 5])),
        tool_memory=draw(st.sampled_from([3, 3, 3, 0])),
        mode=draw(st.sampled_from([Mode.AUTOMATIC, Mode.AUTOMATIC, Mode.MEASURE_ONLY])),
        wear_policy=draw(st.sampled_from(list(WearPolicy))),
        rejected_may_correct=draw(st.booleans()),
        feature=draw(st.sampled_from([Feature.OUTSIDE, Feature.OUTSIDE, Feature.TOOL])),
        max_step=draw(st.one_of(st.none(), LENGTHS)),
        max_total=draw(st.one_of(st.none(), LENGTHS)),
    )


@st.composite
def traces(draw: st.DrawFn) -> tuple[ProcessTrace, Policy]:
    lanes = tuple(
        ReplayedCharacteristic(
            p, -draw(st.sampled_from([1.0, 0.8])) / draw(st.sampled_from([-1.0, -0.5, 0.5])), memory, counts
        )
        for p, memory, counts in draw(
            st.lists(st.tuples(parameter_sets(), st.integers(0, 1), st.booleans()), min_size=1, max_size=3)
        )
    )
    lanes = (lanes[0]._replace(counts=True), *lanes[1:])
    readings = draw(
        st.lists(
            st.tuples(SIZES, st.integers(0, len(lanes) - 1), st.sampled_from([0] * 8 + list(range(127)))),
            min_size=1,
            max_size=80,
        )
    )
    lane = np.array([each[1] for each in readings], dtype=np.int64)
    marks = np.array([each[2] for each in readings], dtype=np.int8)
    marks[0] |= Mark.BEGIN
    begins = int((marks & Mark.BEGIN > 0).sum())
    starts = [draw(st.lists(LENGTHS, min_size=begins, max_size=begins)) for _column in range(4)]
    trace = ProcessTrace(
        np.array([each[0] for each in readings]),
        lane,
        marks,
        parts_of(lane),
        np.array(starts[0]),
        np.array(starts[1]),
        np.array(starts[2:]).T.copy(),
    )
    return trace, Policy(lanes, draw(st.integers(0, 6)))


@given(traces())
@examples(100)
def test_the_compiled_loop_is_decide_in_closed_loop_bit_for_bit(given_: tuple[ProcessTrace, Policy]) -> None:
    trace, policy = given_
    policy = Policy(
        tuple(lane if lane.parameters.average_memory else lane._replace(memory=-1) for lane in policy.lanes),
        policy.delay,
    )
    result, figures = run(trace, policy)
    rows = list(followed(trace, policy))
    for at, row in enumerate(rows):
        mine = (*(float(column[at]) for column in result[:5]), ZONES[result.zone[at]], CODES[result.code[at]])
        assert mine == row
        assert np.signbit(mine[:5]).tolist() == np.signbit(row[:5]).tolist()
    assert figures_of(trace, [policy, policy]) == [figures, figures]
    counted = [
        row
        for row, lane, mark in zip(rows, trace.lane, trace.marks, strict=True)
        if policy.lanes[lane].counts and not mark & Mark.LEFT_OUT
    ]
    assert figures.readings == len(counted)
    held = {Code.TOOL_WORN_HELD}
    assert figures.corrections >= sum(row[3] != 0 and row[6] not in held | {Code.IMPLAUSIBLE} for row in counted)
    assert figures.faults == sum(row[5] == "probe_fault" for row in counted)


@given(st.one_of(st.floats(-1000, 1000), st.integers(-(10**12), 10**12).map(lambda n: (n + 0.5) / 1e9)))
@examples(500)
def test_rounding_is_pythons(value: float) -> None:
    for near in (value, np.nextafter(value, np.inf), np.nextafter(value, -np.inf)):
        assert _rounded(float(near)) == round(float(near), 9) + 0.0


def test_the_worked_example_of_the_cycles() -> None:
    # What was measured, with the corrections taken out that were made after the third and the seventh.
    free = micrometres(3, 5, 6, 2 + 4.625, 4 + 4.625, 5 + 4.625, 5 + 4.625, 3 + 9, 7 + 9, 7 + 13.25)
    result, figures = run(without_events(free), Policy((ReplayedCharacteristic(EXAMPLE, response=1.0),)))
    assert (result.deviation * 1000).round(9).tolist() == [3, 5, 6, 2, 4, 5, 5, 3, 7, 7]
    m = np.where(result.amount != 0, -result.amount, result.average)
    assert (m * 1000).round(9).tolist() == [1.5, 3.25, 4.625, 1.0, 2.5, 3.75, 4.375, 1.5, 4.25, 3.5]
    assert np.flatnonzero(result.amount).tolist() == [2, 6, 8]
    assert (figures.corrections, figures.rejects) == (3, 0)


@pytest.mark.parametrize(
    ("delay", "deviations", "amounts"),
    [
        # Off by 7 µm from the first part on: corrected by 7 at once. What is still to come counts as come.
        (0, [7, 0, 0, 0, 0], [-7, 0, 0, 0, 0]),
        (2, [7, 7, 7, 0, 0], [-7, 0, 0, 0, 0]),
    ],
)
def test_a_step_by_hand(delay: int, deviations: list[float], amounts: list[float]) -> None:
    result, figures = run(
        without_events(micrometres(7, 7, 7, 7, 7)), Policy((ReplayedCharacteristic(SEAT, 1.0),), delay)
    )
    assert (result.deviation * 1000).round(6).tolist() == deviations
    assert (result.amount * 1000).round(6).tolist() == amounts
    assert (figures.corrections, figures.mean_size, figures.rejects) == (1, 0.007, 0)


def test_wear_by_hand() -> None:
    # 1 µm a part, R33 = 2, k = 1: corrected by 3 at each third part.
    policy = Policy((ReplayedCharacteristic(replace(SEAT, zero_range=0.002, weighting_factor=1), 1.0),))
    result, figures = run(without_events(np.arange(13) / 1000), policy)
    assert (result.deviation * 1000).round(6).tolist() == [0, 1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3]
    assert (result.offset * 1000).round(6).tolist() == [0, 0, 0, 0, -3, -3, -3, -6, -6, -6, -9, -9, -9]
    assert (figures.corrections, figures.largest) == (4, 0.003)
    # A part later: one more part has worn, which the correction did not know of.
    late, _figures = run(without_events(np.arange(13) / 1000), policy._replace(delay=1))
    assert (late.deviation * 1000).round(6).tolist() == [0, 1, 2, 3, 4, 2, 3, 4, 2, 3, 4, 2, 3]


def test_the_wrong_sign_runs_away_to_where_a_person_is_asked() -> None:
    wrong = Policy((ReplayedCharacteristic(replace(SEAT, factor=1.0), 1.0),))
    result, figures = run(without_events(np.full(40, 0.006)), wrong)
    assert result.deviation[:4].tolist() == [0.006, 0.012, 0.024, 0.048]
    assert (figures.worn, figures.held) == (34, 34)


def test_what_is_held_waits_for_the_release_of_then() -> None:
    trace = without_events(np.full(5, 0.4))
    trace.marks[3] = Mark.RELEASED
    result, figures = run(trace, Policy((ReplayedCharacteristic(SEAT, 1.0),)))
    assert result.deviation.tolist() == [0.4, 0.4, 0.4, 0.0, 0.0]
    assert (figures.held, figures.corrections) == (3, 0)


def test_what_is_held_is_released_once() -> None:
    """What was released then a second time was another one, which this policy has not held."""
    trace = without_events(np.full(6, 0.4))
    trace.marks[[2, 4]] = Mark.RELEASED
    result, figures = run(trace, Policy((ReplayedCharacteristic(SEAT, 1.0),)))
    assert result.deviation.tolist() == [0.4, 0.4, 0.0, 0.0, 0.0, 0.0]
    assert (figures.held, figures.corrections) == (2, 0)


def test_two_characteristics_of_one_tool_share_what_is_corrected() -> None:
    lane = np.array([0, 1, 0, 1, 0, 1])
    trace = without_events(micrometres(7, 1, 7, 1, 7, 1))._replace(lane=lane, part=parts_of(lane))
    both = Policy(
        (
            ReplayedCharacteristic(SEAT, 1.0),
            ReplayedCharacteristic(replace(SEAT, zero_range=0.002), 1.0, counts=False),
        )
    )
    result, figures = run(trace, both)
    # They lie 6 µm apart, so each corrects what the other has asked for: the second of a part was cut without it.
    assert (result.deviation * 1000).round(6).tolist() == [7, 1, 6, 0, 6, 0]
    assert (result.decided * 1000).round(6).tolist() == [7, -6, 6, -6, 6, -6]
    assert (figures.of_tool, figures.corrections) == (6, 3)


@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.00005, 0.0002),
    st.integers(0, 5),
    st.sampled_from([-1.0, -0.5, 0.5]),
    st.sampled_from([1.0, 0.9]),
)
@examples(60)
def test_taking_the_corrections_out_and_running_the_same_policy_gives_what_was(
    seed: int, wear: float, delay: int, factor: float, effect: float
) -> None:
    chance = np.random.default_rng(seed)
    trace = without_events(np.arange(300) * wear + chance.normal(0, 0.001, 300).round(6))
    policy = Policy((ReplayedCharacteristic(replace(SEAT, factor=factor), -effect / factor),), delay)
    then, figures = run(trace, policy)
    free = rebuilt(then.deviation, then.offset, factor, effect)
    again, same = run(trace._replace(free=free), policy)
    np.testing.assert_allclose(free, trace.free, atol=2e-9)
    assert same.corrections == figures.corrections
    np.testing.assert_allclose(again.deviation, then.deviation, atol=3e-9)


def test_figures_by_hand() -> None:
    trace = without_events(micrometres(1, -1, 9, -9, 400, 1200, 0.5, -0.5))
    trace.marks[7] |= Mark.LEFT_OUT
    _result, figures = run(trace, Policy((ReplayedCharacteristic(replace(SEAT, mode=Mode.MEASURE_ONLY), 1.0),)))
    assert (figures.readings, figures.inner, figures.rejects) == (7, 5, 3)
    assert (figures.oversize, figures.undersize, figures.worn, figures.faults, figures.alarms) == (1, 1, 1, 1, 4)
    assert figures.spread == pytest.approx(np.std(micrometres(1, -1, 9, -9, 0.5), ddof=1))
    assert figures.mean == pytest.approx(0.0001)
    assert (figures.largest, figures.ppk) == (0.009, None)


def test_ppk_is_that_of_the_statistics() -> None:
    from app.core.spc.capability import Limits, capability

    free = np.random.default_rng(3).normal(0.001, 0.002, 400)
    quiet = Policy((ReplayedCharacteristic(replace(SEAT, mode=Mode.MEASURE_ONLY), 1.0),))
    result, figures = run(without_events(free), quiet)
    expected = capability(result.deviation, Limits(-0.008, 0.008))
    assert figures.ppk == pytest.approx(expected.ppk.value, rel=1e-9)
    assert figures.spread == pytest.approx(expected.overall.value, rel=1e-9)


def test_equal_readings_have_no_ppk() -> None:
    _result, figures = run(without_events(np.full(50, 0.0004)), Policy((ReplayedCharacteristic(SEAT, 1.0),)))
    assert (figures.ppk, figures.corrections) == (None, 0)
    assert figures.spread == pytest.approx(0, abs=1e-12)


@given(traces(), st.integers(2, 5), st.integers(0, 4), st.integers(0, 4))
@examples(60)
def test_what_is_measured_of_1_in_n_is_what_the_answers_would_have_said(
    given_: tuple[ProcessTrace, Policy], every: int, after_change: int, after_alarm: int
) -> None:
    """By the rule that readings are answered by, on a process that nothing corrects: there each part is what it is."""
    trace, policy = given_
    trace.marks[:] &= Mark.BEGIN
    quiet = policy.with_(lambda parameters: replace(parameters, mode=Mode.MEASURE_ONLY, feature=Feature.OUTSIDE))
    lanes = tuple(lane._replace(parameters=quiet.lanes[0].parameters, counts=True, memory=-1) for lane in quiet.lanes)
    plan = Plan(every=every, after_change=after_change, after_alarm=after_alarm)
    result, whole = run(trace, Policy(lanes))
    every_part, few = sampled(trace, Policy(lanes), [replace(plan, every=1), plan])
    assert (every_part.measured, every_part.escaped, every_part.figures) == (whole.readings, 0, whole)
    limits = lanes[0].parameters.limits
    measured, escaped, due = 0, 0, 1
    since: dict[Tightened, int | None] = {}
    for deviation, zone, mark in zip(result.deviation, result.zone, trace.marks, strict=True):
        due -= 1
        if mark & Mark.BEGIN and after_change:
            since[Tightened.TOOL_CHANGE], due = 0, 0
        size = abs(in_nanometres(deviation))
        bad = size > limits.tolerance
        if due > 0:
            escaped += bool(bad and size < limits.confidence)
            continue
        since = {why: (count or 0) + 1 for why, count in since.items()}
        measured += 1
        if bad or ZONES[zone] in {"wear", "probe_fault"}:
            since[Tightened.ALARM] = 0
        due = measure_next(plan, since, late=False, measured=ZONES[zone] != "probe_fault") or 1
    assert (few.measured, few.escaped) == (measured, escaped)
    assert (few.figures.readings, few.figures.rejects) == (whole.readings, whole.rejects)


def test_wear_that_nobody_measures_is_not_corrected() -> None:
    """1 µm a part, corrected in full from 6 µm on: of every part none is out (8 µm), of 1 in 20 those before the next are."""
    trace = without_events(np.arange(200) / 1000)
    policy = Policy((ReplayedCharacteristic(SEAT, 1.0),))
    first, fewer = sampled(trace, policy, [Plan(every=1), Plan(every=20, after_alarm=1)])
    assert (first.measured, first.escaped, first.figures.rejects, first.figures.alarms) == (200, 0, 0, 0)
    assert fewer.measured < 30
    assert fewer.figures.alarms < fewer.figures.rejects == fewer.escaped + fewer.figures.alarms
    assert fewer.figures.corrections < first.figures.corrections


def test_agreement_of_nothing_is_not_a_number() -> None:
    assert np.isnan(agreement(np.array([np.nan]), np.array([1.0]))).all()


def test_a_way_without_readings_amounts_to_nothing() -> None:
    _result, figures = run(without_events(np.zeros(0)), Policy((ReplayedCharacteristic(SEAT, 1.0),)))
    assert (figures.readings, figures.mean, figures.spread, figures.ppk, figures.largest) == (0, None, None, None, None)
    assert figures_of(without_events(np.zeros(0)), []) == []
    assert len(ReplayResult.room(0).deviation) == 0


def test_the_size_of_a_tool_is_no_reject_and_out_by_what_is_not_corrected() -> None:
    """20 µm short from the first reading on: the one correction that it asks for is in the offset afterwards."""
    tool = replace(SEAT, feature=Feature.TOOL, factor=1.0)
    _, figures = run(without_events(np.full(5, -0.02)), Policy((ReplayedCharacteristic(tool, -1.0),)))
    assert (figures.rejects, figures.oversize, figures.undersize, figures.corrections) == (0, 0, 1, 1)
    assert decide(tool, LoopState(0.0), deviation=-0.02, outstanding=0.06).alarms == (ReadingAlarm.OVERSIZE,)
