"""The present context of a machine as JSON."""

from datetime import datetime
from typing import Annotated

from pydantic import AfterValidator, BaseModel, Field

from app.loop.present_context.tables import PresentContext
from app.web.fields import Body, one_line

_Said = Annotated[str, AfterValidator(one_line), Field(min_length=1, max_length=128)]


class PresentContextIn(Body):
    """The work of a machine from now on; a field that is left out is not known."""

    order: Annotated[_Said | None, Field(description="Number of the order.")] = None
    batch: Annotated[_Said | None, Field(description="Batch or heat of the material.")] = None
    nest: Annotated[
        int | None, Field(strict=True, ge=0, le=999_999, description="Number of the nest, if all parts are of one.")
    ] = None
    spindle: Annotated[_Said | None, Field(description="The spindle that cuts.")] = None
    fixture: Annotated[_Said | None, Field(description="Fixture, pallet or chuck.")] = None
    program: Annotated[_Said | None, Field(description="The program that runs.")] = None
    operator: Annotated[_Said | None, Field(description="Who measures.")] = None
    gauge: Annotated[_Said | None, Field(description="What is measured with.")] = None


class PresentContextOut(BaseModel):
    """The work of a machine, put within a minute on its readings that bring no context but temperatures."""

    machine: str
    context: Annotated[PresentContextIn, Field(description="As it was set; null is not known.")]
    since: Annotated[datetime | None, Field(description="It holds from then on; null: none was ever set.")]
    changed_by: Annotated[str | None, Field(description="Who set it.")]

    @classmethod
    def of(cls, machine: str, row: PresentContext | None) -> "PresentContextOut":
        """The one that holds; empty where there is none."""
        said = PresentContextIn.model_validate(row.context if row else {})
        return cls(
            machine=machine,
            context=said,
            since=row.since if row else None,
            changed_by=row.changed_by if row else None,
        )
