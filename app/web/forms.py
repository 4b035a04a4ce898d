"""Forms that people send: read by the same schemas as JSON, and shown again with everything they typed."""

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from app.core.number_text import number_or_none
from app.errors import FieldError, InbandError, Invalid
from app.language.i18n import _
from app.web.validation import field_errors

Schema = TypeVar("Schema", bound=BaseModel)


def parsed(schema: type[Schema], fields: Mapping[str, Any]) -> Schema:
    """The form's fields as the API's schema; a field left empty is not said. Raises `Invalid`."""
    filled = {name: value for name, value in fields.items() if value is not None and value != ""}
    try:
        return schema.model_validate(filled)
    except ValidationError as error:
        errors = [FieldError(field, message) for field, message in field_errors(error.errors())]
        raise Invalid(_("The form has to be corrected."), errors=errors) from None


def by_field(error: InbandError) -> dict[str, str]:
    """Errors by the name of the field in the form."""
    messages: dict[str, str] = {}
    for field, message in error.errors:
        name = field.removeprefix("parameters.")
        sentence = message[:1].upper() + message[1:]
        messages[name] = f"{messages[name]}. {sentence}" if name in messages else sentence
    return messages


def length(text: str | None) -> float | str | None:
    """A length in mm as people type it, with a decimal point or comma; what is no number is left for the schema to refuse.

    >>> length(" 0,05 "), length("−0.5"), length(""), length("5 mm"), length("0. 001")
    (0.05, -0.5, None, '5 mm', '0. 001')
    """
    text = (text or "").strip()
    if not text:
        return None
    value = number_or_none(text)
    return text if value is None else value


def micrometres(text: str | None) -> float | str | None:
    """A length as people type it in µm, in mm."""
    value = length(text)
    return round(value / 1000, 9) if isinstance(value, float) else value


def whole(text: str | None) -> int | str | None:
    """A whole number as people type it; what is none is left for the schema to refuse."""
    text = (text or "").strip()
    return int(text) if text.isdecimal() and len(text) < 12 else text or None


def whole_numbers(text: str | None) -> list[int | str | None]:
    """Whole numbers between commas, semicolons or blanks."""
    return [whole(number) for number in (text or "").replace(",", " ").replace(";", " ").split()]


def characteristics_typed(form: Mapping[str, str], results: Iterable[str]) -> dict[str, str]:
    """The characteristics whose readings results become, from the fields `as_x`, by result."""
    return {result: key for result in results if (key := form.get(f"as_{result}", "").strip())}


def words(fields: Mapping[str, str], name: str) -> str:
    """A reason or comment: the one that was chosen as `name`, and what was typed besides as `more`."""
    chosen, more = fields.get(name, "").strip(), fields.get("more", "").strip()
    return _("{chosen}: {more}").format(chosen=chosen, more=more) if chosen and more else chosen or more
