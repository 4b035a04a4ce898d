"""Results in answers that become readings of a characteristic. The same shape at every door."""

from typing import Annotated

from pydantic import BaseModel, Field


class PushedOut(BaseModel):
    """A result as a reading of a characteristic."""

    result: Annotated[str, Field(description="Name of the result.")]
    characteristic: str
    sequence: Annotated[int | None, Field(description="Null while it waits to be stored.")]
    refused: Annotated[str | None, Field(description="Why it became no reading.")]
