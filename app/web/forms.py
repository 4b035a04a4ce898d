"""Forms that people send: read by the same schemas as JSON, and shown again with everything they typed."""

from collections.abc import Iterable, Mapping
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from app.core.number_text import number_or_none
from app.errors import FieldError, InbandError, Invalid
from app.language.i18n import _
from app.web.fields import CHOSEN
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


def typed(schema: type[Schema], form: Mapping[str, str]) -> Schema:
    """The form as the API's schema: each field that bears a name of the schema is read as its type says. Raises `Invalid`.

    A length with comma or minus as people type it, whole numbers between commas, a tick, a reason chosen or in own words (`words`).
    """
    return parsed(schema, {name: _read(form, name, field) for name, field in schema.model_fields.items()})


def _read(form: Mapping[str, str], name: str, field: FieldInfo) -> Any:
    text = form.get(name, "").strip()
    if CHOSEN in field.metadata:
        return words(form, name)
    kinds = _kinds(field.annotation)
    if bool in kinds:
        return text == "true" or None
    if list in kinds:
        return whole_numbers(text)
    if float in kinds:
        return length(text)
    return whole(text) if int in kinds else text


def _kinds(annotation: Any) -> set[Any]:
    """The plain types of an annotation, without the rules beside them: {float, NoneType} of an optional length."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return _kinds(get_args(annotation)[0])
    if origin in (Union, UnionType):
        return {kind for each in get_args(annotation) for kind in _kinds(each)}
    return {origin or annotation}


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
