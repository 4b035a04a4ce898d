"""Windows of readings: by number, or by the time of measurement."""

from dataclasses import dataclass, replace

from sqlalchemy import ColumnElement, and_, exists, func, select
from sqlalchemy.orm import Session

from app.core.context import Chosen
from app.core.decision.limits import Zone
from app.core.period import ALWAYS, Period
from app.db.period import in_period
from app.loop.summaries.queries.context import ends_in_context, in_context
from app.loop.summaries.queries.pyramid import Run, cover_of
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Exclusion, Reading, Stream

MOST_COUNTED = 100_000
"""Of more readings, a few that are left out make no difference."""


@dataclass(frozen=True, slots=True)
class Window:
    """A run of readings, first and last included; empty if last < first. `newest` is the stream's last sequence.

    period: of the run only those measured in it are meant. A reading that came late lies between others of another time; so
    anyone who counts, counts by it too. context: only those with these values in their context.
    """

    first: int
    last: int
    newest: int
    period: Period = ALWAYS
    context: Chosen = ()

    @property
    def count(self) -> int:
        return max(0, self.last - self.first + 1)

    @property
    def reaches_now(self) -> bool:
        return self.last == self.newest

    @property
    def narrowed(self) -> bool:
        """Tell if not all of the run are meant."""
        return self.period.bounded or bool(self.context)

    @property
    def meant(self) -> ColumnElement[bool]:
        """Measured in the period and with the context, as a condition on `Reading`."""
        measured = in_period(Reading.measured_at, self.period)
        return and_(measured, in_context(self.context)) if self.context else measured


def newest_of(session: Session, characteristic: Characteristic) -> int:
    """Number of the newest reading, 0 without readings."""
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
    period: Period = ALWAYS,
    context: Chosen = (),
    usable: bool = False,
) -> Window:
    """The readings first … through; of them those with the context; of them the newest `last`; of them those measured in the period.

    usable: where nobody has asked for a number: neither excluded readings nor probe faults count for `last`, up to `MOST_COUNTED`, so that an index of the last
    1000 stays one of 1000 readings when a person excludes one. Not so with a context.
    """
    newest = newest_of(session, characteristic)
    low, high = max(1, first or 1), min(newest, newest if through is None else through)
    if context:
        low, high = ends_in_context(session, characteristic, context, low, high, last)
    elif last is not None:
        low = max(low, _last_usable(session, characteristic, low, high, last) if usable else high - last + 1)
    window = Window(low, high, newest, context=context)
    if not period.bounded:
        return window
    window = replace(window, period=period)
    cover = cover_of(session, characteristic, low, high, period)
    ends = [end for block in cover.blocks for end in (block.first, block.last)]
    ends += _ends_in_time(session, characteristic, cover.runs, window)
    return replace(window, first=min(ends, default=1), last=max(ends, default=0))


def _last_usable(session: Session, characteristic: Characteristic, low: int, high: int, last: int) -> int:
    """The reading that begins the last N usable ones of low … high."""
    if not 0 < last <= min(MOST_COUNTED, high - low):
        return high - last + 1
    excluded = exists().where(
        Exclusion.machine_id == Reading.machine_id,
        Exclusion.characteristic_id == Reading.characteristic_id,
        Exclusion.sequence == Reading.sequence,
    )
    query = (
        select(Reading.sequence)
        .where(
            Reading.machine_id == characteristic.machine_id,
            Reading.characteristic_id == characteristic.id,
            Reading.sequence.between(low, high),
            Reading.zone != Zone.PROBE_FAULT.value,
            ~excluded,
        )
        .order_by(Reading.sequence.desc())
        .offset(last - 1)
        .limit(1)
    )
    return session.scalar(query) or low


def _ends_in_time(session: Session, characteristic: Characteristic, runs: list[Run], window: Window) -> list[int]:
    ends: list[int] = []
    for low, high in runs:
        query = select(func.min(Reading.sequence), func.max(Reading.sequence)).where(
            Reading.machine_id == characteristic.machine_id,
            Reading.characteristic_id == characteristic.id,
            Reading.sequence.between(low, high),
            window.meant,
        )
        ends += [number for number in session.execute(query).one() if number is not None]
    return ends
