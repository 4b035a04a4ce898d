"""The examples, as they lie in `cases/`."""

import json
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any

Value = float | bool | list[float | bool]
FOLDER = Path(__file__).parent / "cases"


class Basis(StrEnum):
    """Source of the expected numbers: an example counts as published only if what it cites was opened."""

    PUBLISHED = "published"
    DERIVED = "derived"
    COMPUTED = "computed"
    SIMULATED = "simulated"


@dataclass(frozen=True, slots=True)
class Case:
    """One example. `tolerance`: by name of what is expected; a list where every entry of a list has its own.

    relative: tolerances are shares of what is expected. basis: published in `source`, derived by hand, computed by
    other means than the engine, or known because what was given was made up; then `source` says how, and what was not looked up.
    """

    kind: str
    name: str
    source: str
    given: dict[str, Any]
    expected: dict[str, Value]
    tolerance: dict[str, float | list[float]]
    relative: bool = False
    note: str = ""
    basis: Basis = Basis.PUBLISHED


def case_from(described: dict[str, Any]) -> Case:
    """A case from its JSON: one tolerance may stand for all."""
    tolerance = described["tolerance"]
    if not isinstance(tolerance, dict):
        tolerance = dict.fromkeys(described["expected"], tolerance)
    return Case(**(described | {"tolerance": tolerance, "basis": Basis(described.get("basis", "published"))}))


@cache
def cases() -> tuple[Case, ...]:
    """Every case, file by file."""
    return tuple(
        case_from(described)
        for path in sorted(FOLDER.glob("*.json"))
        for described in json.loads(path.read_text(encoding="utf-8"))
    )
