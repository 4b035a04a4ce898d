"""Sentences on readings that an import stored, and on lines that it cannot take."""

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from app.language.i18n import _, ngettext
from app.language.times import MINUTES, plant_zone, written

if TYPE_CHECKING:
    from datetime import datetime

    from app.loop.readings.importing.cells import Flaw

ALIKE = 3  # lines in a row with the same flaw that are named one by one


def stored_of(count: int, characteristic: str) -> str:
    """The readings that were stored of a characteristic, as a sentence begins."""
    text = ngettext("%(num)d reading of %(name)s", "%(num)d readings of %(name)s", count)
    return text % {"num": count, "name": characteristic}


def stored_before(count: int) -> str:
    """The sentence on readings that were there."""
    text = ngettext(
        "%(num)d was stored before and is not stored again.",
        "%(num)d were stored before and are not stored again.",
        count,
    )
    return text % {"num": count}


def which(numbers: tuple[int, int | None] | None, span: "tuple[datetime, datetime] | None") -> str:
    """The first and last of some readings, by number and by time, as a sentence goes on."""
    text = ""
    if numbers is not None:
        text += _(", numbers {first} to {last}").format(first=numbers[0], last=numbers[1])
    if span is not None:
        moments = f"{written(span[0], MINUTES)} – {written(span[1], MINUTES)} {plant_zone().key}"
        text += _(", measured {span}").format(span=moments)
    return text


def sentences(flaws: "Iterable[Flaw]") -> Iterator[str]:
    """Each flaw; where line after line is wrong in one way, the first ones and how far."""
    for column, reason, alike in _alike(flaws):
        listed = alike if len(alike) <= ALIKE + 1 else alike[:ALIKE]
        yield from map(str, listed)
        if len(listed) < len(alike):
            lines = _("lines {first} to {last}").format(first=alike[ALIKE].line, last=alike[-1].line)
            yield f"{lines}{f', {column}' if column else ''}: {reason}"


def _alike(flaws: "Iterable[Flaw]") -> "Iterator[tuple[str, str, list[Flaw]]]":
    """Flaws of neighbouring lines with the same column and reason, together."""
    together: list[Flaw] = []
    for flaw in flaws:
        if together and (flaw.column, flaw.reason, flaw.line) != (
            together[-1].column,
            together[-1].reason,
            together[-1].line + 1,
        ):
            yield together[0].column, together[0].reason, together
            together = []
        together.append(flaw)
    if together:
        yield together[0].column, together[0].reason, together
