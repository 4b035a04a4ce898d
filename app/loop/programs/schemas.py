"""Program text as JSON: what was read of it. Lengths in mm."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.core.programs import fanuc
from app.core.programs.lines import MOST_CHARACTERS, WARNINGS, Note, Program
from app.errors import FieldError
from app.loop.programs import wording
from app.loop.programs.queries import CheckedProgram, ReadableControl
from app.web.fields import Body, Slug, answer_from
from app.web.warnings import Warnings

Verdict = Literal["understood", "ignored", "not_understood"]
KindOf = Literal["calibration", "measuring", "assignments", "results", "kinematics", "work_zero"]


class ProgramIn(Body):
    """A program text to be read."""

    control: Annotated[
        ReadableControl | None, Field(description="Whose text it is; if left out, taken from the text.")
    ] = None
    machine: Annotated[
        Slug | None, Field(description="The machine it is for: what does not fit its type or its locations is said.")
    ] = None
    text: Annotated[str, Field(strict=True, max_length=MOST_CHARACTERS, description="The text, line by line.")]


class Remark(BaseModel):
    """An error, with the parameter that it concerns."""

    field: Annotated[str, Field(description="The parameter that it concerns.")]
    message: Annotated[str, Field(description="What is wrong with it, in words.")]


class NoteOut(BaseModel):
    """Something said about a line or a program."""

    code: str
    text: str
    warning: Annotated[bool, Field(description="Whether somebody should look at it.")]


class ProgramLineOut(BaseModel):
    """A line and what was made of it."""

    line: Annotated[int, Field(description="Number of the line, from 1.")]
    text: str
    verdict: Annotated[
        Verdict, Field(description="`understood`, `ignored` as a program without a meaning here, or `not_understood`.")
    ]
    notes: Annotated[list[NoteOut], Field(description="What there is to say about it.")]


class ProgramOut(BaseModel):
    """One of the programs in the text."""

    kind: Annotated[KindOf, Field(description="Kind of program.")]
    first_line: Annotated[int, Field(description="Number of its first line, from 1.")]
    last_line: Annotated[int, Field(description="Number of its last line.")]
    parameters: Annotated[
        dict[str, Any],
        Field(
            description="As POST /characteristics takes them; of a calibration, with `gauge` (R32), `surface` and `probe`; of a "
            "kinematics cycle, `cycle` and its Q parameters."
        ),
    ]
    about: Annotated[dict[str, str], Field(description="Key, name and part, where the text says them.")]
    values: Annotated[dict[str, float], Field(description="What only the control knows, such as `#504`.")]
    results: Annotated[dict[str, float], Field(description="What the cycle has found, such as `R43` or `#510`.")]
    touches: Annotated[
        list[list[float]] | None, Field(description="The results as `touches` of a reading, where they are such.")
    ]
    notes: Annotated[list[NoteOut], Field(description="What there is to say about it.")]


class ProgramRead(BaseModel):
    """The content of a program text. Nothing was stored."""

    control: Annotated[ReadableControl, Field(description="The control that it was read for.")]
    program: Annotated[
        ProgramOut | None,
        Field(description="The one that makes a characteristic, if there is any; else what there is."),
    ]
    problems: Annotated[list[Remark], Field(description="Why its parameters cannot be used as they are.")]
    warnings: Warnings
    not_understood: Annotated[int, Field(description="How many lines hold something that was not understood.")]
    lines: Annotated[list[ProgramLineOut], Field(description="Every line, and what was made of it.")]
    programs: Annotated[list[ProgramOut], Field(description="The programs in the text.")]


def note_out(note: Note) -> NoteOut:
    return NoteOut(code=note.code, text=wording.note(note), warning=note.code in WARNINGS)


def program_out(program: Program) -> ProgramOut:
    return answer_from(
        ProgramOut,
        program,
        kind=program.kind.value,
        touches=fanuc.touches(program.results),
        notes=[note_out(note) for note in program.notes],
    )


def program_read(looked: CheckedProgram) -> ProgramRead:
    """A text as it is answered."""
    lines = [
        ProgramLineOut(
            line=line.number, text=line.text, verdict=line.verdict.value, notes=[note_out(n) for n in line.notes]
        )
        for line in looked.text.lines
    ]
    return ProgramRead(
        control=looked.control,
        program=None if looked.program is None else program_out(looked.program),
        problems=_remarks(looked.problems),
        warnings=looked.warnings,
        not_understood=sum(line.verdict == "not_understood" for line in lines),
        lines=lines,
        programs=[program_out(program) for program in looked.text.programs],
    )


def _remarks(errors: list[FieldError]) -> list[Remark]:
    return [Remark(field=field, message=message) for field, message in errors]
