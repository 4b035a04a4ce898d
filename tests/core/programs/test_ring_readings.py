"""Readings that the programs of the ring write, against `app.core.ring`: every block may be the last one."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.programs.ring_settings import RingControl
from app.core.ring import (
    SLOTS,
    Register,
    Slot,
    to_fetch,
    went_back,
)
from tests.chance import examples
from tests.core.programs.controls import Stopped
from tests.core.programs.ring_bridge import Bridge, block, cut_off, every_control, mail, ready
from tests.core.programs.ring_machines import Fanuc, machine

MORNING = 8 * 3600 + 30 * 60.0
sizes = st.integers(-9_990_000, 9_990_000).map(lambda n: n / 10_000) | st.floats(-999, 999).map(
    lambda size: round(size, 5)
)


@every_control
@examples(40)
@given(
    measured=sizes,
    part=st.integers(0, 9_999_999),
    tool=st.integers(0, 99),
    status=st.integers(0, 3),
    characteristic=st.integers(1, 9_999),
    written=st.integers(0, 9_999_998),
    in_effect=st.integers(0, 99_999),
)
def test_what_the_program_writes_is_what_the_bridge_reads(
    control: RingControl,
    measured: float,
    part: int,
    tool: int,
    status: int,
    characteristic: int,
    written: int,
    in_effect: int,
) -> None:
    made, _ = ready(control)
    for register in (Register.WRITTEN, Register.ACK):
        made.write(register, written)
    made.write(Register.APPLIED, in_effect)
    if tool:
        made.select(tool)
    made.send(measured, part, characteristic=characteristic, tool=tool, status=status)
    (slot,) = to_fetch(block(made), written)
    expected = Slot(written + 1, characteristic, slot.measured, in_effect if tool else 0, part, tool, status, MORNING)
    assert slot == expected
    assert slot.measured == pytest.approx(measured, abs=5.001e-5)
    assert block(made).written == written + 1


@every_control
def test_a_correction_is_in_effect_from_the_next_selection_of_its_tool(control: RingControl) -> None:
    made, bridge = ready(control)
    made.select(3)
    bridge.post(mail(made, 18, 0.0, -0.0061))
    made.take()
    made.send(40.0, 1)
    made.select(3)
    made.send(40.0, 2)
    made.send(40.0, 3, tool=5)
    bridge.fetch()
    assert [slot.in_effect for slot in bridge.stored] == [0, 18, 0]


def one_more_behind_a_cut(control: RingControl, blocks: int) -> bool:
    """Cut off a reading after so many blocks, then send another one, the bridge looking behind every block; tell if it was cut."""
    made, bridge = ready(control)
    for register in (Register.WRITTEN, Register.ACK):
        made.write(register, 7)
    bridge.stored = [Slot(sequence, 1, 40.0, 0, sequence, 3, 0) for sequence in range(1, 8)]
    made.send(40.008, 8)
    made.send(40.009, 9)
    bridge.look()
    made.seen = bridge.fetch
    cut = cut_off(made, blocks, lambda: made.send(-40.010, 10))
    made.send(40.011, 11)
    parts = [slot.part for slot in bridge.stored]
    assert parts in ([*range(1, 10), 11], [*range(1, 12)])
    assert [slot.sequence for slot in bridge.stored] == list(range(1, len(parts) + 1))
    assert all(abs(slot.measured) == pytest.approx(40 + slot.part / 1000) for slot in bridge.stored[7:])
    assert block(made).written == len(parts)
    assert cut or len(parts) == 11
    return cut


@every_control
def test_the_power_may_go_at_any_block_of_a_reading(control: RingControl) -> None:
    """What counted is stored once, as it was sent; no later reading has its number."""
    blocks = 1
    while one_more_behind_a_cut(control, blocks):
        blocks += 1
    assert blocks > 60


@every_control
@examples(10)
@given(
    cuts=st.lists(st.tuples(st.integers(1, 110), st.sampled_from(["look", "fetch", "none"])), min_size=12, max_size=20)
)
def test_no_reading_is_lost_or_doubled_however_often_the_power_goes(
    control: RingControl, cuts: list[tuple[int, str]]
) -> None:
    made, bridge = ready(control)
    made.waited = bridge.look
    sent: list[int] = []
    for part, (blocks, then) in enumerate(cuts, start=1):
        if not cut_off(made, blocks, lambda part=part: made.send(40 + part / 1000, part)):
            sent.append(part)
        if then != "none":
            bridge.fetch()
        if then == "look":
            bridge.acknowledge()
    bridge.look()
    assert [slot.sequence for slot in bridge.stored] == list(range(1, len(bridge.stored) + 1))
    assert all(slot.measured == pytest.approx(40 + slot.part / 1000, abs=1e-5) for slot in bridge.stored)
    parts = [slot.part for slot in bridge.stored]
    assert parts == sorted(set(parts))
    assert set(sent) <= set(parts)


@every_control
def test_a_full_ring_waits_until_the_bridge_has_fetched(control: RingControl) -> None:
    made, bridge = ready(control)
    for part in range(1, SLOTS + 1):
        made.send(40.0, part)
    assert made.pauses == 0
    made.waited = lambda: bridge.look() if made.pauses == 3 else None
    made.send(40.0, 9)
    assert made.pauses == 3
    bridge.look()
    assert [slot.part for slot in bridge.stored] == list(range(1, 10))


@every_control
def test_a_bridge_that_does_not_fetch_stops_the_machine_and_nothing_is_overwritten(control: RingControl) -> None:
    made, bridge = ready(control, time_out=4.0)
    for part in range(1, SLOTS + 1):
        made.send(40.0, part)
    before = made.registers()
    with pytest.raises(Stopped, match="NOT FETCHING"):
        made.send(40.0, 9)
    assert made.pauses == 8
    assert made.registers() == before
    bridge.look()
    assert len(bridge.stored) == SLOTS


@every_control
def test_or_it_writes_on_and_the_gap_is_seen(control: RingControl) -> None:
    made, bridge = ready(control, time_out=1.0, go_on=True)
    for part in range(1, SLOTS + 2):
        made.send(40.0, part)
    assert block(made).written == SLOTS + 1
    assert "are lost" in (went_back(block(made), 0, bridge.epoch) or "")


@every_control
def test_an_acknowledgement_of_what_was_never_written_does_not_open_the_ring(control: RingControl) -> None:
    """A bridge that did not see the new epoch would let the program overwrite everything."""
    made, _ = ready(control, time_out=1.0)
    made.write(Register.ACK, 500)
    with pytest.raises(Stopped, match="NOT FETCHING"):
        made.send(40.0, 1)


@every_control
@pytest.mark.parametrize(
    "wrong",
    [{"part": 10_000_000}, {"characteristic": 0}, {"tool": 100}, {"status": 4}, {"measured": 10_000.0}, {"part": -1}],
)
def test_what_the_bridge_could_never_read_is_refused_at_once(control: RingControl, wrong: dict[str, Any]) -> None:
    made, _ = ready(control)
    before = made.registers()
    with pytest.raises(Stopped, match="WRONG ARGUMENT"):
        made.send(**{"measured": 40.0, "part": 1} | wrong)
    assert made.registers() == before


@pytest.mark.parametrize("control", [RingControl.FANUC, RingControl.HAAS])
def test_a_size_that_the_cycle_did_not_fill_in_is_no_reading(control: RingControl) -> None:
    made, _ = ready(control)
    with pytest.raises(Stopped, match="WRONG ARGUMENT"):
        made.call("G65 P9821 C1. V#510 T3. W1.")
    assert block(made).written == 0


@every_control
def test_after_the_last_number_a_new_epoch_is_asked_for(control: RingControl) -> None:
    made, _ = ready(control)
    for register in (Register.WRITTEN, Register.ACK):
        made.write(register, 9_999_999)
    with pytest.raises(Stopped, match="NEW EPOCH"):
        made.send(40.0, 1)


@every_control
@pytest.mark.parametrize("run", ["send", "take"])
def test_nothing_runs_before_the_set_up_or_in_another_unit(control: RingControl, run: str) -> None:
    made = machine(control)

    def begin() -> None:
        made.send(40.0, 1) if run == "send" else made.take()

    with pytest.raises(Stopped, match="NOT SET UP"):
        begin()
    made.set_up()
    Bridge(made).post(mail(made, 1, 0.0, 0.01))
    made.inch = not made.inch
    with pytest.raises(Stopped, match="OTHER UNIT"):
        begin()
    assert (block(made).written, block(made).answered) == (0, 0)


@examples(40)
@given(measured=sizes, part=st.integers(0, 9_999_999), written=st.integers(0, 9_999_998))
def test_seven_digits_are_enough_for_the_check_sum(measured: float, part: int, written: int) -> None:
    """Older controls calculate with single precision: whole numbers are exact up to 16,777,216 only."""
    made, _ = ready(RingControl.FANUC)
    assert isinstance(made, Fanuc)
    made.digits = 7
    for register in (Register.WRITTEN, Register.ACK):
        made.write(register, written)
    made.send(measured, part)
    (slot,) = to_fetch(block(made), written)
    assert (slot.sequence, slot.part) == (written + 1, part)
