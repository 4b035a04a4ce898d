"""Measurements by hand as they are answered and as people read them."""

from typing import Any

from app.web.i18n import _
from app.web.numbers import mm


def verdict_of(good: bool | None) -> str | None:
    """The verdict for programs."""
    return None if good is None else "good" if good else "bad"


def verdict_word(good: bool | None) -> str:
    """The verdict for people."""
    return _("no verdict") if good is None else _("good") if good else _("scrap")


def in_words(measured: float | None, good: bool | None) -> str:
    """Size and verdict: `40.0010 mm, good`."""
    said = [mm(measured)] if measured is not None else []
    return ", ".join([*said, *([verdict_word(good)] if good is not None else [])])


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
