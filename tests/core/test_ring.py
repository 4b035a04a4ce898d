"""The register block that NC program and bridge share."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, product

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.core.ring import (
    FIRST_SLOT,
    LAYOUT,
    MAIL_WEIGHTS,
    MODULUS,
    SIZE,
    SLOT_SIZE,
    SLOT_WEIGHTS,
    STEPS,
    Answer,
    BlockError,
    Field,
    Mail,
    Register,
    Slot,
    Unit,
    in_steps,
    mail_registers,
    read_block,
    read_mail,
    read_slot,
    slot_of,
    slot_registers,
    to_fetch,
    went_back,
)
from tests.core.damage import SIXTY, with_one_bit_changed

units = st.sampled_from(list(Unit))
SLOTS = st.builds(
    Slot,
    sequence=st.integers(1, 9_999_999),
    characteristic=st.integers(1, 999),
    measured=st.integers(-9_999_999, 9_999_999).map(lambda steps: steps / 100_000),
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


@given(SLOTS, units)
def test_a_slot_is_read_as_it_was_written(slot: Slot, unit: Unit) -> None:
    assert read_slot(slot_registers(slot, unit), unit) == replace(slot, measured=in_steps(slot.measured, unit))


@given(SLOTS, SLOTS, st.integers(0, SLOT_SIZE - 1))
def test_a_slot_half_written_over_another_does_not_count(before: Slot, after: Slot, written: int) -> None:
    assume(before.sequence != after.sequence)
    registers = slot_registers(before)
    registers[Field.SEQ] = 0.0  # the NC clears it first, and writes it last
    registers[1 : 1 + written] = slot_registers(after)[1 : 1 + written]
    assert read_slot(registers) is None


@pytest.mark.parametrize("value", [1e305, -1e12, float("inf"), float("nan")])
@pytest.mark.parametrize("place", Field)
def test_a_number_that_no_program_writes_does_not_count(place: Field, value: float) -> None:
    registers = slot_registers(reading(7))
    registers[place] = value
    assert read_slot(registers) is None


@given(SLOTS, units)
def test_eight_digits_are_enough(slot: Slot, unit: Unit) -> None:
    rounded = [float(f"{value:.8g}") for value in slot_registers(slot, unit)]
    assert read_slot(rounded, unit) == replace(slot, measured=in_steps(slot.measured, unit))


def test_readings_are_fetched_in_order_until_the_first_that_is_not_complete() -> None:
    registers = block_of(*(reading(sequence) for sequence in range(9, 16)), ack=8)
    registers[FIRST_SLOT + SLOT_SIZE * slot_of(12) + Field.SEQ] = 0.0
    assert [slot.sequence for slot in to_fetch(read_block(registers), 8)] == [9, 10, 11]
    assert to_fetch(read_block(registers), 11) == ()
    assert [slot.sequence for slot in to_fetch(read_block(registers), 12)] == [13, 14, 15]


def test_a_slot_that_the_counter_does_not_say_yet_waits() -> None:
    """After a power loss between the two, the NC program writes another reading under that number."""
    registers = block_of(*(reading(sequence) for sequence in range(9, 13)), written=11)
    assert [slot.sequence for slot in to_fetch(read_block(registers), 8)] == [9, 10, 11]
    assert to_fetch(read_block(registers), 11) == ()


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
        (block_of(layout=1), "older Inband .layout 1, this one has 2.*written again.*docs/how-to/ring-programs.md"),
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
    assert (found.mail, found.mail_fits) == (mail, True)
    found = read_block(block_of(**{place.name: value for place, value in written} | {"mail_value": 0.0138}))
    assert not found.mail_fits


@pytest.mark.parametrize("answer", [Answer.APPLIED, Answer.CHECK_WRONG, Answer.ON_HOLD])
def test_an_answer_that_contradicts_itself_is_none(answer: Answer) -> None:
    """Applied is said twice: by the answer, and by the number of the last correction in the offsets."""
    assert read_block(block_of(answered=18, applied=18, answer=answer)).answer_holds
    assert not read_block(block_of(answered=18, applied=17, answer=answer)).answer_holds
    assert read_block(block_of(answered=18, applied=17, answer=Answer.OFFSET_DIFFERS)).answer_holds


# --- damage: one thing at a time, all of it

MAILS = [
    (Unit.MM, Mail(18, 3, 1, 12, 0.02, 0.0139)),
    (Unit.MM, Mail(4, 3, 0, 2000, 0.0, -0.01)),
    (Unit.MM, Mail(9_999_999, 99, 1, 12_000, -1.2345, -1.3)),
    (Unit.INCH, Mail(1, 1, 1, 2700, 0.00123, -0.00004)),
    (Unit.INCH, Mail(70_123, 50, 9, 15, -0.5, 0.0)),
]
READINGS = [
    (Unit.MM, Slot(12, 1, 40.0012, 3, 812, 3, 0, 30_000.0)),
    (Unit.MM, Slot(9_999_999, 9_999, -999.9999, 9_999_999, 9_999_999, 99, 3, 86_399.0)),
    (Unit.INCH, Slot(1, 7, 1.57481, 0, 0, 0, 1, None)),
    (Unit.INCH, Slot(70_123, 412, 0.0, 17, 41, 64, 2, 0.0)),
]
MAIL = range(Register.MAIL_TOOL, Register.MAIL_NUMBER + 1)
LENGTHS = {Register.MAIL_EXPECTED, Register.MAIL_VALUE}
every_mail = pytest.mark.parametrize(("unit", "mail"), MAILS)
every_reading = pytest.mark.parametrize(("unit", "slot"), READINGS)


def mailbox(mail: Mail, unit: Unit) -> list[float]:
    """The registers with this mail."""
    registers = block_of()
    for place, value in mail_registers(mail, unit):
        registers[place] = value
    assert read_mail(registers, unit) == mail
    return registers


def changed(registers: Sequence[float], place: int, value: float) -> list[float]:
    return [*registers[:place], value, *registers[place + 1 :]]


def shifted(value: float, unit: Unit, *, length: bool) -> Iterator[float]:
    """Up to sixty off: whole numbers, and of a length steps too."""
    for by in SIXTY:
        yield value + by
        if length:
            yield value + by / STEPS[unit]


@every_mail
def test_mail_with_a_register_up_to_sixty_off_does_not_fit(unit: Unit, mail: Mail) -> None:
    registers = mailbox(mail, unit)
    for place in MAIL:
        for value in shifted(registers[place], unit, length=place in LENGTHS):
            assert read_mail(changed(registers, place, value), unit) is None, (Register(place), value)


@every_mail
def test_mail_with_one_bit_changed_does_not_fit_or_is_the_same(unit: Unit, mail: Mail) -> None:
    registers = mailbox(mail, unit)
    for place in MAIL:
        for value in with_one_bit_changed(registers[place]):
            assert read_mail(changed(registers, place, value), unit) in {None, mail}, (Register(place), value)


@every_mail
def test_mail_with_two_registers_exchanged_does_not_fit(unit: Unit, mail: Mail) -> None:
    registers = mailbox(mail, unit)
    for one, other in combinations(MAIL, 2):
        if registers[one] != registers[other]:
            exchanged = changed(changed(registers, one, registers[other]), other, registers[one])
            assert read_mail(exchanged, unit) is None, (Register(one), Register(other))


@pytest.mark.parametrize("unit", Unit)
def test_mail_half_written_over_another_does_not_fit(unit: Unit) -> None:
    """Every choice of registers from the one, the rest from the other."""
    mails = [mail for _, mail in MAILS] + [Mail(19, 3, 1, 12, 0.0139, 0.012), Mail(19, 4, 1, 13, 0.02, 0.0139)]
    for before, after in combinations(mails, 2):
        old, new = (mailbox(replace(mail, expected=in_steps(mail.expected, unit), value=in_steps(mail.value, unit)), unit)
                    for mail in (before, after))  # fmt: skip
        for taken in product([False, True], repeat=len(MAIL)):
            mixed = [*old]
            for place, is_new in zip(MAIL, taken, strict=True):
                mixed[place] = (new if is_new else old)[place]
            if mixed not in (old, new):
                assert read_mail(mixed, unit) is None, (before, after, taken)


@every_reading
def test_a_slot_with_a_register_up_to_sixty_off_does_not_count(unit: Unit, slot: Slot) -> None:
    registers = slot_registers(slot, unit)
    assert read_slot(registers, unit) == slot
    for place in Field:
        for value in shifted(registers[place], unit, length=place is Field.MEASURED):
            assert read_slot(changed(registers, place, value), unit) is None, (place, value)
    for by in SIXTY:  # both numbers of the slot
        again = changed(changed(registers, Field.SEQ, slot.sequence + by), Field.SEQ2, slot.sequence + by)
        assert read_slot(again, unit) is None, by


@every_reading
def test_a_slot_with_one_bit_changed_does_not_count_or_is_the_same(unit: Unit, slot: Slot) -> None:
    registers = slot_registers(slot, unit)
    for place in Field:
        for value in with_one_bit_changed(registers[place]):
            assert read_slot(changed(registers, place, value), unit) in {None, slot}, (place, value)


@every_reading
def test_a_slot_with_two_registers_exchanged_does_not_count(unit: Unit, slot: Slot) -> None:
    registers = slot_registers(slot, unit)
    for one, other in combinations(Field, 2):
        if registers[one] != registers[other]:
            exchanged = changed(changed(registers, one, registers[other]), other, registers[one])
            assert read_slot(exchanged, unit) is None, (one, other)


@pytest.mark.parametrize("number", [1, 2, 7, 255, 4_711, 99_990])
def test_registers_that_are_all_the_same_are_no_reading_and_no_mail(number: float) -> None:
    for unit in Unit:
        assert read_slot([float(number)] * SLOT_SIZE, unit) is None
        assert read_mail([float(number)] * SIZE, unit) is None


@pytest.mark.parametrize("weights", [SLOT_WEIGHTS, MAIL_WEIGHTS], ids=["slot", "mail"])
def test_two_changes_of_up_to_sixty_never_cancel_each_other(weights: dict[str, int]) -> None:
    assert all(MODULUS % divisor for divisor in range(2, 317)), "a change fits only where a prime divides it"
    for one, other in combinations([1, *weights.values()], 2):  # 1: the check sum itself
        seen = {one * by % MODULUS for by in SIXTY}
        assert not seen & {-other * by % MODULUS for by in SIXTY}, (one, other)
