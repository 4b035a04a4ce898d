"""Damage that a number takes on its way, one at a time and without chance."""

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
