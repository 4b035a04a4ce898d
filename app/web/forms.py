"""Forms that people send: read by the same schemas as JSON, and shown again with everything they typed."""

import re
from collections.abc import Callable, Iterable, Mapping
from datetime import datetime
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import AwareDatetime, BaseModel, ValidationError
from pydantic.fields import FieldInfo

from app.core.number_text import number_or_none
from app.errors import FieldError, InbandError, Invalid
from app.files.formats import cell_values
from app.language.i18n import _
from app.language.times import plant_zone
from app.web.fields import CHOSEN, IN_UM, LATER
from app.web.validation import field_errors

Schema = TypeVar("Schema", bound=BaseModel)
BETWEEN = re.compile(r"[\s;]+")


def parsed(schema: type[Schema], fields: Mapping[str, Any]) -> Schema:
    """The form's fields as the API's schema; a field left empty is not said. Raises `Invalid`."""
    filled = {name: value for name, value in fields.items() if value is not None and value != ""}
    try:
        return schema.model_validate(filled)
    except ValidationError as error:
        errors = [FieldError(field, message) for field, message in field_errors(error.errors())]
        raise Invalid(_("The form has to be corrected."), errors=errors) from None


def typed(schema: type[Schema], form: Mapping[str, str], **more: Any) -> Schema:
    """The form as the API's schema: each field that bears a name of the schema is read as its type says. Raises `Invalid`.

    more: what was read otherwise, in place of the form's field; None: left out.
    """
    return parsed(schema, read(schema, form) | more)


def read(schema: type[BaseModel], form: Mapping[str, str]) -> dict[str, Any]:
    """Values of a form for the fields of a schema, by name.

    A length with comma or minus as people type it, in µm where the field says so; numbers between blanks, a tick, a reason
    chosen or in own words (`words`), a time by the plant's clock. Raises `Invalid` for what is no time.
    """
    return {name: _read(form, name, _kinds(field)) for name, field in schema.model_fields.items()}


def _read(form: Mapping[str, str], name: str, kinds: set[Any]) -> Any:
    text = form.get(name, "").strip()
    if CHOSEN in kinds:
        return words(form, name)
    if bool in kinds:
        return text == "true" or None
    if list in kinds:
        return (lengths(text) if float in kinds else whole_numbers(text)) or None
    if AwareDatetime in kinds:
        return moment(form, name, end=LATER in kinds)
    if float in kinds:
        return micrometres(text) if IN_UM in kinds else length(text)
    return whole(text) if int in kinds else text


def _kinds(annotation: Any) -> set[Any]:
    """The plain types of an annotation and the marks beside them: {float, NoneType} of an optional length, {list, int}."""
    if isinstance(annotation, FieldInfo):
        return {mark for mark in annotation.metadata if isinstance(mark, str)} | _kinds(annotation.annotation)
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kinds(arguments[0]) | {mark for mark in arguments[1:] if isinstance(mark, str)}
    if origin in (Union, UnionType, list):
        return {kind for each in arguments for kind in _kinds(each)} | {origin}
    return {origin or annotation}


class FieldErrors(dict[str, str]):
    """Sentences by the name of the field in the form, which knows which of them a template has not asked for.

    >>> errors = FieldErrors(name="Is missing.", key="Is taken.")
    >>> errors.get("name"), errors.unsaid
    ('Is missing.', ['key: Is taken.'])
    """

    def __init__(self, *of: Mapping[str, str], **named: str) -> None:
        super().__init__(*of, **named)
        self._asked: set[str] = set()

    def __getitem__(self, name: str) -> str:
        self._asked.add(name)
        return super().__getitem__(name)

    def get(self, name: str, default: Any = None) -> Any:
        """The sentence of this field."""
        self._asked.add(name)
        return super().get(name, default)

    def items(self) -> Any:
        """All of them, which are asked for with that."""
        self._asked.update(self)
        return super().items()

    def values(self) -> Any:
        """All of them, which are asked for with that."""
        self._asked.update(self)
        return super().values()

    @property
    def unsaid(self) -> list[str]:
        """Sentences that no field shows."""
        return [f"{name}: {sentence}" for name, sentence in super().items() if name not in self._asked]


def by_field(error: InbandError, at: Callable[[str, str], tuple[str, str]] = lambda *same: same) -> FieldErrors:
    """Errors by the name of the field in the form, each sentence once.

    at: from a field of the API and its message, the field of the form and the message there.
    """
    messages: dict[str, str] = {}
    for field, message in error.errors:
        name, words = at(field.removeprefix("parameters."), message)
        sentence = words[:1].upper() + words[1:]
        if sentence not in messages.get(name, ""):
            messages[name] = f"{messages[name]}. {sentence}" if name in messages else sentence
    return FieldErrors(messages)


def of_lists(errors: Mapping[str, str], words: Mapping[str, str]) -> list[str]:
    """Errors of lists that have no field of their own. words: the name of each as the form has it.

    >>> of_lists({"name": "Is missing", "steps": "Must have at least one entry"}, {"steps": "Steps"})
    ['Steps: must have at least one entry']
    """
    wrong = ((re.split(r"[.\[]", field)[0], text) for field, text in errors.items())
    return [f"{words[name]}: {text[:1].lower()}{text[1:]}" for name, text in wrong if name in words]


def length(text: str | None) -> float | str | None:
    """A length in mm as people type it, with a decimal point or comma; what is not a number is left for the schema to refuse.

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


def moment(form: Mapping[str, str], name: str, *, end: bool = False) -> datetime | None:
    """A moment as people type it in this field, by the plant's clock; None where it is left empty. Raises `Invalid`.

    Of a time that the clock shows twice the first one, as an `end` the second.
    """
    text, zone = form.get(name, "").strip(), plant_zone()
    try:
        return cell_values.moment(text, zone, fold=1 if end else 0) if text else None
    except cell_values.Unreadable as error:
        skipped = _("does not exist in {zone}: the clocks go forward in that hour").format(zone=zone.key)
        raise Invalid.at(name, skipped if str(error) == cell_values.never_was(zone) else str(error)) from None


def whole(text: str | None) -> int | str | None:
    """A whole number as people type it; what is none is left for the schema to refuse."""
    text = (text or "").strip()
    return int(text) if text.isdecimal() and len(text) < 12 else text or None


def whole_numbers(text: str | None) -> list[int | str | None]:
    """Whole numbers between commas, semicolons or blanks."""
    return [whole(number) for number in (text or "").replace(",", " ").replace(";", " ").split()]


def ticked(form: Mapping[str, str], name: str) -> list[str]:
    """The choices of a group of ticks, whose fields are `name-choice`.

    >>> ticked({"day-1": "true", "day-2": "", "on": "true", "day-7": "true"}, "day")
    ['1', '7']
    """
    return [field.removeprefix(f"{name}-") for field, value in form.items() if field.startswith(f"{name}-") and value]


def ticked_numbers(form: Mapping[str, str], name: str) -> list[int]:
    """The same where each choice is a number."""
    return [int(each) for each in ticked(form, name) if each.isdecimal()]


def lengths(text: str | None) -> list[float | str | None]:
    """Lengths in mm between blanks, semicolons or line ends, with a decimal point or comma.

    >>> lengths("199,852 199.8531")
    [199.852, 199.8531]
    """
    return [length(number) for number in BETWEEN.split((text or "").strip()) if number]


def characteristics_typed(form: Mapping[str, str], results: Iterable[str]) -> dict[str, str]:
    """The characteristics whose readings results become, from the fields `as_x`, by result."""
    return {result: key for result in results if (key := form.get(f"as_{result}", "").strip())}


def words(fields: Mapping[str, str], name: str) -> str:
    """A reason or comment: the one that was chosen as `name`, and what was typed besides as `more`."""
    chosen, more = fields.get(name, "").strip(), fields.get("more", "").strip()
    return _("{chosen}: {more}").format(chosen=chosen, more=more) if chosen and more else chosen or more
