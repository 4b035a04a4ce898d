"""Program text: what a text says, and what is written for a characteristic. Nothing is stored.

Reading goes from a text to parameters with everything that is wrong with them; writing from a characteristic to the text
that reads back as the same.
"""

import re
from collections.abc import Callable
from typing import Literal, NamedTuple, get_args

from app.core.parameters import (
    MachineType,
    ParameterError,
    read,
    unusual_calibration,
    unusual_on,
    unusual_partly,
    without_location,
)
from app.core.programs import fanuc, heidenhain, sinumerik
from app.core.programs.lines import Program, ProgramError, ProgramKind, ProgramText
from app.core.programs.sinumerik_writing import Calibration, write_calibration, write_measuring
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.wording import field_errors
from app.loop.characteristics.wording import warnings as as_warnings
from app.loop.programs import wording
from app.loop.tables.machines import Machine
from app.web.warnings import WarningOut

ReadableControl = Literal["sinumerik", "fanuc", "heidenhain"]
READERS: dict[str, Callable[[str], ProgramText]] = {
    "sinumerik": sinumerik.read,
    "fanuc": fanuc.read,
    "heidenhain": heidenhain.read,
}
READABLE: tuple[str, ...] = get_args(ReadableControl)


class CheckedProgram(NamedTuple):
    """A program text, read and checked. problems: errors of its parameters; warnings: unusual values."""

    control: ReadableControl
    text: ProgramText
    program: Program | None
    problems: list[FieldError]
    warnings: list[WarningOut]

    @property
    def makes_a_characteristic(self) -> bool:
        """Tell if the text holds parameters of a characteristic, usable or not."""
        kinds = (ProgramKind.MEASURING, ProgramKind.ASSIGNMENTS)
        return self.program is not None and self.program.kind in kinds and bool(self.program.parameters)


def check(text: str, control: ReadableControl | None = None, machine: Machine | None = None) -> CheckedProgram:
    """Read a text for this control, or for the one that it looks like. Raises `Invalid` for what is no program text.

    machine: the one that the program is for, if a person says it: its type and its locations are looked at too.
    """
    control = control or guessed(text)
    try:
        program_text = READERS[control](text)
    except ProgramError as error:
        wrong = wording.refused(error)
        raise Invalid(
            _("The text cannot be read: it {wrong}.").format(wrong=wrong), errors=[FieldError("text", wrong)]
        ) from None
    program = program_text.program
    problems, warnings = _judged(program, machine) if program else ([], [])
    return CheckedProgram(control, program_text, program, problems, warnings)


def guessed(text: str) -> ReadableControl:
    """The control that a text was written for, by its macro variables and cycles.

    >>> guessed("#505=40."), guessed("N10 R33=0.001"), guessed("12 TCH PROBE 452 PRESET COMPENSATION ~")
    ('fanuc', 'sinumerik', 'heidenhain')
    """
    if re.search(
        r"^.{0,40}(?:\bTCH[^\S\n]+PROBE\b|\bBEGIN[^\S\n]+PGM\b|\bG45[012]\b|\bQS?\d{1,4}[^\S\n]*=)",
        text,
        re.MULTILINE | re.IGNORECASE,
    ):
        return "heidenhain"
    # Never beyond the end of its line: a text of thousands of lines would be searched once for each of them.
    return "fanuc" if re.search(r"^[^;(\n]*#[^\S\n]*[\d\[]", text, re.MULTILINE) else "sinumerik"


def _judges(program: Program) -> bool:
    return program.kind in (ProgramKind.MEASURING, ProgramKind.ASSIGNMENTS)


def _judged(program: Program, machine: Machine | None) -> tuple[list[FieldError], list[WarningOut]]:
    """Errors of the parameters, and warnings of unusual values; the latter also while something is missing."""
    if program.kind is ProgramKind.CALIBRATION:
        return [], as_warnings(unusual_calibration(program.parameters))
    if not _judges(program):
        return [], []
    parameters = program.parameters
    problems = without_location(parameters, machine.tool_locations, machine.average_locations) if machine else []
    unfit = unusual_on(parameters, MachineType(machine.type)) if machine else []
    try:
        unusual = read(parameters)[1] + unfit
    except ParameterError as error:
        return field_errors([*error.problems, *problems]), as_warnings(unusual_partly(parameters) + unfit)
    return field_errors(problems), as_warnings(unusual)


def decoded(content: bytes) -> str:
    """The text of a file: UTF-8 or UTF-16 by its mark, else whatever the control's old code page made of it."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


# --- writing

Kind = Literal["measuring", "calibration"]
WRITTEN = ("sinumerik", "fanuc")


def control_of(current: CurrentCharacteristic, control: str | None) -> str:
    """The control that was asked for, else the machine's. Raises `Invalid` where nothing is written for it."""
    control = control or current.machine.control
    if control not in WRITTEN:
        raise Invalid.at(
            "control",
            _("must be sinumerik or fanuc: measuring programs are not written for {control}").format(control=control),
            do=_("Say for which control, for example control=sinumerik."),
        )
    return control


def program_of(
    current: CurrentCharacteristic,
    control: str,
    kind: Kind = "measuring",
    *,
    gauge: float | None = None,
    surface: Literal["free", "groove"] = "free",
    probe: Literal["axial", "radial"] = "axial",
) -> str:
    """The measuring program of a characteristic, or the calibration for its axis, direction and memory location.

    gauge: size of the gauge or ring, R32 or #505, mm; without it the target is there, and the text says so. Raises `Invalid` for
    form, which is not probed by itself.
    """
    if current.source is not None:
        raise Invalid.at(
            "characteristic",
            _("is form: its readings come with those of {key}, whose program it is").format(key=current.source),
            do=_("Ask for the program of that one."),
        )
    characteristic, parameters = current.characteristic, current.parameters
    about = {"characteristic": characteristic.key, "name": characteristic.name, "part": characteristic.part or ""}
    if kind == "measuring":
        if control == "fanuc":
            return fanuc.write_measuring(parameters, about, {})
        return write_measuring(parameters, about)
    size = parameters.target if gauge is None else gauge
    if control == "fanuc":
        text = fanuc.write_calibration(size, about, {})
    else:
        text = write_calibration(Calibration(parameters, size, surface == "free", probe == "radial"), about)
    if gauge is not None:
        return text
    head, rest = text.split("\n", 1)
    where = "#505" if control == "fanuc" else "R32"
    return f"{head}\n({where} IS THE TARGET: WRITE THE SIZE OF YOUR GAUGE THERE)\n{rest}"


class ProgramView(NamedTuple):
    """A program text as pages show it."""

    text: str
    download: str
    file: str


def program_view(current: CurrentCharacteristic) -> ProgramView | None:
    """The measuring program for the machine's own control; None where nothing is written for it, and for form."""
    control = current.machine.control
    if control not in WRITTEN or current.source is not None:
        return None
    download = f"/api/v1/characteristics/{current.characteristic.key}/program"
    return ProgramView(program_of(current, control), download, file_name(current, control, "measuring"))


def file_name(current: CurrentCharacteristic, control: str, kind: Kind) -> str:
    """File name of such a program on its control, with the key in front: `shaft-d40-L15.spf`."""
    key = re.sub(r"[^a-z0-9-]", "-", current.characteristic.key)
    if control == "fanuc":
        return f"{key}-{kind}.nc"
    return f"{key}-{'L15' if kind == 'measuring' else 'L05'}.spf"
