"""Damage that a number or a line takes on its way: each kind whole, without chance."""

import struct
from collections.abc import Iterator

SIXTY = [by for by in range(-60, 61) if by]
"""Shifts of one register, in whole numbers or in steps of a length."""


def with_one_bit_changed(value: float) -> Iterator[float]:
    """The number with each of its 64 bits changed in turn, and with each of its 32 where a control keeps so many."""
    for real, whole in (("<d", "<Q"), ("<f", "<I")):
        [bits] = struct.unpack(whole, struct.pack(real, value))
        for place in range(8 * struct.calcsize(real)):
            [changed] = struct.unpack(real, struct.pack(whole, bits ^ 1 << place))
            yield changed


def with_one_digit_changed(line: str) -> Iterator[str]:
    """The line with each digit changed to each other one in turn."""
    for place, digit in enumerate(line):
        if digit.isdigit():
            for other in "0123456789".replace(digit, ""):
                yield line[:place] + other + line[place + 1 :]


def with_neighbours_exchanged(line: str) -> Iterator[str]:
    """The line with each two neighbours exchanged in turn."""
    for place in range(len(line) - 1):
        yield line[:place] + line[place + 1] + line[place] + line[place + 2 :]


def with_one_bit_of_it_changed(line: str) -> Iterator[str]:
    """The line with each of the seven bits of each character changed in turn."""
    for place, character in enumerate(line):
        for bit in range(7):
            yield line[:place] + chr(ord(character) ^ 1 << bit) + line[place + 1 :]
