"""What the readers and writers of all controls share: a verdict on every line, numbers, and what R text cannot say.

Our parameters hold more than the cycles' R numbers can: the factor, the mode, n of m. What has no R number is written as
a comment ``(INBAND FACTOR=-1)``, which controls skip and our readers understand, so that nothing is lost on the way.
Lengths are mm.
"""

import re
from collections.abc import Container, Iterable, Iterator, Mapping
from decimal import Decimal
from enum import StrEnum
from math import isfinite
from types import MappingProxyType
from typing import Any, NamedTuple

from app.core.parameters import BY_NAME, FIELDS, Field, Kind, Parameters

MOST_CHARACTERS = 65_536
MOST_LINES = 4_000
LONGEST_LINE = 1_000  # no control takes half of it
NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)"
PLAIN = re.compile(r"[ -$&'*-:<-z|~]")  # ASCII that no control takes for the end of a comment; others travel as {D8}
SETTING = re.compile(r"\s*INBAND\s+([A-Za-z_]+)\s*=(.*)", re.IGNORECASE)
DESCRIBING = ("characteristic", "name", "part")


class Verdict(StrEnum):
    """What became of a line."""

    UNDERSTOOD = "understood"
    IGNORED = "ignored"
    NOT_UNDERSTOOD = "not_understood"


class Note(NamedTuple):
    """Something said about a line or a program: a code with values, worded at the edge.

    Taken: ``assigned``, ``setting``, ``call``, ``result``. Warnings about what was taken: ``r44_for_r34``, ``again``,
    ``skip_block``, ``not_used``, ``macro``, ``assumed``, ``l75_missing``, ``l75_wins``, ``two_point``,
    ``no_tool``. Passed over: ``comment``, ``empty``, ``words``, ``computed``. Not understood: ``expression``,
    ``no_value``, ``placeholder``, ``unknown_r``, ``unknown``, ``too_large``, ``too_long``, ``bad_setting``.
    """

    code: str
    data: dict[str, Any]


TAKEN = frozenset({"assigned", "setting", "call", "result"})
WARNINGS = frozenset(
    {"r44_for_r34", "again", "skip_block", "not_used", "macro", "assumed", "l75_missing", "l75_wins", "two_point"}
    | {"no_tool"}  # of the whole program
)
NOT_UNDERSTOOD = frozenset(
    {"expression", "no_value", "placeholder", "unknown_r", "unknown", "too_large", "too_long", "bad_setting"}
)


class Line(NamedTuple):
    """A line of the text, numbered from 1, and what was made of it."""

    number: int
    text: str
    verdict: Verdict
    notes: tuple[Note, ...]


class ProgramKind(StrEnum):
    """What a text holds."""

    CALIBRATION = "calibration"
    MEASURING = "measuring"
    ASSIGNMENTS = "assignments"
    RESULTS = "results"


class Program(NamedTuple):
    """One program of a text. parameters: as `core.parameters.read` takes them, or as a calibration has them.

    about: ``characteristic``, ``name`` and ``part``, where the text says them. values: what only the control knows, by
    its own names. results: what the cycle found, by its own names.
    """

    kind: ProgramKind
    first_line: int
    last_line: int
    parameters: dict[str, Any]
    about: dict[str, str]
    values: dict[str, float]
    results: dict[str, float]
    notes: tuple[Note, ...]


class ProgramText(NamedTuple):
    """Everything that was read: every line with its verdict, and the programs in the order of the text."""

    lines: tuple[Line, ...]
    programs: tuple[Program, ...]

    @property
    def program(self) -> Program | None:
        """The one that makes a characteristic: the first that measures, else what there is."""
        order = (ProgramKind.MEASURING, ProgramKind.ASSIGNMENTS, ProgramKind.CALIBRATION, ProgramKind.RESULTS)
        return min(self.programs, key=lambda program: order.index(program.kind), default=None)


class ProgramError(ValueError):
    """A text that is no program text at all. code: ``binary``, ``too_long``, ``too_many_lines`` or ``empty``."""

    def __init__(self, code: str, **data: Any) -> None:
        super().__init__(code)
        self.code, self.data = code, data


def split(text: str) -> list[str]:
    """The lines of a text, whatever ends them. Raises `ProgramError`.

    >>> split("N5 M73\\r\\nN10 L92\\n")
    ['N5 M73', 'N10 L92']
    """
    if len(text) > MOST_CHARACTERS:
        raise ProgramError("too_long", most=MOST_CHARACTERS, got=len(text))
    if "\0" in text or sum(character < " " and character not in "\t\r\n\f" for character in text) > 8:
        raise ProgramError("binary")
    if not text.strip():
        raise ProgramError("empty")
    lines = re.sub(r"\r\n?|\f", "\n", text.removeprefix("\ufeff")).split("\n")
    if not lines[-1]:
        lines.pop()
    if len(lines) > MOST_LINES:
        raise ProgramError("too_many_lines", most=MOST_LINES, got=len(lines))
    return lines


def line_of(number: int, text: str, notes: Iterable[Note]) -> Line:
    """The line with the verdict that its notes come to: one word not understood is enough."""
    said = tuple(notes)
    codes = {note.code for note in said}
    if codes & NOT_UNDERSTOOD:
        return Line(number, text, Verdict.NOT_UNDERSTOOD, said)
    return Line(number, text, Verdict.UNDERSTOOD if codes & TAKEN else Verdict.IGNORED, said)


def number_in(text: str) -> float | None:
    """The number of a plain piece of text, with point or comma; None when it is beyond any float.

    >>> number_in("0,001"), number_in("+40."), number_in("9" * 400)
    (0.001, 40.0, None)
    """
    value = float(text.replace(",", "."))
    return value + 0.0 if isfinite(value) else None


def written(value: float) -> str:
    """A number without exponent, all its digits, so that reading it gives the same number again.

    >>> written(0.0053), written(40.0), written(1e-7), written(-0.0)
    ('0.0053', '40', '0.0000001', '0')
    """
    text = format(Decimal(repr(float(value))), "f")
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


# --- what R text cannot say


def describing(about: Mapping[str, str]) -> Iterator[str]:
    """The comments that say whose program it is, without their brackets."""
    for name in DESCRIBING:
        if about.get(name):
            yield f"INBAND {name.upper()}={_escaped(about[name])}"


def settings(
    parameters: Parameters, said: Container[str], implied: Mapping[str, Any] = MappingProxyType({})
) -> Iterator[str]:
    """The comments for all that the parameters hold beside what is ``said`` already and what goes without saying.

    implied: what the reader of this text takes where nothing is said, in place of the parameters' own defaults.
    """
    values = parameters.as_dict()
    expected = {field.name: field.default for field in FIELDS} | {"accept": {"n": 1, "m": 1}} | dict(implied)
    if parameters.nominal is not None:  # target and width follow from the drawing (L75)
        expected |= {name: values[name] for name in ("target", "tolerance_width")}
    for name in (*BY_NAME, *(name for name in values if name not in BY_NAME)):
        if name not in said and values.get(name) is not None and values[name] != expected.get(name):
            yield f"INBAND {name.upper()}={_said(values[name])}"


def _said(value: Any) -> str:
    if isinstance(value, bool):
        return "YES" if value else "NO"
    if isinstance(value, Mapping):  # acceptance
        return f"{value['n']}/{value['m']}"
    return written(value) if isinstance(value, int | float) else str(value).upper()


def setting_in(comment: str) -> tuple[str, Any] | None:
    """The name and value of a comment of ours; None for any other comment. The value is None where it makes no sense.

    >>> setting_in("INBAND FACTOR=-0.5"), setting_in("INBAND ACCEPT=2/3"), setting_in("roughing")
    (('factor', -0.5), ('accept', {'n': 2, 'm': 3}), None)
    """
    found = SETTING.fullmatch(comment)
    if found is None:
        return None
    name, text = found[1].lower(), found[2].strip()
    if name in DESCRIBING:
        return name, (_unescaped(text).lower() if name == "characteristic" else _unescaped(text)) or None
    if name == "accept":
        parts = re.fullmatch(r"(\d{1,3})\s*/\s*(\d{1,3})", text, re.ASCII)
        return name, {"n": int(parts[1]), "m": int(parts[2])} if parts else None
    field = BY_NAME.get(name)
    return name, None if field is None else _value(field, text)


def _value(field: Field, text: str) -> Any:
    if field.kind is Kind.CHOICE:
        return next((choice for choice in field.choices if choice.upper() == text.upper()), None)
    if field.kind is Kind.YES_NO:
        return {"YES": True, "NO": False}.get(text.upper())
    return number_in(text) if re.fullmatch(NUMBER, text, re.ASCII) else None


def _escaped(text: str) -> str:
    return "".join(c if PLAIN.fullmatch(c) else f"{{{ord(c):X}}}" for c in text)


def _unescaped(text: str) -> str:
    def character(found: re.Match[str]) -> str:
        code = int(found[1], 16)
        return chr(code) if 32 <= code < 0xD800 or 0xDFFF < code <= 0x10FFFF else ""

    return re.sub(r"\{([0-9A-Fa-f]{1,6})\}", character, text)
