"""The readings in a file of a measuring machine: CSV, XLSX, NDJSON, a text protocol, or AQDEF. Nothing is moved or sent here.

A file is taken whole or not at all: one line that cannot be read is a `Fault`, and a person puts the file right. Each reading has
a key for ever. With a time to the second a reading is known by that, by characteristic, size and part, and like ones by
their place among each other: the same file again, one that has grown, one with the newest line first, and a window that rolls
bring nothing twice. Else it is a hash of the file up to its line and of its own fields, and without time, part and key the
file's name and its time of modification tell it apart.
"""

import hashlib
import io
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any, Final

from app.bridge.configuration import Machine
from app.bridge.fields import EVERY, FIELDS, TEMPERATURES, Form, put
from app.bridge.file_entries import TIMES, Entry, meant, oldest_first, to_the_second
from app.bridge.file_rows import (
    Fault,
    Found,
    Table,
    cell_of,
    csv_rows,
    has,
    labels_of,
    ndjson_rows,
    reasons,
    unit_in_doubt,
    units_of,
    unnamed_times,
)
from app.bridge.file_settings import Settings
from app.bridge.links import Received
from app.bridge.patterns import LONGEST_LINE, NotFound, Patterns, TooSlow
from app.core.ring import INCH
from app.errors import TooManyRequests
from app.files.apart import apart, spend
from app.files.aqdef import description as aqdef
from app.files.aqdef import values as aqdef_values
from app.files.aqdef.context import context_of
from app.files.aqdef.times import WallClock, day_order, time_of
from app.files.aqdef.values import Keys
from app.files.formats import delimited, spreadsheet
from app.files.formats.cell_values import Slashed, Unreadable, same_number, slashed, zone_named
from app.files.formats.file_times import times_of
from app.files.formats.headings import is_summary
from app.files.formats.number_with_unit import number_and_unit
from app.files.formats.repeats import Remark, Repeats
from app.files.formats.units import LENGTHS, UnknownUnit, beside, in_celsius, length_unit, unit_in, unit_of_name

NAMES: Final = {"csv": "*.csv", "xlsx": "*.xls[xm]", "ndjson": "*.ndjson", "text": "*.txt", "aqdef": "*.df[qdxQDX]"}
NOT_ALONE: Final = 2  # files of a pair


@dataclass(slots=True)
class Content:
    """The content of a file.

    left_out: temperatures, in words by field. skipped: readings that were passed over. complete: its last line has an end. digest: a hash of the whole. stamp: the one
    that is in the keys of readings that nothing else tells apart.
    """

    entries: list[Entry] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    skipped: int = 0
    complete: bool = True
    digest: str = ""
    stamp: str = ""

    def received(self, machine: str, named: str) -> list[Received]:
        """The readings for the store; of a file that cannot be taken one entry for the quarantine says why."""
        if not self.faults:
            return [Received(entry.key, entry.body, mark=named) for entry in self.entries]
        first, *others = reasons(self.faults)
        more = f" (and {len(others)} more)" if others else ""
        words = f"File {named} is in the folder of failed ones, nothing of it was taken: {first}{more}"
        return [Received(f"{machine}:file:{self.digest[:32]}", {"file": named}, fault=words, mark=named)]


def read_content(
    machine: Machine, paths: tuple[Path, ...], stamp: str = "", earlier: tuple[str, str] | None = None
) -> Content:
    """Read a file, or a pair of AQDEF. stamp: name and time of modification.

    earlier: digest and stamp of what was stored of this file before: one that has only grown since keeps that stamp. Raises
    `OSError` only.
    """
    settings: Settings = machine.settings
    content = Content(stamp=stamp)
    try:
        with _as_text(settings, paths) as texts:
            _Reader(machine, settings, texts, earlier, content).read()
    except TooManyRequests as error:
        raise OSError(str(error)) from error
    except delimited.Unusable as error:
        content.faults.append(Fault(error.line, "", str(error)))
    if not content.faults and not content.entries and not content.skipped:
        content.faults.append(Fault(None, "", _nothing_found(settings)))
    return content


@contextmanager
def _as_text(settings: Settings, paths: tuple[Path, ...]) -> Iterator[tuple[Path, ...]]:
    """The files; in place of a workbook the text of its sheet, written in a process of its own: a small one may unpack to much."""
    if settings.format != "xlsx":
        yield paths
        return
    with spreadsheet.text_of(paths[0], settings.sheet, lambda *given: apart(spreadsheet.texts, *given, spend)) as text:
        yield (text,)


def files_of(path: Path) -> tuple[Path, ...]:
    """The file, or the pair of AQDEF that it belongs to. Raises `Unusable` for values without their description."""
    if path.suffix.lower() not in {".dfd", ".dfx"}:
        return (path,)
    source = aqdef.Source.at(path)
    return (source.description,) if source.values is None else (source.description, source.values)


def _passed_over(item: aqdef_values.Value, value: aqdef_values.Measured | None) -> str:
    if value is None and not item.fields.get("K0001", "").strip():
        return "has no value; passed over"
    return "is marked as not valid (K0002); passed over"


def _nothing_found(settings: Settings) -> str:
    if settings.format == "text":
        return "No line holds a reading as an expression of lines describes it. Try with “inband bridge preview”."
    return "The file holds no readings."


class _Reader:
    def __init__(
        self,
        machine: Machine,
        settings: Settings,
        paths: tuple[Path, ...],
        earlier: tuple[str, str] | None,
        content: Content,
    ) -> None:
        self.machine, self.settings, self.content = machine, settings, content
        self.path = next((path for path in paths if path.suffix.lower() != ".dfd"), paths[0])
        self.scale = INCH if machine.unit == "inch" else 1.0
        self.zone = None if settings.zone is None else zone_named(settings.zone)
        self.form = Form(
            self.scale, settings.decimal or ".", settings.times, self.zone, sheet=settings.format == "xlsx"
        )
        self.encoding = settings.encoding or (
            aqdef.encoding_of(self.path) if settings.format == "aqdef" else delimited.encoding_of(self.path)
        )
        seed = hashlib.sha256()
        for path in paths:
            if path != self.path:
                seed.update(path.read_bytes())
        self._prefixes(seed)
        self.remarks = Repeats()
        self.left_out: dict[str, Repeats] = {}
        self.nominal: dict[str, tuple[int, str]] = {}
        self.alike: Counter[str] = Counter()
        if earlier is not None and earlier[0] in self.prefix:
            content.stamp = earlier[1]

    def _prefixes(self, seed: Any) -> None:
        """A hash of the file up to each line, whatever its line ends are."""
        text = self.path.read_bytes().decode(self.encoding, "replace")
        self.content.complete = text.endswith(("\n", "\r", "\x1a"))
        self.lines = list(io.StringIO(text, newline=None))
        self.prefix = [seed.hexdigest()]
        for line in self.lines:
            seed.update(line.rstrip("\n").encode("utf-8", "replace") + b"\n")
            self.prefix.append(seed.hexdigest())
        self.content.digest = self.prefix[-1]

    def read(self) -> None:
        match self.settings.format:
            case "csv":
                delimiter = delimited.BLANKS if self.settings.delimiter == "blanks" else self.settings.delimiter
                self._rows(self._form_of_table(self.encoding, delimiter))
            case "xlsx":
                self._rows(self._form_of_table("utf-8", "\t"))
            case "ndjson":
                self._table(ndjson_rows(self.lines))
            case "text":
                self._text()
            case "aqdef":
                self._aqdef()
        self.content.entries = oldest_first(self.content.entries)
        self.content.remarks = self.remarks.sentences()
        self.content.left_out = {name: "; ".join(each.sentences()) for name, each in self.left_out.items()}

    # --- tables

    def _form_of_table(self, encoding: str, delimiter: str | None) -> Table:
        columns = set(filter(None, self.settings.columns.values()))
        names = {*self.machine.characteristics, *(() if self.settings.columns else FIELDS)}
        return Table(encoding, delimiter, columns, names, self.content.complete, self.settings.format == "xlsx")

    def _rows(self, table: Table) -> None:
        self._table(csv_rows(self.path, table), units_of(self.path, table))

    def _table(self, rows: Iterator[tuple[int, Found]], unit: Callable[[str], str | None] = unit_in) -> None:
        columns = dict(self.settings.columns) or {name: name for name in FIELDS}
        table = list(rows)
        if "measured_at" not in self.settings.columns:
            unnamed = unnamed_times(columns, table, self.settings.times)
            columns |= unnamed.column
            table += unnamed.said
        column = columns.get("measured_at", "")
        written = (str(cell_of(row, column) or "") for _line, row in table if isinstance(row, Mapping))
        self.form = self.form._replace(together=times_of(written, self.settings.times).live)
        units: dict[str, str | None] = {}
        for line, row in table:
            if isinstance(row, Fault):
                self.content.faults.append(row)
                continue
            if isinstance(row, Remark):
                self._remark(row)
                continue
            fields = {name: cell_of(row, column) for name, column in columns.items() if has(row, column)}
            if label := next(filter(is_summary, labels_of(fields, row)), None):
                self._statistics(line, str(label)[:40])
                continue
            for name in fields.keys() & set(TEMPERATURES):
                if not in_celsius(columns[name]):
                    del fields[name]
                    if columns[name] not in units:
                        units[columns[name]] = None
                        self._leave_out(name, Remark(line, columns[name], "", "names another scale than °C; left out"))
            if "unit" not in self.settings.columns:
                fields["unit"] = beside(row, "unit")
            sizes = (
                [columns["measured"]]
                if "measured" in fields
                else [name for name in self.machine.characteristics if name in row]
            )
            new = [column for column in sizes if column not in units]
            try:
                units |= {column: self.settings.unit or unit(column) for column in new}
            except UnknownUnit as error:
                self._fault(line, error.word, unit_in_doubt(error.word))
                return
            if doubt := next(filter(None, (self._thousands(table, each, units[each]) for each in new)), ""):
                self._fault(line, "", f"{doubt}.")
                return
            if "measured" in fields:
                name = str(fields.get("characteristic", EVERY)).strip()
                if reason := self._other_nominal(line, name, str(beside(row, "nominal") or "").strip()):
                    self._fault(line, "", reason)
                    continue
                self._take(line, name, fields, row, units[columns["measured"]])
                continue
            if not sizes:
                reason = "has neither a column measured nor one that characteristics names."
                self._fault(line, "", f"{reason} It has {', '.join(map(str, row))}.")
                return
            for name in sizes:
                if row[name] not in {None, ""} and str(row[name]).strip():
                    self._take(line, name, fields | {"measured": row[name]}, row, units[name])

    def _thousands(self, table: Sequence[tuple[int, Found]], column: str, unit: str | None) -> str:
        """The question about a column of sizes in a small unit whose sign may part thousands; empty where nothing is in doubt."""
        sheet = self.settings.format == "xlsx"
        if not sheet and (self.settings.decimal is not None or self.settings.format != "csv"):
            return ""
        rows = [row for _line, row in table if isinstance(row, Mapping)]
        cells = [number_and_unit(str(cell_of(row, column) or "")) for row in rows]
        said = {
            unit,
            *(length_unit(str(beside(row, "unit") or "")) for row in rows),
            *(length_unit(each) for _, each in cells),
        }
        small = next((each for each in said if each is not None and LENGTHS[each] < 1), None)
        number = delimited.like_thousands((text for text, _unit in cells), sheet=sheet) if small else ""
        return delimited.thousands_in_doubt(number, str(small), sheet=sheet) if number else ""

    def _statistics(self, line: int, label: str) -> None:
        """A row of limits or statistics, which is no part."""
        if self.settings.statistics == "skip":
            self._remark(Remark(line, "", label, "holds limits or statistics; passed over"))
            return
        reason = (
            'holds limits or statistics, no part: let the program write readings alone, or set statistics = "skip".'
        )
        self._fault(line, "", reason, label)

    def _other_nominal(self, line: int, name: str, nominal: str) -> str:
        """The reason against a row with another nominal size than the first of its name has: it is another characteristic."""
        first, before = self.nominal.setdefault(name, (line, nominal)) if nominal else (line, "")
        if not nominal or same_number(nominal, before):
            return ""
        return (
            f"has the nominal size {nominal}, line {first} has {before} for {name!r}: two characteristics of one name? Name the"
            ' columns that distinguish them, such as columns.characteristic = "Feature+Axis".'
        )

    # --- text protocols

    def _text(self) -> None:
        patterns = Patterns(self.settings.lines)
        for line, text in enumerate(self.lines, 1):
            if len(text) > LONGEST_LINE:
                self._fault(line, "", f"is longer than {LONGEST_LINE} characters: is this the right file?")
                continue
            try:
                for fields in patterns.find(text.rstrip("\n")):
                    self._take(line, fields.get("characteristic", EVERY).strip(), fields, fields, self.settings.unit)
            except NotFound as error:
                self._fault(line, "", str(error))
                if isinstance(error, TooSlow):
                    return  # the next line would take as long

    # --- AQDEF

    def _aqdef(self) -> None:
        source = aqdef.Source.at(self.path, self.settings.encoding)
        description = aqdef.describe(source)
        zone, keys = self.zone, Keys()
        clocks = {} if zone is None else {index: WallClock(zone) for index in description.characteristics}
        items = list(aqdef_values.values(source, description))
        written = (item.fields.get("K0004", "") for item in items if not isinstance(item, Remark))
        together = times_of(written, read=time_of).live
        order = day_order(self.settings.day_first) or together.order
        for item in items:
            if isinstance(item, Remark):
                self._remark(item)
                continue
            characteristic = description.characteristics[item.characteristic]
            key, name = self._key_of(description.part_of(characteristic).get("K1001", ""), characteristic)
            if key is None:
                self._nobody(item.line, name)
                continue
            if characteristic.counts or characteristic.grades:
                what = "counts parts, it" if characteristic.counts else "holds grades (K2004), it"
                self.content.skipped += 1
                self._remark(Remark(item.line, "", name, f"{what} measures nothing; passed over"))
                continue
            if order is None and slashed(item.fields.get("K0004", "")) is Slashed.EITHER:
                self._fault(item.line, "K0004", "could be day/month or month/day: set day_first to true or false.")
                continue
            value = aqdef_values.read_value(item, order)
            if isinstance(value, Remark):
                self._remark(value)
                continue
            if value is not None and value.at is not None:
                value = value._replace(at=together.settled(value.at))
            alone = None
            if value is not None and value.at is not None:
                unit = length_unit(characteristic.fields.get("K2142", ""))
                measured = value.measured * (self.scale if unit is None else LENGTHS[unit])
                alone = keys.of(item, description.identity(characteristic), measured, value.at)
            if value is None or value.attribute:
                self.content.skipped += 1
                self._remark(Remark(item.line, "", name, _passed_over(item, value)))
            else:
                self._measured(item, key, name, value, description, clocks.get(item.characteristic), alone)

    def _measured(
        self,
        item: aqdef_values.Value,
        key: str,
        name: str,
        value: aqdef_values.Measured,
        description: aqdef.Description,
        clock: WallClock | None,
        alone: str | None,
    ) -> None:
        unit = description.characteristics[item.characteristic].fields.get("K2142", "")
        said = length_unit(unit)
        if unit and said is None:
            reason = f"{unit!r} is no unit of length that is known; known are {', '.join(LENGTHS)}."
            self._fault(item.line, "K2142", reason)
            return
        scale = self.scale if said is None else LENGTHS[said]
        if not isfinite(value.measured * scale):
            self._fault(item.line, "", f"{value.measured:g} is not a number.")
            return
        body: dict[str, Any] = {"characteristic": key, "measured": round(value.measured * scale, 9)}
        if part := value.part or value.batch:
            body["part"] = part[:128]
        if context := context_of(item, value, description, self._remark):
            body["context"] = context
        if value.at is not None:
            if value.at.tzinfo is None and clock is None:
                self._fault(item.line, "K0004", "does not say its time zone: set zone, such as Europe/Belgrade.")
                return
            try:
                body["measured_at"] = (clock.moment(value.at) if clock else value.at).isoformat()
            except Unreadable as error:
                self._fault(item.line, "K0004", f"{error}.", item.fields.get("K0004", ""))
                return
        raw = item.fields
        if value.at is None and value.batch and not value.part:  # a batch is many parts: the next one may be as large
            raw = raw | {"file": self.content.stamp}
        self._add(item.line, f"{name}/{item.characteristic}", body, raw, None, alone)

    def _key_of(self, part: str, characteristic: aqdef.Characteristic) -> tuple[str | None, str]:
        """The key of a characteristic by part and number or name, number, or name; and its name for sentences."""
        names = [name for name in (characteristic.number, characteristic.name) if name]
        for name in [f"{part}/{name}" for name in names] + names:
            if name in self.machine.characteristics:
                return self.machine.characteristics[name], name
        return None, names[0] if names else str(characteristic.index)

    def _remark(self, remark: Remark) -> None:
        if remark.wrong:
            self._fault(remark.line, remark.field, remark.reason, remark.value)
        else:
            self.remarks.add(remark)

    def _leave_out(self, temperature: str, remark: Remark) -> None:
        self.remarks.add(remark)
        self.left_out.setdefault(temperature, Repeats()).add(remark)

    # --- one reading

    def _take(
        self, line: int, name: str, fields: Mapping[str, Any], raw: Mapping[str, Any], unit: str | None = None
    ) -> None:
        """Take a reading. unit: that the header of its column names."""
        key = self.machine.characteristics.get(name)
        if key is None:
            self._nobody(line, name)
            return
        if str(fields.get("measured")).strip() in self.settings.missing:
            self.content.skipped += 1
            self._remark(Remark(line, "", name, "is marked as missing; passed over"))
            return
        body: dict[str, Any] = {"characteristic": key}
        try:
            said = fields.get("unit")
            form = self.form.in_unit(unit, said, unit_of_name(name, unit or (str(said) if said else None)))
        except Unreadable as error:
            hint = "" if fields.get("unit") is None else ' If this column holds no units, set columns.unit = "".'
            self._fault(line, self.settings.columns.get("unit", "unit"), f"{error}.{hint}")
            return
        own = None
        for field_, value in fields.items():
            if field_ in {"characteristic", "unit"} or ((value is None or value == "") and field_ != "measured"):
                continue
            try:
                if field_ == "key":
                    own = str(value)
                elif (read := form.value(field_, value)) is not None:
                    put(body, field_, read)
                elif words := form.left_out(field_, value):
                    column = self.settings.columns.get(field_, field_)
                    self._leave_out(field_, Remark(line, column, str(value)[:40], words))
            except Unreadable as error:
                column = self.settings.columns.get(field_, field_ if name == EVERY or "measured" in fields else name)
                self._fault(line, column, f"{error}.", str(value)[:40])
                return
        lasting = any(to_the_second(fields[time]) for time in TIMES if time in body)
        self._add(line, name, body, raw, own, lasting=lasting)

    def _add(
        self,
        line: int,
        name: str,
        body: dict[str, Any],
        raw: Mapping[str, Any],
        own: str | None,
        alone: str | None = None,
        *,
        lasting: bool = False,
    ) -> None:
        """Add a reading. own: the key that its line gives. alone: one that tells it from all others, in whatever file.

        lasting: its meaning tells it from others wherever its line stands.
        """
        if alone is not None:
            self.content.entries.append(Entry(line, name, body, alone))
            return
        if own is not None:
            place, parts = "own", [own, name]
        elif lasting:
            place, parts = "at", [meant(body)]
            self.alike[parts[0]] += 1
            parts.append(str(self.alike[parts[0]]))
        else:
            place = str(line)
            parts = [self.prefix[line], name, json.dumps(dict(raw), sort_keys=True, default=str)]
            if not body.keys() & {*TIMES, "part"}:
                parts.append(self.content.stamp)
        digest = hashlib.sha256("\0".join(parts).encode("utf-8", "replace")).hexdigest()[:32]
        self.content.entries.append(Entry(line, name, body, f"{self.machine.key}:{place}:{digest}"))

    def _nobody(self, line: int, name: str) -> None:
        self.content.skipped += 1
        if self.settings.others == "fail":
            where = f"machine.{self.machine.key}.characteristics"
            said = (
                f"names no characteristic that {where} has"
                if name in {EVERY, ""}
                else f"{name!r} is not named in {where}"
            )
            self._fault(line, "", f'{said}. Add it there, or set others = "skip".')

    def _fault(self, line: int | None, field_: str, reason: str, value: str = "") -> None:
        self.content.faults.append(Fault(line, field_, reason, value))
