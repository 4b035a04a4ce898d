"""Signs: what is found, entered on the control as it is worded, makes the machine true. Table and head, all three axes."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from app.core.rotary.axis import ERRORS, AxisErrors, AxisFault, AxisName, Carried, NoAxis, Position, estimate
from tests.core.rotary.machine import Machine, Place

ANGLES = [-90.0, -45.0, 0.0, 45.0, 90.0, 135.0, 180.0]
FAR = {"C": (180.0, 40.0, 60.0), "A": (60.0, 180.0, 40.0), "B": (40.0, 60.0, 180.0)}
BELIEVED = (250.0, -30.0, -120.0)
small = some.tuples(*[some.floats(-0.2, 0.2)] * 2)
tilt = some.tuples(*[some.floats(-0.005, 0.005)] * 2)


def machine(axis: AxisName, errors: dict[str, float], *, reversed_: bool = False) -> Machine:
    """Built beside where the control believes its axis."""
    believed = Place(BELIEVED)
    return Machine(axis, believed.with_errors(errors), believed, reversed_=reversed_)


def measure(machine: Machine, axis: AxisName, carries: Carried, shift: Any = (0.0, 0.0, 0.0)) -> AxisErrors:
    """A run on it: centres and nominal ball seen from where the kinematics has the axis now."""
    home = np.array(machine.believed.at)
    ball = home + FAR[axis]
    look = machine.table if carries is Carried.TABLE else machine.head
    seen = [Position(angle, tuple((look(ball + shift, angle) - home).tolist())) for angle in ANGLES]
    return estimate(axis, seen, FAR[axis], carries=carries, reversed_=machine.reversed_)


def found(run: AxisErrors) -> dict[str, float]:
    return {name: each.value for name, each in run.errors.items()}


@pytest.mark.parametrize("carries", list(Carried))
@pytest.mark.parametrize("axis", ["A", "B", "C"])
@pytest.mark.parametrize("reversed_", [False, True])
def test_entered_it_is_gone(axis: AxisName, carries: Carried, reversed_: bool) -> None:
    true = dict(zip(ERRORS[axis], (0.05, -0.03, 0.0021, -0.0013), strict=True))
    built = machine(axis, true, reversed_=reversed_)
    before = measure(built, axis, carries)
    assert found(before) == pytest.approx(true, abs=2e-5)
    assert before.scatter_before > 0.03
    after = measure(built.corrected({name: v for name, v in found(before).items() if name[1] in "XYZ"}), axis, carries)
    assert [v for name, v in found(after).items() if name[1] in "XYZ"] == pytest.approx([0, 0], abs=2e-5)
    expected = built.corrected(found(before))
    ball = np.array(BELIEVED) + FAR[axis]
    for angle in ANGLES:
        if carries is Carried.TABLE:
            off = expected.table(ball, angle) - expected.table_expected(ball, angle)
        else:
            off = expected.head(ball, angle) - ball
        assert off.tolist() == pytest.approx([0, 0, 0], abs=3e-5), angle


@given(small, tilt, some.sampled_from(list(Carried)), some.sampled_from(["A", "B", "C"]))
def test_whatever_is_wrong_with_it(places: Any, tilts: Any, carries: Carried, axis: AxisName) -> None:
    true = dict(zip(ERRORS[axis], [*places, *tilts], strict=True))
    run = measure(machine(axis, true), axis, carries, (0.01, -0.02, 0.005))
    assert found(run) == pytest.approx(true, abs=1e-4)
    assert run.shift is not None
    assert [each.value for each in run.shift] == pytest.approx([0.01, -0.02, 0.005], abs=5e-5)
    assert run.scatter_after < 5e-5


@pytest.mark.parametrize("carries", list(Carried))
def test_the_wrong_sign_would_double_it(carries: Carried) -> None:
    """So that the tests above cannot pass by a machine that does not care."""
    built = machine("C", {"EX0C": 0.05})
    assert found(measure(built.corrected({"EX0C": -0.05}), "C", carries))["EX0C"] == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize("carries", list(Carried))
@pytest.mark.parametrize("reversed_", [False, True])
@pytest.mark.parametrize("axis", ["A", "B", "C"])
def test_backlash_lags_behind_the_way_it_came(axis: AxisName, carries: Carried, reversed_: bool) -> None:
    built = machine(axis, {}, reversed_=reversed_)
    ball = np.array(BELIEVED) + FAR[axis]
    seen = []
    for angle in ANGLES:
        for approach in (1, -1):
            stands = angle - approach * 0.002 / 2  # the axis has not quite got there
            if carries is Carried.TABLE:
                centre = built.table(ball, stands)
            else:
                centre = (
                    built.head(ball, stands) + built.table_expected(ball, angle) - built.table_expected(ball, stands)
                )
            seen.append(Position(angle, tuple((centre - BELIEVED).tolist()), approach))
    run = estimate(axis, seen, FAR[axis], carries=carries, reversed_=reversed_)
    assert run.backlash is not None
    assert run.backlash.value == pytest.approx(0.002, abs=1e-6)
    assert list(found(run).values()) == pytest.approx([0] * 4, abs=1e-5)


@pytest.mark.parametrize("carries", list(Carried))
@pytest.mark.parametrize("reversed_", [False, True])
def test_an_angle_error_has_the_sign_of_the_axis(carries: Carried, reversed_: bool) -> None:
    """At 45° the axis stands 0.01° too far in the direction in which it counts."""
    built = machine("C", {}, reversed_=reversed_)
    ball = np.array(BELIEVED) + FAR["C"]
    seen = []
    for angle in ANGLES:
        stands = angle + (0.01 if angle == 45 else 0)
        if carries is Carried.TABLE:
            centre = built.table(ball, stands)
        else:
            centre = built.head(ball, stands) + built.table_expected(ball, angle) - built.table_expected(ball, stands)
        seen.append(Position(angle, tuple((centre - BELIEVED).tolist())))
    run = estimate("C", seen, FAR["C"], carries=carries, reversed_=reversed_, ball_known=True)
    assert 0.004 < run.angle_error < 0.01


@pytest.mark.parametrize("said", [True, False])
@pytest.mark.parametrize(
    ("is_so", "sent_as", "fits"),
    [("reversed", "table", "reversed"), ("head", "table", "head"), ("table", "head", "table")],
)
def test_what_was_sent_as_something_else_is_refused_and_reported(
    is_so: str, sent_as: str, fits: str, said: bool
) -> None:
    built = machine("C", {"EX0C": 0.02}, reversed_=is_so == "reversed")
    ball = np.array(BELIEVED) + FAR["C"]
    look = built.head if is_so == "head" else built.table
    seen = [Position(angle, tuple((look(ball, angle) - BELIEVED).tolist())) for angle in ANGLES]
    with pytest.raises(NoAxis) as caught:
        estimate("C", seen, FAR["C"] if said else None, carries=Carried(sent_as))
    assert (caught.value.fault, caught.value.fits) == (AxisFault.ELSEWHERE, fits)


@pytest.mark.parametrize("ball", [None, (5.0, 0.0, 40.0)])
def test_centres_at_one_place_are_no_table(ball: Any) -> None:
    with pytest.raises(NoAxis) as caught:
        estimate("C", [Position(angle, (5.0, 0.0, 40.0)) for angle in ANGLES], ball)
    assert caught.value.fault in {AxisFault.ON_AXIS, AxisFault.ELSEWHERE}
    with pytest.raises(NoAxis) as caught:
        estimate("C", [Position(angle, (180.0, 0.0, 40.0)) for angle in ANGLES], None if ball is None else (180, 0, 40))
    assert (caught.value.fault, caught.value.fits) == (AxisFault.ELSEWHERE, "head")
