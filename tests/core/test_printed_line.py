"""The line of DPRNT: whole lines are read whatever stands around them, damaged ones never."""

import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.printed_line import END, START, LineReader, Printed, line_of, read_line
from app.core.ring import Slot, Unit

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


@pytest.mark.parametrize("letter", list("ENCVIPTSHUK"))
def test_no_wrong_digit_passes(letter: str) -> None:
    at = body(LINE).index(letter)
    for place in range(at + 1, len(body(LINE))):
        digit = body(LINE)[place]
        if digit == " ":
            break
        if digit.isdigit():
            for other in "0123456789".replace(digit, ""):
                assert read_line(body(LINE)[:place] + other + body(LINE)[place + 1 :]) is None


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
