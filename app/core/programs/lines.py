"""Shared base of the readers and writers of all controls: line verdicts, numbers, and parameters without R number.

Our parameters hold more than the cycles' R numbers can: the factor, the mode, n of m. What has no R number is written as
a comment ``(INBAND FACTOR=-1)``, which controls skip and our readers understand, so that nothing is lost on the way.
Lengths are mm.
"""

import re
from collections.abc import Container, Iterable, Iterator, Mapping
from decimal import Decimal
from enum import StrEnum
from types import MappingProxyType
from typing import Any, NamedTuple

from app.core.decision.step import rounded
from app.core.natural_limit import NaturalLimit, assumed
from app.core.number_text import number_or_none, plain
from app.core.parameters import BY_NAME, FIELDS, Field, FieldKind, Parameters

MOST_CHARACTERS = 65_536
MOST_LINES = 4_000
LONGEST_LINE = 1_000  # no control takes half of it
NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)"
MM_PER_INCH = 25.4
WORD_ENDS = r"(?![\d.])(?![A-Z_](?!\s*=?\s*[-+]?\s*[.\d#\[]))"
"""Behind a number: the next word may follow without a blank, as in ``G1X10.Y20.``; what is not a word may not."""
UNIT = re.compile(
    r"G\s*0*(?:(20|70|700)|21|71|710)(?![\d.])|BEGIN\s+PGM\s+\S+\s+(?:(INCH)|MM)\b", re.IGNORECASE | re.ASCII
)
_DIGITS_ONLY = re.compile(r"[+-]?\s*[\w.,]*\d[\d.,\s]*")
_BLANK_INSIDE = re.compile(r"[\d.,+-]\s+[\d.,]")
PLAIN = re.compile(r"[ -$&'*-:<-z|~]")  # ASCII that no control takes for the end of a comment; others travel as {D8}
_REMARK = re.compile(r"(?!(?:in|inch|inches|mil|cm|um|[µμ]m)\b)[^\W\d_][^\W\d_]+[^\d_=#*/+<>$%&@\[\]{}\"]*")
SETTING = re.compile(r"\s*INBAND\s+([A-Za-z_]+)\s*=(.*)", re.IGNORECASE)
DESCRIBING = ("characteristic", "name", "part")


class LineVerdict(StrEnum):
    """Verdict on a line."""

    UNDERSTOOD = "understood"
    IGNORED = "ignored"
    NOT_UNDERSTOOD = "not_understood"


class Note(NamedTuple):
    """Something said about a line or a program: a code with values, worded at the edge.

    Taken: ``assigned``, ``setting``, ``call``, ``result``, ``unit_inch``, ``unit_mm``; of Heidenhain ``cycle``,
    ``q_assigned``, ``cut_out``, ``as_number``, and the warnings ``q_range``, ``q_missing``, ``tcpm_active``, ``tilted``,
    ``rotated``, and not understood ``unknown_q``, ``cut_wrong``. Warnings about what was taken:
    ``r44_for_r34``, ``again``, ``skip_block``, ``not_used``, ``macro``, ``assumed``, ``l75_missing``, ``l75_wins``,
    ``two_point``, ``no_tool``, ``from_inch``, ``printed_minus``, ``remark``. Passed over: ``comment``, ``empty``, ``words``,
    ``computed``. Not understood: ``expression``, ``no_value``, ``no_number``, ``blank_in_number``, ``unit_mixed``,
    ``placeholder``, ``unknown_r``, ``unknown``, ``too_large``, ``too_long``, ``bad_setting``.
    """

    code: str
    data: dict[str, Any]


TAKEN = frozenset(
    {"assigned", "setting", "call", "result", "unit_inch", "unit_mm", "cycle", "q_assigned", "cut_out", "as_number"}
    | {"step"}  # of a printed macro
)
WARNINGS = frozenset(
    {"r44_for_r34", "again", "skip_block", "not_used", "macro", "assumed", "l75_missing", "l75_wins", "two_point"}
    | {"remark"}
    | {"unit_inch", "printed_minus", "q_range", "q_missing", "tcpm_active", "tilted", "rotated"}
    | {"no_tool", "from_inch", "feeler_range"}  # of the whole program
)
NOT_UNDERSTOOD = frozenset(
    {"expression", "no_value", "no_number", "blank_in_number", "unit_mixed", "placeholder", "unknown_r", "unknown"}
    | {"too_large", "too_long", "bad_setting", "unknown_q", "cut_wrong"}
)


class Line(NamedTuple):
    """A line of the text, numbered from 1, and what was made of it."""

    number: int
    text: str
    verdict: LineVerdict
    notes: tuple[Note, ...]


class ProgramKind(StrEnum):
    """Kind of a program text."""

    CALIBRATION = "calibration"
    MEASURING = "measuring"
    ASSIGNMENTS = "assignments"
    RESULTS = "results"
    KINEMATICS = "kinematics"
    WORK_ZERO = "work_zero"


class Program(NamedTuple):
    """One program of a text. parameters: as `core.parameters.read` takes them, or as a calibration has them.

    about: ``characteristic``, ``name`` and ``part``, where the text says them. values: what only the control knows, by
    its own names. results: what the cycle found, by its own names. All lengths are mm; inch says that the text has them
    in inches, and that they were converted.
    """

    kind: ProgramKind
    first_line: int
    last_line: int
    parameters: dict[str, Any]
    about: dict[str, str]
    values: dict[str, float]
    results: dict[str, float]
    notes: tuple[Note, ...]
    inch: bool = False


class ProgramText(NamedTuple):
    """Everything that was read: every line with its verdict, and the programs in the order of the text."""

    lines: tuple[Line, ...]
    programs: tuple[Program, ...]

    @property
    def program(self) -> Program | None:
        """The one that makes a characteristic: the first that measures, else what there is."""
        order = (
            ProgramKind.MEASURING,
            ProgramKind.ASSIGNMENTS,
            ProgramKind.CALIBRATION,
            ProgramKind.KINEMATICS,
            ProgramKind.WORK_ZERO,
            ProgramKind.RESULTS,
        )
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


def single_blanks(block: str) -> str:
    """A block with ordinary signs and single blanks: expressions that take blanks anywhere try every way to share a row of them.

    >>> single_blanks(" R32\\t =  \N{MINUS SIGN}0.016 ")
    'R32 = -0.016'
    """
    return " ".join(plain(block).split())


def line_of(number: int, text: str, notes: Iterable[Note]) -> Line:
    """The line with the verdict that its notes come to: one word not understood is enough."""
    line_notes = tuple(notes)
    codes = {note.code for note in line_notes}
    if codes & NOT_UNDERSTOOD:
        return Line(number, text, LineVerdict.NOT_UNDERSTOOD, line_notes)
    return Line(number, text, LineVerdict.UNDERSTOOD if codes & TAKEN else LineVerdict.IGNORED, line_notes)


def number_in(text: str) -> float | None:
    """The number of a plain piece of text, with point or comma; None when it is beyond any float.

    >>> number_in("0,001"), number_in("-40."), number_in("9" * 400)
    (0.001, -40.0, None)
    """
    return number_or_none(text)


def in_mm(value: float, inch: bool | None) -> float:
    """A length in mm, converted to the picometre where it is in inches.

    >>> in_mm(1.5748, True), in_mm(40.0, None)
    (39.99992, 40.0)
    """
    return rounded(value * MM_PER_INCH) if inch else value


def says_inch(word: re.Match[str]) -> bool:
    """Tell inch (G20, G70, G700, BEGIN PGM … INCH) from mm (G21, G71, G710, BEGIN PGM … MM) in a match of `UNIT`."""
    return bool(word[1] or word[2])


def unit_note(word: re.Match[str]) -> Note:
    """The note on a line that says in which unit the lengths are from there on."""
    text = re.sub(r"\s+", " " if word[0].upper().startswith("B") else "", word[0]).upper()
    return Note("unit_inch" if says_inch(word) else "unit_mm", {"word": text[:60]})


def mixed(units: Iterable[bool | None]) -> bool:
    """Tell that lengths of one program were assigned in several units; where nothing is said they are mm.

    >>> mixed([None, False]), mixed([True, True]), mixed([None, True])
    (False, False, True)
    """
    return len({bool(unit) for unit in units}) > 1


def is_remark(block: str, rest: str) -> bool:
    """Tell if the rest of a block is words for people that are there without ``;`` or brackets.

    block: what was read before it. Only words without numbers and signs are a remark, and only where they are not in the
    capitals that the block itself is written in, so that no statement of a control passes for one.

    >>> is_remark("N10 L93 ", "measuring cycle"), is_remark("N10 R33=0.001 ", "GOTOF END"), is_remark("", "bore")
    (True, False, False)
    >>> is_remark("R33=0.001 ", "inch")
    False
    """
    in_words = _REMARK.fullmatch(rest) and not all("A" <= letter <= "Z" for letter in rest if letter.isalpha())
    return bool(block.strip() and block.upper() == block and in_words)


def no_number(r: str, text: str) -> Note:
    """The reason why what is assigned to a variable is not a number: nothing there, a blank inside, or a calculation."""
    text = text.strip()
    if not text:
        return Note("no_value", {"r": r})
    if _DIGITS_ONLY.fullmatch(text):
        return Note("blank_in_number" if _BLANK_INSIDE.search(text) else "no_number", {"r": r, "text": text[:80]})
    return Note("expression", {"r": r, "text": text[:80]})


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
    parameters: Parameters, stated: Container[str], implied: Mapping[str, Any] = MappingProxyType({})
) -> Iterator[str]:
    """The comments for all that the parameters hold beside what is ``said`` already and what goes without saying.

    implied: what the reader of this text takes where nothing is said, in place of the parameters' own defaults.
    """
    values = parameters.as_dict()
    expected = {field.name: field.default for field in FIELDS} | {"accept": {"n": 1, "m": 1}} | dict(implied)
    if assumed(values) is NaturalLimit.NONE:  # else both are said, for the reader of a text without it would assume one
        expected["natural_limit"] = NaturalLimit.NONE.value
    if parameters.nominal is not None:  # target and width follow from the drawing (L75)
        expected |= {name: values[name] for name in ("target", "tolerance_width")}
    for name in (*BY_NAME, *(name for name in values if name not in BY_NAME)):
        if name not in stated and values.get(name) is not None and values[name] != expected.get(name):
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
    match = SETTING.fullmatch(comment)
    if match is None:
        return None
    name, text = match[1].lower(), match[2].strip()
    if name in DESCRIBING:
        return name, (_unescaped(text).lower() if name == "characteristic" else _unescaped(text)) or None
    if name == "accept":
        parts = re.fullmatch(r"(\d{1,3})\s*/\s*(\d{1,3})", text, re.ASCII)
        return name, {"n": int(parts[1]), "m": int(parts[2])} if parts else None
    field = BY_NAME.get(name)
    return name, None if field is None else _value(field, plain(text))


def _value(field: Field, text: str) -> Any:
    if field.kind is FieldKind.CHOICE:
        return next((choice for choice in field.choices if choice.upper() == text.upper()), None)
    if field.kind is FieldKind.YES_NO:
        return {"YES": True, "NO": False}.get(text.upper())
    return number_or_none(text)


def _escaped(text: str) -> str:
    return "".join(c if PLAIN.fullmatch(c) else f"{{{ord(c):X}}}" for c in text)


def _unescaped(text: str) -> str:
    def character(match: re.Match[str]) -> str:
        code = int(match[1], 16)
        return chr(code) if 32 <= code < 0xD800 or 0xDFFF < code <= 0x10FFFF else ""

    return re.sub(r"\{([0-9A-Fa-f]{1,6})\}", character, text)
