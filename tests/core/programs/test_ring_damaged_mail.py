"""Mail that was changed on its way: nothing is set, or what the bridge has sent."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.programs.ring_settings import RingControl
from app.core.ring import (
    MODULUS,
    STEPS,
    Answer,
    Mail,
    Register,
)
from tests.chance import examples
from tests.core.damage import SIXTY, with_one_bit_changed
from tests.core.programs.ring_bridge import block, every_control, mail, parameter, ready, unit_of
from tests.core.programs.ring_machines import Machine, Sinumerik

LENGTHS = {Register.MAIL_EXPECTED, Register.MAIL_VALUE}
MAIL = range(Register.MAIL_TOOL, Register.MAIL_NUMBER + 1)
FEW_SHIFTS = (-60, -12, -1, 1, 4, 10, 11)
FEW_BITS = (0, 40, 49, 51, 52, 54, 62, 63)


def take_damaged(control: RingControl, damage: Callable[[float, float], float]) -> None:
    """Mail of a tool, each of its registers in turn changed on its way: nothing is set, or what the bridge has sent.

    damage: of a number, and the step in which it counts; what stands there then.
    """
    inch = control is RingControl.HAAS  # one of the three
    made, bridge = ready(control, inch=inch)
    sent = mail(made, 4, 0.0, 0.003 if inch else -0.01)
    before = ready(control, inch=inch)[0]
    for place in MAIL:
        made.remember(before)
        bridge.post(sent)
        right = made.registers()[place]
        step = 1 / STEPS[unit_of(made)] if place in LENGTHS else 1.0
        made.write(place, damage(right, step))
        made.take()
        found = block(made)
        if (
            found.answer == Answer.APPLIED and found.answered
        ):  # it did no harm: the program takes whole numbers, and steps
            assert abs(made.registers()[place] - right) < 0.51 * step
            assert (made.wears(), found.answered) == (wear_of(made, sent), 4)
        else:
            assert (made.wears(), found.answered, found.applied) == ({}, 0, 0), Register(place)
            assert found.answer == Answer.CHECK_WRONG or made.registers()[Register.MAIL_NUMBER] < 0.5


def wear_of(control: Machine, sent: Mail) -> dict[Any, float]:
    """The one wear that such mail sets."""
    place = ("TC_DP12", 3, 1) if control.settings.control is RingControl.SINUMERIK else parameter(control) + 3
    return {place: sent.value}


@every_control
@pytest.mark.parametrize(
    "by", [pytest.param(by, marks=() if by in FEW_SHIFTS else pytest.mark.long) for by in (*SIXTY, MODULUS - 1)]
)
def test_mail_with_a_register_off_is_refused(control: RingControl, by: int) -> None:
    take_damaged(control, lambda number, step: number + by * step)


@every_control
@pytest.mark.parametrize(
    "at", [pytest.param(at, marks=() if at in FEW_BITS else pytest.mark.long) for at in range(64 + 32)]
)
def test_mail_with_one_bit_changed_is_refused_or_the_same(control: RingControl, at: int) -> None:
    take_damaged(control, lambda number, _: [*with_one_bit_changed(number)][at])


@every_control
def test_a_tool_number_off_is_refused_where_that_tool_is_there(control: RingControl) -> None:
    """The finding that asked for all this: 3 became 7 by one bit, and tool 7 got the correction of tool 3."""
    made, bridge = ready(control)
    if isinstance(made, Sinumerik):
        made.names["P_TOOLEXIST"][7] = True
    bridge.post(mail(made, 4, 0.0, -0.01))
    made.write(Register.MAIL_TOOL, 7.0)
    made.take()
    assert (block(made).answer, block(made).answered, made.wears()) == (Answer.CHECK_WRONG, 0, {})
    bridge.post(mail(made, 4, 0.0, -0.01))  # it is written again
    made.take()
    assert (block(made).answer, block(made).answered, made.wear(3)) == (Answer.APPLIED, 4, -0.01)


@every_control
@examples(15)
@given(
    number=st.integers(1, 9_999_999),
    value=st.integers(-90, 90),
    damaged=st.integers(0, len(MAIL) - 1),
    to=st.floats(-20_000_000, 20_000_000),
)
def test_the_programs_and_the_bridge_agree_on_what_fits(
    control: RingControl, number: int, value: int, damaged: int, to: float
) -> None:
    """Whatever lies there: the program takes it exactly where `read_mail` does."""
    made, bridge = ready(control)
    bridge.post(mail(made, number, 0.0, value / 1000))
    made.write(MAIL[damaged], to)
    found = block(made)
    made.take()
    if found.mail_fits:
        assert block(made).answer != Answer.CHECK_WRONG
    else:
        assert (block(made).answered, made.wears()) == (0, {})
