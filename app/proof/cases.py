"""The published examples, as they lie in `cases/`."""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

Value = float | bool | list[float | bool]
FOLDER = Path(__file__).parent / "cases"


@dataclass(frozen=True, slots=True)
class Case:
    """One example. `tolerance`: by name of what is expected; a list where every entry of a list has its own.

    relative: tolerances are shares of what is expected.
    """

    kind: str
    name: str
    source: str
    given: dict[str, Any]
    expected: dict[str, Value]
    tolerance: dict[str, float | list[float]]
    relative: bool = False
    note: str = ""


def case_from(described: dict[str, Any]) -> Case:
    """A case from its JSON: one tolerance may stand for all."""
    tolerance = described["tolerance"]
    if not isinstance(tolerance, dict):
        tolerance = dict.fromkeys(described["expected"], tolerance)
    return Case(**(described | {"tolerance": tolerance}))


@cache
def cases() -> tuple[Case, ...]:
    """Every case, file by file."""
    return tuple(
        case_from(described)
        for path in sorted(FOLDER.glob("*.json"))
        for described in json.loads(path.read_text(encoding="utf-8"))
    )
