"""A number with its unit, such as ``40,001 mm``, ``0.3 µm`` or ``1.5 thou``: the one place where both are read together.

The number is read by `app.core.number_text`, the unit behind it, in its row or over its column is a word of
`app.files.formats.units`. So a size has one meaning at every door::

    import of CSV and workbooks   app.loop.readings.importing.cells    readings
                                  app.loop.readings.importing.drawn    nominal sizes and limits
    pasted tables                 app.quality.gauge_studies.table_reader
    files and messages            app.bridge.fields                    at the machine
    what a table is               headings, parts_across, app.bridge.file_rows, app.loop.readings.importing.layout

Fields of forms, the station's keypad and the command line name their unit themselves, and refuse another one behind the number:
`app.web.forms.length`. AQDEF names it in a field of its own: `app.files.aqdef`. Result parameters of a Heidenhain control are mm:
`app.core.rotary.results`.
"""

import re
from typing import Any, Final

from app.core.number_text import number_or_none
from app.files.formats.cell_values import Unreadable
from app.files.formats.units import LENGTHS, LONGEST_SIZE, length_unit
from app.language.i18n import _

_BEHIND: Final = re.compile(r"(.*\d[.,]?)\s*([^\d\s.,]{1,12})")
_LARGEST: Final = 1e300  # what is larger would become infinite


def number_and_unit(text: str) -> tuple[str, str]:
    """The text of a number and of the unit of length behind it; no unit where none that is known is there.

    >>> number_and_unit("12,003 mm"), number_and_unit('0.4724"'), number_and_unit("12.003"), number_and_unit("25 Nm")
    (('12,003', 'mm'), ('0.4724', '"'), ('12.003', ''), ('25 Nm', ''))
    """
    match = _BEHIND.fullmatch(text.strip()) if len(text) <= LONGEST_SIZE else None
    return (match[1], match[2]) if match is not None and length_unit(match[2]) else (text, "")


def number_before_unit(text: str) -> float | None:
    """The number of a text that may have a unit of length behind it, as it is written; None where it is none.

    >>> number_before_unit("12,003 mm"), number_before_unit("1.5 thou"), number_before_unit("25 Nm"), number_before_unit("1 234")
    (12.003, 1.5, None, None)
    """
    return number_or_none(number_and_unit(text)[0])


def agreed_unit(unit: str | None, *words: Any) -> str | None:
    """The unit of a size: of its column, as the header or a person says, and of its row and cell. None where none is named.

    >>> agreed_unit(None, "", "Zoll"), agreed_unit("um", "µm"), agreed_unit(None, None)
    ('inch', 'um', None)

    Raises `Unreadable` where one is not known, or they contradict each other.
    """
    for word in (str(each).strip() for each in words if each is not None):
        said = length_unit(word) if word else unit
        if word and said is None:
            known = ", ".join(LENGTHS)
            raise Unreadable(
                _("names the unit {word}, which is no length that is known ({known})").format(
                    word=repr(word), known=known
                )
            )
        if unit is not None and said != unit:
            raise Unreadable(
                _("is in {said}, its column or row says {unit}: it cannot be determined which counts").format(
                    said=said, unit=unit
                )
            )
        unit = said
    return unit


def in_mm(value: Any, unit: str | None) -> Any:
    """Lengths in mm: a number, or a list of them; what is neither stays as it is."""
    scale = LENGTHS[unit or "mm"]
    if isinstance(value, list):
        return [in_mm(each, unit) for each in value]
    is_length = isinstance(value, int | float) and not isinstance(value, bool)
    return round(value * scale, 9) if is_length and scale != 1.0 and abs(value) < _LARGEST else value
