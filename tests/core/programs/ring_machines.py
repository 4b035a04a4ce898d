"""Three controls that run the programs of the ring block by block: with look-ahead, a clock, wear, and power that goes.

What a program waits for happens only behind a block that stops the look-ahead, as on the machine: a wait without one would
look at the acknowledgement for ever without any time going by.
"""

import ast
import math
import re
from collections.abc import Callable
from functools import cache
from types import CodeType
from typing import Any

from app.core.programs.ring_dialects import RingText
from app.core.programs.ring_settings import Offsets, RingControl, RingSettings
from app.core.programs.ring_texts import joined, texts
from app.core.ring import SIZE
from tests.core.programs.controls import Stopped

ARGUMENTS = dict(
    zip(
        "ABCIJKDEFHMQRSTUVWXYZ",
        (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26),
        strict=True,
    )
)


@cache
def _texts(settings: RingSettings) -> list[RingText]:
    """The programs as they are written once; machines are made by the thousand."""
    return texts(settings)


class PowerLost(Exception):
    """The power went between two blocks."""


class Machine:
    """power: blocks until it goes. seen: called behind every block; waited: called when half a second has gone by."""

    def __init__(self, settings: RingSettings, *, inch: bool = False) -> None:
        self.settings, self.inch = settings, inch
        self.power: int | None = None
        self.seen: Callable[[], None] = lambda: None
        self.waited: Callable[[], None] = lambda: None
        self.dwells = self.pauses = 0
        self.clock = (23, 8, 30, 0, 417)  # day, hour, minute, second, millisecond
        self.load(settings)

    def load(self, settings: RingSettings) -> None:
        raise NotImplementedError

    def remember(self, other: "Machine") -> None:
        """Keep what another machine of its kind keeps over power off."""
        raise NotImplementedError

    def registers(self) -> list[float]:
        """The block, as a bridge reads it."""
        raise NotImplementedError

    def write(self, place: int, value: float) -> None:
        """One register of the block, as a bridge writes it."""
        raise NotImplementedError

    def hold(self, on: float = 1) -> None:
        """The operator lets no correction in, or with 0 lets them in again."""
        raise NotImplementedError

    def wear(self, tool: int) -> float:
        raise NotImplementedError

    def put_wear(self, tool: int, value: float) -> None:
        raise NotImplementedError

    def wears(self) -> dict[Any, float]:
        """Every wear that is not 0, by what this control calls it."""
        raise NotImplementedError

    def call(self, line: str) -> None:
        """A block of the part program that calls one of the programs."""
        raise NotImplementedError

    def set_up(self, applied: int = 0) -> None:
        raise NotImplementedError

    def send(self, measured: float, part: int, *, characteristic: int = 1, tool: int = 3, status: int = 0) -> None:
        raise NotImplementedError

    def take(self) -> None:
        raise NotImplementedError

    def select(self, tool: int) -> None:
        raise NotImplementedError

    def _ran(self) -> None:
        self.seen()
        if self.power is not None:
            self.power -= 1
            if self.power <= 0:
                raise PowerLost

    def _synchronised(self) -> None:
        for _ in range(self.dwells):
            self.pauses += 1
            self.waited()
        self.dwells = 0


def machine(control: RingControl, *, inch: bool = False, **settings: Any) -> Machine:
    """A control with the programs in it, on which nothing was run yet."""
    offsets = {RingControl.SINUMERIK: Offsets.EDGES, RingControl.FANUC: Offsets.LATHE, RingControl.HAAS: Offsets.MILL}
    kind = {RingControl.SINUMERIK: Sinumerik, RingControl.FANUC: Fanuc, RingControl.HAAS: Haas}[control]
    chosen: dict[str, Any] = {"offsets": offsets[control], "measured": "0", "decision_time": 0.0}
    return kind(RingSettings(control, **(chosen | settings)), inch=inch)


# --- Sinumerik


class _Field:
    """A field of user data or of tool data; whoever counts it in anything but INT is refused."""

    def __init__(self, size: int | None = None) -> None:
        self.size = size
        self.values: dict[Any, float] = {}

    def __getitem__(self, index: Any) -> float:
        self._look(index)
        return self.values.get(index, 0.0)

    def __setitem__(self, index: Any, value: float) -> None:
        self._look(index)
        self.values[index] = float(value)

    def _look(self, index: Any) -> None:
        for one in index if isinstance(index, tuple) else (index,):
            assert type(one) is int, f"{one} counts a field"
            assert one >= 0
            assert self.size is None or one < self.size


class Sinumerik(Machine):
    """With the tools 3 and 5, of two edges each."""

    def load(self, settings: RingSettings) -> None:
        self.programs: dict[str, list[str]] = {}
        for text in _texts(settings):
            if found := re.match(r"PROC (\w+)", text.text):
                self.programs[found[1]] = text.text.splitlines()
        self.fields = {"INBAND": _Field(SIZE), "INBAND_EFFECT": _Field(100), "R": _Field()}
        self.fields |= {f"TC_DP{number}": _Field() for number in range(12, 16)}
        self.names: dict[str, Any] = {
            "__builtins__": {}, "ABS": abs, "TRUNC": math.trunc, "ROUND": lambda value: math.floor(value + 0.5),
            "P_TOOLEXIST": {tool: tool in {3, 5} for tool in range(100)}, "P_TOOLND": dict.fromkeys(range(100), 2),
        } | self.fields  # fmt: skip

    def remember(self, other: Machine) -> None:
        assert isinstance(other, Sinumerik)
        for name, field in self.fields.items():
            field.values = dict(other.fields[name].values)

    def registers(self) -> list[float]:
        field, first = self._block()
        return [field[first + place] for place in range(SIZE)]

    def write(self, place: int, value: float) -> None:
        field, first = self._block()
        field[first + place] = value

    def _block(self) -> tuple[_Field, int]:
        first = self.settings.first_register
        return self.fields["R" if first else "INBAND"], first

    def hold(self, on: float = 1) -> None:
        self.fields["INBAND_EFFECT"][0] = on

    def wear(self, tool: int) -> float:
        return self.fields["TC_DP12"][tool, 1]

    def put_wear(self, tool: int, value: float) -> None:
        self.fields["TC_DP12"][tool, 1] = value

    def wears(self) -> dict[Any, float]:
        fields = {name: field for name, field in self.fields.items() if name.startswith("TC_DP")}
        return {
            (name, *place): value for name, field in fields.items() for place, value in field.values.items() if value
        }

    def set_up(self, applied: int = 0) -> None:
        self.call(f"INBAND_SETUP({applied})")

    def send(self, measured: float, part: int, *, characteristic: int = 1, tool: int = 3, status: int = 0) -> None:
        self.call(f"INBAND_READING({characteristic},{measured:.6f},{tool},{part},0,{status})")

    def take(self) -> None:
        self.call("INBAND_CORRECTION")

    def select(self, tool: int) -> None:
        self.call(f"INBAND_TOOL({tool})")

    def call(self, line: str) -> None:
        found = re.fullmatch(r"(\w+)(?:\((.*)\))?", line)
        assert found is not None
        lines = self.programs[found[1]]
        self.names |= {"P_GG": {13: 1 if self.inch else 2}, "MN_SCALING_SYSTEM_IS_METRIC": 0 if self.inch else 1}
        words = ("A_DAY", "A_HOUR", "A_MINUTE", "A_SECOND", "A_MSECOND")
        self.names |= dict(zip(words, self.clock, strict=True))
        self.own: dict[str, float] = {}
        self.kinds: dict[str, str] = {}
        self.skipped = False
        self.message = ""
        header = re.fullmatch(r"PROC \w+(?:\((.*)\))?", lines[0])
        assert header is not None
        for declared, given in zip(
            filter(None, (header[1] or "").split(",")), filter(None, (found[2] or "").split(",")), strict=True
        ):
            kind, name = declared.split()
            self.kinds[name] = kind
            self._set(name, self._value(given))
        at = 1
        while (block := lines[at].partition(";")[0].strip()) != "M17":
            target = self._do(block)
            at = at + 1 if target is None else self._found(lines, at, *target)
            self._ran()
        self._synchronised()

    def _found(self, lines: list[str], at: int, word: str, label: str) -> int:
        place = lines.index(f"{label}:")
        assert (place > at) == (word == "GOTOF"), f"{word} {label} looks the wrong way"
        return place

    def _do(self, block: str) -> tuple[str, str] | None:
        if self.skipped:
            self.skipped = block != "ENDIF"
            return None
        if found := re.fullmatch(r"(?:IF (.+) )?(GOTO[FB]) (\w+)", block):
            return (found[2], found[3]) if found[1] is None or self._value(found[1]) else None
        if found := re.fullmatch(r"IF (.+)", block):
            self.skipped = not self._value(found[1])
        elif found := re.fullmatch(r"DEF (INT|REAL) (\w+)", block):
            self.kinds[found[2]] = found[1]
            self.own[found[2]] = 0
        elif found := re.fullmatch(r"(\$?\w+)(?:\[(.+)\])?=(.+)", block):
            if found[2] is None:
                self._set(found[1], self._value(found[3]))
            else:
                index = self._value(f"({found[2]})")
                self.fields[found[1].removeprefix("$")][index] = self._value(found[3])
        elif found := re.fullmatch(r'MSG\("(.{1,100})"\)', block):
            self.message = found[1]
        elif re.fullmatch(r"SETAL\(65[0-8]\d\d\)", block):
            raise Stopped(self.message)
        elif block == "STOPRE":
            self._synchronised()
        elif re.fullmatch(r"G4 F0\.5", block):
            self.dwells += 1
        else:
            assert not block or block == "ENDIF" or re.fullmatch(r"\w+:", block), block
        return None

    def _set(self, name: str, value: float) -> None:
        self.own[name] = math.floor(value + 0.5) if self.kinds[name] == "INT" else float(value)

    def _value(self, expression: str) -> Any:
        return eval(_python(expression), self.names, self.own)  # noqa: S307 - the texts are our own


@cache
def _python(expression: str) -> CodeType:
    """An expression of this control, as Python has it."""
    text = expression.replace("<>", "!=").replace(" AND ", " and ").replace("FALSE", "False").replace("$", "")
    assert re.fullmatch(r"[\w\s.+\-*/<>=!()\[\],]*", text), text
    return compile(text, expression, "eval")


# --- Fanuc


@cache
def _tree(expression: str) -> ast.expr:
    """An expression of this control, as Python parses it; V is a variable."""
    text = expression.replace("[", "(").replace("]", ")").replace("#(", "V(")
    text = re.sub(r"#(\d+)", r"V(\1)", text)
    for word, sign in (("GE", ">="), ("LE", "<="), ("GT", ">"), ("LT", "<"), ("EQ", "==")):
        text = text.replace(f" {word} ", sign)
    return ast.parse(text, mode="eval").body


@cache
def _without_comment(line: str) -> str:
    block = re.sub(r"^N\d+\s*", "", line)
    return block if "#3000" in block else re.sub(r"\([^)]*\)", "", block).strip()


class Fanuc(Machine):
    """digits: significant digits of each result. Wear is kept with as many decimals as such a control has."""

    digits, decimals = 8, 4

    def load(self, settings: RingSettings) -> None:
        text = joined(settings, [text for text in _texts(settings) if text.key != "call"])
        self.programs: dict[int, list[str]] = {}
        lines: list[str] = []
        for line in text.splitlines():
            if found := re.match(r"O(\d+)", line):
                lines = self.programs.setdefault(int(found[1]), [])
            lines.append(line)
        self.variables: dict[int, float | None] = {}

    def remember(self, other: Machine) -> None:
        assert isinstance(other, Fanuc)
        self.variables = dict(other.variables)

    def registers(self) -> list[float]:
        first = self.settings.first_register
        return [self.variables.get(first + place) or 0.0 for place in range(SIZE)]

    def write(self, place: int, value: float) -> None:
        self.variables[self.settings.first_register + place] = self._digits(value)

    def hold(self, on: float = 1) -> None:
        self.variables[self.settings.first_effect] = on

    def wear(self, tool: int) -> float:
        return self.variables.get(self.settings.wears[0].parameter + tool) or 0.0

    def put_wear(self, tool: int, value: float) -> None:
        self.variables[self.settings.wears[0].parameter + tool] = value

    def wears(self) -> dict[Any, float]:
        first = self.settings.first_register
        return {place: value for place, value in self.variables.items() if value and not first <= place < first + 200}

    def set_up(self, applied: int = 0) -> None:
        self.call(f"G65 P9820 A{applied}.")

    def send(self, measured: float, part: int, *, characteristic: int = 1, tool: int = 3, status: int = 0) -> None:
        told = f" S{status}." if status else ""
        self.call(f"G65 P9821 C{characteristic}. V{measured:.6f} T{tool}. W{part}.{told}")

    def take(self) -> None:
        self.call("G65 P9822")

    def select(self, tool: int) -> None:
        self.call(f"G65 P9823 T{tool}.")

    def call(self, line: str) -> None:
        found = re.fullmatch(r"G65 P(\d+)((?: [A-Z]\S+)*)", line)
        assert found is not None
        lines = self.programs[int(found[1])]
        given = {ARGUMENTS[word[0]]: self._value(word[1:]) for word in found[2].split()}
        self.own: dict[int, float | None] = dict.fromkeys(range(1, 34)) | given
        at = 0
        while (block := _without_comment(lines[at])) != "M99":
            target = self._do(block)
            at = at + 1 if target is None else self._found(lines, target)
            self._ran()
        self._synchronised()

    def _found(self, lines: list[str], target: str) -> int:
        places = [at for at, line in enumerate(lines) if re.match(rf"N{target}(\s|$)", line)]
        assert len(places) == 1, target
        return places[0]

    def _do(self, block: str) -> str | None:
        if found := re.fullmatch(r"#3000=\d+\((.{1,26})\)", block):
            raise Stopped(found[1])
        if found := re.fullmatch(r"(?:IF \[(.+)\] )?GOTO (\d+)", block):
            return found[2] if found[1] is None or self._value(found[1]) else None
        if found := re.fullmatch(r"#(\d+|\[.+?\])=(.+)", block):
            where = int(found[1]) if found[1].isdecimal() else self._index(found[1])
            self._keep(where, self._value(found[2]))
        else:
            self._other(block)
        return None

    def _other(self, block: str) -> None:
        if block == "G4 P500":
            self.dwells += 1
        elif block == "G53":
            self._synchronised()
        else:
            assert not block or re.match(r"O\d{4}\b", block), block

    def _keep(self, where: int, value: float | None) -> None:
        if where < 34:
            self.own[where] = value
        else:
            wear = any(wear.parameter < where <= wear.parameter + 200 for wear in self.settings.wears)
            self.variables[where] = round(value or 0.0, self.decimals) if wear else value

    def _index(self, text: str) -> int:
        value = float(self._value(text))
        assert abs(value - round(value)) < 1e-6, text
        return round(value)

    def _digits(self, value: float) -> float:
        return float(f"{value:.{self.digits}g}")

    def _variable(self, number: float | None) -> float | None:
        where = round(number or 0)
        if where < 34:
            return self.own.get(where)
        if 3000 < where < 5000:
            day, hour, minute, second, millisecond = self.clock
            today, now = 20_261_100.0 + day, 10_000.0 * hour + 100 * minute + second
            unit = 20.0 if self.inch else 21.0
            return {3001: 86_400.0 + millisecond, 3011: today, 3012: now, 4006: unit}[where]
        return self.variables.get(where)

    def _value(self, expression: str) -> Any:
        return self._calculated(_tree(expression))

    def _calculated(self, node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=int() | float() as value):
                return float(value)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -(self._calculated(operand) or 0.0)
            case ast.Call(func=ast.Name(id="V"), args=[number]):
                return self._variable(self._calculated(number))
            case ast.Call(func=ast.Name(id=name), args=[argument]):
                value = self._calculated(argument) or 0.0
                if name == "ABS":
                    return abs(value)
                return float(math.trunc(value) if name == "FIX" else math.copysign(math.floor(abs(value) + 0.5), value))
            case ast.BinOp(left=left, op=op, right=right):
                a, b = (self._calculated(left) or 0.0), (self._calculated(right) or 0.0)
                calculate = {
                    ast.Add: float.__add__,
                    ast.Sub: float.__sub__,
                    ast.Mult: float.__mul__,
                    ast.Div: float.__truediv__,
                }
                return self._digits(calculate[type(op)](a, b))
            case ast.Compare(left=left, ops=[ast.Eq()], comparators=[right]):
                return self._calculated(left) == self._calculated(right)  # an empty variable is no 0
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                a, b = (self._calculated(left) or 0.0), (self._calculated(right) or 0.0)
                return {ast.Lt: a < b, ast.LtE: a <= b, ast.Gt: a > b, ast.GtE: a >= b}[type(op)]
            case _:
                raise AssertionError(ast.unparse(node))


class Haas(Fanuc):
    """A mill with double precision. Its look-ahead stands still behind three empty blocks, while it is limited."""

    digits, decimals = 15, 4
    limited, empty = False, 0

    def call(self, line: str) -> None:
        super().call(line)
        assert not self.limited, "the look-ahead is still limited"

    def _other(self, block: str) -> None:
        self.empty = self.empty + 1 if block == ";" else 0
        if block in {"G103 P0", "G103 P1"}:
            self.limited = block == "G103 P1"
        elif block == "G04 P0.5":
            self.dwells += 1
        elif block == ";":
            if self.limited and self.empty >= 3:
                self._synchronised()
        else:
            assert not block or re.match(r"O\d{5}\b", block), block
