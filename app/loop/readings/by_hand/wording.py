"""Measurements by hand as they are answered."""

from typing import Any


def verdict_of(good: bool | None) -> str | None:
    """The verdict for programs."""
    return None if good is None else "good" if good else "bad"


def as_json(row: Any) -> dict[str, Any]:
    """A row as it is answered."""
    return {
        "id": row.id,
        "sequence": row.sequence,
        "at": row.at,
        "by": row.actor,
        "measured": row.measured,
        "verdict": verdict_of(row.good),
        "comment": row.comment,
        "alarm": row.alarm,
    }
