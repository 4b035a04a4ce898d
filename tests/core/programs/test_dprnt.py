"""The printing macros, run by a small control of eight digits: what they print is what the bridge reads."""

import math
import re
from typing import Any

import pytest

from app.core.printed_line import LineReader, Printed
from app.core.programs.dprnt import REGISTERS, dprnt_programs
from app.core.ring import Slot, Unit

ARGUMENTS = {"A": 1, "B": 2, "C": 3, "E": 8, "S": 19, "T": 20, "V": 22, "W": 23}


class Stopped(Exception):
    """An alarm of the program."""


class Control:
    """User macros B, as far as these programs need them. padded: leading zeros are printed as blanks."""

    def __init__(self, text: str, *, inch: bool = False, padded: bool = True) -> None:
        self.inch, self.padded = inch, padded
        self.programs: dict[int, list[str]] = {}
        lines: list[str] = []
        for line in text.splitlines():
            if found := re.match(r"O(\d+)", line):
                lines = self.programs.setdefault(int(found[1]), [])
            lines.append(re.sub(r"\(.*?\)", "", line).strip() if "#3000" not in line else line)
        self.common: dict[int, float] = {}
        self.output = b""
        self.is_open = False

    def call(self, program: int, arguments: dict[int, float]) -> None:
        own: dict[int, float | None] = dict.fromkeys(range(1, 34)) | arguments
        lines = self.programs[program]
        at = 0
        while (block := re.sub(r"^N\d+ ", "", lines[at])) != "M99":
            at += 1
            if found := re.match(r"(?:IF \[(.+)\] )?GOTO (\d+)$", block):
                if found[1] is None or self.value(found[1], own):
                    [at] = [place for place, line in enumerate(lines) if line.startswith(f"N{found[2]} ")]
            elif found := re.match(r"#3000=\d+\((.+)\)", block):
                raise Stopped(found[1])
            elif found := re.match(r"G65 P(\d+)(.*)", block):
                given = re.findall(r"([A-Z])(#\[.+?\]|#\d+)", found[2])
                self.call(int(found[1]), {ARGUMENTS[letter]: self.value(text, own) for letter, text in given})
            elif block in {"POPEN", "PCLOS"}:
                self.is_open = block == "POPEN"
            elif found := re.match(r"DPRNT\[(.+)\]$", block):
                assert self.is_open
                self.output += self.printed(found[1], own)
            elif found := re.match(r"#(\d+|\[.+?\])=(.+)$", block):
                where = round(self.value(found[1], own))
                (own if where < 34 else self.common)[where] = self.value(found[2], own)
            else:
                assert not block or block.startswith("O") or block == "%", block

    def printed(self, text: str, own: dict[int, float | None]) -> bytes:
        def number(found: re.Match[str]) -> str:
            value, before, after = own[int(found[1])] or 0.0, int(found[2]), int(found[3])
            shown = f"{abs(value):.{after}f}"
            assert len(shown.split(".", maxsplit=1)[0]) <= before, (
                f"#{found[1]} = {value:g} has more than {before} digits"
            )
            width = before + (after + 1 if after else 0)
            return ("-" if value < 0 else " " * self.padded) + (shown.rjust(width) if self.padded else shown)

        return re.sub(r"#(\d+)\[(\d)(\d)\]", number, text).replace("*", " ").encode() + b"\r\n"

    def variable(self, number: float, own: dict[int, float | None]) -> float | None:
        where = round(number)
        clock = {3001: 86_400_123.0, 3011: 20_261_123.0, 3012: 134_501.0, 4006: 20.0 if self.inch else 21.0}
        return own[where] if where < 34 else clock.get(where, self.common.get(where))

    def value(self, expression: str, own: dict[int, float | None]) -> Any:
        text = re.sub(r" (EQ|NE|GT|GE|LT|LE) ", lambda found: f" {COMPARED[found[1]]} ", expression)
        if empty := re.fullmatch(r"#(\d+) == #0", text):
            return self.variable(int(empty[1]), own) is None
        text = text.replace("[", "(").replace("]", ")")
        text = re.sub(r"#(\d+)", r"R(\1)", text).replace("#(", "R(")
        names = {
            "R": lambda number: self.variable(number, own) or 0.0,
            "FIX": math.trunc,
            "ROUND": lambda value: math.copysign(math.floor(abs(value) + 0.5), value),
            "ABS": abs,
        }
        assert re.fullmatch(r"[\w\s.+\-*/<>=()]*", text), text
        found = eval(text, {"__builtins__": {}}, names)  # noqa: S307 - the text is our own
        return found if isinstance(found, bool) else float(f"{found:.8g}")


COMPARED = {"EQ": "==", "NE": "!=", "GT": ">", "GE": ">=", "LT": "<", "LE": "<="}


def measure(control: Control, size: float, **other: float) -> None:
    given = {"C": 1.0, "T": 3.0, "W": 41.0, "V": size} | other
    control.call(9825, {ARGUMENTS[letter]: value for letter, value in given.items()})


@pytest.mark.parametrize("padded", [True, False])
@pytest.mark.parametrize("inch", [True, False])
def test_each_reading_is_one_line(*, inch: bool, padded: bool) -> None:
    control = Control(dprnt_programs(), inch=inch, padded=padded)
    sizes = [40.00124, -0.50006, 0.0, 999.99991, 3.99996]
    for size in sizes:
        measure(control, size, E=1_234_567.0, S=2.0)
    reader = LineReader()
    found = reader.feed(control.output)
    assert reader.damaged == 0
    decimals = 5 if inch else 4
    epoch = found[0].epoch
    time = float(13 * 3600 + 45 * 60 + 1)
    unit = Unit.INCH if inch else Unit.MM
    assert found == [
        Printed(epoch, unit, Slot(number, 1, float(f"{size:.{decimals}f}"), 1_234_567, 41, 3, 2, time))
        for number, size in enumerate(sizes, start=1)
    ]
    assert 1 <= epoch <= 999_999


def test_the_last_eight_come_again_at_the_end() -> None:
    control = Control(dprnt_programs())
    for number in range(11):
        measure(control, 40 + number / 1000)
    first = LineReader().feed(control.output)
    control.output = b""
    control.call(9826, {})
    assert LineReader().feed(control.output) == first[3:]
    few = Control(dprnt_programs(900, 8000))
    few.call(8001, {})
    assert few.output == b""
    assert set(few.common) <= set(range(900, 900 + REGISTERS))


@pytest.mark.parametrize(("size", "characteristic"), [(10_000.0, 1.0), (40.0, 0.0)])
def test_wrong_arguments_stop_the_program(size: float, characteristic: float) -> None:
    with pytest.raises(Stopped, match="INBAND WRONG ARGUMENT"):
        measure(Control(dprnt_programs()), size, C=characteristic)


def test_the_sequence_ends_with_seven_digits() -> None:
    control = Control(dprnt_programs())
    measure(control, 40.0)
    control.common[701] = 9_999_999.0
    with pytest.raises(Stopped, match="NEW EPOCH"):
        measure(control, 40.0)


@pytest.mark.parametrize(
    ("register", "program"), [(499, 9825), (530, 9825), (603, 9825), (930, 9825), (700, 0), (700, 9998)]
)
def test_variables_that_do_not_last_or_belong_to_other_texts_are_refused(register: int, program: int) -> None:
    with pytest.raises(ValueError, match=r"is|leave"):
        dprnt_programs(register, program)
