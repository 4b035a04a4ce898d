"""The steps of the ring's programs in the words of a control: what Sinumerik, Fanuc and Haas have in common."""

import ast
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from app.core.programs.lines import written
from app.core.programs.ring_settings import RingSettings
from app.core.programs.ring_steps import (
    Alarm,
    Do,
    Filled,
    Goto,
    If,
    Label,
    Let,
    Missing,
    Remark,
    RingProgram,
    Step,
    Stop,
)
from app.core.ring import Field, Register

NUMBERS = {register.name: int(register) for register in Register} | {field.name: int(field) for field in Field}
"""The names of registers, and of the numbers of a slot, in expressions."""


class RingText(NamedTuple):
    """One of the texts that are written. key: `definition`, `setup`, `reading`, `correction`, `tool` or `call`."""

    key: str
    file: str
    text: str


class Dialect(ABC):
    """Words of a control. opening, closing: brackets in calculations; functions: abs, round, trunc; compared: < <= > >=."""

    opening, closing = "(", ")"
    functions: dict[str, str]
    compared: dict[str, str]

    def __init__(self, settings: RingSettings) -> None:
        self.settings = settings
        self.program: RingProgram | None = None

    # --- what differs

    @abstractmethod
    def texts(self, programs: Sequence[RingProgram], comments: Sequence[str]) -> list[RingText]:
        """Every text, in the order in which they go into the control. comments: whose characteristic it is."""

    @abstractmethod
    def joined(self, texts: Sequence[RingText]) -> str:
        """Several texts in one."""

    @abstractmethod
    def name(self, name: str) -> str:
        """A number of the program's own."""

    @abstractmethod
    def cell(self, array: str, index: str) -> str:
        """An element of ``block``, ``effect`` or ``system``."""

    @abstractmethod
    def comment(self, text: str) -> str: ...

    @abstractmethod
    def assigned(self, target: str, value: str) -> str: ...

    @abstractmethod
    def jump(self, condition: str | None, label: str) -> str: ...

    @abstractmethod
    def label(self, name: str) -> str: ...

    @abstractmethod
    def missing(self, argument: str) -> str | None:
        """Condition that the caller has left out an argument; None where it cannot be determined."""

    @abstractmethod
    def filled(self, argument: str) -> str | None: ...

    @abstractmethod
    def do(self, what: Do) -> Iterator[Step | str]:
        """Lines, or steps in their place."""

    @abstractmethod
    def stop(self, alarm: Alarm) -> Iterator[str]: ...

    # --- what is the same

    def lines(self, program: RingProgram) -> list[str]:
        """The steps of a program. A stop that nothing leads to is left out."""
        steps: list[Step | str] = []
        for given in program.steps:
            steps += self.do(given) if isinstance(given, Do) else [given]
        wanted = {step.label for step in steps if isinstance(step, If | Goto | Missing)}
        wanted |= {label for line in steps if isinstance(line, str) for label in _labels_in(line)}
        found: list[str] = []
        for at, step in enumerate(steps):
            before = steps[at - 1] if at else None
            if isinstance(step, Label) and step.name not in wanted:
                continue
            if isinstance(step, Stop) and isinstance(before, Label) and before.name not in wanted:
                continue
            found += [step] if isinstance(step, str) else self._written(step)
        return found

    def _written(self, step: Step) -> Iterator[str]:
        if isinstance(step, Remark):
            yield self.comment(step.text)
        elif isinstance(step, Let):
            line = self.assigned(self.expression(step.target), self.expression(step.value))
            yield self._remarked(
                line, ": ".join(filter(None, (_registers(step.target), step.remark))) or _registers(step.value)
            )
        elif isinstance(step, If):
            yield self._remarked(self.jump(self.expression(step.condition), step.label), _registers(step.condition))
        elif isinstance(step, Goto):
            yield self.jump(None, step.label)
        elif isinstance(step, Label):
            yield self.label(step.name)
        elif isinstance(step, Missing):
            if condition := self.missing(step.argument):
                yield self.jump(condition, step.label)
        elif isinstance(step, Filled):
            yield from filter(None, map(self.filled, step.arguments))
        elif isinstance(step, Stop):
            yield from self.stop(step.alarm)

    def _remarked(self, line: str, remark: str) -> str:
        return f"{line} {self.comment(remark)}" if remark else line

    def expression(self, text: str) -> str:
        """An expression in this control's words."""
        return self._rendered(ast.parse(text, mode="eval").body)

    def _rendered(self, node: ast.expr, strength: int = 0) -> str:
        match node:
            case ast.Constant(value=int() | float() as value):
                return written(value)
            case ast.Name(id=name):
                return str(NUMBERS[name]) if name in NUMBERS else self.name(name)
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as value)):
                return f"-{written(value)}"
            case ast.Call(func=ast.Name(id=name), args=[argument]):
                return f"{self.functions[name]}{self.opening}{self._rendered(argument)}{self.closing}"
            case ast.Subscript(value=ast.Name(id=array), slice=index):
                return self.cell(array, self._rendered(index, 1))
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                sign = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}[type(op)]
                return f"{self._rendered(left)}{self.compared[sign]}{self._rendered(right)}"
            case ast.BinOp(left=left, op=op, right=right):
                sign, own = {ast.Add: ("+", 1), ast.Sub: ("-", 1), ast.Mult: ("*", 2), ast.Div: ("/", 2)}[type(op)]
                last = self._rendered(right, own + (sign in "-/"))
                if sign == "+" and last == "0":  # the first number of a slot
                    return self._rendered(left, strength)
                whole = f"{self._rendered(left, own)}{sign}{last}"
                return f"{self.opening}{whole}{self.closing}" if own < strength else whole
            case _:
                raise ValueError(ast.unparse(node))


def _registers(*expressions: str) -> str:
    """The names of registers in these expressions: what is behind a line as a comment."""
    found = {
        node.id.replace("_", " "): None
        for text in expressions
        for node in ast.walk(ast.parse(text, mode="eval"))
        if isinstance(node, ast.Name) and node.id in NUMBERS
    }
    return ", ".join(found)


def _labels_in(line: str) -> Iterator[str]:
    words = line.split()
    yield from (after for word, after in pairwise(words) if word in {"GOTOF", "GOTOB"})
