"""The values of AQDEF files, one after the other, and their keys: out of K lines, or out of lines that hold one of every characteristic.

In such a line characteristics are parted by the character 15 and the fields of a value (`ROW`) by the character 20.
"""

import hashlib
import re
from collections import Counter
from collections.abc import Iterator
from datetime import datetime
from typing import NamedTuple

from app.core.number_text import NotANumber, NumberFault, read_number
from app.files.aqdef import description as aqdef
from app.files.aqdef.description import LINE, Description, Source, encoding_of, open_text
from app.files.aqdef.fields import FIELDS, OF_VALUES, ROW
from app.files.aqdef.times import time_of
from app.files.formats.cell_values import DayOrder, Unreadable, no_number
from app.files.formats.delimited import Unusable
from app.files.formats.repeats import Remark
from app.language.i18n import _

OF_CHARACTERISTIC, OF_FIELD = aqdef.OF_CHARACTERISTIC, "\x14"
SHOWN_CHARACTERISTIC, SHOWN_FIELD = "¤☼", "¶"
"""The signs by which manuals and editors show these two; a file that went through one has them in their place."""
COUNTED = ("K0020", "K0021", "")
"""What stands before the attribute in place of the value where parts are counted, not measured."""
_WHO = ("K0014", "K0006", "K0053", "K0007")
_VALUE_ITSELF = {"K0001", "K0002", "K0020"}
NO_VALUE = {255, 256}
"""K0002: missing, deleted. Any other than 0: there, but not to be evaluated."""


_LIKE_A_VALUE = re.compile(r"[+-]?[.,]?\d")
_CLOCK = re.compile(r"\d:\d")
_PARAMETER = r"(\d{1,9})/([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)(?=$|[,;\s])"
_ONE_PARAMETER = re.compile(_PARAMETER, re.ASCII)
_PROCESS = re.compile(f"{_PARAMETER}(?:[,;\\s]+{_PARAMETER})*", re.ASCII)


class Value(NamedTuple):
    """One value of one characteristic: the line where it begins, and its fields as they are written."""

    characteristic: int
    line: int
    fields: dict[str, str]


class Measured(NamedTuple):
    """A value read. measured: in the unit of its characteristic. at: without a zone unless the file names an offset.

    attribute: K0002, 0 for a good one. Numbers are those of the file's catalogues, 0 for none; some programs write names there.
    """

    measured: float
    attribute: int
    at: datetime | None
    part: str
    batch: str
    order: str
    nest: int | str
    operator: int | str
    machine: int | str
    gauge: int | str
    events: tuple[int | str, ...]
    process: str
    text: str = ""


def values(source: Source, description: Description) -> Iterator[Value | Remark]:
    """Every value in the order of the file, and what cannot be read, with its line."""
    path = source.values or source.description
    encoding = source.encoding or (encoding_of(path) if source.values else description.encoding)
    reading = _Reading(description)
    line, number = "\n", 0
    try:
        with open_text(path, encoding) as file:
            for number, line in enumerate(file, 1):
                yield from reading.take(number, line)
    except UnicodeError:
        raise Unusable(_("This is not {encoding} text.").format(encoding=encoding.upper())) from None
    if not line.endswith("\n") and reading.is_cut(number):
        reason = _("is shorter than what is above it and has no end: the file is cut off here; take the whole one")
        yield Remark(number, "", line.replace(OF_FIELD, "|").replace(OF_CHARACTERISTIC, "||")[-40:], reason, wrong=True)
    yield from reading.end()


class _Reading:
    """Takes the lines of values. A value is complete when the next one of its characteristic begins."""

    def __init__(self, description: Description) -> None:
        self._characteristics = description.characteristics
        self._of_values = description.of_values
        self._open: dict[int, Value] = {}
        self._begun: dict[int, int] = {}  # values of each characteristic
        self._rows = 0
        self._row_line = 0  # where the last of them stands
        self._portions: list[str] = []  # of the last line
        self._before: list[str] = []  # of the one above
        self._timed: set[int] = set()  # characteristics whose values have a time of their own
        self._for_all: dict[str, str] = {}
        self._above: set[str] = set()  # fields for all that are above their values, as above the first ones
        self._waiting: Remark | None = None  # the last of them, until its values come
        self._closed = False  # by a field for all: what comes next is another row
        self._given: set[str] = set()  # fields for all since it was closed
        self._held: dict[str, str] = {}
        self._longer = False  # a row with more fields than are known was remarked on
        self._begins: str | None = None

    def take(self, number: int, line: str) -> Iterator[Value | Remark]:
        line = line.strip(" \t\r\n\x1a\ufeff")
        if not line:
            return
        if line[0] in "Kk":
            if line[1:3] == "00":
                yield from self._field(number, line)
            return
        line = _with_separators(line)
        if OF_FIELD in line or OF_CHARACTERISTIC in line or _is_number(line):
            yield from self._row(number, line)
        elif _LIKE_A_VALUE.match(line) and (self._rows or _CLOCK.search(line)):
            reason = _(
                "is no value: the characters 15 and 20 that part values are missing, as editors and mail leave them out; "
                "take the file as the machine wrote it"
            )
            yield Remark(number, "", line[:40], reason, wrong=True)
        else:
            yield Remark(number, "", line[:40], _("is neither a K field nor a value; it is passed over"))

    def end(self) -> Iterator[Value | Remark]:
        waiting = [self._waiting] if self._waiting is not None and self._begun else []
        for at, above in self._ahead().items() if self._rows else ():
            field, text = next(iter(above.fields.items()))
            waiting.append(Remark(above.line, f"{field}/{at}", text[:40], "", wrong=True))
        reason = _("is above the first values and below the last ones: it could belong to either")
        yield from (each._replace(reason=reason) for each in waiting)
        yield from self._all_open()
        for (index, count), (line, fields) in self._of_values.items():
            if not index or count <= self._begun.get(index, 0):
                continue
            if index not in self._characteristics:
                yield self._nobody(line, index, fields.get("K0001", ""))
            elif fields.keys().isdisjoint({"K0001", "K0002", "K0020"}):
                name, value = next(iter(fields.items()))
                reason = _("belongs to value {count}, but the file has {most}").format(
                    count=count, most=self._begun.get(index, 0)
                )
                yield Remark(line, f"{name}/{index}/{count}", value[:40], reason)
            else:
                yield Value(index, line, self._with_own(index, count, {}))

    def is_cut(self, number: int) -> bool:
        """Tell if a last line without an end holds less than those before it."""
        last = max(self._open.values(), key=lambda value: value.line, default=None)
        if last is None:
            return False
        if not self._rows:
            return last.characteristic in self._timed and "K0004" not in last.fields
        at = len(self._portions) - 1
        return (
            last.line == number and at < len(self._before) and _extent(self._portions[at]) < _extent(self._before[at])
        )

    def _all_open(self) -> Iterator[Value]:
        for value in sorted(self._open.values(), key=lambda value: value.line):
            yield self._done(value)
        self._open.clear()
        self._closed = False

    def _done(self, value: Value) -> Value:
        if "K0004" in value.fields:
            self._timed.add(value.characteristic)
        return value

    def _with_own(self, index: int, count: int, fields: dict[str, str]) -> dict[str, str]:
        """The fields of value `count` of a characteristic, with those that the file gives by its number."""
        if not self._of_values:
            return fields
        nothing: tuple[int, dict[str, str]] = (0, {})
        of_all, of_row, own = (self._of_values.get(at, nothing)[1] for at in ((index, 0), (0, count), (index, count)))
        return of_all | fields | of_row | own

    def _ahead(self) -> dict[int, Value]:
        """Fields of single characteristics that are above the line of their values, as the first ones do."""
        if self._begins is None or self._begins in _VALUE_ITSELF:
            return {}
        return {
            index: each
            for index, each in self._open.items()
            if each.line > self._row_line and _VALUE_ITSELF.isdisjoint(each.fields)
        }

    def _row(self, number: int, line: str) -> Iterator[Value | Remark]:
        """Read a line that holds a value of each characteristic, in the order of their indices."""
        above, ahead = self._for_all, self._ahead()
        for index in ahead:
            del self._open[index]
        yield from self._all_open()
        self._for_all, self._waiting = {}, None
        self._rows += 1
        self._row_line = number
        portions = line.split(OF_CHARACTERISTIC)
        self._before, self._portions = self._portions, portions
        for index, portion in enumerate(portions, 1):
            if not portion.strip():
                continue
            characteristic = self._characteristics.get(index)
            if characteristic is None:
                yield self._nobody(number, index, portion.split(OF_FIELD)[0])
                continue
            cells = [cell.strip() for cell in portion.rstrip(" \t" + OF_FIELD).split(OF_FIELD)]
            names = COUNTED + ROW[1:] if _counts(characteristic, cells) else ROW
            if len(cells) > len(names) and not self._longer:
                self._longer = True
                shown = portion[:40].replace(OF_FIELD, "|")
                reason = _("has more fields than are known; the rest is passed over, here and in later lines")
                yield Remark(number, "", shown, reason)
            fields = {name: cell for name, cell in zip(names, cells, strict=False) if name and cell}
            if "K0006" in fields:
                fields["K0006"] = fields["K0006"].removeprefix("#")
            self._held |= {name: cell for name, cell in fields.items() if FIELDS[name].holds}
            self._begun[index] = self._rows
            own = above | ahead[index].fields if index in ahead else above
            self._open[index] = Value(index, number, self._with_own(index, self._rows, self._held | own | fields))

    def _nobody(self, number: int, index: int, value: str) -> Remark:
        most = len(self._characteristics)
        reason = _("belongs to characteristic {index}, but the file describes {most}").format(index=index, most=most)
        return Remark(number, "K0001", value[:40], reason, wrong=True)

    def _field(self, number: int, line: str) -> Iterator[Value | Remark]:
        match = LINE.fullmatch(line)
        if match is None or len(match[1]) != 4:
            wrong = match is None and line[1:5].isdigit()  # the field of a value whose index is none
            reason = _("has no index that can be read") if wrong else aqdef.no_field(line)
            yield Remark(number, line[:5] if wrong else "", line[5 * wrong :][:40], reason, wrong)
            return
        if match[3]:
            return  # by the number of a value: the description has it
        key, index, value = f"K{match[1]}", int(match[2] or 1), (match[4] or "").strip()
        if match[3] == "":
            reason = _("has a second stroke, but no number of a value behind it; it is taken for {key}/{index}")
            yield Remark(number, f"{key}/{index}/", value[:40], reason.format(key=key, index=index))
        if key not in OF_VALUES:
            yield Remark(number, key, value[:40], _("is no field that is known here; it is kept and not used"))
        if key == "K0006":
            value = value.removeprefix("#")
        if index == 0:
            if not self._begun:
                self._above.add(key)
            if self._open and key in self._above:
                yield from self._all_open()
                self._for_all = {}
            if not self._closed:
                self._given.clear()
            self._closed = bool(self._open)
            if not self._open:
                self._for_all[key] = value
                self._waiting = Remark(number, f"{key}/0", value[:40], "", wrong=True)
            if key not in self._given:  # the same field once more says nothing new to those that are open
                self._given.add(key)
                for each in self._open.values():
                    each.fields.setdefault(key, value)
            return
        if index not in self._characteristics:
            yield self._nobody(number, index, value)
        else:
            yield from self._of_one(number, key, index, value)

    def _of_one(self, number: int, key: str, index: int, value: str) -> Iterator[Value | Remark]:
        first = "K0020" if self._characteristics[index].counts else "K0001"
        # Where values are in K lines, the first field of the first one begins the others too.
        self._begins = self._begins or (first if self._rows else key)
        self._waiting = None
        current = self._open.get(index)
        begins = key in {first, self._begins}
        if current is not None and begins and not current.fields.keys().isdisjoint({key, first}):
            if self._closed:
                yield from self._all_open()
            else:
                yield self._done(self._open.pop(index))
            self._for_all = {}
            current = None
        elif current is not None and self._closed and begins:
            yield from self._all_open()
            current = None
        elif current is None and self._closed:
            yield from self._all_open()
        if current is None:
            count = self._begun[index] = self._begun.get(index, 0) + 1
            self._open[index] = Value(index, number, self._with_own(index, count, self._for_all | {key: value}))
            return
        if current.fields.get(key, value) != value:
            yield Remark(number, f"{key}/{index}", value[:40], _("is written twice for one value; the last one counts"))
        current.fields[key] = value


def read_value(value: Value, order: DayOrder | None = None) -> "Measured | Remark | None":
    """The fields of a value as what they mean; None where nothing was measured: it is empty, or K0002 says missing or deleted.

    order: which comes first in dates with slashes, day or month.
    """
    fields, name = value.fields, "K0001"
    try:
        name = "K0002"
        attributes = [_whole(each) for each in _several(fields.get(name, ""))]
        attribute = next(filter(None, attributes), 0)
        name = "K0001"
        if not fields.get(name, "").strip() or not NO_VALUE.isdisjoint(attributes):
            return None
        measured = number_of(fields[name])
        name = "K0004"
        at = time_of(fields[name], order) if fields.get(name) else None
    except Unreadable as error:
        return Remark(value.line, f"{name}/{value.characteristic}", fields.get(name, "")[:40], str(error), wrong=True)
    return Measured(
        measured,
        attribute,
        at,
        fields.get("K0014", ""),
        fields.get("K0006", ""),
        fields.get("K0053", ""),
        _entry(fields.get("K0007", "")),
        _entry(fields.get("K0008", "")),
        _entry(fields.get("K0010", "")),
        _entry(fields.get("K0012", "")),
        tuple(filter(None, map(_entry, _several(fields.get("K0005", ""))))),
        fields.get("K0011", ""),
        fields.get("K0009", ""),
    )


def process_of(text: str) -> dict[int, float] | None:
    """Process parameters (K0011) by their number in the catalogue; None where the text is something else.

    A comma parts them, unless what is behind it can only be decimal places.

    >>> process_of("1/0.5,2/-3"), process_of("1/21,5"), process_of("21,5")
    ({1: 0.5, 2: -3.0}, {1: 21.5}, None)
    """
    if not _PROCESS.fullmatch(text.strip()):
        return None
    try:
        return {int(number): number_of(value) for number, value in _ONE_PARAMETER.findall(text)}
    except Unreadable:  # too large for a number
        return None


def number_of(text: str) -> float:
    """A number with a point or a comma. Raises `Unreadable`.

    >>> number_of("10,023"), number_of("6.00100000000000E+0000")
    (10.023, 6.001)
    """
    try:
        return read_number(text)
    except NotANumber as error:
        reason = _("is empty") if not text.strip() else _("is not a number")
        if error.fault in {NumberFault.BRACKETS, NumberFault.BOUND}:
            reason = no_number(error.fault, ".")
        raise Unreadable(reason) from None


def _counts(characteristic: aqdef.Characteristic, cells: list[str]) -> bool:
    """Tell if a row counts parts: K2004 says so; where it is missing, the place of the time does."""
    if "K2004" in characteristic.fields:
        return characteristic.counts
    time_of_size, time_of_count = (ROW.index("K0004") + shift for shift in (0, len(COUNTED) - 1))
    return (
        len(cells) > time_of_count
        and _CLOCK.search(cells[time_of_count]) is not None
        and _CLOCK.search(cells[time_of_size]) is None
    )


def _extent(portion: str) -> tuple[int, int]:
    """Fields of a value, and the colons of the last one, by which a time is as long as another."""
    return portion.count(OF_FIELD), portion.rpartition(OF_FIELD)[2].count(":")


def _with_separators(line: str) -> str:
    """The line with the separators that the signs stand for; a lone sign with a time in its third place parts fields."""
    shown = SHOWN_CHARACTERISTIC + SHOWN_FIELD
    if OF_FIELD in line or not any(sign in line for sign in shown):
        return line
    first = next((sign for sign in SHOWN_CHARACTERISTIC if sign in line), None)
    fields_only = first is not None and SHOWN_FIELD not in line and ":" in "".join(line.split(first)[2:3])
    if OF_CHARACTERISTIC in line or fields_only:
        return re.sub(f"[{shown}]", OF_FIELD, line)
    return re.sub(f"[{SHOWN_CHARACTERISTIC}]", OF_CHARACTERISTIC, line).replace(SHOWN_FIELD, OF_FIELD)


def _several(text: str) -> list[str]:
    return [each for each in re.split(r"[,;\s]+", text) if each]


def _entry(text: str) -> int | str:
    """The number of a catalogue's entry, 0 where nothing is said; or the name that is in its place."""
    text = text.strip()
    try:
        return _whole(text)
    except Unreadable:
        return text


def _is_number(text: str) -> bool:
    try:
        read_number(text)
    except NotANumber:
        return False
    return True


def _whole(text: str) -> int:
    """A whole number, 0 where nothing is said."""
    text = text.strip()
    if not text:
        return 0
    try:
        value = read_number(text)
    except NotANumber:
        value = 0.5
    if value != int(value):
        raise Unreadable(_("is not a whole number"))
    return int(value)


class Keys:
    """The keys of the values of one file: the same value has the same one, in whatever file and however written it comes. Values that are alike in everything are counted, wherever in the file they stand."""

    def __init__(self) -> None:
        self._seen: set[int] = set()  # 8 bytes of each name: a file has millions
        self._again: Counter[int] = Counter()

    def of(self, value: Value, identity: tuple[str, str, str], measured: float, at: datetime) -> str:
        """The key of a value. identity: part, number and name of its characteristic. measured: mm. at: as the file has it."""
        fields = {name: value.fields.get(name, "") for name in _WHO}
        if not fields["K0007"].strip("0"):  # some programs write every field, others none that says nothing
            fields["K0007"] = ""
        text = "|".join([*identity, repr(round(measured, 9)), at.isoformat(), *fields.values()])
        name = hashlib.blake2b(text.encode(), digest_size=10)
        short = int.from_bytes(name.digest()[:8])
        if short in self._seen:
            self._again[short] += 1
        self._seen.add(short)
        return f"aqdef:{name.hexdigest()}:{self._again[short] + 1}"
