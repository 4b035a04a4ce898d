"""Characteristics that a table itself describes, row by row: nominal size and limits, by which missing ones are set up."""

from collections.abc import Collection

from app.core.natural import NaturalLimit
from app.core.number_text import NotANumber, read_number
from app.files.formats.cell_values import Unreadable, folded
from app.files.formats.column_names import LOWER_LIMITS, LOWER_OF_EITHER, UPPER_LIMITS, UPPER_OF_EITHER
from app.files.formats.units import UnknownUnit, agreed, in_mm, unit_in, unit_of_name
from app.language.i18n import _
from app.loop.readings.aqdef.matching import Content, not_new
from app.loop.readings.importing.columns import is_both_ways, is_tolerance, is_unsigned
from app.loop.readings.importing.layout import Drawn, Layout

_SIZES = frozenset(map(folded, (*UPPER_LIMITS, *LOWER_LIMITS)))
_EITHER = frozenset(map(folded, (*UPPER_OF_EITHER, *LOWER_OF_EITHER)))


class _Wrong(ValueError):
    """A characteristic that its rows do not describe; the words say why."""


def contents(layout: Layout) -> list[Content]:
    """The characteristics that the rows name, as far as they describe them, in the order of `layout.names`."""
    return [_content(place, name, drawn, layout) for place, (name, drawn) in enumerate(layout.drawn.items())]


def missing(layout: Layout, chosen: Collection[int]) -> tuple[list[Content], list[Content]]:
    """Those that nobody has chosen: which can be set up, and which cannot."""
    others = [each for each in contents(layout) if each.index not in chosen]
    return [each for each in others if not each.not_new], [each for each in others if each.not_new]


def _content(place: int, name: str, drawn: Drawn, layout: Layout) -> Content:
    try:
        nominal, lower, upper = _limits(name, drawn, layout)
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


def _limits(name: str, drawn: Drawn, layout: Layout) -> tuple[float | None, float | None, float | None]:
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
    sizes = []
    for side, value in (("lower", lower), ("upper", upper)):
        form_error = lower is None and not nominal  # its upper limit is both
        column = folded(layout.named(side))
        by_number = column in _EITHER and nominal and value is not None and abs(value) > abs(nominal) / 2
        if value is None or form_error or column in _SIZES or by_number:
            sizes.append(value)
        elif nominal is None and column in _EITHER:
            words = _("its {column} may be a size or a deviation: the nominal size, which would tell, is missing")
            raise _Wrong(words.format(column=layout.named(side)))
        elif nominal is None:
            raise _Wrong(
                _("its {column} is a deviation from a nominal size, which is missing").format(column=layout.named(side))
            )
        else:
            sizes.append(round(nominal + value, 9))
    if lower is not None and upper is not None and lower > 0 and sizes[0] != lower:
        words = _("its {column} is above 0: a deviation, or one without its sign? Nobody can tell")
        raise _Wrong(words.format(column=layout.named("lower")))
    if nominal and upper is not None and sizes[1] == upper and abs(upper) < abs(nominal) / 2:
        words = _("its {column} is a size by its name, and far from the nominal size: a deviation? Nobody can tell")
        raise _Wrong(words.format(column=layout.named("upper")))
    return nominal, sizes[0], sizes[1]


def _length(name: str, drawn: Drawn, layout: Layout, field: str) -> float | None:
    text = getattr(drawn, field).removeprefix("±").removeprefix("+/-").removeprefix("+-")
    if not text:
        return None
    try:
        unit = agreed(
            unit_in(layout.named(field)) or layout.said_unit,
            drawn.unit,
            unit_of_name(name, layout.said_unit or drawn.unit or None),
        )
        length: float = in_mm(read_number(text), unit)
    except (NotANumber, Unreadable, UnknownUnit) as error:
        reason = str(error) if isinstance(error, Unreadable) else _("is not a number, or in no unit that is known")
        raise _Wrong(f"{layout.named(field)} {text[:40]!r} {reason}") from None
    return length
