"""Set-up of the ring by its programs: a new block, one that was cut off, one of an older layout."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.programs.ring_settings import RingControl
from app.core.ring import (
    BlockError,
    Register,
    Unit,
    mail_registers,
    to_fetch,
    went_back,
)
from tests.chance import examples
from tests.core.programs.controls import Stopped
from tests.core.programs.ring_bridge import Bridge, block, cut_off, every_control, mail, ready
from tests.core.programs.ring_machines import Machine, machine


# --- set-up
@every_control
def test_a_block_is_read_as_soon_as_it_is_set_up(control: RingControl) -> None:
    made = machine(control)
    with pytest.raises(BlockError, match="has not set it up"):
        block(made)
    made.set_up(17)
    found = block(made)
    assert (found.ack, found.written, found.applied, found.answered, found.unit) == (0, 0, 17, 0, Unit.MM)
    assert 1 <= found.epoch <= 999_999
    assert found.slots == ()


@every_control
def test_setting_up_again_changes_nothing(control: RingControl) -> None:
    made, bridge = ready(control)
    made.send(40.0123, 1)
    bridge.look()
    before = made.registers()
    made.clock = (24, 9, 1, 2, 3)
    made.set_up(5)
    assert made.registers() == before


@every_control
@examples(20)
@given(blocks=st.integers(1, 620))
def test_a_set_up_that_was_cut_off_is_done_again_with_another_epoch(control: RingControl, blocks: int) -> None:
    made = machine(control)
    cut = cut_off(made, blocks, made.set_up)
    first = made.registers()[Register.EPOCH]
    if made.registers()[Register.LAYOUT] == 0:
        assert cut
        made.set_up()
        assert block(made).epoch != first or first == 0
    assert block(made).epoch >= 1


@every_control
def test_counters_that_were_lost_get_another_epoch_and_an_empty_mailbox(control: RingControl) -> None:
    made, bridge = ready(control)
    bridge.post(mail(made, 9, 0.0, 0.01))
    made.send(40.0, 1)
    for register in (Register.LAYOUT, Register.WRITTEN):
        made.write(register, 0)
    made.set_up()
    found = block(made)
    assert found.epoch != bridge.epoch
    assert (found.mail.number, found.slots, found.written) == (0, (), 0)
    assert "epoch" in (went_back(found, 1, bridge.epoch) or "")


@every_control
def test_registers_of_somebody_else_are_not_cleared(control: RingControl) -> None:
    made = machine(control)
    made.write(Register.LAYOUT, 12.5)
    before = made.registers()
    with pytest.raises(Stopped, match="IN USE"):
        made.set_up()
    assert made.registers() == before


# --- programs of an older layout
def of_layout_1(control: RingControl, readings: int = 0, acknowledged: int | None = None) -> Machine:
    """A machine whose block was set up, and used, by programs of layout 1; its last correction was 17."""
    made, _ = ready(control)
    for part in range(1, readings + 1):
        made.send(40.0, part)
        made.write(Register.ACK, part)
    for place, value in (
        (Register.ACK, readings if acknowledged is None else acknowledged),
        (Register.APPLIED, 17),
        (Register.ANSWERED, 17),
        (Register.LAYOUT, 1),
    ):
        made.write(place, value)
    for register, number in mail_registers(mail(made, 18, 0.0, -0.01)):
        made.write(register, number)
    return made


@every_control
@pytest.mark.parametrize(
    "run",
    [lambda made: made.send(40.0, 4), lambda made: made.take(), lambda made: made.select(3)],
    ids=["send", "take", "select"],
)
def test_programs_of_this_layout_do_nothing_in_a_block_of_an_older_one(
    control: RingControl, run: Callable[[Machine], None]
) -> None:
    made = of_layout_1(control, readings=3)
    before = made.registers()
    with pytest.raises(Stopped, match="NOT SET UP"):
        run(made)
    assert (made.registers(), made.wears()) == (before, {})


@every_control
def test_the_set_up_takes_an_older_block_over_with_its_counters(control: RingControl) -> None:
    made = of_layout_1(control, readings=11)
    with pytest.raises(BlockError, match="written again"):
        block(made)
    epoch = made.registers()[Register.EPOCH]
    made.set_up()
    found = block(made)
    assert (found.epoch, found.ack, found.written, found.applied, found.answered) == (epoch, 11, 11, 17, 17)
    made.take()
    assert made.wears() == {}, "mail of before is sent again by the bridge"
    made.send(40.0123, 12)
    (slot,) = to_fetch(block(made), 11)
    assert (slot.sequence, slot.measured) == (12, 40.0123)
    Bridge(made).post(mail(made, 18, 0.0, -0.01))
    made.take()
    assert (block(made).answered, made.wear(3)) == (18, -0.01)


@every_control
def test_the_power_may_go_while_an_older_block_is_taken_over(control: RingControl) -> None:
    blocks, cut = 1, True
    while cut:
        made = of_layout_1(control, readings=2)
        cut = cut_off(made, blocks, made.set_up)
        assert made.registers()[Register.LAYOUT] in {1, 2}
        made.set_up()
        assert (block(made).written, block(made).applied) == (2, 17)
        blocks += 1
    assert blocks > 20


@every_control
@pytest.mark.parametrize("counted", [True, False])
def test_an_older_block_with_readings_that_nobody_has_fetched_is_left(control: RingControl, *, counted: bool) -> None:
    """They have another check sum: this bridge could not read them, and would wait for them for ever."""
    made = of_layout_1(control, readings=9, acknowledged=8)
    if not counted:  # the power went between the last two steps
        made.write(Register.WRITTEN, 8)
    before = made.registers()
    with pytest.raises(Stopped, match="OLD READINGS WAIT"):
        made.set_up()
    assert made.registers() == before
