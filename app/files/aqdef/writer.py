"""AQDEF files (Q-DAS ASCII transfer format) written: one line for each part, with a value of every characteristic measured on it.

Whether a system takes a file is
said by its certification, which this is not.
"""

import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from decimal import Decimal
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

from app.core.natural_limit import NaturalLimit
from app.files.aqdef.description import encoding_of
from app.files.aqdef.fields import CATALOGUES, Catalogue, most_of
from app.files.aqdef.values import OF_CHARACTERISTIC, OF_FIELD
from app.files.formats.delimited import Unusable
from app.language.i18n import _

MISSING = 255
SAME_PART = timedelta(hours=1)
"""Readings of a part further apart than this are of two measurements."""
_SIGNS = re.compile(r"[\x00-\x1f\x7f-\x9f;]+")


class Validity(IntEnum):
    """K0002 of a value that is there."""

    GOOD = 0
    INVALID = 129
    IMPLAUSIBLE = 290


class LimitKind(IntEnum):
    """K2120 and K2121: none, a limit, or one that nature sets (a form error is never below 0)."""

    NONE = 0
    LIMIT = 1
    NATURAL = 2


class Part(NamedTuple):
    """Number (K1001), name (K1002), machine (K1081, K1082), place (K1085) and operation (K1086)."""

    number: str
    name: str
    machine: str = ""
    machine_name: str = ""
    place: str = ""
    operation: str = ""


class Described(NamedTuple):
    """A characteristic as the file describes it. Lengths in its unit. part: the place of its part in the list of parts."""

    part: int
    number: str
    name: str
    nominal: float | None
    lower: float | None
    upper: float | None
    unit: str = "mm"
    decimals: int = 4
    importance: int | None = None
    gauge: str = ""
    natural_limit: NaturalLimit = NaturalLimit.NONE

    def kind_of(self, limit: NaturalLimit) -> LimitKind:
        """K2120 of the lower limit, K2121 of the upper one."""
        if (self.lower if limit is NaturalLimit.LOWER else self.upper) is None:
            return LimitKind.NONE
        return LimitKind.NATURAL if self.natural_limit is limit else LimitKind.LIMIT


class Written(NamedTuple):
    """A value. characteristic: its place in the list. at: by the clock of the plant. process: parameters by name."""

    characteristic: int
    measured: float
    at: datetime
    validity: int = Validity.GOOD
    part: str = ""
    events: Sequence[str] = ()
    order: str = ""
    batch: str = ""
    nest: int = 0
    operator: str = ""
    machine: str = ""
    gauge: str = ""
    process: Mapping[str, float] = {}
    comment: str = ""
    fields: Mapping[str, str] = {}


@dataclass
class Catalogues:
    """Texts that values name by number: those of the events, machines, gauges, operators and process parameters.

    What a value names besides comes behind them.
    """

    events: Sequence[str] = ()
    machines: Sequence[tuple[str, str]] = ()
    gauges: Sequence[tuple[str, str]] = ()
    operators: Sequence[str] = ()
    process: Sequence[str] = ()


@dataclass
class Outcome:
    """Numbers of values and lines written, and remarks on what was shortened or replaced."""

    values: int = 0
    lines: int = 0
    remarks: list[str] = field(default_factory=list)


def write(
    path: Path,
    parts: Sequence[Part],
    characteristics: Sequence[Described],
    values: Iterable[Written],
    catalogues: Catalogues,
) -> Outcome:
    """Write a `.dfq` under a temporary name and rename it when it is complete.

    values: of each characteristic in their order. They are written first, so that the catalogues know what they name.
    Windows-1252 where that has all letters and is known again by them, else UTF-8 with its mark.
    """
    draft, body = path.with_name(f".{path.name}.part"), path.with_name(f".{path.name}.values")
    done = Outcome()
    used = _Used(catalogues)
    try:
        with body.open("w", encoding="utf-8", newline="") as file:
            texts = _Values(len(characteristics), used, done)
            file.writelines(f"{line}\r\n" for line in texts.lines(values))
        with draft.open("w", encoding="utf-8", newline="") as file, body.open(encoding="utf-8", newline="") as rest:
            header = _Header(done)
            file.writelines(f"{line}\r\n" for line in header.lines(parts, characteristics, used))
            shutil.copyfileobj(rest, file)
        _settle_encoding(draft)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)
        body.unlink(missing_ok=True)
    return done


class _Catalogue:
    """Entries by number: a short text and a long one. Either names the entry; a short one that is empty is its number."""

    def __init__(self, entries: Iterable[tuple[str, str]]) -> None:
        self.entries = list(entries)
        self._numbers: dict[str, int] = {}
        for number, entry in enumerate(self.entries, 1):
            for text in filter(None, entry):
                self._numbers.setdefault(text, number)

    def number(self, text: str, *, both: bool = True) -> int:
        """The number of the entry with this text, 0 for none; a new one comes at the end."""
        if not text:
            return 0
        if text not in self._numbers:
            self.entries.append((text if both else "", text))
            self._numbers[text] = len(self.entries)
        return self._numbers[text]


class _Used:
    """The catalogues of a file while it is written, by the field of a value that names their entries."""

    def __init__(self, given: Catalogues) -> None:
        self.of = {
            "K0010": _Catalogue(given.machines),
            "K0012": _Catalogue(given.gauges),
            "K0008": _Catalogue((name, name) for name in given.operators),
            "K0005": _Catalogue(("", text) for text in given.events),
            "K0011": _Catalogue(("", text) for text in given.process),
        }


def _settle_encoding(path: Path) -> None:
    """Make Windows-1252 of the UTF-8 where it can be, and is taken for that again; else put the mark before it.

    Plain ASCII is both. An è in Windows-1252 is the č of Windows-1250: nothing in the file says which.
    """
    content = path.read_bytes()
    if content.isascii():
        return
    try:
        path.write_bytes(content.decode().encode("cp1252"))
        if encoding_of(path) == "cp1252":
            return
    except (UnicodeEncodeError, Unusable):  # no such letters, or none that would be known again
        pass
    path.write_bytes(b"\xef\xbb\xbf" + content)


class _Texts:
    """Texts that fit into their fields."""

    def __init__(self, done: Outcome) -> None:
        self._done = done
        self._written: set[tuple[str, str]] = set()

    def fit(self, key: str, text: str) -> str:
        plain = _SIGNS.sub(lambda signs: "," if signs[0] == ";" else " ", text).strip()
        most = most_of(key)
        short = plain[:most].rstrip()
        if short != text.strip() and (key, text) not in self._written and len(self._written) < 100:
            self._written.add((key, text))
            if short != plain:
                reason = _("{key} holds {most} characters: {text} is written as {short}.")
            else:
                reason = _("{text} has signs that {key} cannot hold: it is written as {short}.")
            self._done.remarks.append(reason.format(key=key, most=most, text=repr(text), short=repr(short)))
        return short


class _Header(_Texts):
    """Lines that describe."""

    def lines(self, parts: Sequence[Part], characteristics: Sequence[Described], catalogues: _Used) -> Iterator[str]:
        yield f"K0100 {len(characteristics)}"
        for number, part in enumerate(parts, 1):
            where = f"/{number}" if len(parts) > 1 else ""  # without one some take it for that of a characteristic
            for key, text in zip(("K1001", "K1002", "K1081", "K1082", "K1085", "K1086"), part, strict=True):
                if text or key in {"K1001", "K1002"}:
                    yield f"{key}{where} {self.fit(key, text)}"
            taken: set[str] = set()
            for index, described in enumerate(characteristics, 1):
                if described.part == number - 1:
                    yield from self._characteristic(index, described, taken, catalogues)
        for of_value, catalogue in CATALOGUES.items():
            yield from self._catalogue(catalogue, catalogues.of[of_value].entries)

    def _characteristic(self, index: int, described: Described, taken: set[str], catalogues: _Used) -> Iterator[str]:
        number = self.fit("K2001", described.number)
        for other in range(2, len(taken) + 3):  # two that were cut to the same
            if number not in taken:
                break
            number = f"{described.number[: most_of('K2001') - 4]}~{other}"
        taken.add(number)
        nominal, lower, upper = described.nominal, described.lower, described.upper
        off = [
            None if nominal is None or limit is None else plain_number(round(limit - nominal, 9))
            for limit in (lower, upper)
        ]
        fields = {
            "K2001": number,
            "K2002": self.fit("K2002", described.name),
            "K2004": 0,
            "K2005": described.importance,
            "K2022": described.decimals,
            "K2060": 1 if catalogues.of["K0005"].entries else None,
            "K2061": 1 if catalogues.of["K0011"].entries else None,
            "K2101": None if nominal is None else plain_number(nominal),
            "K2110": None if lower is None else plain_number(lower),
            "K2111": None if upper is None else plain_number(upper),
            "K2112": off[0],
            "K2113": off[1],
            "K2120": described.kind_of(NaturalLimit.LOWER).value,
            "K2121": described.kind_of(NaturalLimit.UPPER).value,
            "K2142": self.fit("K2142", described.unit),
            "K2402": self.fit("K2402", described.gauge) if described.gauge else None,
        }
        for key, value in fields.items():
            if value is not None:
                yield f"{key}/{index} {value}"

    def _catalogue(self, catalogue: Catalogue, entries: Sequence[tuple[str, str]]) -> Iterator[str]:
        if entries:
            yield f"{catalogue.key}/1 Inband {catalogue.name}"
        for number, texts in enumerate(entries, 1):
            for one, text in zip((catalogue.short, catalogue.long), texts, strict=True):
                yield f"{one}/{number} {self.fit(one, text or str(number))}"


@dataclass
class _Line:
    """The values of one part; `number` counts the lines."""

    number: int
    part: str
    order: str
    begun: datetime
    values: dict[int, Written] = field(default_factory=dict)


class _Values(_Texts):
    """Lines of values. Those of one part come into one line where that leaves the order of each characteristic as it is."""

    def __init__(self, count: int, catalogues: _Used, done: Outcome) -> None:
        super().__init__(done)
        self._count = count
        self._fields = 3  # of a value: at least itself, its attribute and its time
        self._catalogues = catalogues
        self._batch = False  # some value before had one: it holds on until another is said

    def lines(self, values: Iterable[Written]) -> Iterator[str]:
        waiting: list[_Line] = []
        newest = [0] * self._count
        count = 0
        for value in values:
            self._done.values += 1
            while waiting and value.at - waiting[0].begun > SAME_PART:
                yield from self._texts_of(waiting.pop(0))
            at = value.characteristic
            line = next((each for each in waiting if self._joins(value, each, newest[at])), None)
            if line is None:
                count += 1
                line = _Line(count, value.part, value.order, value.at)
                waiting.append(line)
                if len(waiting) > 1000:  # a batch that was measured in one hour
                    yield from self._texts_of(waiting.pop(0))
            line.values[at] = value
            newest[at] = line.number
        for line in waiting:
            yield from self._texts_of(line)

    def _joins(self, value: Written, line: _Line, newest: int) -> bool:
        return (
            bool(value.part)
            and line.part == value.part
            and line.order == value.order
            and value.characteristic not in line.values
            and line.number > newest
        )

    def _texts_of(self, line: _Line) -> Iterator[str]:
        self._done.lines += 1
        missing = f"0{OF_FIELD}{MISSING}"
        last = max(line.values)
        yield OF_CHARACTERISTIC.join(
            self._portion(line.values[at]) if at in line.values else missing for at in range(last + 1)
        )
        if line.part:
            yield f"K0014/0 {self.fit('K0014', line.part)}"
        if line.order:
            yield f"K0053/0 {self.fit('K0053', line.order)}"
        for at, value in sorted(line.values.items()):
            for key, text in {"K0009": value.comment, **value.fields}.items():
                if fitted := self.fit(key, text):
                    yield f"{key}/{at + 1} {fitted}"

    def _portion(self, value: Written) -> str:
        names = self._catalogues.of
        parameter = names["K0011"].number
        process = ",".join(
            f"{parameter(name, both=False)}/{plain_number(number)}" for name, number in value.process.items()
        )
        cells = [
            plain_number(value.measured),
            str(int(value.validity)),
            value.at.strftime("%d.%m.%Y/%H:%M:%S"),
            ",".join(str(names["K0005"].number(text, both=False)) for text in value.events),
            f"#{self.fit('K0006', value.batch)}" if value.batch or self._batch else "",
            str(value.nest),
            str(names["K0008"].number(value.operator)),
            str(names["K0010"].number(value.machine)),
            process,
            str(names["K0012"].number(value.gauge)),
        ]
        self._batch = self._batch or bool(value.batch)
        # What is not said holds on from the value before: a field that was filled once is always written from then on.
        self._fields = max(self._fields, *(at for at, cell in enumerate(cells, 1) if cell not in {"", "0"}))
        return OF_FIELD.join(cells[: self._fields])


def plain_number(value: float) -> str:
    """A number without an exponent and without zeros behind it.

    >>> plain_number(39.99810), plain_number(1e-06), plain_number(-0.0), plain_number(40.0)
    ('39.9981', '0.000001', '0', '40')
    """
    text = format(Decimal(repr(value or 0.0)), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text
