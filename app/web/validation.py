"""Errors that pydantic reports, in words that a machinist understands."""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from app.core.parameters import LARGEST_LENGTH
from app.errors import FieldError, Invalid
from app.language.formatting import as_typed
from app.language.i18n import _

LENGTHS = {"tip", "tip_radius", "feeler"}  # whose limit is nearer than that of other lengths
_KIND = re.compile(r"constrained-\w+|literal\[.*\]")  # how pydantic names one of the kinds that a field may be of
OTHER_UNITS = {"probing_feed": "mm/min", "group_pause": "min"}  # of fields that go as far as lengths and are none


def field_path(location: Sequence[str | int]) -> str:
    """``("body", "parameters", "zero_range")`` is `parameters.zero_range`; list items are `[17].measured`."""
    if location and location[0] == "query":  # of several values, the query string does not say which
        location = [step for step in location if not isinstance(step, int)]
    location = [step for step in location if not (isinstance(step, str) and _KIND.fullmatch(step))]
    path = ""
    for step in location[1:] if location and location[0] in {"body", "query", "path", "header"} else location:
        path += f"[{step}]" if isinstance(step, int) else f".{step}" if path else str(step)
    return path or "body"


def field_errors(errors: Iterable[Mapping[str, Any]]) -> list[FieldError]:
    """One sentence for each thing that is wrong; where a field may be of several kinds, one for all of them."""
    sentences: dict[str, list[str]] = {}
    for error in errors:
        sentences.setdefault(_field_of(error), []).append(message(error))
    return [FieldError(field, _(", or ").join(dict.fromkeys(messages))) for field, messages in sentences.items()]


def _field_of(error: Mapping[str, Any]) -> str:
    """The field that is meant: of a check of several fields together, the one that it names as `at` in its context."""
    at = str((error.get("ctx") or {}).get("at") or "")
    return field_path((*error["loc"], *at.split("."))) if at else field_path(error["loc"])


def message(error: Mapping[str, Any]) -> str:
    """The sentence for one of pydantic's errors."""
    kind, context = str(error["type"]), error.get("ctx", {})
    if kind == "missing" and tuple(error["loc"]) == ("body",):
        return _("is missing: send a JSON object with the header Content-Type: application/json")
    simple = {
        "missing": _("is missing"),
        "extra_forbidden": _("is not a field of this request; check the spelling"),
        "string_type": _("must be text in quotation marks"),
        "string_unicode": _("holds half a character (a lone surrogate); send complete Unicode text"),
        "slug": _(
            "must be a key of 1 to 64 characters: small letters a-z, digits, point, hyphen and underscore, "
            "beginning with a letter or digit, for example shaft-d40"
        ),
        "one_line": _("must be one line of text"),
        "int_type": _("must be a whole number"),
        "int_parsing": _("must be a whole number"),
        "int_parsing_size": _("is too large a number"),
        "int_from_float": _("must be a whole number"),
        "float_type": _("must be a number"),
        "float_parsing": _("must be a number with a decimal point, for example 0.0053"),
        "finite_number": _("must be a finite number"),
        "bool_type": _("must be true or false"),
        "bool_parsing": _("must be true or false"),
        "dict_type": _("must be a JSON object: {...}"),
        "mapping_type": _("must be a JSON object: {...}"),
        "model_attributes_type": _("must be a JSON object: {...}"),
        "model_type": _("must be a JSON object: {...}"),
        "list_type": _("must be a JSON list: [...]"),
        "timezone_aware": _("must say its offset from UTC, for example 2026-11-21T08:15:02+01:00"),
    }.get(kind)
    if simple is not None:
        return simple
    if kind.startswith("date_"):
        return _("must be a day, for example 2026-11-21")
    if kind.startswith(("datetime", "date", "time")):
        return _("must be a time with its offset from UTC, for example 2026-11-21T08:15:02+01:00")
    if kind in {"enum", "literal_error"}:
        return _("must be one of {choices}").format(choices=str(context.get("expected", "")).replace("'", ""))
    if kind == "string_pattern_mismatch" and "|all" in str(context.get("pattern")):
        # How all that ask for the last N readings are made: a number, or one of these words.
        words = str(context["pattern"]).rstrip(")$").split("|")[1:]
        return _("must be a number of readings from 1 on, such as 500, or one of: {words}").format(
            words=", ".join(words)
        )
    if kind == "too_long" and isinstance(error.get("input"), str):  # of a text that was read in another way first
        kind = "text_too_long"
    sentence = _with_values(kind, context)
    return str(error.get("msg", kind)) if sentence is None else sentence + _unit_of(error)


def _unit_of(error: Mapping[str, Any]) -> str:
    """The unit of a limit that is as far as lengths go, so that nobody takes it for another one."""
    limit = (error.get("ctx") or {}).get("le", (error.get("ctx") or {}).get("ge"))
    field = str(error["loc"][-1]) if error.get("loc") else ""  # a value checked by itself has no place
    if isinstance(limit, float) and (field in LENGTHS or abs(limit) == LARGEST_LENGTH):
        return f" {OTHER_UNITS.get(field, 'mm')}"
    return ""


def _with_values(kind: str, context: Mapping[str, Any]) -> str | None:
    sentences = {
        "string_too_short": (
            _("must not be empty")
            if context.get("min_length") == 1
            else _("must have at least {min_length} characters")
        ),
        "string_too_long": _("must have at most {max_length} characters"),
        "control_character": _("holds a control character ({code}), which cannot be read or stored; remove it"),
        "greater_than": _("must be greater than {gt}"),
        "greater_than_equal": _("must be at least {ge}"),
        "less_than": _("must be less than {lt}"),
        "less_than_equal": _("must be at most {le}"),
        "string_pattern_mismatch": _("must have the form {pattern}"),
        "too_long": _("must have at most {max_length} entries, not {actual_length}"),
        "text_too_long": _("must have at most {max_length} characters, not {actual_length}"),
        "too_short": (
            _("must have at least one entry")
            if context.get("min_length") == 1
            else _("must have at least {min_length} entries")
        ),
    }
    sentence = sentences.get(kind)
    return None if sentence is None else sentence.format(**{name: _plain(value) for name, value in context.items()})


def _plain(value: Any) -> Any:
    """A limit as people write it: 0 and 0.000001, neither 0.0 nor 1e-06."""
    return as_typed(value) if isinstance(value, float) else value


def checked(kind: Any, value: Any, field: str) -> Any:
    """The value as this annotated type (`Text200`, `Reason`, …). Raises `Invalid` that names the field."""
    try:
        return _adapter(kind).validate_python(value)
    except ValidationError as error:
        errors = [FieldError(field, message(problem)) for problem in error.errors()]
        raise Invalid(
            f"{field}: {errors[0].message}", _("Correct the named field and send it again."), errors=errors
        ) from None


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)
