"""AQDEF files (Q-DAS ASCII transfer format) read: `.dfq`, or a description `.dfd` with its values `.dfx`.

A line is `Kxxxx/i value`: K1… belongs to a part, K2…, K3… and K8… to the characteristic i, K4… to catalogues, K51… to the tree, K0001 to
K0099 to measured values. Without an index it is 1; index 0 is all. Values are in K lines, or in one line for all characteristics:
`values` takes both. A file is read twice, once for what it
describes and once for its values, one line after the other: however long it is, little of it is in memory.
Sources: the fields and catalogues as Hexagon lists them for *Q-DAS ASCII Transfer Format*, version 12; how files deviate
from that is known from what public readers take.
"""

import codecs
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

from app.files.aqdef.fields import FIELDS
from app.files.formats import delimited, letters
from app.files.formats.delimited import Unusable
from app.files.formats.repeats import Remark
from app.language.i18n import _

ENDINGS = {".dfq", ".dfd", ".dfx"}
OF_CHARACTERISTIC = "\x0f"
"""Parts what belongs to one characteristic and to the next: values in a line, and fields without an index that describe all."""
MOST_CHARACTERISTICS = 10_000
LONGEST = 200  # characters of a name by which something is known again
COUNTING_KINDS = {"1", "5", "6"}
"""K2004: attribute, kind of fault, list of faults."""
MOST_REMARKS = 200
LINE = re.compile(r"[Kk](\d{4,5})(?:/(\d{0,9})(?:/(\d{0,9}))?)?(?:[ \t]+(.*))?", re.DOTALL | re.ASCII)
_OF_VALUE = re.compile(r"[Kk](00\d\d)/(\d{1,9})/(\d{1,9})(?:[ \t]+(.*))?", re.DOTALL | re.ASCII)
_BAD_INDEX = re.compile(r"[Kk]\d{4,5}/(\S*)", re.ASCII)
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]+")
_WHO = {"K1001", "K2001", "K2002"}
_FAMILIES = set("1234580")


@dataclass
class Characteristic:
    """One characteristic of a file: its index, the index of its part, its fields by K number, and their lines."""

    index: int
    part: int
    fields: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)

    @property
    def number(self) -> str:
        """K2001."""
        return self.fields.get("K2001", "")

    @property
    def name(self) -> str:
        """K2002."""
        return self.fields.get("K2002", "")

    @property
    def counts(self) -> bool:
        """Tell if parts are counted (K2004), not measured."""
        return self.fields.get("K2004", "").lstrip("0") in COUNTING_KINDS

    @property
    def grades(self) -> bool:
        """Tell if K2004 says that the values are neither measured sizes nor counts: grades, such as a surface judged by eye as 2."""
        kind = self.fields.get("K2004", "").lstrip("0")
        return kind.isascii() and kind.isdigit() and kind not in COUNTING_KINDS


@dataclass
class Description:
    """The lines of a file that describe: parts, characteristics, catalogues.

    of_values: line and fields by characteristic and number of the value (K0014/1/7), which may be anywhere; 0 is all.
    """

    encoding: str = "utf-8"
    declared: int | None = None  # K0100
    parts: dict[int, dict[str, str]] = field(default_factory=dict)
    characteristics: dict[int, Characteristic] = field(default_factory=dict)
    catalogues: dict[str, dict[int, str]] = field(default_factory=dict)
    others: dict[tuple[str, int], str] = field(default_factory=dict)
    of_values: dict[tuple[int, int], tuple[int, dict[str, str]]] = field(default_factory=dict)
    remarks: list[Remark] = field(default_factory=list)

    def part_of(self, characteristic: Characteristic) -> Mapping[str, str]:
        """The fields of its part."""
        return self.parts.get(characteristic.part, {})

    def identity(self, characteristic: Characteristic) -> tuple[str, str, str]:
        """Part, number and name, by which it is known again in another file."""
        part = self.part_of(characteristic)
        words = (part.get("K1001", "") or part.get("K1002", ""), characteristic.number, characteristic.name)
        return words[0][:LONGEST], words[1][:LONGEST], words[2][:LONGEST]

    def named(self, entry: int | str, *catalogues: str) -> str:
        """The text of an entry (3, "K4093", "K4092") in the first of these catalogues that has it, else the entry as it is."""
        if isinstance(entry, str):
            return entry
        texts = (self.catalogues.get(each, {}).get(entry, "") for each in catalogues)
        return next(filter(None, texts), str(entry or ""))


@dataclass(frozen=True)
class Source:
    """The file of a description, and the file of its values where that is another one."""

    description: Path
    values: Path | None = None
    encoding: str | None = None  # as a person says; else found out

    @classmethod
    def at(cls, path: Path, encoding: str | None = None) -> "Source":
        """The file, or the pair that it belongs to: the other one lies beside it. Raises `Unusable`."""
        ending = path.suffix.lower()
        if ending not in {".dfd", ".dfx"}:
            return cls(path, None, encoding)
        wanted = ".dfx" if ending == ".dfd" else ".dfd"
        for other in sorted(path.parent.iterdir()):
            if other.stem.lower() == path.stem.lower() and other.suffix.lower() == wanted:
                return cls(*((path, other) if ending == ".dfd" else (other, path)), encoding)
        if ending == ".dfx":
            raise Unusable(
                _("The description of these values ({name}) does not lie beside them.").format(name=f"{path.stem}.dfd")
            )
        return cls(path, None, encoding)


def describe(source: Source) -> Description:
    """The description of a file. Raises `Unusable` for what is no AQDEF, or several files one after the other."""
    found = Description(encoding=source.encoding or encoding_of(source.description))
    reader = _Describing(found)
    try:
        with open_text(source.description, found.encoding) as file:
            for number, line in enumerate(file, 1):
                reader.take(number, line)
    except UnicodeError:
        raise Unusable(_("This is not {encoding} text.").format(encoding=found.encoding.upper())) from None
    reader.end()
    return found


def encoding_of(path: Path) -> str:
    """By the byte order mark; else UTF-8 if the whole file is, else the one whose letters fit best, as a rule Windows-1252.

    Raises `Unusable` for names in letters of East Asia.
    """
    decoder = codecs.getincrementaldecoder("utf-8")()
    with path.open("rb") as file:
        start = file.read(4)
        if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return "utf-16"
        for marked, name in ((start[:2], "utf-16-le"), (start[1::-1], "utf-16-be")):
            if marked[:1].isalnum() and marked[1:] == b"\0":  # no mark, but every other byte is 0
                return name
        file.seek(0)
        try:
            while block := file.read(1 << 20):
                decoder.decode(block)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            file.seek(0)
            return _letters_of(file.read(delimited.LOOKED_AT))
    return "utf-8-sig"


def _letters_of(beginning: bytes) -> str:
    """The encoding that fits the names of parts and characteristics, else all letters: graphics (K50..) are bytes of any kind."""
    lines = [line for line in beginning.splitlines() if not line.startswith(b"K5")]
    names = b"\n".join(line for line in lines if line.startswith((b"K1", b"K2")))
    name, european = letters.guessed(b"\n".join(lines) if names.isascii() else names)
    if not european and not names.isascii():
        raise Unusable(delimited.not_european())
    return name


def open_text(path: Path, encoding: str) -> TextIO:
    """The file as lines, whether they end with CR and LF, LF or CR."""
    return path.open(encoding=encoding, errors="strict" if encoding.startswith("utf") else "replace", newline=None)


def no_field(line: str) -> str:
    """The reason why a line that begins with K is none of a field."""
    if found := _BAD_INDEX.match(line):
        return _("has an index that is not a number ({index}); it is passed over").format(index=repr(found[1]))
    return _("is too short or no K field; it is passed over")


def _several_files(key: str, value: str, before: str, line: int, of: str = "{name}") -> Unusable:
    return Unusable(
        _(
            "{key} is {value} here and was {before} above, with values between: this is several files, one after the other. "
            "Split them."
        ).format(key=key, value=of.format(name=repr(value)), before=of.format(name=repr(before))),
        line,
    )


def _count(text: str) -> int | None:
    """A number of things; None where the text is something else."""
    return int(text) if len(text) <= 9 and text.isascii() and text.isdigit() else None


def _too_many(line: int) -> Unusable:
    return Unusable(_("A file holds at most {most} characteristics; part it.").format(most=MOST_CHARACTERISTICS), line)


class _Describing:
    """Takes the lines that describe, and passes over the values."""

    def __init__(self, found: Description) -> None:
        self.found = found
        self._part = self._last_part = 1
        self._described: set[int] = set()  # parts that have characteristics
        self._values_came = self._any = False
        self._lines: dict[tuple[str, int], int] = {}
        self._nodes: dict[str, dict[int, list[int]]] = {}
        self._all_parts: dict[str, str] = {}
        self._all_characteristics: dict[str, str] = {}

    def take(self, number: int, line: str) -> None:
        line = line.strip(" \t\r\n\x1a\ufeff")
        if line[:1] not in {"K", "k"}:
            self._values_came = self._values_came or line[:1] not in {"", "#"}
            return
        if line[1:3] == "00":
            self._values_came = self._any = True
            if line[5:6] == "/" and (own := _OF_VALUE.fullmatch(line)):
                _line, fields = self.found.of_values.setdefault((int(own[2]), int(own[3])), (number, {}))
                fields[f"K{own[1]}"] = (own[4] or "").strip()
            return
        match = LINE.fullmatch(line)
        if match is None:
            self._remark(number, "", line[:40], no_field(line))
            return
        self._any = True
        key, index, text = f"K{match[1]}", int(match[2] or 1), (match[4] or "").strip()
        value = text if text.isprintable() else _CONTROL.sub(" ", text).strip()
        if match[3] is not None:
            self._remark(
                number, key, value, _("has the number of a value, which only values have; that is passed over")
            )
        family = match[1][0] if len(match[1]) == 4 else ""
        if family == "1":
            self._of_part(number, key, index, value, indexed=bool(match[2]))
        elif family in {"2", "3", "8"} and OF_CHARACTERISTIC in text and not match[2]:
            for place, each in enumerate(text.split(OF_CHARACTERISTIC), 1):
                self._of_characteristic(number, key, place, _CONTROL.sub(" ", each).strip())
        elif family in {"2", "3", "8"}:
            self._of_characteristic(number, key, index, value)
        elif family == "4":
            self.found.catalogues.setdefault(key, {})[index] = value
        elif key.startswith("K51") and key in FIELDS:
            if (node := _count(value)) is not None:
                self._nodes.setdefault(key, {}).setdefault(index, []).append(node)
        elif key == "K0100":
            self.found.declared = _count(value)
            if (self.found.declared or 0) > MOST_CHARACTERISTICS:
                raise _too_many(number)
        else:
            if family not in _FAMILIES:
                self._remark(number, key, value[:40], _("is no field that is known here; it is kept and not used"))
            self.found.others[key, index] = value

    def _of_part(self, line: int, key: str, index: int, value: str, *, indexed: bool) -> None:
        if index == 0:
            self._all_parts[key] = value
            return
        if not indexed:
            index = self._part
            before = self.found.parts.get(index, {})
            if key == "K1001" and before.get(key, value) != value and index in self._described:
                index = self._last_part + 1
        self._part = index
        self._last_part = max(self._last_part, index)
        self._put(line, key, index, value, self.found.parts.setdefault(index, {}))

    def _of_characteristic(self, line: int, key: str, index: int, value: str) -> None:
        if index == 0:
            self._all_characteristics[key] = value
            return
        known = self.found.characteristics.get(index)
        if known is not None and self._values_came and known.part != self._part and key in _WHO:
            raise _several_files(
                f"{key}/{index}", self._name_of(self._part), self._name_of(known.part), line, _("of the part {name}")
            )
        if known is None:
            if len(self.found.characteristics) >= MOST_CHARACTERISTICS:
                raise _too_many(line)
            known = self.found.characteristics[index] = Characteristic(index, self._part)
            self._described.add(self._part)
        self._put(line, key, index, value, known.fields)
        known.lines[key] = line

    def _put(self, line: int, key: str, index: int, value: str, fields: dict[str, str]) -> None:
        before = fields.get(key)
        if before is not None and before != value:
            if key in _WHO and self._values_came:
                raise _several_files(f"{key}/{index}", value, before, line)
            first = self._lines.get((key, index), 0)
            self._remark(
                line,
                f"{key}/{index}",
                value[:40],
                _("is written twice, in line {line} too; the last one counts").format(line=first),
            )
        self._lines[key, index] = line
        fields[key] = value

    def _name_of(self, part: int) -> str:
        return self.found.parts.get(part, {}).get("K1001", "") or str(part)

    def _place(self) -> None:
        """Put characteristics below the part that the file's tree (K51xx) says."""
        nodes = self._nodes
        open_nodes = [(node, part) for node, (part, *_more) in nodes.get("K5111", {}).items()]
        seen: set[int] = set()
        for node, part in open_nodes:
            if node in seen or part not in self.found.parts:
                continue
            seen.add(node)
            for index in nodes.get("K5102", {}).get(node, []) + nodes.get("K5112", {}).get(node, []):
                if index in self.found.characteristics:
                    self.found.characteristics[index].part = part
            open_nodes += [(child, part) for child in nodes.get("K5103", {}).get(node, [])]

    def _tell_of_bare_parts(self) -> None:
        used = {each.part for each in self.found.characteristics.values()}
        others = ", ".join(self._name_of(each) for each in sorted(used)[:20])
        for part in self.found.parts.keys() - used:
            self._remark(
                self._lines.get(("K1001", part), 0),
                f"K1001/{part}",
                self._name_of(part),
                _("has no characteristic below it: those of the file count as parts of {other}").format(other=others),
            )

    def _remark(self, line: int, key: str, value: str, reason: str) -> None:
        if len(self.found.remarks) < MOST_REMARKS:
            self.found.remarks.append(Remark(line, key, value, reason))

    def end(self) -> None:
        found = self.found
        if not self._any:
            raise Unusable(_("This is no AQDEF file: no line begins with a K field such as K0100."))
        for index in range(1, (found.declared or 0) + 1):
            if index not in found.characteristics:
                found.characteristics[index] = Characteristic(index, self._part)
        found.characteristics = dict(sorted(found.characteristics.items()))
        self._place()
        if found.characteristics:
            self._tell_of_bare_parts()
        for characteristic in found.characteristics.values():
            found.parts.setdefault(characteristic.part, {})
            for key, value in self._all_characteristics.items():
                characteristic.fields.setdefault(key, value)
        for fields in found.parts.values():
            for key, value in self._all_parts.items():
                fields.setdefault(key, value)
