"""The values of an AQDEF file as readings of each characteristic: read once, put down beside, however long the file is."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zoneinfo import ZoneInfo

import msgspec

from app.errors import Invalid
from app.files.formats import aqdef_values
from app.files.formats.aqdef import Description, Remark, Source
from app.files.formats.aqdef_context import context_of
from app.files.formats.aqdef_keys import Keys
from app.files.formats.aqdef_times import DayOrder, Slashed, WallClock, slashed
from app.files.formats.aqdef_values import Value
from app.language.i18n import _, ngettext
from app.loop.readings.importing.aqdef.matching import Content
from app.loop.readings.importing.cells import Flaw, fingerprint
from app.loop.readings.importing.history import MOST_FLAWS
from app.loop.readings.importing.lines import Line
from app.loop.readings.schemas import reading_of

AT_ONCE = 20_000  # readings in memory before they are put down


@dataclass(frozen=True)
class Wishes:
    """Choices of a person about a file."""

    zone: ZoneInfo
    order: DayOrder | None = None
    unit: str | None = None
    encoding: str | None = None


class _Kept(msgspec.Struct, array_like=True):
    """A reading as it is put down. measured: mm."""

    line: int
    measured: float
    at: datetime | None
    part: str
    key: str
    context: dict[str, Any] | None = None


@dataclass
class Readings:
    """The readings of a file. excluded: keys by characteristic and K0002. counted: values by characteristic."""

    folder: Path
    description: Description
    counted: Counter[int] = field(default_factory=Counter)
    excluded: dict[int, dict[int, list[str]]] = field(default_factory=dict)
    missing: Counter[int] = field(default_factory=Counter)
    without_time: int = 0
    month_first: str = ""  # a date with strokes that can only be read so
    flaws: list[Flaw] = field(default_factory=list)
    flaw_count: int = 0
    remarks: list[Remark] = field(default_factory=list)

    def lines(self, index: int, characteristic: str) -> Iterator[Line | Flaw]:
        """The readings of one characteristic, in the order of the file."""
        decoder = msgspec.json.Decoder(_Kept)
        now = datetime.now(UTC)
        path = self.folder / str(index)
        if not path.exists():
            return
        with path.open("rb") as file:
            for text in file:
                kept = decoder.decode(text)
                fields = {
                    "characteristic": characteristic,
                    "measured": kept.measured,
                    "measured_at": kept.at,
                    "part": kept.part or None,
                    "key": kept.key,
                    "context": kept.context,
                }
                try:
                    yield Line(kept.line, reading_of(fields, now))
                except Invalid as refusal:
                    for error in refusal.errors:
                        yield Flaw(kept.line, f"{error.field}", "", error.message)

    def sentences(self) -> list[str]:
        """Sentences on the file that a person should know before it is imported."""
        texts = [str(each) for each in self.remarks]
        if self.without_time:
            texts.append(
                ngettext(
                    "%(num)d value has no time (K0004): it gets the time of this import.",
                    "%(num)d values have no time (K0004): they get the time of this import.",
                    self.without_time,
                )
                % {"num": self.without_time}
            )
        if self.month_first:
            texts.append(
                _("Dates with / are read as month/day/year, as {date} says.").format(date=repr(self.month_first))
            )
        if missing := sum(self.missing.values()):
            texts.append(
                ngettext(
                    "%(num)d value is empty, or marked as missing or deleted (K0002 = 255, 256), and left out.",
                    "%(num)d values are empty, or marked as missing or deleted (K0002 = 255, 256), and left out.",
                    missing,
                )
                % {"num": missing}
            )
        return texts


@contextmanager
def put_down(
    source: Source,
    description: Description,
    wanted: Mapping[int, Content],
    wishes: Wishes,
    progress: Callable[[], None] = lambda: None,
    most: int | None = None,
) -> Iterator[Readings]:
    """Read the values of these characteristics, the first `most` of them; the readings are there inside the block.

    Raises `Unusable`.
    """
    with TemporaryDirectory() as folder:
        readings = Readings(Path(folder), description)
        _Sorter(readings, wanted, wishes, fingerprint(source.values or source.description)).run(source, progress, most)
        yield readings


class _Sorter:
    """Sorts values by characteristic."""

    def __init__(self, readings: Readings, wanted: Mapping[int, Content], wishes: Wishes, mark: str) -> None:
        self._readings = readings
        self._wanted = wanted
        self._wishes = wishes
        self._mark = mark
        self._clocks = {index: WallClock(wishes.zone) for index in wanted}
        self._keys = Keys()
        self._doubtful: list[Flaw] = []  # dates that may be either
        self._doubtful_count = 0
        self._waiting: dict[int, list[bytes]] = {}
        self._encode = msgspec.json.Encoder().encode

    def run(self, source: Source, progress: Callable[[], None], most: int | None) -> None:
        readings, waiting = self._readings, 0
        for value in islice(aqdef_values.values(source, readings.description), most):
            progress()
            if isinstance(value, Remark):
                self._remark(value)
            elif value.characteristic in self._wanted and (kept := self._kept(value)) is not None:
                self._waiting.setdefault(value.characteristic, []).append(self._encode(kept))
                waiting += 1
                if waiting >= AT_ONCE:
                    self._write()
                    waiting = 0
        self._write()
        if self._doubtful and not readings.month_first:
            readings.flaws += self._doubtful[: MOST_FLAWS - len(readings.flaws)]
            readings.flaw_count += self._doubtful_count

    def _look_at_date(self, value: Value) -> None:
        """Note a date of which nobody has said whether the day or the month comes first."""
        text = value.fields.get("K0004", "")
        match slashed(text):
            case Slashed.MONTH_FIRST:
                self._readings.month_first = self._readings.month_first or text
            case Slashed.EITHER:
                self._doubtful_count += 1
                if len(self._doubtful) < MOST_FLAWS:
                    reason = _("could be day/month or month/day: say which comes first")
                    self._doubtful.append(Flaw(value.line, f"K0004/{value.characteristic}", text[:40], reason))

    def _write(self) -> None:
        for index, lines in self._waiting.items():
            with (self._readings.folder / str(index)).open("ab") as file:
                file.write(b"\n".join(lines) + b"\n")
        self._waiting.clear()

    def _remark(self, remark: Remark) -> None:
        readings = self._readings
        if remark.wrong:
            readings.flaw_count += 1
            if len(readings.flaws) < MOST_FLAWS:
                readings.flaws.append(Flaw(*remark[:4]))
        elif len(readings.remarks) < MOST_FLAWS:
            readings.remarks.append(remark)

    def _kept(self, value: Value) -> _Kept | None:
        readings, index, content = self._readings, value.characteristic, self._wanted[value.characteristic]
        read = aqdef_values.read_value(value, self._wishes.order)
        if isinstance(read, Remark):
            self._remark(read)
            return None
        if read is None:
            readings.missing[index] += 1
            return None
        measured = read.measured if content.scale == 1.0 else round(read.measured * content.scale, 9)
        if read.at is None:
            key = f"file:{self._mark}:{value.line}"
        else:
            key = self._keys.of(value, content.identity, measured, read.at)
        at = self._clocks[index].moment(read.at) if read.at is not None else None
        readings.counted[index] += 1
        readings.without_time += at is None
        if self._wishes.order is None:
            self._look_at_date(value)
        if read.attribute:
            readings.excluded.setdefault(index, {}).setdefault(read.attribute, []).append(key)
        context = context_of(value, read, readings.description, self._remark)
        return _Kept(value.line, measured, at, (read.part or read.batch)[:128], key, context or None)
