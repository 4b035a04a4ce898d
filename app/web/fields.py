"""The kinds of text and number that come in from outside, the same at every door.

Text is trimmed and holds no control characters: PostgreSQL cannot store U+0000, and nobody can read the others. Nor does it
hold signs that turn the order of what follows (U+202E), or, in a name, blanks without a width (U+200B).
Half surrogates are refused by pydantic itself.
"""

import re
import unicodedata
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
)
from pydantic_core import PydanticCustomError

from app.core.parameters import LARGEST_LENGTH
from app.language.i18n import _

SLUG = r"[a-z0-9][a-z0-9._-]{0,63}"
_SLUG = re.compile(SLUG)
_REORDERING = frozenset(map(chr, [*range(0x202A, 0x202F), *range(0x2066, 0x206A)]))
_UNSEEN = frozenset("\u200b\u2060\ufeff")
LARGEST_ID = 2**63 - 1
LARGEST_SERIAL = 2**31 - 1
Item = TypeVar("Item")
Answer = TypeVar("Answer", bound=BaseModel)


def is_slug(text: str) -> bool:
    """Tell if this can be the key of a machine or characteristic."""
    return _SLUG.fullmatch(text) is not None


def slug_of(name: str) -> str:
    """The key that a name suggests; empty where the name has no Latin letter or digit.

    >>> slug_of("Bearing seat Ø40 h6"), slug_of("Fräse 2"), slug_of("Вал")
    ('bearing-seat-d40-h6', 'frase-2', '')
    """
    plain = unicodedata.normalize("NFKD", name.replace("Ø", "d").replace("ø", "d").replace("ß", "ss"))
    letters = plain.encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", letters).strip("-")[:64].rstrip("-")


def _slug(text: str) -> str:
    if not is_slug(text):
        raise PydanticCustomError("slug", "not a key")
    return text


def readable(text: str) -> str:
    """The text; raises an error of pydantic if it holds a control character, or a sign that turns the order of what follows."""
    for character in text:
        if (unicodedata.category(character) in {"Cc", "Cs"} and character not in "\n\t") or character in _REORDERING:
            raise PydanticCustomError("control_character", "control character", {"code": f"U+{ord(character):04X}"})
    return text


def one_line(text: str) -> str:
    """The text; raises an error of pydantic if it is none that fits a line."""
    if "\n" in text or "\t" in text:
        raise PydanticCustomError("one_line", "one line")
    for character in _UNSEEN.intersection(text):
        raise PydanticCustomError("control_character", "control character", {"code": f"U+{ord(character):04X}"})
    return readable(text)


def _written(value: Any) -> Any:
    """A count of (milli)seconds is not a time here, not even as text: it cannot be determined which of them it is."""
    if isinstance(value, datetime) or (isinstance(value, str) and "-" in value[1:]):
        return value
    raise PydanticCustomError("datetime_type", "not a time")


Moment = Annotated[AwareDatetime, BeforeValidator(_written)]
"""A time with its offset from UTC."""

EARLIEST = datetime(2000, 1, 1, tzinfo=UTC)
"""Before it, the clock of a machine that reports was never set."""
HISTORY_BEGINS = datetime(1900, 1, 1, tzinfo=UTC)
"""No reading of a file is older."""
AHEAD = timedelta(hours=24)
"""Of this server's clock; more is a wrong clock, or a wrong unit of the time."""
MACHINED_AHEAD = timedelta(minutes=1)
"""Of this server's clock; a part cut later than that would count as cut with corrections that it was cut without."""


def _sensible(moment: datetime) -> datetime:
    if moment < EARLIEST or moment > datetime.now(UTC) + AHEAD:
        raise PydanticCustomError("moment", _("is more than a day ahead, or before 2000; check the machine's clock"))
    return moment


LatelyOrNow = Annotated[Moment, AfterValidator(_sensible)]
"""Time of an event at a machine, by its clock."""

Control = Annotated[
    Literal["sinumerik", "fanuc", "heidenhain", "other"], Field(description="Which family its control belongs to.")
]
Slug = Annotated[str, AfterValidator(_slug), Field(json_schema_extra={"pattern": f"^{SLUG}$", "maxLength": 64})]
"""A key that people choose and programs use in addresses."""

Text200 = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200), AfterValidator(one_line)
]
"""A name: one line, 1 to 200 characters."""

CHOSEN = "one of some likely ones, and what is typed besides as `more`"
"""How a form asks for a field."""
IN_UM = "typed in µm"
"""Mark of a length in mm that a form asks for in µm."""
LATER = "the later of a time that the clock shows twice"
"""Mark of a time at which something ends."""

Reason = Annotated[
    str,
    StringConstraints(strip_whitespace=True, min_length=1, max_length=1000),
    AfterValidator(readable),
    CHOSEN,
    Field(description="Why, in words; it stays on record."),
]
"""Reason for an action: 1 to 1000 characters."""

Length = Annotated[float, Field(strict=True, ge=-LARGEST_LENGTH, le=LARGEST_LENGTH, allow_inf_nan=False)]
"""A length in mm."""

RecordKey = Annotated[
    Text200,
    Field(
        max_length=128,
        description="Unique per machine: sent again, the answer is the first answer and nothing happens twice.",
    ),
]
"""The key of what is sent, for sending it again."""

MappingHash = Annotated[
    Text200,
    Field(max_length=64, description="Hash of the mapping by which the bridge converts; any text up to 64 characters."),
]
"""Which mapping a bridge has used between the tool memory and the control."""


class Body(BaseModel):
    """Body of a JSON request: unknown fields are refused by name, not ignored."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class ReasonIn(Body):
    """The reason for a change."""

    reason: Reason


def answer_from(schema: type[Answer], row: object, /, **more: Any) -> Answer:
    """An answer of this schema: what is given as `more`, and the attributes of the row that bear the names of its fields."""
    fields = {name: getattr(row, name) for name in schema.model_fields if name not in more and hasattr(row, name)}
    return schema.model_validate(fields | more, from_attributes=True)


class Page(BaseModel, Generic[Item]):
    """One page of a list; ``next`` is the cursor of the following one."""

    items: list[Item]
    next: str | None = None


def page_of(rows: Sequence[Item], limit: int, cursor: Callable[[Item], int | str]) -> Page[Item]:
    """A page of at most ``limit``, made of one row more than that: if it is there, the list goes on."""
    items = list(rows[:limit])
    return Page(items=items, next=str(cursor(items[-1])) if len(rows) > limit else None)
