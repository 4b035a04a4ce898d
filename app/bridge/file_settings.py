"""The configuration of a folder into which a measuring machine writes files."""

from pathlib import Path
from typing import Literal

from msgspec import Struct

from app.bridge.configuration import Positive
from app.bridge.fields import FIELDS, refuse_unknown
from app.bridge.patterns import check_expressions
from app.files.formats.units import Unit


class Settings(Struct, forbid_unknown_fields=True, frozen=True):
    """A folder into which a measuring machine writes files.

    path: absolute. names: a pattern such as ``part_*.csv``; else by the format. done, failed: folders that files are moved to,
    from ``path``, on the same disk or share. every: s between two looks; a file is read when two looks find it the same.
    settle: s that a file whose last line has no end, or that cannot be read, has to stay the same. empty_after: s after
    which an empty file, or one without its pair, has failed. largest: MB.

    columns: column (or name in NDJSON) by field of `FIELDS`, two as ``Date+Time``; if empty, each is named as its field. Without ``measured`` the
    names in ``characteristics`` are columns of sizes. lines: regular expressions with fields as named groups; one without
    ``measured`` holds for the lines below. decimal, delimiter, encoding: of the text; the last two are found out if they are
    left out, decimals have a point. sheet: of a workbook; the first with cells if it is left out. times: the form of times, as strptime has it. zone: of times without an offset. day_first: in dates
    with strokes, AQDEF only. missing: marks in place of a size that was not measured. others: readings of a characteristic that has no name in ``characteristics`` make the file fail,
    or are passed over. statistics: rows of limits or statistics do the same. unit: of sizes whose row and cell name none, whatever
    names of columns and lines above them say. decisions: an absolute path, of a file that says `stop` or `hold`; anyone who acts on it removes it.
    """

    path: str
    format: Literal["csv", "xlsx", "ndjson", "text", "aqdef"]
    names: str | None = None
    done: str = "done"
    failed: str = "failed"
    every: Positive = 2.0
    settle: Positive = 30.0
    empty_after: Positive = 600.0
    largest: Positive = 20.0
    columns: dict[str, str] = {}
    lines: tuple[str, ...] = ()
    decimal: Literal[".", ","] | None = None
    delimiter: str | None = None
    encoding: str | None = None
    sheet: str | None = None
    times: str | None = None
    zone: str | None = None
    day_first: bool | None = None
    missing: tuple[str, ...] = ()
    others: Literal["fail", "skip"] = "fail"
    statistics: Literal["fail", "skip"] = "fail"
    unit: Unit | None = None
    decisions: str | None = None

    def __post_init__(self) -> None:
        """Refuse what contradicts itself."""
        if not Path(self.path).is_absolute():
            raise ValueError(f"path = {self.path!r} is not absolute: name it from the root or the drive on")
        if {Path(self.path, self.done), Path(self.path, self.failed)} & {Path(self.path)} or self.done == self.failed:
            raise ValueError("done and failed are two other folders than path")
        if self.decisions is not None:
            place = Path(self.decisions)
            if not place.is_absolute() or place.parent == Path(self.path):
                raise ValueError(
                    f"decisions = {self.decisions!r}: an absolute path of a file, in another folder than path"
                )
        for name in self.columns.keys() - set(FIELDS):
            raise ValueError(f"columns.{name} is no field; fields are {', '.join(FIELDS)}")
        refuse_unknown(self.zone, self.encoding)
        if self.delimiter is not None and len(self.delimiter) != 1 and self.delimiter != "blanks":
            raise ValueError("delimiter is one character, or blanks for two of them and more")
        if self.format == "text":
            check_expressions(self.lines)
