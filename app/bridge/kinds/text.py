"""Readings in lines of text that a probing cycle, a gauge or a protocol printer prints, found by regular expressions: from a
serial port or by TCP.

Nothing tells a line that was lost or damaged, and nothing comes again. A reading whose line, or a line above it, gives a key, a
time or a part is known by its fields: printed again it is the same one. One without them is known by its arrival.
"""

import hashlib
import json
import re
import time
import uuid
from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import Any, Literal

from app.bridge import sources
from app.bridge.configuration import Machine
from app.bridge.fields import EVERY, Form, left_out_since, put, refuse_unknown
from app.bridge.links import Misconfigured, Position, Received
from app.bridge.patterns import LONGEST_LINE, NotFound, Patterns, check_expressions
from app.bridge.sources import Printing, Source, source_of
from app.core.ring import INCH
from app.files.formats.cell_values import Unreadable, zone_named

FILLING = re.compile(r"[\0\x11-\x14\x7f]")
"""Signs that a tape or a handshake leaves in a line."""
SHOWN = 200  # characters of a line


class Settings(sources.Settings, forbid_unknown_fields=True, frozen=True):
    """One of serial, connect and listen says where the lines come from, see `app.bridge.sources.Settings`.

    lines: regular expressions with fields as named groups; one without ``measured`` holds for the lines below. A line ends with
    CR, LF or both. encoding: left out, the eighth bit is parity. decimal, times, zone, others: as of kind ``folder``.
    """

    lines: tuple[str, ...] = ()
    encoding: str | None = None
    decimal: Literal[".", ","] = "."
    times: str | None = None
    zone: str | None = None
    others: Literal["fail", "skip"] = "fail"

    def __post_init__(self) -> None:
        """Refuse what contradicts itself."""
        check_expressions(self.lines)
        refuse_unknown(self.zone, self.encoding)


class TextLines:
    """Whole lines of a stream, each with what stood on the lines above it. damaged: those that were too long."""

    def __init__(self, settings: Settings) -> None:
        self.damaged = 0
        self.patterns = Patterns(settings.lines)
        self._encoding = settings.encoding
        self._rest = b""

    def feed(self, data: bytes) -> list["Line"]:
        """The lines that these bytes complete."""
        *whole, self._rest = re.split(rb"[\r\n\f]", self._rest + data)
        if len(self._rest) > LONGEST_LINE:
            self._rest = b""
            self.damaged += 1
        return [Line(text, self.patterns) for each in whole if (text := self._text(each))]

    def _text(self, line: bytes) -> str:
        if self._encoding is None:
            line, encoding = bytes(byte & 0x7F for byte in line), "ascii"
        else:
            encoding = self._encoding
        return FILLING.sub("", line.decode(encoding, "replace")).rstrip()


class Line:
    """A line, and the expressions of its connection: what holds for it was on the same one."""

    def __init__(self, text: str, patterns: Patterns) -> None:
        self.text, self.patterns = text, patterns


class TextLink(Printing[Line]):
    """A machine that prints text. remark: lines without a reading or too long, temperatures that are left out."""

    def __init__(self, machine: Machine) -> None:
        super().__init__(machine)
        self.settings: Settings = machine.settings
        zone = None if self.settings.zone is None else zone_named(self.settings.zone)
        scale = INCH if machine.unit == "inch" else 1.0
        self._form = Form(scale, self.settings.decimal, self.settings.times, zone)
        self._lines = self._found = 0
        self._left_out: dict[str, str] = {}

    async def connect(self) -> str:
        """Open the source; what it is called."""
        if self.machine.corrections != "none":
            raise Misconfigured(
                f'machine.{self.machine.key}: a machine that prints takes no corrections. Set corrections = "none".'
            )
        self._source = source_of(self.settings, "text", lambda: TextLines(self.settings))
        return await self._source.open()

    def _received(self, source: Source[Line], lines: Sequence[Line], stored: Position) -> Iterator[Received]:
        del source, stored
        now = datetime.now().astimezone()
        for line in lines:
            self._lines += 1
            try:
                found = line.patterns.find(line.text[:LONGEST_LINE])
            except NotFound as error:
                yield self._refused(line, str(error))
                continue
            self._found += len(found)
            yield from [each for fields in found if (each := self._reading(line, fields, now))]

    def _reading(self, line: Line, fields: dict[str, str], now: datetime) -> Received | None:
        name = fields.get("characteristic", EVERY).strip()
        key = self.machine.characteristics.get(name)
        if key is None:
            if self.settings.others == "skip":
                return None
            where = f"machine.{self.machine.key}.characteristics"
            said = f"names no characteristic that {where} has" if name == EVERY else f"{name!r} is not named in {where}"
            return self._refused(line, f'{said}. Add it there, or set others = "skip".')
        body: dict[str, Any] = {"characteristic": key}
        left_out: dict[str, str] = {}
        field, value = "unit", fields.get("unit", "")
        try:
            form = self._form.in_unit(value)
            for field, value in fields.items():
                if field in {"characteristic", "unit", "key"} or (value == "" and field != "measured"):
                    continue
                if (read := form.value(field, value)) is not None:
                    put(body, field, read)
                elif words := form.left_out(field, value):
                    left_out[field] = f"{field} {value[:40]!r} {words}."
        except Unreadable as error:
            return self._refused(line, f"{field} {value[:40]!r} {error}.")
        self._left_out = left_out_since(self._left_out, body, left_out)
        if "key" in fields:
            parts = [fields["key"], name]
        elif body.keys() & {"measured_at", "machined_at", "part"}:
            parts = [name, json.dumps(body, sort_keys=True)]
        else:
            parts = [uuid.uuid4().hex]
        body.setdefault("measured_at", now.isoformat())
        return Received(f"{self.machine.key}:text:{_digest(parts)}", body)

    def _refused(self, line: Line, reason: str) -> Received:
        key = f"{self.machine.key}:refused:{_digest([line.text, str(time.time_ns())])}"
        return Received(key, {"line": line.text[:SHOWN]}, fault=f"The line {line.text[:SHOWN]!r}: {reason}")

    def _remark(self) -> str:
        words = [self._source.remark] if self._source is not None and self._source.remark else []
        if self._lines and not self._found:
            words.append(
                f"Of {self._lines} lines that came none holds a reading as an expression of lines describes it."
            )
        words += self._left_out.values()
        if self._damaged:
            words.append(f"Lines longer than {LONGEST_LINE} characters since the start: {self._damaged}. Baud rate?")
        return " ".join(words)


def _digest(parts: Sequence[str]) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "replace")).hexdigest()[:32]


def link(machine: Machine) -> TextLink:
    """The link to a machine that prints text."""
    return TextLink(machine)
