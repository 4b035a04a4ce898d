"""The line of DPRNT: whole lines are read whatever stands around them, damaged ones never."""

import random
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.printed_line import END, START, LineReader, Printed, line_of, read_line
from app.core.ring import Slot, Unit
from tests.core.damage import with_neighbours_exchanged, with_one_bit_of_it_changed, with_one_digit_changed

SLOT = Slot(12, 1, 40.0012, 3, 7, 3, 0, 43_200.0)
LINE = line_of(Printed(481_516, Unit.MM, SLOT))
slots = st.builds(
    Slot,
    sequence=st.integers(1, 9_999_999),
    characteristic=st.integers(1, 9999),
    measured=st.integers(-99_999_999, 99_999_999).map(lambda steps: steps / 10_000),
    in_effect=st.integers(0, 9_999_999),
    part=st.integers(0, 9_999_999),
    tool=st.integers(0, 9999),
    status=st.integers(0, 3),
    time=st.none() | st.integers(0, 86_399).map(float),
)


def body(line: str) -> str:
    return line.removeprefix(START).removesuffix(END)


def test_the_line_of_the_description() -> None:
    assert LINE == "INBLINE E481516 N12 C1 V40.0012 I3 P7 T3 S0 H43200 U1 K4 FIN"


@given(slots, st.integers(1, 999_999), st.sampled_from(list(Unit)))
def test_what_is_written_is_read(slot: Slot, epoch: int, unit: Unit) -> None:
    printed = Printed(epoch, unit, slot)
    assert read_line(body(line_of(printed))) == printed


def test_padding_as_controls_print_it() -> None:
    printed = Printed(481_516, Unit.MM, replace(SLOT, measured=-0.5, time=None))
    padded = body(line_of(printed)).replace("V-0.5000", "V-     .5000").replace("N12 ", "N     12. ")
    assert read_line(padded) == printed


def padded(printed: Printed) -> str:
    """A line as a control prints it that fills every number up with blanks."""
    digits = {"E": 6, "N": 7, "C": 4, "V": 9, "I": 7, "P": 7, "T": 4, "S": 1, "H": 5, "U": 1, "K": 2}
    return re.sub(
        r"([A-Z])(-?)([0-9.]+)(?= )",
        lambda found: f"{found[1]}{found[2] or ' '}{found[3]:>{digits[found[1]]}}",
        line_of(printed),
    )


def lines() -> Iterator[tuple[Printed, str]]:
    """Readings whose every number 97 divides in turn, as what is ten times as large or a tenth has the same remainder then."""
    ordinary = [
        Printed(481_516, Unit.MM, SLOT),
        Printed(7, Unit.INCH, replace(SLOT, measured=-0.5, time=None, sequence=9_999_999, status=3)),
        Printed(1, Unit.MM, Slot(1, 1, 0.0, 0, 0, 0, 0, None)),
        Printed(999_999, Unit.INCH, Slot(70_123, 9999, -999.99999, 9_999_999, 9_999_999, 9999, 1, 86_399.0)),
    ]
    divided = [Printed(97, Unit.MM, SLOT), Printed(9700, Unit.INCH, SLOT)]
    for name, number in product(("sequence", "characteristic", "in_effect", "part", "tool"), (97, 970, 1940)):
        divided.append(Printed(481_516, Unit.MM, replace(SLOT, **{name: number})))
    sizes = [
        Printed(481_516, unit, replace(SLOT, measured=measured + step / steps))
        for unit, measured, steps in ((Unit.MM, 40.0, 10_000), (Unit.INCH, -0.5, 100_000))
        for step in range(97)
    ]
    for printed in (*ordinary, *divided):
        yield printed, padded(printed)
    for printed in (*ordinary, *divided, *sizes):
        yield printed, line_of(printed)


def test_no_wrong_digit_passes() -> None:
    for printed, line in lines():
        assert read_line(body(line)) == printed, line
        for wrong in with_one_digit_changed(body(line)):
            assert read_line(wrong) is None, wrong


@pytest.mark.parametrize("damaged", [with_neighbours_exchanged, with_one_bit_of_it_changed])
def test_no_exchange_and_no_wrong_bit_passes(damaged: Callable[[str], Iterator[str]]) -> None:
    """Or it says the same: a blank that moved, a 0 in front of a number."""
    for printed, line in lines():
        for wrong in damaged(body(line)):
            assert read_line(wrong) in {None, printed}, wrong


@pytest.mark.parametrize(
    "wrong",
    [
        LINE.replace("N12 ", "N12"),  # one blank, no more and no less
        LINE.replace("N12 ", "N12  "),
        LINE.replace(" FIN", "FIN"),
        LINE.replace("E4", "  E4"),
        LINE.replace("40.0012", "40.001200"),
        LINE.replace("N12", "N1 2"),
        LINE.replace("H43200", "H43200.0"),
        LINE.replace("C1", "C"),
        LINE.replace("C1", "C-"),
    ],
)
def test_a_line_of_another_form_is_none(wrong: str) -> None:
    assert read_line(body(LINE)) is not None
    assert read_line(body(wrong)) is None


def test_lines_are_found_among_everything_else_however_they_are_cut() -> None:
    chance = random.Random(3)
    wanted = [Printed(7, Unit.MM, replace(SLOT, sequence=number)) for number in range(1, 60)]
    stream = b""
    for printed in wanted:
        line = line_of(printed)
        stream += chance.choice([b"", b"%\r\n", b"\x12", b"\0\0\0", bytes(chance.randbytes(9)), b"\r\nG1 X5 FIN\r\n"])
        stream += chance.choice([b"", f"{line[: chance.randrange(1, len(line) - 3)]}\r\n".encode()])
        stream += line.encode() + chance.choice([b"\r\n", b"\n", b"", b"\n\r\r"])
    reader, found = LineReader(), []
    while stream:
        size = chance.randrange(1, 40)
        found += reader.feed(stream[:size])
        stream = stream[size:]
    assert [each for each in found if each not in wanted] == []
    assert found == wanted


def test_seven_bits_with_parity_through_a_port_of_eight() -> None:
    data = bytes(byte | (0x80 if byte.bit_count() % 2 else 0) for byte in f"{LINE}\r\n".encode())
    assert LineReader().feed(data) == [Printed(481_516, Unit.MM, SLOT)]


def test_damaged_lines_are_counted() -> None:
    reader = LineReader()
    assert reader.feed(f"{LINE[:30]}\r\n{LINE.replace('N12', 'N13')}\n{LINE}\n".encode()) == [
        Printed(481_516, Unit.MM, SLOT)
    ]
    assert reader.damaged == 2
    for _ in range(100):
        assert reader.feed(b"INBLINE" + b" X" * 200) == []
    assert reader.damaged == 102
