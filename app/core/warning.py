"""A warning as the core gives it: a code and the values that a sentence is made of. The words are added at the edge."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

Value = float | str | tuple[int, ...]


@dataclass(frozen=True)
class CodedWarning:
    """Something was accepted although it may be wrong: a frame turned far, points exchanged, a unit assumed.

    code: a stable name such as `turned_far`. values: the numbers and names for the sentence, lengths in mm, angles in
    degrees. field: the field of the request that caused it, such as `touches[2].deviation`; None for the whole.
    """

    code: str
    values: Mapping[str, Value] = field(default_factory=dict)
    field: str | None = None


def as_stored(warnings: Iterable[CodedWarning]) -> list[dict[str, Any]]:
    """Return warnings as they are kept with a result, as JSON."""
    return [
        {
            "code": warning.code,
            "values": {name: _plain(value) for name, value in warning.values.items()},
            "field": warning.field,
        }
        for warning in warnings
    ]


def of_stored(stored: Iterable[Mapping[str, Any]]) -> list[CodedWarning]:
    """Return warnings as they were kept."""
    return [CodedWarning(entry["code"], entry["values"], entry["field"]) for entry in stored]


def _plain(value: Value) -> Any:
    return list(value) if isinstance(value, tuple) else value
