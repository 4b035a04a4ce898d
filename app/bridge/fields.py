"""Fields of readings as others write them, in files, lines and messages; as ``POST /readings`` takes them."""

from collections.abc import Mapping
from math import isfinite
from typing import Any, Final, NamedTuple
from zoneinfo import ZoneInfo

from app.files.formats import spreadsheet
from app.files.formats.cell_values import Unreadable, number, zone_named
from app.files.formats.file_times import LIVE, FileTimes
from app.files.formats.number_with_unit import agreed_unit, number_and_unit
from app.files.formats.units import LENGTHS

FIELDS: Final = (
    "characteristic",
    "measured",
    "unit",
    "measured_at",
    "machined_at",
    "part",
    "correction_in_effect",
    "key",
    "part_temperature",
    "machine_temperature",
)
"""What a column, a member, or a named group of a regular expression may be."""
EVERY: Final = "*"
"""The name in ``characteristics`` that stands for readings that name none."""
TEMPERATURES: Final = FIELDS[-2:]
"""Fields of the context, °C. What is not a number is left out: no reading is lost to a sensor."""
HIGHEST_NUMBER: Final = 2_147_483_647
LONGEST_TEXT: Final = 128
_CELSIUS: Final = ("°C", "ºC", "C")


def refuse_unknown(zone: str | None, encoding: str | None = None) -> None:
    """Raises `ValueError` for a time zone or an encoding that is not known."""
    if zone is not None:
        zone_named(zone)
    if encoding is not None:
        try:
            "".encode(encoding)
        except LookupError:
            raise ValueError(f"encoding = {encoding!r} is not known; known are utf-8, cp1252, cp1250 …") from None


class Form(NamedTuple):
    """The form of values. scale: mm in a unit of the sizes. times: as strptime has it. zone: of times without an offset.

    together: what the times of a file say together. unit: of the sizes, where the file says it. sheet: they are
    cells of a workbook.
    """

    scale: float
    decimal: str = "."
    times: str | None = None
    zone: ZoneInfo | None = None
    together: FileTimes = LIVE
    unit: str | None = None
    sheet: bool = False

    def in_unit(self, *words: Any) -> "Form":
        """The form of sizes whose column, row or cell says their unit. Raises `Unreadable`."""
        unit = agreed_unit(self.unit, *words)
        return self if unit is None else self._replace(scale=LENGTHS[unit], unit=unit)

    def value(self, field: str, value: Any) -> Any:
        """The value of a field but ``characteristic``; None of a time or a temperature that is none. Raises `Unreadable`, whose words go behind the value."""
        text = str(value).strip()
        if field in TEMPERATURES:
            return self._degrees(text)
        if self.sheet:
            spreadsheet.refuse_error(text)
        if field == "measured":
            if isinstance(value, bool) or not isinstance(value, int | float | str):
                raise Unreadable("is not a number")
            text, behind = number_and_unit(text)
            size = value if isinstance(value, int | float) else number(text, self._decimal_in(text))
            scale = self.in_unit(behind).scale
            if not isfinite(size * scale):
                raise Unreadable("is not a number")
            return round(size * scale, 9)
        if field in {"measured_at", "machined_at"}:
            at = self.together.moment(text, self.zone, self.times)
            return None if at is None else at.isoformat()
        if field == "correction_in_effect":
            if not text.isascii() or not text.isdigit() or int(text) > HIGHEST_NUMBER:
                raise Unreadable("is not the number of a correction, such as 12")
            return int(text)
        if not 1 <= len(text) <= LONGEST_TEXT:
            raise Unreadable(f"is longer than {LONGEST_TEXT} characters" if text else "is empty")
        return text

    def left_out(self, field: str, value: Any) -> str | None:
        """Words behind the value of a temperature that is something, and no number of °C; None of any other."""
        text = str(value).strip()
        if field not in TEMPERATURES or value is None or not text or self._degrees(text) is not None:
            return None
        return f'is not a number of °C, with decimal = "{self._decimal_in(text)}"; left out'

    def _degrees(self, text: str) -> float | None:
        unit = next((each for each in _CELSIUS if text.endswith(each)), "")
        text = text.removesuffix(unit).rstrip()
        try:
            degrees = number(text, self._decimal_in(text))
        except Unreadable:
            return None
        return degrees if isfinite(degrees) else None

    def _decimal_in(self, text: str) -> str:
        return spreadsheet.decimal_in(text) if self.sheet else self.decimal


def put(body: dict[str, Any], field: str, value: Any) -> None:
    """Put a field into the body of a reading, where ``POST /readings`` has it."""
    if field in TEMPERATURES:
        body.setdefault("context", {})[field] = value
    else:
        body[field] = value


def left_out_since(before: Mapping[str, str], body: Mapping[str, Any], left_out: Mapping[str, str]) -> dict[str, str]:
    """Temperatures that are left out, in words by field, after one more reading: a good one ends what was said of its field.

    >>> left_out_since({"part_temperature": "a", "machine_temperature": "b"}, {"context": {"part_temperature": 21.5}}, {})
    {'machine_temperature': 'b'}
    """
    good = body.get("context", {})
    return {field: words for field, words in before.items() if field not in good} | dict(left_out)
