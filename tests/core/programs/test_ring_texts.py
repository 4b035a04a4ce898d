"""Texts of the programs of the ring: what a control takes, and registers that others use."""

import re

import pytest

from app.core.parameters import MachineType
from app.core.programs.ring_settings import WEARS, Offsets, RingControl, RingError, RingSettings, offsets_of
from app.core.programs.ring_texts import joined, texts
from app.core.ring import (
    to_fetch,
)
from tests.core.programs.ring_bridge import block, every_control, mail, ready
from tests.core.programs.ring_machines import machine


@pytest.mark.parametrize(("control", "offsets"), list(WEARS))
def test_the_texts_stay_within_what_the_controls_take(control: RingControl, offsets: Offsets) -> None:
    made = RingSettings(control, offsets, measured="#510")
    everything = joined(made, texts(made))
    assert everything.isascii()
    assert everything == everything.upper()
    lines = everything.splitlines()
    if control is RingControl.SINUMERIK:
        assert max(map(len, lines)) <= 160
        assert all(len(word) <= 31 for word in re.findall(r"\w+", everything))
        return
    assert max(map(len, lines)) <= 80
    for comment in re.findall(r"\(([^\n]*)\)", everything):
        assert re.fullmatch(r"[A-Z0-9 .,+\-=#/]+", comment), comment
    used = {int(number) for number in re.findall(r"#(\d+)", re.sub(r"\([^)]*\)", "", everything))}
    assert not used & {*range(100, 200), *range(550, 600)}, "the probing cycles have these"
    assert max(len(number.strip(".").replace(".", "")) for number in re.findall(r"\d+\.?\d*", everything)) <= 8


def test_sinumerik_may_keep_the_block_in_r_parameters() -> None:
    made, bridge = ready(RingControl.SINUMERIK, first_register=700)
    made.send(40.0123, 812)
    bridge.look()
    bridge.post(mail(made, 4, 0.0, -0.01))
    made.take()
    made.select(3)
    made.send(40.0, 813)
    bridge.look()
    assert [(slot.part, slot.in_effect) for slot in bridge.stored] == [(812, 0), (813, 4)]
    assert "definition" not in {text.key for text in texts(made.settings)}


@pytest.mark.parametrize(
    ("control", "offsets", "given", "code"),
    [
        (RingControl.FANUC, Offsets.EDGES, {}, "offsets"),
        (RingControl.FANUC, Offsets.LATHE, {"first_register": 450}, "taken"),
        (RingControl.FANUC, Offsets.LATHE, {"first_register": 900}, "too_high"),
        (RingControl.HAAS, Offsets.MILL, {"first_register": 10_500}, "taken"),
        (RingControl.SINUMERIK, Offsets.EDGES, {"first_register": 90}, "taken"),
    ],
)
def test_registers_that_others_use_are_refused(
    control: RingControl, offsets: Offsets, given: dict[str, int], code: str
) -> None:
    with pytest.raises(RingError) as refused:
        RingSettings(control, offsets, **given)  # type: ignore[arg-type]
    assert refused.value.code == code


def test_every_control_and_machine_has_offsets() -> None:
    assert all((control, offsets_of(control, kind)) in WEARS for control in RingControl for kind in MachineType)


@every_control
def test_the_calls_for_the_part_program_run(control: RingControl) -> None:
    """With numbers in place of the words that only a machine knows."""
    made = machine(control, number=7, tool=3, measured="40.0123")
    call = next(text for text in texts(made.settings) if text.key == "call")
    for line in call.text.splitlines():
        if line.startswith(("INBAND_", "G65")):
            made.call(line.replace("$AC_ACTUAL_PARTS", "812").replace("#3901", "812."))
    (slot,) = to_fetch(block(made), 0)
    assert (slot.characteristic, slot.part, slot.tool) == (7, 812, 3)
    assert slot.measured == pytest.approx(40.0123)
