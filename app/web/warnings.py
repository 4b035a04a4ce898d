"""Warnings in answers, and acknowledging them: what was accepted although it may be wrong. The same shape at every door."""

from collections.abc import Callable, Iterable
from datetime import datetime
from typing import Annotated, Protocol

from pydantic import BaseModel, Field

from app.core.warning import CodedWarning
from app.web.fields import Body, Reason


class WarningOut(BaseModel):
    """Something that was accepted although it may be wrong."""

    code: Annotated[str, Field(description="A stable name, for programs.")]
    text: Annotated[str, Field(description="The same in words.")]
    field: Annotated[str | None, Field(description="The field that caused it; null where it is about the whole.")] = (
        None
    )


Warnings = Annotated[
    list[WarningOut],
    Field(description="What was accepted although it may be wrong; empty where nothing is suspicious."),
]


def warnings_out(warnings: Iterable[CodedWarning], sentence: Callable[[CodedWarning], str]) -> list[WarningOut]:
    """Warnings as they are answered, in the order given. sentence: the room's wording of a warning."""
    return [WarningOut(code=warning.code, text=sentence(warning), field=warning.field) for warning in warnings]


class WarningsAcknowledgeIn(Body):
    """Reason for accepting a result that may be wrong."""

    reason: Reason


class AcknowledgedOut(BaseModel):
    """Acknowledgement of the warnings: person, time and reason."""

    at: datetime
    by: str
    reason: str


Acknowledged = Annotated[
    AcknowledgedOut | None,
    Field(description="Who acknowledged the warnings; until then the program text stops the control."),
]


class Acknowledgement(Protocol):
    """An acknowledgement as it is kept."""

    at: datetime
    actor: str
    reason: str


def acknowledged_out(kept: Acknowledgement | None) -> AcknowledgedOut | None:
    """Return an acknowledgement as it is answered."""
    return None if kept is None else AcknowledgedOut(at=kept.at, by=kept.actor, reason=kept.reason)
