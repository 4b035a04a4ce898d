"""Mail and decisions that the programs of the ring take: applied once, at the right tool, or refused with the reason."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.programs.ring_settings import RingControl
from app.core.ring import (
    Answer,
    Register,
    Told,
    Unit,
    mail_registers,
)
from tests.chance import examples
from tests.core.programs.controls import Stopped
from tests.core.programs.ring_bridge import block, cut_off, every_control, mail, ready
from tests.core.programs.ring_machines import Machine


# --- corrections
@every_control
@examples(40)
@given(
    expected=st.integers(-20_000, 20_000).map(lambda n: n / 10_000),
    step=st.integers(-100_000, 100_000).map(lambda n: n / 1_000_000),
    number=st.integers(1, 9_999_999),
)
def test_mail_of_the_bridge_is_taken_once(control: RingControl, expected: float, step: float, number: int) -> None:
    made, bridge = ready(control)
    made.put_wear(3, expected)
    value = round(expected + step, 6)
    bridge.post(mail(made, number, expected, value))
    for _ in range(3):
        made.take()
    found = block(made)
    assert (found.answered, found.answer, found.applied) == (number, Answer.APPLIED, number)
    assert found.offset == pytest.approx(value, abs=6e-4)
    assert made.wear(3) == found.offset
    made.put_wear(3, 0.5)  # the operator, later: nobody sets it back
    made.take()
    assert made.wear(3) == 0.5


def _watch(made: Machine, seen: set[float]) -> Callable[[], None]:
    return lambda: seen.add(round(made.wear(3), 4))


@every_control
@examples(15)
@given(data=st.data())
def test_the_power_may_go_at_any_block_of_a_correction(control: RingControl, data: st.DataObject) -> None:
    made, bridge = ready(control)
    offset, number = 0.0, 0
    for _ in range(data.draw(st.integers(1, 4))):
        number += data.draw(st.integers(1, 9))
        before, offset = offset, round(offset + data.draw(st.integers(-90, 90)) / 1000, 4)
        bridge.post(mail(made, number, before, offset))
        seen: set[float] = set()
        made.seen = _watch(made, seen)
        for _ in range(data.draw(st.integers(0, 3))):
            cut_off(made, data.draw(st.integers(1, 140)), made.take)
            if block(made).answered == number:
                assert made.wear(3) == pytest.approx(offset, abs=1e-6)
        made.take()
        assert seen <= {before, offset}
        assert (block(made).answered, block(made).answer, block(made).applied) == (number, Answer.APPLIED, number)
        assert made.wear(3) == pytest.approx(offset, abs=1e-6)


@every_control
def test_one_run_takes_the_mail_of_every_tool(control: RingControl) -> None:
    """The bridge posts the next one when it has seen the answer; the program waits for it, and not for ever."""
    made, bridge = ready(control)
    orders = [mail(made, 7, 0.0, -0.01), mail(made, 2, 0.0, 0.02, tool=5), mail(made, 8, -0.01, -0.02)]
    bridge.post(orders.pop(0))
    taken: list[int] = []

    def look() -> None:
        found = block(made)
        if found.answered == found.mail.number and orders:
            taken.append(found.answered)
            bridge.post(orders.pop(0))

    made.waited = look
    made.take()
    found = block(made)
    assert (taken, found.answered, found.answer, found.applied) == ([7, 2], 8, Answer.APPLIED, 8)
    assert made.wear(3) == pytest.approx(-0.02)
    assert made.wear(5) == pytest.approx(0.02)
    last = 6 if control is RingControl.HAAS else 2
    assert made.pauses == 2 + last
    made.take()
    assert made.pauses == 2 + last, "without mail the program waits for none"


# --- decisions
@every_control
def test_a_stop_reaches_the_program_that_waits_for_the_decision(control: RingControl) -> None:
    made, bridge = ready(control, decision_time=3.0)

    def decide(action: Told) -> None:
        bridge.look()
        made.write(Register.ACTION, action)
        made.write(Register.DECIDED, len(bridge.stored))

    made.waited = lambda: decide(Told.NONE) if made.pauses == 2 else None
    made.send(40.0, 1)
    assert made.pauses == 2
    made.waited = lambda: decide(Told.HOLD)
    made.send(40.0, 2)  # goes on: a person decides
    assert made.registers()[Register.ACTION] == Told.NONE
    made.waited = lambda: decide(Told.STOP)
    with pytest.raises(Stopped, match="INBAND SAYS STOP"):
        made.send(40.0, 3)
    assert made.registers()[Register.ACTION] == Told.NONE, "once"
    bridge.look()
    assert [slot.part for slot in bridge.stored] == [1, 2, 3]


@every_control
def test_a_decision_that_comes_late_stops_before_the_next_part(control: RingControl) -> None:
    made, _ = ready(control, decision_time=2.0)
    made.send(40.0, 1)
    assert made.pauses == 4, "nobody has decided: it goes on"
    made.write(Register.ACTION, Told.STOP)
    made.write(Register.DECIDED, 1)
    with pytest.raises(Stopped, match="INBAND SAYS STOP"):
        made.take()
    made.write(Register.ACTION, Told.STOP)
    with pytest.raises(Stopped, match="INBAND SAYS STOP"):
        made.send(40.0, 2)
    assert block(made).written == 2, "the reading is sent before"


@every_control
def test_the_program_may_stop_without_a_decision_or_on_a_hold(control: RingControl) -> None:
    made, _ = ready(control, decision_time=1.0, decision_stops=True, hold_stops=True)
    with pytest.raises(Stopped, match="HAS NOT DECIDED"):
        made.send(40.0, 1)
    made.write(Register.ACTION, Told.HOLD)
    made.write(Register.DECIDED, 2)
    with pytest.raises(Stopped, match="INBAND SAYS HOLD"):
        made.send(40.0, 2)


@every_control
def test_an_offset_that_somebody_has_changed_is_reported_and_left(control: RingControl) -> None:
    made, bridge = ready(control)
    made.put_wear(3, 0.05)
    bridge.post(mail(made, 4, 0.0, -0.01))
    made.take()
    found = block(made)
    assert (found.answered, found.answer, found.applied) == (4, Answer.OFFSET_DIFFERS, 0)
    assert found.offset == made.wear(3) == 0.05


@every_control
@pytest.mark.parametrize(
    ("changed", "answer"),
    [
        ({"tool": 0}, Answer.NOT_POSSIBLE),
        ({"tool": 100}, Answer.NOT_POSSIBLE),
        ({"edge": 7}, Answer.NOT_POSSIBLE),
        ({"parameter": 3}, Answer.NOT_POSSIBLE),
        ({"value": 0.1010}, Answer.STEP_TOO_LARGE),
        ({"value": -0.1010}, Answer.STEP_TOO_LARGE),
    ],
)
def test_mail_that_cannot_be_applied_is_answered_with_the_reason(
    control: RingControl, changed: dict[str, Any], answer: Answer
) -> None:
    made, bridge = ready(control)
    bridge.post(mail(made, 4, 0.0, **({"value": -0.01} | changed)))
    made.take()
    assert (block(made).answered, block(made).answer, block(made).applied) == (4, answer, 0)
    assert made.wear(3) == 0


def test_a_tool_that_a_sinumerik_does_not_have_is_not_possible() -> None:
    made, bridge = ready(RingControl.SINUMERIK)
    bridge.post(mail(made, 4, 0.0, -0.01, tool=4))
    made.take()
    assert block(made).answer == Answer.NOT_POSSIBLE


@every_control
def test_the_operator_can_keep_corrections_out(control: RingControl) -> None:
    made, bridge = ready(control)
    made.hold()
    bridge.post(mail(made, 4, 0.0, -0.01))
    made.take()
    assert (block(made).answer, block(made).answered, made.wear(3)) == (Answer.ON_HOLD, 0, 0)
    made.hold(0)
    made.take()
    assert (block(made).answer, block(made).answered, made.wear(3)) == (Answer.APPLIED, 4, -0.01)


@every_control
def test_mail_that_is_being_written_is_left_for_the_next_time(control: RingControl) -> None:
    """Half of the next one, under the number of the last: it was answered, so nothing happens."""
    made, bridge = ready(control)
    bridge.post(mail(made, 4, 0.0, -0.01))
    made.take()
    for place, value in mail_registers(mail(made, 5, -0.01, 0.02))[:-1]:
        made.write(place, value)
        made.take()
    assert (block(made).answered, made.wear(3)) == (4, -0.01)


@every_control
def test_a_control_in_inch_has_limits_in_inch(control: RingControl) -> None:
    made, bridge = ready(control, inch=True, largest_step=0.1)
    assert block(made).unit == Unit.INCH
    bridge.post(mail(made, 1, 0.0, 0.0041))  # 0.104 mm
    made.take()
    assert block(made).answer == Answer.STEP_TOO_LARGE
    made.put_wear(3, 0.0002)  # 5 µm
    bridge.post(mail(made, 2, 0.0, 0.001))
    made.take()
    assert block(made).answer == Answer.OFFSET_DIFFERS
    bridge.post(mail(made, 3, 0.0002, 0.0039))
    made.take()
    assert (block(made).answer, made.wear(3)) == (Answer.APPLIED, 0.0039)
