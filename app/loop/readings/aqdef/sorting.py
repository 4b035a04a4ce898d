"""The values of an AQDEF file, put down beside by characteristic: read once, however long the file is.

Imports little: files of others are read here in a process of their own.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple
from zoneinfo import ZoneInfo

import msgspec

from app.files.aqdef import description as aqdef
from app.files.aqdef import values as aqdef_values
from app.files.aqdef.context import context_of
from app.files.aqdef.description import Description, Source
from app.files.aqdef.times import WallClock, time_of
from app.files.aqdef.values import Keys, Value
from app.files.formats.cell_values import DayOrder, Slashed, Unreadable, slashed
from app.files.formats.file_times import FileTimes, times_of
from app.files.formats.repeats import Remark, Repeats
from app.language.i18n import _
from app.loop.readings.importing.cells import MOST_FLAWS, Flaw, fingerprint
from app.loop.readings.origin import EMPIRICAL, Origin, named_by

SAMPLE = 250  # values whose times say what the file means by them
AT_ONCE = 20_000  # readings in memory before they are put down


@dataclass(frozen=True)
class Wishes:
    """Choices of a person about a file."""

    zone: ZoneInfo
    order: DayOrder | None = None
    unit: str | None = None
    encoding: str | None = None


class Wanted(NamedTuple):
    """A characteristic whose values are wanted. scale: mm in its unit. identity: part, number, name."""

    scale: float
    identity: tuple[str, str, str]


class Kept(msgspec.Struct, array_like=True):
    """A reading as it is put down. measured: mm."""

    line: int
    measured: float
    at: datetime | None
    part: str
    key: str
    context: dict[str, Any] | None = None
    origin: Origin | None = None  # of a reading that Inband wrote


@dataclass
class Sorted:
    """The values of a file. excluded: keys by characteristic and K0002. counted: values by characteristic."""

    counted: Counter[int] = field(default_factory=Counter)
    excluded: dict[int, dict[int, list[str]]] = field(default_factory=dict)
    missing: Counter[int] = field(default_factory=Counter)
    without_time: int = 0
    month_first: str = ""  # a date with strokes that can only be read so
    day_first: str = ""  # the same
    twice: int = 0  # in the hour that is there twice
    flaws: list[Flaw] = field(default_factory=list)
    flaw_count: int = 0
    remarks: Repeats = field(default_factory=Repeats)


def described(source: Source) -> Description:
    """The description of a file without what belongs to single values, of which there are millions. Raises `Unusable`."""
    return replace(aqdef.describe(source), of_values={}, others={})


def sort_out(
    source: Source,
    wanted: Mapping[int, Wanted],
    wishes: Wishes,
    folder: Path,
    most: int | None,
    spend: Callable[[int], None] = lambda _bytes: None,
    progress: Callable[[], None] = lambda: None,
) -> Sorted:
    """Put the values of each characteristic, of the first `most` ones, into a file of the folder, as `Kept`.

    spend: is called with bytes before they are written. Raises `Unusable`.
    """
    sorter = _Sorter(aqdef.describe(source), wanted, wishes, folder, fingerprint(source.values or source.description))
    return sorter.run(source, most, spend, progress)


class _Sorter:
    """Sorts values by characteristic."""

    def __init__(
        self, description: Description, wanted: Mapping[int, Wanted], wishes: Wishes, folder: Path, mark: str
    ) -> None:
        self._description = description
        self._folder = folder
        self._readings = Sorted()
        self._wanted = wanted
        self._order = wishes.order
        self._times = FileTimes()
        self._mark = mark
        self._clocks = {index: WallClock(wishes.zone) for index in wanted}
        self._keys = Keys()
        self._doubtful: list[Flaw] = []  # dates that may be either
        self._doubtful_count = 0
        self._waiting: dict[int, list[bytes]] = {}
        self._encode = msgspec.json.Encoder().encode

    def run(
        self, source: Source, most: int | None, spend: Callable[[int], None], progress: Callable[[], None]
    ) -> Sorted:
        readings, waiting = self._readings, 0
        begin = islice(aqdef_values.values(source, self._description), SAMPLE)
        texts = [value.fields.get("K0004", "") for value in begin if not isinstance(value, Remark)]
        self._times = times_of(texts, read=time_of)
        if self._order is None and self._times.order == "day_first":
            self._order = "day_first"
            readings.day_first = next(text for text in texts if slashed(text) is Slashed.DAY_FIRST)
        for value in islice(aqdef_values.values(source, self._description), most):
            progress()
            if isinstance(value, Remark):
                self._remark(value)
            elif value.characteristic in self._wanted and (kept := self._kept(value)) is not None:
                self._waiting.setdefault(value.characteristic, []).append(self._encode(kept))
                waiting += 1
                if waiting >= AT_ONCE:
                    self._write(spend)
                    waiting = 0
        self._write(spend)
        readings.twice = sum(clock.twice for clock in self._clocks.values())
        if self._doubtful and (readings.day_first or not readings.month_first):
            readings.flaws += self._doubtful[: MOST_FLAWS - len(readings.flaws)]
            readings.flaw_count += self._doubtful_count
        return readings

    def _look_at_date(self, value: Value) -> None:
        """Note a date for which it is not known whether the day or the month comes first."""
        text = value.fields.get("K0004", "")
        match slashed(text):
            case Slashed.MONTH_FIRST:
                self._readings.month_first = self._readings.month_first or text
            case Slashed.DAY_FIRST:
                self._readings.day_first = self._readings.day_first or text
            case Slashed.EITHER:
                self._doubtful_count += 1
                if len(self._doubtful) < MOST_FLAWS:
                    reason = _("could be day/month or month/day: say which comes first")
                    self._doubtful.append(Flaw(value.line, f"K0004/{value.characteristic}", text[:40], reason))

    def _write(self, spend: Callable[[int], None]) -> None:
        for index, lines in self._waiting.items():
            content = b"\n".join(lines) + b"\n"
            spend(len(content))
            with (self._folder / str(index)).open("ab") as file:
                file.write(content)
        self._waiting.clear()

    def _remark(self, remark: Remark) -> None:
        readings = self._readings
        if remark.wrong:
            readings.flaw_count += 1
            if len(readings.flaws) < MOST_FLAWS:
                readings.flaws.append(Flaw(*remark[:4]))
        else:
            readings.remarks.add(remark)

    def _kept(self, value: Value) -> Kept | None:
        readings, index, content = self._readings, value.characteristic, self._wanted[value.characteristic]
        read = aqdef_values.read_value(value, self._order)
        if isinstance(read, Remark):
            self._remark(read)
            return None
        if read is None:
            readings.missing[index] += 1
            return None
        try:
            read = read._replace(at=None if read.at is None else self._times.settled(read.at))
            at = self._clocks[index].moment(read.at) if read.at is not None else None
        except Unreadable as error:
            place, text = f"K0004/{index}", value.fields.get("K0004", "")
            self._remark(Remark(value.line, place, text[:40], str(error), wrong=True))
            return None
        measured = read.measured if content.scale == 1.0 else round(read.measured * content.scale, 9)
        if read.at is None:
            key = f"file:{self._mark}:{value.line}"
        else:
            key = self._keys.of(value, content.identity, measured, read.at)
        readings.counted[index] += 1
        readings.without_time += at is None
        if self._order is None:
            self._look_at_date(value)
        if read.attribute:
            readings.excluded.setdefault(index, {}).setdefault(read.attribute, []).append(key)
        context = context_of(value, read, self._description, self._remark)
        origin = None
        if named := named_by(value.fields.get("K0097", "")):
            origin = Origin(*named, measured + context.get("process", {}).get(EMPIRICAL, 0.0))
            # They are of where the file comes from: this reading will have its own.
            for name, own in (("fields", "K0097"), ("process", EMPIRICAL)):
                further = {each: text for each, text in context.pop(name, {}).items() if each != own}
                context |= {name: further} if further else {}
        return Kept(value.line, measured, at, (read.part or read.batch)[:128], key, context or None, origin)
