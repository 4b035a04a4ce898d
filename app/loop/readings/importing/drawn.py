"""Characteristics that a table itself describes, row by row: nominal size and limits, by which missing ones are set up."""

from collections.abc import Collection
from enum import Enum
from typing import NamedTuple

from app.core.natural_limit import NaturalLimit
from app.core.number_text import NotANumber, read_number
from app.files.formats.cell_values import Unreadable, folded
from app.files.formats.column_names import LOWER_LIMITS, LOWER_OF_EITHER, UPPER_LIMITS, UPPER_OF_EITHER
from app.files.formats.number_with_unit import agreed_unit, in_mm, number_and_unit
from app.files.formats.units import UnknownUnit, unit_in, unit_of_name
from app.language.i18n import _
from app.loop.readings.aqdef.matching import Content, not_new
from app.loop.readings.importing.columns import is_both_ways, is_tolerance, is_unsigned
from app.loop.readings.importing.layout import Drawn, Layout

_SIZES = frozenset(map(folded, (*UPPER_LIMITS, *LOWER_LIMITS)))
_EITHER = frozenset(map(folded, (*UPPER_OF_EITHER, *LOWER_OF_EITHER)))


class _Wrong(ValueError):
    """A characteristic that its rows do not describe; the words say why."""


class _Limits(Enum):
    """The meanings of limits: sizes, or deviations from the nominal size."""

    SIZES = 1
    DEVIATIONS = 2


def contents(layout: Layout) -> list[Content]:
    """The characteristics that the rows name, as far as they describe them, in the order of `layout.names`."""
    votes = _votes(layout)
    return [_content(place, name, drawn, layout, votes) for place, (name, drawn) in enumerate(layout.drawn.items())]


def missing(layout: Layout, chosen: Collection[int]) -> tuple[list[Content], list[Content]]:
    """Those that are not chosen: which can be set up, and which cannot."""
    others = [each for each in contents(layout) if each.index not in chosen]
    return [each for each in others if not each.not_new], [each for each in others if each.not_new]


class _Vote(NamedTuple):
    """The meaning of the limits of a line by its numbers. sure: they are far nearer to the one than to the other."""

    limits: _Limits
    sure: bool
    line: int


def _votes(layout: Layout) -> dict[_Limits, _Vote]:
    """The meanings of columns such as Upper and Lower by the numbers of all lines, each with the first line that has it."""
    votes: list[_Vote] = []
    for name, drawn in layout.drawn.items():
        try:
            vote = _vote(drawn.line, *(_length(name, drawn, layout, side) for side in ("nominal", "lower", "upper")))
        except _Wrong:
            continue
        votes += [] if vote is None else [vote]
    sure = [vote for vote in votes if vote.sure] or votes
    return {vote.limits: vote for vote in reversed(sure)}


def _vote(line: int, nominal: float | None, lower: float | None, upper: float | None) -> _Vote | None:
    """The only meaning that the limits of a line can have: sizes are about the nominal size, deviations about 0. None where both are possible."""
    limits = [each for each in (lower, upper) if each is not None]
    if not nominal or not limits:
        return None
    if all(abs(each) < abs(nominal) / 10 for each in limits):
        return _Vote(_Limits.DEVIATIONS, True, line)
    if all(abs(each - nominal) < abs(nominal) / 10 for each in limits) and any(each != nominal for each in limits):
        return _Vote(_Limits.SIZES, True, line)
    if lower is None or upper is None or (lower <= nominal <= upper) == (lower <= 0 <= upper):
        return None
    return _Vote(_Limits.SIZES if lower <= nominal <= upper else _Limits.DEVIATIONS, False, line)


def _agreed(votes: dict[_Limits, _Vote], own: _Vote | None, column: str) -> _Limits:
    """The meaning that all lines give a column such as Upper, and this one does not deny. Raises `_Wrong`."""
    found = dict(votes)
    if own is not None:
        found.setdefault(own.limits, own)
    if len(found) == 1:
        return next(iter(found))
    what = _("Name it “upper limit” or “lower limit” for sizes, “upper deviation” or “lower deviation” for deviations")
    if not found:
        words = _("its {column} may be a size or a deviation, and no other line tells. {what}")
        raise _Wrong(words.format(column=column, what=what))
    words = _(
        "its {column} holds sizes by the numbers of line {sizes}, and deviations by those of line {deviations}. {what}"
    )
    sizes, deviations = found[_Limits.SIZES].line, found[_Limits.DEVIATIONS].line
    raise _Wrong(words.format(column=column, sizes=sizes, deviations=deviations, what=what))


def _content(place: int, name: str, drawn: Drawn, layout: Layout, votes: dict[_Limits, _Vote]) -> Content:
    try:
        nominal, lower, upper = _limits(name, drawn, layout, votes)
        natural = _natural(drawn, layout)
    except _Wrong as error:
        return Content(place, "", "", "", name, "mm", not_new=str(error))
    if lower is None and upper is not None and not nominal and natural in (None, NaturalLimit.LOWER):
        nominal, lower, natural = 0.0, 0.0, NaturalLimit.LOWER  # a form error
    reason = not_new(nominal, lower, upper, (_limit(layout, "lower"), _limit(layout, "upper")))
    return Content(place, "", "", "", name, "mm", nominal, lower, upper, not_new=reason, natural_limit=natural)


def _limit(layout: Layout, side: str) -> str:
    """The limit that is missing, and how its column is named where none is known."""
    words = {"lower": _("the lower limit"), "upper": _("the upper limit")}[side]
    return words if side in layout.columns else _("{limit} (--map {side}=COLUMN)").format(limit=words, side=side)


def _natural(drawn: Drawn, layout: Layout) -> NaturalLimit | None:
    """The natural limit that its rows name; None where they say nothing. Raises `_Wrong`."""
    said = folded(drawn.natural_limit)
    if not said:
        return None
    if said not in set(NaturalLimit):
        words = _("{column} {said!r} is not lower, upper or none")
        raise _Wrong(words.format(column=layout.named("natural_limit"), said=drawn.natural_limit[:40]))
    return NaturalLimit(said)


def _limits(
    name: str, drawn: Drawn, layout: Layout, votes: dict[_Limits, _Vote]
) -> tuple[float | None, float | None, float | None]:
    """Nominal size, lower and upper limit, mm. Raises `_Wrong`."""
    if drawn.other:
        words = _(
            "lines {first} and {other} give it different limits, nominal sizes or units: if another column tells them apart, "
            "--map characteristic={column}+COLUMN"
        )
        raise _Wrong(words.format(first=drawn.line, other=drawn.other, column=layout.named("characteristic")))
    both = is_both_ways(layout.named("lower"))
    if drawn.lower and is_tolerance(layout.named("lower")):
        if not is_both_ways(drawn.lower):
            words = _(
                "its {column} {said!r} may be half the tolerance or all of it: write ±, or a column for each limit"
            )
            raise _Wrong(words.format(column=layout.named("lower"), said=drawn.lower[:40]))
        both = True
    nominal, lower, upper = (_length(name, drawn, layout, side) for side in ("nominal", "lower", "upper"))
    if (both or is_unsigned(layout.named("lower"))) and lower is not None:
        lower = -abs(lower)
        upper = -lower if both else upper
    own = _vote(drawn.line, nominal, lower, upper)
    form_error = lower is None and not nominal  # its upper limit is both
    sizes = []
    for side, value in (("lower", lower), ("upper", upper)):
        if value is None or form_error:
            sizes.append(value)
            continue
        found = _kind(layout.named(side), nominal, votes, own)
        sizes.append(value if found is _Limits.SIZES else round((nominal or 0.0) + value, 9))
    if lower is not None and upper is not None and lower > 0 and sizes[0] != lower:
        words = _("its {column} is above 0: a deviation, or one without its sign? It cannot be determined")
        raise _Wrong(words.format(column=layout.named("lower")))
    return nominal, sizes[0], sizes[1]


def _kind(column: str, nominal: float | None, votes: dict[_Limits, _Vote], own: _Vote | None) -> _Limits:
    """The meaning of a column of limits, by its name or by the numbers. Raises `_Wrong` where they contradict each other."""
    either, sizes = folded(column) in _EITHER, folded(column) in _SIZES
    if nominal is None and not sizes:
        words = _("its {column} is a deviation from a nominal size, which is missing")
        if either:
            words = _("its {column} may be a size or a deviation: the nominal size, which would tell, is missing")
        raise _Wrong(words.format(column=column))
    if either and nominal:
        return _agreed(votes, own, column)
    found = _Limits.SIZES if sizes else _Limits.DEVIATIONS
    if own is not None and own.limits is not found:
        words = _("its {column} is a deviation by its name, and near the nominal size: a size? It cannot be determined")
        if sizes:
            words = _(
                "its {column} is a size by its name, and far from the nominal size: a deviation? It cannot be determined"
            )
        raise _Wrong(words.format(column=column))
    return found


def _length(name: str, drawn: Drawn, layout: Layout, field: str) -> float | None:
    text = getattr(drawn, field).removeprefix("±").removeprefix("+/-").removeprefix("+-")
    if not text:
        return None
    number, behind = number_and_unit(text)
    try:
        said = unit_of_name(name, layout.said_unit or drawn.unit or behind or None)
        unit = agreed_unit(unit_in(layout.named(field)) or layout.said_unit, drawn.unit, behind, said)
        length: float = in_mm(read_number(number), unit)
    except (NotANumber, Unreadable, UnknownUnit) as error:
        reason = str(error) if isinstance(error, Unreadable) else _("is not a number, or in no unit that is known")
        raise _Wrong(f"{layout.named(field)} {text[:40]!r} {reason}") from None
    return length
