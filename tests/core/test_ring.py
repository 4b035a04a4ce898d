"""The register block that NC program and bridge share."""

from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.core.ring import (
    FIRST_SLOT,
    LAYOUT,
    SIZE,
    SLOT_SIZE,
    BlockError,
    Field,
    Mail,
    Register,
    Slot,
    mail_check,
    mail_registers,
    read_block,
    read_slot,
    slot_of,
    slot_registers,
    to_fetch,
    went_back,
)

SLOTS = st.builds(
    Slot,
    sequence=st.integers(1, 9_999_999),
    characteristic=st.integers(1, 999),
    measured=st.floats(-2000, 2000),
    in_effect=st.integers(0, 99_999),
    part=st.integers(0, 999_999),
    tool=st.integers(0, 999),
    status=st.integers(0, 3),
    time=st.none() | st.integers(0, 86_399).map(float),
)


def block_of(*slots: Slot, **heads: float) -> list[float]:
    """The registers with these slots in place, and these heads."""
    registers = [0.0] * SIZE
    registers[Register.LAYOUT] = LAYOUT
    registers[Register.EPOCH] = 4711
    registers[Register.UNIT] = 1
    for slot in slots:
        first = FIRST_SLOT + SLOT_SIZE * slot_of(slot.sequence)
        registers[first : first + SLOT_SIZE] = slot_registers(slot)
        registers[Register.WRITTEN] = max(registers[Register.WRITTEN], slot.sequence)
    for name, value in heads.items():
        registers[Register[name.upper()]] = value
    return registers


def reading(sequence: int, measured: float = 40.0) -> Slot:
    return Slot(sequence, 1, measured, 0, 812, 3, 0, 30_000.0)


@given(SLOTS)
def test_a_slot_is_read_as_it_was_written(slot: Slot) -> None:
    assert read_slot(slot_registers(slot)) == slot


@given(SLOTS, SLOTS, st.integers(0, SLOT_SIZE - 1))
def test_a_slot_half_written_over_another_does_not_count(before: Slot, after: Slot, written: int) -> None:
    assume(before.sequence != after.sequence)
    registers = slot_registers(before)
    registers[Field.SEQ] = 0.0  # the NC clears it first, and writes it last
    registers[1 : 1 + written] = slot_registers(after)[1 : 1 + written]
    assert read_slot(registers) is None


@given(SLOTS, st.floats(0.0003, 500))
def test_a_size_that_is_not_the_one_written_does_not_count(slot: Slot, difference: float) -> None:
    assume(abs(10_000 * difference) % 9973 > 3 and abs(10_000 * difference) % 9973 < 9970)
    registers = slot_registers(slot)
    registers[Field.MEASURED] += difference
    assert read_slot(registers) is None


@pytest.mark.parametrize("value", [1e305, -1e12, float("inf"), float("nan")])
@pytest.mark.parametrize("place", Field)
def test_a_number_that_no_program_writes_does_not_count(place: Field, value: float) -> None:
    registers = slot_registers(reading(7))
    registers[place] = value
    assert read_slot(registers) is None


@given(SLOTS)
def test_eight_digits_are_enough(slot: Slot) -> None:
    assume(abs(slot.measured) < 1000)
    rounded = [float(f"{value:.8g}") for value in slot_registers(slot)]
    found = read_slot(rounded)
    assert found is not None
    assert found.measured == pytest.approx(slot.measured, abs=5e-5)


def test_readings_are_fetched_in_order_until_the_first_that_is_not_complete() -> None:
    registers = block_of(*(reading(sequence) for sequence in range(9, 16)), ack=8)
    registers[FIRST_SLOT + SLOT_SIZE * slot_of(12) + Field.SEQ] = 0.0
    assert [slot.sequence for slot in to_fetch(read_block(registers), 8)] == [9, 10, 11]
    assert to_fetch(read_block(registers), 11) == ()
    assert [slot.sequence for slot in to_fetch(read_block(registers), 12)] == [13, 14, 15]


@pytest.mark.parametrize(
    ("heads", "stored", "epoch", "words"),
    [
        ({"epoch": 5}, 3, 4711, "epoch 5"),
        ({"written": 2}, 3, 4711, "went back"),
        ({"written": 13}, 3, 4711, "are lost"),
        ({"written": 11}, 3, 4711, None),
        ({"epoch": 5}, 0, None, None),
    ],
)
def test_counters_that_went_back_are_seen(
    heads: dict[str, float], stored: int, epoch: int | None, words: str | None
) -> None:
    found = went_back(read_block(block_of(**heads)), stored, epoch)
    assert found is None if words is None else words in (found or "")


def test_a_complete_slot_counts_as_written_before_the_counter_says_so() -> None:
    """The power went between the two: the NC program sets the counter when it runs the next time."""
    registers = block_of(*(reading(sequence) for sequence in range(1, 4)), written=2)
    assert went_back(read_block(registers), 3, 4711) is None


@pytest.mark.parametrize(
    ("registers", "words"),
    [
        ([0.0] * SIZE, "has not set it up"),
        ([0.0] * 95, "95 were read"),
        (block_of(layout=7), "holds 7"),
        (block_of(written=0.5), "no whole numbers"),
        (block_of(epoch=float("nan")), "no whole numbers"),
    ],
)
def test_registers_that_are_no_block_are_refused_in_words(registers: list[float], words: str) -> None:
    with pytest.raises(BlockError, match=words):
        read_block(registers)


def test_the_number_of_a_correction_is_written_last() -> None:
    mail = Mail(18, 3, 1, 12, 0.02, 0.0139)
    written = mail_registers(mail)
    assert written[-1] == (Register.MAIL_NUMBER, 18.0)
    found = read_block(block_of(**{place.name: value for place, value in written}))
    assert found.mail == mail
    assert found.mail_check == mail_check(mail) != mail_check(replace(mail, value=0.0138))
