"""Content of a report. Pure: values with their units, worded only when they are shown.

A report is a head and sections; a section holds sentences, facts, a table, and pictures. Every rendering walks through the
same sections, so that page, PDF, XLSX, CSV and JSON cannot say different things.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from math import isfinite
from typing import Any, Literal
from zoneinfo import ZoneInfo

from app.language.formatting import (
    LEVELS,
    MINUS,
    NO_BREAK_SPACE,
    NOTHING,
    as_read,
    decimals_beside,
    grouped,
    in_percent,
    signed,
)
from app.language.i18n import _

Kind = Literal["text", "count", "deviation", "width", "size", "number", "probability", "share", "moment"]
LONGEST = 500  # letters of a text in a cell
UNITS: dict[Kind, str] = {"deviation": "µm", "width": "µm", "size": "mm", "share": "%"}


class Paper(StrEnum):
    """Paper sizes of a printed report."""

    A4 = "a4"
    LETTER = "letter"


class Format(StrEnum):
    """File formats of a report."""

    PDF = "pdf"
    XLSX = "xlsx"
    CSV = "csv"


@dataclass(frozen=True, slots=True)
class Value:
    """One value. Lengths are kept in mm, shares of 1, moments as ISO 8601 in UTC; None where there is none.

    deviation: in µm with its sign; width: in µm without one; size: in mm; number: without a unit; probability: one, too,
    of which a very small one is never shown as none.
    """

    kind: Kind
    value: float | int | str | None
    decimals: int = 1

    @property
    def unit(self) -> str:
        """The unit in which it is read."""
        return UNITS.get(self.kind, "")

    @property
    def number(self) -> float | int | None:
        """In its unit; None for texts, moments, and where there is none."""
        if self.kind in ("text", "moment") or self.value is None or isinstance(self.value, str):
            return None
        if self.kind in ("deviation", "width"):
            return round(self.value * 1000, 9)
        return self.value * 100 if self.kind == "share" else self.value

    @property
    def shown_decimals(self) -> int:
        """Decimals in a cell: more where fewer would round a share to all or none, or a probability across a level."""
        if self.kind == "share":
            return decimals_beside(self.number or 0, 3, 0, 100)
        return (
            decimals_beside(self.number or 0, self.decimals, *LEVELS) if self.kind == "probability" else self.decimals
        )

    @property
    def moment(self) -> datetime | None:
        """The moment, in UTC."""
        return datetime.fromisoformat(str(self.value)) if self.kind == "moment" and self.value else None

    def words(self, zone: ZoneInfo) -> str:
        r"""As people read it, with its unit.

        >>> Value("deviation", -0.0061).words(ZoneInfo("UTC")), Value("share", 0.99996).words(ZoneInfo("UTC"))
        ('−6.1\xa0µm', '99.9\xa0%')
        >>> Value("share", 958 / 960).words(ZoneInfo("UTC")), Value("share", 1.0).words(ZoneInfo("UTC"))
        ('99.8\xa0%', '100.0\xa0%')
        >>> Value("probability", 0.00001, 4).words(ZoneInfo("UTC"))
        '<\xa00.0001'
        """
        if self.value is None or self.value == "":
            return NOTHING if self.value is None else ""
        moment, number = self.moment, self.number
        if moment is not None:
            return as_read(moment, zone=zone)
        if number is None:
            return str(self.value)
        match self.kind:
            case "count":
                return grouped(number)
            case "share":  # 99.96 % is not all of them; 99.79 % is 99.8 %
                text = in_percent(number / 100, 1)
            case "deviation":
                text = signed(number, self.decimals)
            case _:
                text = f"{number:.{self.shown_decimals}f}".replace("-", MINUS)
                small = number >= 0 if self.kind == "probability" else number > 0
                if small and not float(f"{number:.{self.decimals}f}"):
                    text = f"<{NO_BREAK_SPACE}{10**-self.decimals:.{self.decimals}f}"
        return f"{text}{NO_BREAK_SPACE}{self.unit}" if self.unit else text


def words(content: str | None) -> Value:
    """A text, cut where it is far too long for a cell."""
    text = content or ""
    return Value("text", text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…")


def count(number: int | None) -> Value:
    return Value("count", number)


def deviation(length: float | None, decimals: int = 1) -> Value:
    """A deviation or correction, mm."""
    return Value("deviation", _finite(length), decimals)


def width(length: float | None, decimals: int = 2) -> Value:
    """A spread or a limit, mm."""
    return Value("width", _finite(length), decimals)


def size(length: float | None, decimals: int = 4) -> Value:
    """A size, mm."""
    return Value("size", _finite(length), decimals)


def number(value: float | None, decimals: int = 3) -> Value:
    """A number without a unit."""
    return Value("number", _finite(value), decimals)


def probability(value: float | None) -> Value:
    """A p-value."""
    return Value("probability", _finite(value), 4)


def share(value: float | None) -> Value:
    """A share of 1."""
    return Value("share", _finite(value))


def moment(at: datetime | None) -> Value:
    return Value("moment", None if at is None else at.astimezone(UTC).isoformat())


def _finite(value: float | None) -> float | None:
    return value if value is not None and isfinite(value) else None


@dataclass(frozen=True, slots=True)
class Fact:
    """A value with its name; `code` is the R number beside it, `note` what it should not be read without.

    low, high: the ends of its confidence interval.
    """

    key: str
    name: str
    value: Value
    code: str = ""
    note: str = ""
    low: Value | None = None
    high: Value | None = None


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table: `share` is how wide it is among the others, `aligned` its state."""

    key: str
    name: str
    share: float = 1.0
    aligned: Literal["left", "right"] = "left"


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of values; `more` of them are left out, the oldest."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Value, ...], ...]
    more: int = 0

    @property
    def filled(self) -> list[int]:
        """The columns in which anything stands: on paper there is no room for the others."""
        return [at for at in range(len(self.columns)) if any(row[at].value not in (None, "") for row in self.rows)]


def table_of(rows: Iterable[Any], *columns: tuple[Column, Callable[[Any], Value]], more: int = 0) -> Table:
    """A table of these rows: each column with its value of a row."""
    return Table(
        tuple(column for column, _value in columns),
        tuple(tuple(value(row) for _column, value in columns) for row in rows),
        more,
    )


@dataclass(frozen=True, slots=True)
class Picture:
    """A chart as its page has it, drawn into `width` × `height` pixels; `says` it in words.

    data: makes the same in numbers; its first column lies across, every other one that holds numbers is a course of the
    chart. Only spreadsheets ask for them: they are tens of thousands of values. figure: a `Chart`, untyped because msgspec
    reads stored reports, which have no pictures, and takes no union of dataclasses as a type.
    """

    key: str
    title: str
    says: str
    figure: Any
    width: int
    height: int
    data: Callable[[], Table]

    @property
    def beside(self) -> bool:
        """Narrow enough to stand beside the facts."""
        return self.width < 500


@dataclass(frozen=True, slots=True)
class Section:
    """One part of a report. `warnings` are sentences that the numbers should not be read without.

    signatures: what people sign; a section with places for them is a page of its own, with a place for a logo.
    """

    key: str
    title: str
    sentences: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    facts: tuple[Fact, ...] = ()
    table: Table | None = None
    pictures: tuple[Picture, ...] = ()
    signatures: tuple[str, ...] = ()

    def fact(self, key: str) -> Value:
        """The value of one fact."""
        return next(fact.value for fact in self.facts if fact.key == key)


@dataclass(frozen=True, slots=True)
class Report:
    """A characteristic and a period. `zone` names the time zone in which moments are read.

    warnings: what is above everything else. made_by: who asked for it; empty where a program did.
    """

    key: str
    name: str
    machine: str
    part: str
    period: str
    zone: str
    made_at: Value
    head: tuple[Fact, ...]
    sections: tuple[Section, ...]
    warnings: tuple[str, ...] = ()
    made_by: str = ""

    @property
    def made(self) -> str:
        """Sentence about who made it, when, and by which clock its times are."""
        sentence = (
            _("Made at {at} by {who}; times are those of {zone}.")
            if self.made_by
            else _("Made at {at}; times are those of {zone}.")
        )
        return sentence.format(at=self.words(self.made_at), who=self.made_by, zone=self.zone)

    def words(self, value: Value) -> str:
        """A value as people read it."""
        return value.words(ZoneInfo(self.zone))

    def between(self, fact: Fact) -> str:
        """Its interval as people read it; empty without one."""
        if fact.low is None or fact.high is None:
            return ""
        return _("{low} to {high}").format(low=self.words(fact.low), high=self.words(fact.high))

    def section(self, key: str) -> Section | None:
        return next((section for section in self.sections if section.key == key), None)

    def without_pictures(self) -> "Report":
        """The same, as far as it is words and numbers."""
        return replace(self, sections=tuple(replace(section, pictures=()) for section in self.sections))
