"""Calibration: hand-computed and published cases (cases/calibration.json), and what must hold for any."""

import json
from math import isclose
from pathlib import Path
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.core.calibration import Calibration, Gauge, Outcome, Ring, Section, calibrate, centre
from app.core.pairs import FEWEST, compare, grubbs_limit, outlier
from app.core.probing import TouchError

CASES: dict[str, list[dict[str, Any]]] = json.loads(
    (Path(__file__).parent / "cases/calibration.json").read_text("utf-8")
)
micrometres = st.integers(-2_000, 2_000).map(lambda um: um / 1000)


def named(kind: str) -> list[Any]:
    return [pytest.param(case, id=case["name"]) for case in CASES[kind]]


def gauge_of(case: dict[str, Any]) -> Gauge:
    return Gauge(case["R32"], case["R33"], case["R34"], case["R36"], case["R29"], case["R28"])


@pytest.mark.parametrize("case", named("gauge"))
def test_l92_by_hand(case: dict[str, Any]) -> None:
    done = calibrate(gauge_of(case), case["touches"], empirical_value=case["empirical_value"], average=case["average"])
    assert (done.size, done.measured, done.difference, done.average) == (
        case["R42"],
        case["R43"],
        case["R44"],
        case["R49"],
    )
    assert (done.deviation, done.proposed, done.outcome) == (case["deviation"], case["proposed"], case["outcome"])
    assert done.repeat == case.get("repeat")
    assert done.outcome.refused == (case["outcome"] in {"probe_fault", "window"})


def test_the_published_averaging_example_runs_through_calibrations_as_well() -> None:
    """R33 = 4 µm, k = 2; each time the proposal is accepted, so EV moves and the average begins again at 0."""
    gauge, ev, average, averages = Gauge(50.0, 0.004, 0.0133, 1.0, 2.0), 0.0, 0.0, []
    for deviation in (3, 5, 6, 2, 4, 5, 5, 3, 7, 7):
        done = calibrate(gauge, [50.0 + ev + deviation / 1000], empirical_value=ev, average=average)
        averages.append(round(done.average * 1000, 6))
        average = done.average
        if done.proposed is not None:
            assert done.proposed == pytest.approx(ev + done.average)
            ev, average = done.proposed, 0.0
    assert averages == [1.5, 3.25, 4.625, 1, 2.5, 3.75, 4.375, 1.5, 4.25, 3.5]
    assert ev == pytest.approx((4.625 + 4.375 + 4.25) / 1000)


@given(st.lists(micrometres, min_size=1, max_size=10), micrometres, micrometres, st.floats(1, 4))
def test_accepting_what_follows_leaves_nothing_beyond_the_averaging_limit(
    off: list[float], ev: float, average: float, k: float
) -> None:
    gauge = Gauge(199.852, 0.001, 0.01, 1.0, k)
    touches = [199.852 + each for each in off]
    done = calibrate(gauge, touches, empirical_value=ev, average=average)
    assert isclose(done.difference, sum(off) / len(off), abs_tol=2e-9)
    assert isclose(done.deviation, done.difference - ev, abs_tol=2e-9)
    if done.outcome.refused:
        assert done.proposed is None
        assert done.average == average
        return
    if done.proposed is not None:
        again = calibrate(gauge, touches, empirical_value=done.proposed)
        assert not again.outcome.refused
        if done.outcome is Outcome.FULL_DIFFERENCE:
            assert abs(again.deviation) < 1e-8


def test_a_touch_on_the_edge_of_the_window_is_inside() -> None:
    gauge = Gauge(25.0, 0.001, 0.01, 1.0)
    assert calibrate(gauge, [26.0, 24.0], empirical_value=0.0).outcome is Outcome.WITHIN_ZERO_RANGE
    refused = calibrate(gauge, [26.0, 23.999999], empirical_value=0.0)
    assert (refused.outcome, refused.repeat) == (Outcome.WINDOW, 2)


def test_no_touch_is_no_calibration() -> None:
    with pytest.raises(TouchError) as wrong:
        calibrate(Gauge(25, 0.001, 0.01, 1.0), [], empirical_value=0.0)
    assert (wrong.value.code, wrong.value.got) == ("repeats", 0)


@pytest.mark.parametrize("case", named("ring"))
def test_the_ring_comes_to_what_the_macro_computes(case: dict[str, Any]) -> None:
    ring = Ring(case["smallest"], case["largest"], case["radius_term"])
    done = centre(ring, [Section(*section) for section in case["sections"]])
    assert (list(done.diameters), done.correction) == (case["diameters"], case["correction"])
    plus, minus = (sum(touches) / 3 for touches in zip(*case["sections"], strict=True))
    v2732, v505, v502 = case["offset"], 30.0, case["radius_term"]
    v140 = v2732 - v505 + (plus + v502)
    v141 = v2732 - v505 - (minus - v502)
    assert v2732 + (v140 - v141) / 2 == pytest.approx(case["offset_after"], abs=1e-9)
    assert v2732 + done.correction == pytest.approx(case["offset_after"], abs=1e-9)


RING = Ring(29.99, 30.01, 6.0)
GOOD = Section(24.0, -24.0)


def test_the_first_move_along_z_triggers() -> None:
    done = centre(RING, [], blocked=True)
    assert (done.outcome, done.correction, done.outcome.refused) == (Outcome.NOT_A_BORE, None, True)


@pytest.mark.parametrize(("sections", "at"), [([GOOD, Section(24.0111, -24.01)], 2), ([Section(23.98, -23.9799)], 1)])
def test_the_macro_stops_at_the_first_section_outside_the_limits(sections: list[Section], at: int) -> None:
    done = centre(RING, sections)
    assert (done.outcome, done.section, done.correction) == (Outcome.WRONG_GAUGE, at, None)


@pytest.mark.parametrize("count", [0, 1, 2, 4])
def test_good_sections_must_be_three(count: int) -> None:
    with pytest.raises(TouchError) as wrong:
        centre(RING, [GOOD] * count)
    assert (wrong.value.expected, wrong.value.got) == (3, count)


@pytest.mark.parametrize("case", named("paired"))
def test_pairs_as_published(case: dict[str, Any]) -> None:
    found = compare(case["differences"], empirical_value=0.0)
    assert found.mean == pytest.approx(case["mean"], abs=1e-6)
    assert found.deviation is not None
    if "G" in case:
        furthest = case["differences"][case["outlier"]]
        assert (furthest - case["mean"]) / found.deviation == pytest.approx(case["G"], abs=1e-4)  # printed cut off
    else:
        assert found.deviation == pytest.approx(case["deviation"], abs=1e-6)
        assert found.low == pytest.approx(case["low"], abs=1e-7)
        assert found.high == pytest.approx(case["high"], abs=1e-7)
    assert found.outlier == case["outlier"]
    assert found.suggested == found.mean


@pytest.mark.parametrize(("count", "published"), [(3, 1.155), (5, 1.715), (8, 2.126), (10, 2.290), (20, 2.709)])
def test_limits_of_grubbs_test(count: int, published: float) -> None:
    """Grubbs and Beck (1972), two-sided, 5 %."""
    assert grubbs_limit(count) == pytest.approx(published, abs=0.002)


def test_few_pairs_say_how_many_are_missing() -> None:
    differences = [0.0008, 0.0012, 0.0009, 0.0011, 0.001, 0.001]
    assert [compare(differences[:n], empirical_value=0.5).missing for n in range(7)] == [5, 4, 3, 2, 1, 0, 0]
    assert [compare(differences[:n], empirical_value=0.5).suggested for n in range(3, 7)] == [None, None, 0.001, 0.001]
    assert (compare([], empirical_value=0.0).mean, compare([0.002], empirical_value=0.0).deviation) == (None, None)


def test_equal_differences_are_no_certainty() -> None:
    """A gauge that shows whole steps hides the scatter: an interval of width zero would call every other value wrong."""
    found = compare([40.002 - 40.0, *([0.002] * 5)], empirical_value=0.0)  # as they come of subtracting: 0.002 + 2e-15
    assert (found.mean, found.low, found.high, found.suggested, found.equal) == (0.002, None, None, None, True)
    found = compare([*([0.002] * 9), 0.003], empirical_value=0.0)
    assert found.step == pytest.approx(0.001), "a step is larger than s"
    assert (found.low, found.high) == pytest.approx((0.0016, 0.0026)), "half a step to each side"
    assert found.suggested == 0.0021


def test_pairs_that_agree_with_the_value_in_effect_suggest_nothing() -> None:
    differences = [0.0008, 0.0015, 0.0011, 0.0009, 0.0012]
    assert compare(differences, empirical_value=0.001).suggested is None
    assert compare(differences, empirical_value=0.0).suggested == 0.0011
    known = compare(differences, empirical_value=0.0)
    assert known.low is not None
    assert known.high is not None
    for value, suggested in (
        (known.low, None),
        (known.high, None),
        (known.low - 1e-6, 0.0011),
        (known.high + 1e-6, 0.0011),
    ):
        assert compare(differences, empirical_value=value).suggested == suggested, "an end of the interval agrees"


@given(st.lists(micrometres, min_size=2, max_size=30))
def test_the_mean_lies_inside_its_interval_and_a_surer_one_is_wider(differences: list[float]) -> None:
    assume(len(set(differences)) > 1)
    narrow = compare(differences, empirical_value=9.0, confidence=0.9)
    wide = compare(differences, empirical_value=9.0, confidence=0.99)
    assert narrow.mean is not None
    assert narrow.low is not None
    assert wide.low is not None
    assert narrow.high is not None
    assert wide.high is not None
    assert wide.low <= narrow.low <= narrow.mean <= narrow.high <= wide.high
    assert (narrow.suggested is None) == (len(differences) < FEWEST)


def test_equal_values_have_no_outlier() -> None:
    assert outlier([0.002] * 8) is None
    assert outlier([0.001, 0.002]) is None


def test_spread_of_the_touches() -> None:
    done: Calibration = calibrate(Gauge(25, 0.001, 0.01, 1.0), [25.001, 25.0004, 25.0016], empirical_value=0.0)
    assert done.spread == 0.0012
