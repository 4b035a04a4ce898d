"""Tables the other way round: characteristics downward, parts across. They are recognised, and refused with what to do."""

from collections.abc import Mapping, Sequence

from app.files.formats.delimited import Row
from app.files.formats.number_with_unit import number_before_unit
from app.language.i18n import _

OF_A_CHARACTERISTIC = {"characteristic", "nominal", "upper", "lower", "natural_limit"}


def columns(header: Sequence[str], known: Mapping[str, Sequence[int]], rows: Sequence[Row]) -> tuple[str, ...]:
    """The columns that hold a size of each characteristic, one column a part; none in any other table.

    They are two or more without a meaning, of numbers only, beside a name or limits; or their names are 1, 2, 3 …
    known: places of the columns whose names are known, by the field that they mean.

    >>> columns(["Dim", "Soll", "P1", "P2"], {"nominal": [1]}, [Row(2, ["D40", "40", "40.01", "40.02"])])
    ('P1', 'P2')
    """
    if "measured" in known or not rows:
        return ()
    used = {place for places in known.values() for place in places}
    sizes = [place for place, name in enumerate(header) if place not in used and name and _are_sizes(place, rows)]
    described = not known.keys().isdisjoint(OF_A_CHARACTERISTIC)
    counted = [header[place] for place in sizes] == [str(at) for at in range(1, len(sizes) + 1)]
    named = any(place not in sizes and not _is_size(cell) for place, cell in enumerate(rows[0].cells))
    return tuple(header[place] for place in sizes) if len(sizes) > 1 and named and (described or counted) else ()


def sentence(parts: Sequence[str]) -> str:
    """The reason and the remedy."""
    words = _(
        "Each row is a characteristic and each of the columns {parts} a part. Turn the table round (in a spreadsheet: copy, "
        "paste transposed), so that each row is a part, or import the parts one by one: measured={first}."
    )
    return words.format(parts=", ".join(parts[:3]) + (", …" if len(parts) > 3 else ""), first=parts[0])


def _are_sizes(place: int, rows: Sequence[Row]) -> bool:
    return all(_is_size(row.cells[place]) for row in rows if place < len(row.cells))


def _is_size(cell: str) -> bool:
    return not cell.strip() or number_before_unit(cell) is not None
