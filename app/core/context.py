"""Circumstances of a reading by which readings differ: its order, its batch, its nest and others."""

from enum import StrEnum


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
