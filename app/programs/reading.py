"""From a program text to parameters: what was read, what is wrong with it, and what it is about. Nothing is stored."""

import re
from typing import Any, Literal, NamedTuple, get_args

from app.characteristics.wording import field_errors
from app.core.parameters import ParameterError, read
from app.core.programs import fanuc, sinumerik
from app.core.programs.lines import Program, ProgramError, ProgramKind, ProgramText
from app.errors import FieldError, Invalid
from app.programs import wording
from app.web.i18n import _

ReadableControl = Literal["sinumerik", "fanuc"]
READABLE: tuple[str, ...] = get_args(ReadableControl)


class Looked(NamedTuple):
    """A text as it was understood. problems: why its parameters cannot be used as they are; warnings: what is unusual."""

    control: ReadableControl
    text: ProgramText
    program: Program | None
    problems: list[FieldError]
    warnings: list[FieldError]

    @property
    def makes_a_characteristic(self) -> bool:
        """Whether it holds parameters to judge by, usable or not."""
        kinds = (ProgramKind.MEASURING, ProgramKind.ASSIGNMENTS)
        return self.program is not None and self.program.kind in kinds and bool(self.program.parameters)


def look(text: str, control: ReadableControl | None = None) -> Looked:
    """Read a text for this control, or for the one that it looks like. Raises `Invalid` for what is no program text."""
    control = control or guessed(text)
    try:
        found = (fanuc if control == "fanuc" else sinumerik).read(text)
    except ProgramError as error:
        wrong = wording.refused(error)
        raise Invalid(
            _("The text cannot be read: it {wrong}.").format(wrong=wrong), errors=[FieldError("text", wrong)]
        ) from None
    program = found.program
    problems, warnings = _judged(program.parameters) if program and _judges(program) else ([], [])
    return Looked(control, found, program, problems, warnings)


def guessed(text: str) -> ReadableControl:
    """Which control it was written for: macro variables stand in texts of the one only.

    >>> guessed("#505=40."), guessed("N10 R33=0.001")
    ('fanuc', 'sinumerik')
    """
    return "fanuc" if re.search(r"^[^;(]*#\s*[\d\[]", text, re.MULTILINE) else "sinumerik"


def _judges(program: Program) -> bool:
    return program.kind in (ProgramKind.MEASURING, ProgramKind.ASSIGNMENTS)


def _judged(parameters: dict[str, Any]) -> tuple[list[FieldError], list[FieldError]]:
    try:
        return [], field_errors(read(parameters)[1])
    except ParameterError as error:
        return field_errors(error.problems), []


def decoded(content: bytes) -> str:
    """The text of a file: UTF-8 or UTF-16 by its mark, else whatever the control's old code page made of it."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")
