"""Which readings are meant: by number, or by when they were measured."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.characteristics.tables import Characteristic
from app.readings.tables import Reading, Stream
from app.statistics.queries.pyramid import Run, cover_of


@dataclass(frozen=True, slots=True)
class Window:
    """A run of readings, first and last included; empty if last < first. `newest` is the stream's last sequence."""

    first: int
    last: int
    newest: int

    @property
    def count(self) -> int:
        return max(0, self.last - self.first + 1)

    @property
    def reaches_now(self) -> bool:
        return self.last == self.newest


def newest_of(session: Session, characteristic: Characteristic) -> int:
    """How many readings there are."""
    return (
        session.scalar(
            select(Stream.sequence).where(
                Stream.machine_id == characteristic.machine_id, Stream.characteristic_id == characteristic.id
            )
        )
        or 0
    )


def window_of(
    session: Session,
    characteristic: Characteristic,
    *,
    last: int | None = None,
    first: int | None = None,
    through: int | None = None,
    start: datetime | None = None,
    end: datetime | None = None,
) -> Window:
    """The readings first … through; of them the `last` so many; of them from the first to the last measured in start … end."""
    newest = newest_of(session, characteristic)
    low, high = max(1, first or 1), min(newest, newest if through is None else through)
    if last is not None:
        low = max(low, high - last + 1)
    window = Window(low, high, newest)
    if start is None and end is None:
        return window
    cover = cover_of(session, characteristic, low, high, start=start, end=end)
    ends = [end for block in cover.blocks for end in (block.first, block.last)]
    ends += _ends_in_time(session, characteristic, cover.runs, start, end)
    return Window(min(ends), max(ends), newest) if ends else Window(1, 0, newest)


def _ends_in_time(
    session: Session, characteristic: Characteristic, runs: list[Run], start: datetime | None, end: datetime | None
) -> list[int]:
    ends: list[int] = []
    for low, high in runs:
        query = select(func.min(Reading.sequence), func.max(Reading.sequence)).where(
            Reading.machine_id == characteristic.machine_id,
            Reading.characteristic_id == characteristic.id,
            Reading.sequence.between(low, high),
        )
        if start is not None:
            query = query.where(Reading.measured_at >= start)
        if end is not None:
            query = query.where(Reading.measured_at <= end)
        ends += [found for found in session.execute(query).one() if found is not None]
    return ends
