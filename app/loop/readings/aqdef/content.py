"""The values of an AQDEF file as readings of each characteristic."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec

from app.errors import Invalid
from app.files.apart import PREFIX, apart, spend
from app.files.aqdef.description import Source
from app.language.i18n import _, ngettext
from app.loop.readings.aqdef.matching import Content
from app.loop.readings.aqdef.sorting import Kept, Sorted, Wanted, Wishes, sort_out
from app.loop.readings.importing.cells import Flaw
from app.loop.readings.importing.lines import Line
from app.loop.readings.schemas import reading_of


class Readings:
    """The readings of a file, which lie in a folder."""

    def __init__(self, folder: Path, found: Sorted) -> None:
        self.folder = folder
        self.found = found

    def lines(self, index: int, characteristic: str) -> Iterator[Line | Flaw]:
        """The readings of one characteristic, in the order of the file."""
        decoder = msgspec.json.Decoder(Kept)
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
                    yield Line(kept.line, reading_of(fields, now), kept.origin)
                except Invalid as refusal:
                    for error in refusal.errors:
                        yield Flaw(kept.line, f"{error.field}", "", error.message)

    def sentences(self) -> list[str]:
        """Sentences on the file that a person should know before it is imported."""
        texts = self.found.remarks.sentences()
        if self.found.without_time:
            texts.append(
                ngettext(
                    "%(num)d value has no time (K0004): it gets that of the value above, or of this import where none has any.",
                    "%(num)d values have no time (K0004): each gets that of the value above, or of this import where none has any.",
                    self.found.without_time,
                )
                % {"num": self.found.without_time}
            )
        if self.found.twice:
            texts.append(
                ngettext(
                    "%(num)d value lies in the hour that is there twice, because the clocks went back: the order of the file decides.",
                    "%(num)d values lie in the hour that is there twice, because the clocks went back: the order of the file decides.",
                    self.found.twice,
                )
                % {"num": self.found.twice}
            )
        if self.found.month_first:
            texts.append(
                _("Dates with / are read as month/day/year, as {date} says.").format(date=repr(self.found.month_first))
            )
        if self.found.day_first and not self.found.month_first:
            texts.append(
                _("Dates with / are read as day/month/year, as {date} says.").format(date=repr(self.found.day_first))
            )
        if missing := sum(self.found.missing.values()):
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
    wanted: Mapping[int, Content],
    wishes: Wishes,
    progress: Callable[[], None] = lambda: None,
    most: int | None = None,
    *,
    foreign: bool = False,
) -> Iterator[Readings]:
    """Read the values of these characteristics, the first `most` of them; the readings are there inside the block.

    foreign: in a process of its own. Raises `Unusable`.
    """
    asked = {index: Wanted(content.scale, content.identity) for index, content in wanted.items()}
    with TemporaryDirectory(prefix=PREFIX) as name:
        folder = Path(name)
        if foreign:
            found = apart(sort_out, source, asked, wishes, folder, most, spend)
        else:
            found = sort_out(source, asked, wishes, folder, most, progress=progress)
        yield Readings(folder, found)
