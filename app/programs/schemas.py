"""Program text as JSON: what was read of it, and the corrections that were fetched as text. Lengths in mm."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from app.characteristics.schemas import Warned
from app.core.programs import fanuc
from app.core.programs.corrections import MOST_STEPS
from app.core.programs.lines import MOST_CHARACTERS, WARNINGS, Note, Program
from app.errors import FieldError
from app.offsets.fetching import Fetched
from app.programs import wording
from app.programs.reading import Looked, ReadableControl
from app.web.fields import LARGEST_SERIAL, Body

Verdict = Literal["understood", "ignored", "not_understood"]
KindOf = Literal["calibration", "measuring", "assignments", "results"]
Number = Annotated[int, Field(strict=True, ge=1, le=LARGEST_SERIAL)]
Numbers = Annotated[
    list[Number], Field(min_length=1, max_length=MOST_STEPS, description="Which corrections, by their numbers.")
]

TEXT = (
    "L15\nN5 R103 R115 R240 R250\nN10 R33=0.001 R36=1 R37=0.3\nN15 R40=0 R41=-0.016 R42=40\nN20 L75\nN25 L93\nN30 M17\n"
)
LINE: dict[str, JsonValue] = {
    "line": 3,
    "text": "N10 R33=0.001 R36=1 R37=0.3",
    "verdict": "understood",
    "notes": [{"code": "assigned", "text": "R33 = 0.001 mm zero range", "warning": False}],
}
PARAMETERS: dict[str, JsonValue] = {
    "tool_memory": 3,
    "average_memory": 5,
    "variant": "single",
    "nominal": 40.0,
    "upper_deviation": 0.0,
    "lower_deviation": -0.016,
    "zero_range": 0.001,
    "wear_limit": 0.3,
    "confidence_limit": 1.0,
}
PROGRAM: dict[str, JsonValue] = {
    "kind": "measuring",
    "first_line": 1,
    "last_line": 7,
    "parameters": PARAMETERS,
    "about": {},
    "values": {},
    "results": {},
    "touches": None,
    "notes": [],
}
MARKED: dict[str, JsonValue] = {
    "number": 18,
    "fetched_at": "2026-11-21T07:15:40Z",
    "fetched_by": "ana",
    "fetched_as": "turning 5e8a0c1d77f2",
    "fetched_before": False,
}


class ProgramIn(Body):
    """A program text to be read."""

    model_config = ConfigDict(json_schema_extra={"example": {"control": "sinumerik", "text": TEXT}})

    control: Annotated[
        ReadableControl | None, Field(description="Whose text it is; if left out, found out by the text.")
    ] = None
    text: Annotated[str, Field(strict=True, max_length=MOST_CHARACTERS, description="The text, line by line.")]


class NoteOut(BaseModel):
    """Something said about a line or a program."""

    code: str
    text: str
    warning: Annotated[bool, Field(description="Whether somebody should look at it.")]


class LineOut(BaseModel):
    """A line and what was made of it."""

    model_config = ConfigDict(json_schema_extra={"example": LINE})

    line: int
    text: str
    verdict: Verdict
    notes: list[NoteOut]


class ProgramOut(BaseModel):
    """One of the programs in the text."""

    model_config = ConfigDict(json_schema_extra={"example": PROGRAM})

    kind: KindOf
    first_line: int
    last_line: int
    parameters: Annotated[
        dict[str, Any],
        Field(
            description="As POST /characteristics takes them; of a calibration, with `gauge` (R32), `surface` and `probe`."
        ),
    ]
    about: Annotated[dict[str, str], Field(description="Key, name and part, where the text says them.")]
    values: Annotated[dict[str, float], Field(description="What only the control knows, such as `#504`.")]
    results: Annotated[dict[str, float], Field(description="What the cycle has found, such as `R43` or `#510`.")]
    touches: Annotated[
        list[list[float]] | None, Field(description="The results as `touches` of a reading, where they are such.")
    ]
    notes: list[NoteOut]


class ProgramRead(BaseModel):
    """What was read of a text. Nothing was stored."""

    model_config = ConfigDict(
        json_schema_extra={
            "example": {
                "control": "sinumerik",
                "program": PROGRAM,
                "problems": [
                    {
                        "field": "parameters.factor",
                        "message": "The factor is missing: it says which way the offset acts.",
                    }
                ],
                "warnings": [],
                "not_understood": 0,
                "lines": [LINE],
                "programs": [PROGRAM],
            }
        }
    )

    control: ReadableControl
    program: Annotated[
        ProgramOut | None,
        Field(description="The one that makes a characteristic, if there is any; else what there is."),
    ]
    problems: Annotated[list[Warned], Field(description="Why its parameters cannot be used as they are.")]
    warnings: list[Warned]
    not_understood: Annotated[int, Field(description="How many lines hold something that was not understood.")]
    lines: list[LineOut]
    programs: list[ProgramOut]


class FetchedIn(Body):
    """Which corrections were fetched, and in which form."""

    model_config = ConfigDict(json_schema_extra={"example": {"numbers": [18], "form": "turning"}})

    numbers: Numbers
    form: Annotated[
        str | None, Field(max_length=40, description="The form of the text; if left out, the usual one of the control.")
    ] = None


class FetchedOne(BaseModel):
    """A correction that was fetched."""

    model_config = ConfigDict(json_schema_extra={"example": MARKED})

    number: int
    fetched_at: datetime
    fetched_by: str
    fetched_as: Annotated[str, Field(description="Form and check sum of the text.")]
    fetched_before: Annotated[
        bool, Field(description="It was fetched earlier already: the same text with the same number.")
    ]


class FetchedOut(BaseModel):
    """What was marked."""

    model_config = ConfigDict(json_schema_extra={"example": {"items": [MARKED]}})

    items: list[FetchedOne]


class ConfirmedIn(Body):
    """Which corrections are in the control now."""

    model_config = ConfigDict(json_schema_extra={"example": {"numbers": [17, 18]}})

    numbers: Numbers


class ConfirmedOut(BaseModel):
    """What came of it."""

    model_config = ConfigDict(
        json_schema_extra={"example": {"applied": [18], "applied_before": [17], "must_not_be_in": [], "note": None}}
    )

    applied: list[int]
    applied_before: list[int]
    must_not_be_in: Annotated[list[int], Field(description="Rejected or superseded meanwhile: take them out again.")]
    note: str | None


def note_out(note: Note) -> NoteOut:
    return NoteOut(code=note.code, text=wording.note(note), warning=note.code in WARNINGS)


def program_out(program: Program) -> ProgramOut:
    return ProgramOut(
        kind=program.kind.value,
        first_line=program.first_line,
        last_line=program.last_line,
        parameters=program.parameters,
        about=program.about,
        values=program.values,
        results=program.results,
        touches=fanuc.touches(program.results),
        notes=[note_out(note) for note in program.notes],
    )


def looked_out(looked: Looked) -> ProgramRead:
    """A text as it is answered."""
    lines = [
        LineOut(line=line.number, text=line.text, verdict=line.verdict.value, notes=[note_out(n) for n in line.notes])
        for line in looked.text.lines
    ]
    return ProgramRead(
        control=looked.control,
        program=None if looked.program is None else program_out(looked.program),
        problems=_warned(looked.problems),
        warnings=_warned(looked.warnings),
        not_understood=sum(line.verdict == "not_understood" for line in lines),
        lines=lines,
        programs=[program_out(program) for program in looked.text.programs],
    )


def _warned(errors: list[FieldError]) -> list[Warned]:
    return [Warned(field=field, message=message) for field, message in errors]


def fetched_out(marked: list[Fetched]) -> FetchedOut:
    """Fetched corrections as they are answered."""
    return FetchedOut(
        items=[
            FetchedOne(
                number=c.number,
                fetched_at=c.fetched_at,  # type: ignore[arg-type] # it was marked just now, or before
                fetched_by=c.fetched_by or "",
                fetched_as=c.fetched_as or "",
                fetched_before=before,
            )
            for c, before in marked
        ]
    )
