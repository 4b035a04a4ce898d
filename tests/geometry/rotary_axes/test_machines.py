"""A simulated machine with a wrong pivot, from touches through the API to its corrected control: table and head."""

from typing import Any

import numpy as np
import pytest

from app.core.rotary.axis import ERRORS, AxisName
from tests.core.rotary.machine import Machine, Place
from tests.geometry.rotary_axes.bench import RADIUS, enter, take, touches
from tests.shop import Shop

ANGLES = (-90.0, -30.0, 0.0, 45.0, 90.0, 135.0)
BALL = {"A": (60.0, 180.0, 40.0), "B": (40.0, 60.0, 180.0), "C": (180.0, 40.0, 60.0)}
PLACE = (250.0, -30.0, -120.0)


def run_of(machine: Machine, carries: str) -> dict[str, Any]:
    """Raw touches in the coordinates of the machine, as the probe gives them."""
    letter = machine.letter
    ball = [p + b for p, b in zip(PLACE, BALL[letter], strict=True)]
    look = machine.table if carries == "table" else machine.head
    return {
        "axis": letter,
        "ball": ball,
        "position": list(machine.believed.at),
        "seen_from": "machine",
        "carries": carries,
        "reversed": machine.reversed_,
        "positions": [{"angle": angle, "touches": touches(look(ball, angle).tolist())} for angle in ANGLES],
    }


@pytest.mark.parametrize("carries", ["table", "head"])
@pytest.mark.parametrize(("axis", "reversed_"), [("A", False), ("B", True), ("C", False), ("C", True)])
def test_what_is_to_be_entered_makes_the_machine_true(
    shop: Shop, carries: str, axis: AxisName, reversed_: bool
) -> None:
    believed = Place(PLACE)
    true = dict(zip(ERRORS[axis], (0.031, -0.017, 0.0, 0.0), strict=True))
    machine = Machine(axis, believed.with_errors(true), believed, reversed_=reversed_)
    before = take(shop, axes=[run_of(machine, carries)], ball_radius=RADIUS)
    found = before["axes"][0]
    errors = {name: each["value"] for name, each in found["errors"].items()}
    assert errors == pytest.approx(true, abs=1e-5)
    assert found["carries"] == carries
    move = [b - a for a, b in zip(found["position_before"], found["position_after"], strict=True)]
    assert move == pytest.approx(found["correction"], abs=1e-8)
    assert found["position_after"] == pytest.approx(machine.built.at, abs=1e-5)  # the axis is where it is said to go
    enter(shop, before)
    corrected = machine.corrected(errors)
    after = take(shop, axes=[run_of(corrected, carries)], ball_radius=RADIUS)
    left = after["axes"][0]
    assert left["scatter_before"] < 1e-4 < found["scatter_before"]
    assert [each["value"] for each in left["errors"].values()] == pytest.approx([0] * 4, abs=2e-5)
    assert np.abs(left["position_before"]).tolist() == pytest.approx(np.abs(corrected.believed.at).tolist())


@pytest.mark.parametrize(("sent", "hint"), [({"carries": "head"}, "table"), ({"reversed": True}, "reversed direction")])
def test_what_was_sent_as_something_else_is_reported(shop: Shop, sent: dict[str, Any], hint: str) -> None:
    machine = Machine("C", Place(PLACE), Place(PLACE))
    problem = take(shop, 422, axes=[run_of(machine, "table") | sent], ball_radius=RADIUS)
    assert "mm from the positions to which axis C would turn the sphere" in problem["detail"]
    assert hint in problem["what_to_do"]


def test_coordinates_of_the_machine_need_the_place_of_the_axis(shop: Shop) -> None:
    run = run_of(Machine("C", Place(PLACE), Place(PLACE)), "table")
    del run["position"]
    problem = take(shop, 422, axes=[run], ball_radius=RADIUS)
    assert "where the kinematics has the axis now" in str(problem["errors"])
    problem = take(shop, 422, axes=[run | {"seen_from": "axis"}], ball_radius=RADIUS)
    assert problem["what_to_do"]
