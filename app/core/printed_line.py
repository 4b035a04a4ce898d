"""The line that an NC program prints for each reading by DPRNT: for controls that answer nothing, they only print.

    INBLINE E481516 N12 C1 V40.0012 I3 P7 T3 S0 H43200 U1 K4 FIN

E epoch, N sequence, C characteristic, V measured size, I correction in effect, P part, T tool, S status, H second of the day (-1
unknown), U unit, K check sum; all but E, U and K as in a slot of `app.core.ring`. A control pads numbers with blanks, prints ``-``
in front of the padding, and ends lines as its parameters say: only start word and end mark count.

The check sum is the remainder by 97 of a weighted sum of the remainders. It finds every single wrong digit, and any two that
changed places. It cannot find a number that became exactly ten times as large, or a tenth, where 97 divides it. So the form
counts too: one blank is in front of each letter and of the end mark, and a size has 4 decimals in mm, 5 in inch; a blank that
became 0, a 0 that became a blank, or a point that moved breaks it. One of a hundred lines that are wrong in several places, or
have lost a digit, may pass.
"""

import re
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from app.core.ring import STEPS, Slot, Unit

START: Final = "INBLINE"
"""No word that a control calculates with, and none that a program text contains by chance."""
END: Final = "FIN"
MODULUS: Final = 97
LONGEST: Final = 240
"""Characters between start word and end mark."""
LETTERS: Final = "ENCVIPTSHUK"
WEIGHTS: Final = {"E": 1, "N": 3, "C": 5, "V": 1, "I": 7, "P": 11, "T": 13, "S": 17, "H": 19, "U": 23}
DECIMALS: Final = {Unit.MM: 4, Unit.INCH: 5}
"""Decimals of a size: a step of the check sum is one of the last."""
_FIELDS = re.compile(
    "".join(f" {letter}( *(?:- *)?{'[0-9]*[.][0-9]{4,5}' if letter == 'V' else '[0-9]+[.]?'})" for letter in LETTERS)
    + " "
)
_FRAME = re.compile(rf"{START}((?:(?!{START})[ -~]){{1,{LONGEST}}}?){END}")
_NEWEST = re.compile(rf"{START}[ -~]{{0,{LONGEST}}}\Z")


class Printed(NamedTuple):
    """A line that was read: the reading, the epoch of its sequence, and its unit."""

    epoch: int
    unit: Unit
    slot: Slot


def check_of(printed: Printed) -> int:
    """The check sum of a line: 0 to 96."""
    slot = printed.slot
    numbers = {
        "E": printed.epoch,
        "N": slot.sequence,
        "C": slot.characteristic,
        "V": abs(round(slot.measured * STEPS[printed.unit])),
        "I": slot.in_effect,
        "P": slot.part,
        "T": slot.tool,
        "S": slot.status,
        "H": 0 if slot.time is None else round(slot.time) + 1,
        "U": int(printed.unit),
    }
    minus = slot.measured < 0
    return (sum(WEIGHTS[letter] * (number % MODULUS) for letter, number in numbers.items()) + minus) % MODULUS


def line_of(printed: Printed) -> str:
    """A line as a control prints it that leaves out the padding."""
    slot = printed.slot
    decimals = DECIMALS[printed.unit]
    time = -1 if slot.time is None else round(slot.time)
    return (
        f"{START} E{printed.epoch} N{slot.sequence} C{slot.characteristic} V{slot.measured:.{decimals}f} I{slot.in_effect}"
        f" P{slot.part} T{slot.tool} S{slot.status} H{time} U{int(printed.unit)} K{check_of(printed)} {END}"
    )


def read_line(text: str) -> Printed | None:
    """The line of which this stands between start word and end mark; None where it is damaged.

    >>> read_line(" E7 N 12 C1 V-  0.5000 I0 P3 T2 S0 H-1 U1 K87 ").slot.measured
    -0.5
    """
    found = _FIELDS.fullmatch(text)
    if found is None:
        return None
    parts = {letter: part.replace(" ", "") for letter, part in zip(LETTERS, found.groups(), strict=True)}
    size = parts.pop("V")
    whole = {letter: int(part.removesuffix(".")) for letter, part in parts.items()}
    if whole["U"] not in set(Unit) or min(whole["N"], whole["E"]) < 1 or any(whole[each] < 0 for each in "CIPTSK"):
        return None
    unit = Unit(whole["U"])
    if whole["H"] < -1 or len(size.partition(".")[2]) != DECIMALS[unit]:
        return None
    time = None if whole["H"] < 0 else float(whole["H"])
    numbers = (whole["I"], whole["P"], whole["T"], whole["S"])
    printed = Printed(whole["E"], unit, Slot(whole["N"], whole["C"], float(size), *numbers, time))
    return printed if check_of(printed) == whole["K"] else None


@dataclass(slots=True)
class LineReader:
    """Finds lines in a stream of bytes. damaged: those that began and were not complete, or did not fit their check sum."""

    damaged: int = 0
    _rest: str = field(default="", init=False)

    def feed(self, data: bytes) -> list[Printed]:
        """The lines that these bytes complete, in their order.

        The eighth bit is taken off: it is the parity where a control sends seven bits and the port takes eight.
        """
        text = self._rest + bytes(byte & 0x7F for byte in data).decode("ascii")
        text = re.sub(r"[\0\x11-\x14\x7f]", "", text)  # filling, XON and XOFF, tape marks
        lines, last = [], 0
        for found in _FRAME.finditer(text):
            self.damaged += text.count(START, last, found.start())
            printed = read_line(found[1])
            if printed is None:
                self.damaged += 1
            else:
                lines.append(printed)
            last = found.end()
        rest = text[last:]
        newest = _NEWEST.search(rest)
        kept = newest.start() if newest else max(0, len(rest) - len(START))
        self.damaged += rest.count(START, 0, kept)
        self._rest = rest[kept:]
        return lines
