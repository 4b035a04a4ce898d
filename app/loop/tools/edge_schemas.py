"""Tool edges and their lives as JSON. Lengths in mm."""

from datetime import UTC, datetime
from typing import Annotated

from pydantic import BaseModel, Field

from app.core.parameters import LARGEST_LENGTH, MOST_LOCATIONS
from app.loop.tools.lives_queries import Life, Lives
from app.web.fields import IN_UM, Body, Reason, Text200, answer_from


class ToolSettings(Body):
    """The tool in a location. Omitted fields stay as they are; null clears a field."""

    edge: Annotated[Text200 | None, Field(description="The cutting edge: D number or name.")] = None
    name: Annotated[Text200 | None, Field(description="What the tool is called.")] = None
    kind: Annotated[Text200 | None, Field(description="Type of tool or insert.")] = None
    planned_parts: Annotated[
        int | None,
        Field(strict=True, ge=1, le=10_000_000, description="Planned tool life: parts until the edge is changed."),
    ] = None
    planned_total: Annotated[
        float | None,
        IN_UM,
        Field(
            strict=True,
            ge=0.000001,
            le=LARGEST_LENGTH,
            allow_inf_nan=False,
            description="Planned wear life: largest total correction per edge (magnitude of the sum), mm.",
        ),
    ] = None
    sister: Annotated[
        int | None,
        Field(strict=True, ge=1, le=MOST_LOCATIONS, description="R10 of the tool that goes on when this one is worn."),
    ] = None


class SisterIn(Body):
    """The reason for the change to the sister tool."""

    reason: Reason


class SwitchedOut(BaseModel):
    """The characteristics that correct the sister tool now."""

    machine: str
    tool: Annotated[int, Field(description="R10 of the tool that is not corrected any more.")]
    sister: Annotated[int, Field(description="R10 of the tool that goes on.")]
    characteristics: Annotated[list[str], Field(description="Keys of the characteristics.")]
    superseded: Annotated[list[int], Field(description="Corrections that must not be applied any more.")]
    averages: Annotated[list[int], Field(description="R11 whose running average began again at 0.")]


class LifeOut(BaseModel):
    """One edge, from the tool change that brought it in to the one that took it out."""

    began_at: Annotated[datetime | None, Field(description="null if nobody recorded how it came in.")]
    ended_at: Annotated[datetime | None, Field(description="null while it is in.")]
    seconds: Annotated[float | None, Field(description="How long it was in, or has been so far.")]
    parts: Annotated[int, Field(description="Parts cut with it.")]
    total: Annotated[
        float | None, Field(description="Sum of the corrections while it was in, mm; null if not on record.")
    ]
    edge: Annotated[str | None, Field(description="The cutting edge: D number or name.")]
    name: str | None
    actor: Annotated[str | None, Field(description="Who said that it was changed.")]
    reason: Annotated[str | None, Field(description="Why it was changed.")]


class LivesOut(BaseModel):
    """The lives of the edges in one location, newest first; the first is the present one."""

    machine: str
    tool_memory: Annotated[int, Field(description="R10")]
    usual_parts: Annotated[float | None, Field(description="Median of the parts that the edges before have cut.")]
    life_used: Annotated[float | None, Field(description="Share of the planned life that is used.")]
    parts_left: Annotated[int | None, Field(description="Parts until the planned life is reached.")]
    lives: Annotated[list[LifeOut], Field(description="Newest first; the first is the present one.")]


def lives_out(lives: Lives, machine: str) -> LivesOut:
    """The lives as they are answered."""
    now = datetime.now(UTC)
    return LivesOut(
        machine=machine,
        tool_memory=lives.tool.number,
        usual_parts=lives.usual,
        life_used=None if lives.use.share is None else round(lives.use.share, 4),
        parts_left=lives.use.left,
        lives=[_life(life, now) for life in lives.lives],
    )


def _life(life: Life, now: datetime) -> LifeOut:
    lasted = life.lasted(now)
    return answer_from(LifeOut, life, seconds=None if lasted is None else round(lasted.total_seconds(), 3))
