"""Circumstances of a reading by which readings differ: its order, its batch, its nest and others."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any


class ContextField(StrEnum):
    """A field of the context of a reading that makes strata; all but the nest are texts."""

    ORDER = "order"
    BATCH = "batch"
    NEST = "nest"
    SPINDLE = "spindle"
    FIXTURE = "fixture"
    OPERATOR = "operator"
    PROGRAM = "program"
    GAUGE = "gauge"


Chosen = tuple[tuple[ContextField, str], ...]
"""Values that the context of a reading must have, each field once."""


def as_stored(chosen: Chosen) -> dict[str, str | int]:
    """The chosen values as a context has them.

    >>> as_stored(((ContextField.ORDER, "A-77"), (ContextField.NEST, "2")))
    {'order': 'A-77', 'nest': 2}
    """
    return {field.value: int(value) if field is ContextField.NEST else value for field, value in chosen}


def missing(context: Mapping[str, Any] | None, required: tuple[ContextField, ...]) -> list[ContextField]:
    """The required fields that a context does not have. A nest 0 is a nest.

    >>> [field.value for field in missing({"order": "A-77", "nest": 0}, (ContextField.ORDER, ContextField.NEST, ContextField.BATCH))]
    ['batch']
    """
    return [field for field in required if (context or {}).get(field.value) is None]
