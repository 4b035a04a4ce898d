"""Parts by the name that machines give them with their readings: any text of one line. Never writes."""

from typing import Annotated

from pydantic import AfterValidator, StringConstraints
from pydantic_core import PydanticCustomError

from app.loop.readings.schemas import clean_text


def _clean(part: str) -> str:
    if not clean_text(part):
        raise PydanticCustomError("control_character", "control character", {"code": "U+0000"})
    return part


Part = Annotated[str, StringConstraints(min_length=1, max_length=128), AfterValidator(_clean)]
"""Name of a part as machines send it, blanks and all."""
