"""Notes as JSON."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from app.language.i18n import _
from app.loop.notes.queries import NoteRow
from app.web.fields import LARGEST_ID, Body, LatelyOrNow, Reason, RecordKey, Slug

Words = Annotated[Reason, Field(description="The note: 1 to 1000 characters.")]


class NoteIn(Body):
    """A note at a characteristic, or at a whole machine."""

    machine: Annotated[Slug | None, Field(description="The machine; needless beside a characteristic.")] = None
    characteristic: Annotated[Slug | None, Field(description="The characteristic; without it, the whole machine.")] = (
        None
    )
    sequence: Annotated[
        int | None,
        Field(strict=True, ge=1, le=LARGEST_ID, description="The reading of the characteristic that it is about."),
    ] = None
    at: Annotated[
        LatelyOrNow | None, Field(description="The moment that it is about; without it, that of the reading, or now.")
    ] = None
    text: Words
    key: RecordKey | None = None

    @model_validator(mode="after")
    def _about_something(self) -> "NoteIn":
        if self.machine is None and self.characteristic is None:
            raise PydanticCustomError(
                "about", _("is missing: name the machine or the characteristic"), {"at": "machine"}
            )
        if self.sequence is not None and self.characteristic is None:
            raise PydanticCustomError("of_which", _("needs the characteristic whose reading it is"), {"at": "sequence"})
        return self


class WithdrawalOut(BaseModel):
    """Withdrawal of a note: its moment, who did it, and the reason."""

    at: datetime
    by: str
    reason: str


class WrittenNote(BaseModel):
    """A note."""

    id: int
    machine: str
    characteristic: Annotated[str | None, Field(description="null: it is about the whole machine.")]
    sequence: Annotated[int | None, Field(description="The reading that it is about, if it is about one.")]
    at: Annotated[datetime, Field(description="The moment that it is about.")]
    text: str
    key: str | None
    written_at: Annotated[datetime, Field(description="When it was written.")]
    written_by: Annotated[str, Field(description="Who wrote it.")]
    withdrawn: Annotated[WithdrawalOut | None, Field(description="null: it is in effect.")]

    @classmethod
    def of(cls, row: NoteRow) -> "WrittenNote":
        """A note as it is stored."""
        note = row.note
        withdrawn = (
            WithdrawalOut(at=note.withdrawn_at, by=note.withdrawn_by or "", reason=note.withdrawn_why or "")
            if note.withdrawn_at is not None
            else None
        )
        return cls(
            id=note.id,
            machine=row.machine.key,
            characteristic=row.characteristic.key if row.characteristic else None,
            sequence=note.sequence,
            at=note.at,
            text=note.text,
            key=note.key,
            written_at=note.written_at,
            written_by=note.written_by,
            withdrawn=withdrawn,
        )
