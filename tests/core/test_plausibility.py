"""Jumps that neither wear nor scatter explains, and the suggested setting; hand-computed, and properties."""

import random
from collections.abc import Callable

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.core.decision.decide import LoopState, ReadingAlarm, decide, outstanding_effect
from app.core.decision.limits import Zone
from app.core.decision.step import Action, Code
from app.core.parameters import Mode, Parameters, WearPolicy
from app.core.plausibility import is_jump, moved, suggested_jump, uncorrected
from app.core.tool_life import LifePlan, use_of, usual_life

Made = Callable[..., Parameters]
lengths = st.floats(-0.5, 0.5).map(lambda length: round(length, 6))
factors = st.sampled_from([-1.0, -0.5, 0.5])


@given(lengths, st.lists(lengths, max_size=6), factors)
def test_a_correction_is_no_jump(size: float, amounts: list[float], factor: float) -> None:
    """Whatever corrections are in effect, taking them out gives the deviation that the tool would have cut without them."""
    deviation = size + outstanding_effect(amounts, factor)
    assert uncorrected(deviation, sum(amounts), factor) == pytest.approx(size, abs=2e-9)


@given(lengths, lengths, st.floats(1e-6, 1))
def test_a_jump_is_a_jump_in_both_directions(now: float, level: float, allowed: float) -> None:
    assert is_jump(now, level, allowed) == is_jump(-now, -level, allowed) == is_jump(level, now, allowed)
    assert not is_jump(now, None, allowed)
    assert not is_jump(level, level, allowed)


@given(st.lists(lengths, min_size=1, max_size=40))
def test_the_level_stays_among_the_readings(readings: list[float]) -> None:
    level: float | None = None
    for reading in readings:
        level = moved(level, reading)
    assert level is not None
    assert min(readings) - 1e-9 <= level <= max(readings) + 1e-9


def test_the_limit_itself_is_plausible_and_a_nanometre_more_is_not() -> None:
    assert not is_jump(0.0101, 0.0001, 0.010)
    assert is_jump(0.010101, 0.0001, 0.010)
    assert not is_jump(0.0 + 0.1 + 0.2, 0.0, 0.3)  # binary fractions


class TestSuggested:
    def test_by_hand(self) -> None:
        # moving ranges all 2 µm: sigma 2/0.954 = 2.096; 6 x 2.096 x sqrt(4/3) = 14.52; halves alike, so no wear
        assert suggested_jump([0.0, 0.002] * 10) == 0.0146
        # 1 µm of wear per part and no scatter besides: sigma 1/0.954, 7.26 and twice the wear
        assert suggested_jump([n / 1000 for n in range(20)]) == 0.0093

    def test_not_of_nothing(self) -> None:
        assert suggested_jump([]) is None
        assert suggested_jump([0.001] * 9) is None
        assert suggested_jump([0.001] * 50) is None

    def test_one_chip_does_not_move_it(self) -> None:
        rng = random.Random(1)
        course = [rng.gauss(0, 0.001) for _ in range(60)]
        with_chip = [*course[:30], 0.08, *course[31:]]
        assert suggested_jump(with_chip) == pytest.approx(suggested_jump(course), rel=0.6)

    @pytest.mark.parametrize("wear", [0.0, 0.0005, -0.001])
    def test_neither_scatter_nor_wear_reaches_it(self, wear: float) -> None:
        rng = random.Random(7)
        course = [rng.gauss(n * wear, 0.001) for n in range(5000)]
        allowed = suggested_jump(course[:50])
        assert allowed is not None
        level: float | None = None
        jumps = 0
        for reading in course:
            jumps += is_jump(reading, level, allowed)
            level = moved(level, reading)
        assert jumps <= 1  # six sigma of 5000, with sigma known from 50 readings only
        assert level is not None
        assert is_jump(level + 2 * allowed, level, allowed)


@given(st.floats(-0.25, 0.25).map(lambda d: round(d, 6)), st.floats(-0.004, 0.004))
def test_a_jump_never_corrects_and_leaves_the_average(deviation: float, average: float) -> None:
    parameters = Parameters(
        target=40.0, tolerance_width=0.016, zero_range=0.001, averaging_limit=0.005, wear_limit=0.3, confidence_limit=1.0,
        weighting_factor=2, factor=-1, tool_memory=3, average_memory=5, plausible_jump=0.01,
    )  # fmt: skip
    decision = decide(parameters, LoopState(average), deviation, jump=True)
    assert decision.action in {Action.HOLD, Action.NONE}
    assert decision.code is Code.IMPLAUSIBLE
    assert decision.average_after == average
    assert ReadingAlarm.IMPLAUSIBLE in decision.alarms
    assert (decision.amount is None) == (decision.zone is Zone.ZERO)
    if decision.amount is not None:
        assert decision.amount == pytest.approx(-deviation)


class TestDecision:
    def test_without_a_jump_nothing_is_different(self, shaft: Made) -> None:
        guarded, plain = shaft(plausible_jump=0.01), shaft()
        for deviation in (0.0005, 0.004, 0.007, 0.02, 0.4, 1.5):
            assert decide(guarded, LoopState(0.001), deviation) == decide(plain, LoopState(0.001), deviation)

    @pytest.mark.parametrize(
        ("micrometres", "policy", "code", "signals"),
        [
            (0.5, WearPolicy.HOLD, Code.IMPLAUSIBLE, {ReadingAlarm.IMPLAUSIBLE}),
            (20, WearPolicy.HOLD, Code.IMPLAUSIBLE, {ReadingAlarm.IMPLAUSIBLE, ReadingAlarm.OVERSIZE}),
            (400, WearPolicy.HOLD, Code.TOOL_WORN_HELD, {ReadingAlarm.TOOL_WORN}),  # it asks the same, and holds, too
            (400, WearPolicy.RELEASE, Code.IMPLAUSIBLE, {ReadingAlarm.IMPLAUSIBLE, ReadingAlarm.TOOL_WORN}),
            (1500, WearPolicy.HOLD, Code.PROBE_FAULT, {ReadingAlarm.PROBE_FAULT}),
        ],
    )
    def test_what_asks_a_person(
        self, shaft: Made, micrometres: float, policy: WearPolicy, code: Code, signals: set[ReadingAlarm]
    ) -> None:
        decision = decide(shaft(wear_policy=policy.value), LoopState(), micrometres / 1000, jump=True)
        assert (decision.code, set(decision.alarms)) == (code, signals)

    def test_where_nothing_is_corrected_anyway_nobody_is_asked(self, shaft: Made) -> None:
        assert decide(shaft(), LoopState(paused=True), 0.02, jump=True).code is Code.PAUSED
        assert decide(shaft(), LoopState(), 0.02, previous_tool=True, jump=True).code is Code.BEFORE_TOOL_CHANGE
        measured = decide(shaft(mode=Mode.MEASURE_ONLY.value), LoopState(0.001), 0.02, jump=True)
        assert (measured.code, measured.action, measured.average_after) == (Code.IMPLAUSIBLE, Action.NONE, 0.001)

    def test_the_limits_of_corrections_hold_for_a_held_one(self, shaft: Made) -> None:
        clamped = decide(shaft(max_step=0.005), LoopState(), 0.02, jump=True)
        assert (clamped.amount, clamped.clamped) == (-0.005, True)
        limited = decide(shaft(max_total=0.01), LoopState(), 0.02, jump=True)
        assert (limited.code, limited.amount) == (Code.OFFSET_LIMIT, None)


class TestToolLife:
    @given(st.integers(0, 10_000), lengths, st.integers(1, 10_000), st.floats(1e-3, 1))
    def test_spent_is_what_has_nothing_left(self, parts: int, total: float, planned: int, wear: float) -> None:
        use = use_of(LifePlan(planned, wear), parts, total)
        assert use.share is not None
        assert (use.spent is not None) == (use.share >= 1 or abs(total) >= wear - 5e-7)
        if use.spent:
            assert use.left == 0

    def test_by_hand(self) -> None:
        assert use_of(LifePlan(), 500, -0.03) == (None, None, None)
        assert use_of(LifePlan(parts=100), 100, 0.0) == (1.0, 0, "parts")
        assert use_of(LifePlan(parts=100, total=0.02), 40, 0.015) == (0.75, 13, None)  # 5 µm left at 15/40 µm per part
        assert use_of(LifePlan(total=0.02), 0, 0.0) == (0.0, None, None)

    @given(st.integers(1, 1000), st.floats(0.001, 0.1), st.integers(1, 1000))
    def test_less_is_left_the_more_is_cut(self, parts: int, total: float, more: int) -> None:
        plan = LifePlan(parts=5000, total=0.2)
        assume(parts + more <= 5000)
        assert (use_of(plan, parts + more, total).left or 0) <= 5000 - parts - more

    def test_usual(self) -> None:
        assert usual_life([]) is None
        assert usual_life([400]) == 400.0
