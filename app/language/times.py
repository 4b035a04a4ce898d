"""Moments as people read them: in the time zone of the plant, and no other.

The setting `timezone` names the zone (INBAND_TIMEZONE; without it that of the computer), the setting `shifts` says when the
shifts begin. Pages, charts, reports, files and sentences take it from here, so that all times on a screen are of one zone. A
wall-clock time that is there twice, because the clocks went back, is written with its offset. JSON keeps RFC 3339 with an
offset.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, date, datetime, time, timedelta
from functools import cache
from typing import TYPE_CHECKING, NamedTuple
from zoneinfo import ZoneInfo

if TYPE_CHECKING:  # a fifth of a second to read, which most commands need not spend
    from app.settings import Settings

SECONDS, MINUTES = "%Y-%m-%d %H:%M:%S", "%Y-%m-%d %H:%M"
_chosen: ContextVar[ZoneInfo | None] = ContextVar("zone", default=None)


class PlantTime(NamedTuple):
    """The time zone of a plant, and when its shifts begin by its clock."""

    zone: ZoneInfo
    shifts: Sequence[time]


_of_plant: ContextVar[PlantTime | None] = ContextVar("plant time", default=None)
_of_process: list[PlantTime] = []


def use_zone(settings: Settings) -> None:
    """Take the plant's time of these settings for the whole process."""
    _of_process[:] = [plant_time(settings)]


def plant_time(settings: Settings) -> PlantTime:
    """Return the time zone and the shifts that these settings name."""
    return PlantTime(ZoneInfo(settings.timezone), [time.fromisoformat(begin) for begin in settings.shifts.split(",")])


def keep_time_of(plant: PlantTime) -> None:
    """Take the time of this plant from now on in this task and the tasks and threads that it begins."""
    _of_plant.set(plant)


@cache
def _usual() -> PlantTime:
    from app.settings import computer_timezone

    return PlantTime(ZoneInfo(computer_timezone()), [time(6), time(14), time(22)])


def _time() -> PlantTime:
    return _of_plant.get() or (_of_process[0] if _of_process else _usual())


def plant_zone() -> ZoneInfo:
    """The time zone in which people read and type times."""
    return _chosen.get() or _time().zone


@contextmanager
def in_zone(zone: ZoneInfo) -> Iterator[None]:
    """Everything inside is written in this time zone: a report may be asked for in another one than the plant's."""
    token = _chosen.set(zone)
    try:
        yield
    finally:
        _chosen.reset(token)


def plant_shifts() -> Sequence[time]:
    """Beginnings of the shifts of the plant, by its clock."""
    return _time().shifts


def local(at: datetime) -> datetime:
    """The moment in the zone of the plant."""
    return at.astimezone(plant_zone())


def begin_of_day(at: datetime, days: int = 0) -> datetime:
    """Midnight at the plant, N days after that of the moment."""
    return datetime.combine(local(at).date() + timedelta(days), time(), plant_zone())


def begin_of_shift(at: datetime) -> datetime:
    """The beginning of the shift in which the moment lies."""
    day = local(at).date()
    moment = at.astimezone(UTC)
    return [begin for begin in _begins(day - timedelta(1), day) if begin.astimezone(UTC) <= moment][-1]


def end_of_shift(at: datetime) -> datetime:
    """The end of the shift in which the moment lies: the beginning of the next one."""
    day = local(at).date()
    moment = at.astimezone(UTC)
    return next(begin for begin in _begins(day, day + timedelta(1)) if begin.astimezone(UTC) > moment)


def _begins(first: date, last: date, plant: PlantTime | None = None) -> list[datetime]:
    """Beginnings of the shifts of these days, ascending.

    By the moment, not by the clock: one that falls into the hour which the clock skips begins after it, perhaps after the next one.
    """
    zone, shifts = plant or PlantTime(plant_zone(), _time().shifts)
    days = (first + timedelta(n) for n in range((last - first).days + 1))
    begins = {datetime.combine(day, at, zone).astimezone(UTC) for day in days for at in shifts}
    return [begin.astimezone(zone) for begin in sorted(begins)]


def shifts_now() -> str:
    """Beginnings of the plant's shifts, and the zone of their clock, to be kept with what was grouped by them."""
    plant = _time()
    return f"{','.join(f'{begin:%H:%M}' for begin in plant.shifts)} {plant.zone.key}"


def begins_of_shifts(first: datetime, last: datetime, kept: str | None = None) -> list[datetime]:
    """Beginnings of the shifts from the one in which the first moment lies to that of the last, ascending.

    kept: shifts as `shifts_now` wrote them; without them those of the plant as they are set now.

    >>> from datetime import UTC
    >>> noon, evening = (datetime(2026, 10, 25, hour, tzinfo=UTC) for hour in (12, 20))
    >>> [str(each) for each in begins_of_shifts(noon, evening, "06:00,18:00 Europe/Berlin")]
    ['2026-10-25 06:00:00+01:00', '2026-10-25 18:00:00+01:00']
    >>> len(begins_of_shifts(evening, evening, "06:00,18:00 Europe/Berlin"))
    1
    """
    clocks, name = (kept or shifts_now()).rsplit(" ", 1)
    zone, shifts = ZoneInfo(name), [time.fromisoformat(each) for each in clocks.split(",")]
    day, end = first.astimezone(zone).date() - timedelta(1), last.astimezone(zone).date()
    begins = _begins(day, end, PlantTime(zone, shifts))
    of, until = first.astimezone(UTC), last.astimezone(UTC)
    moments = [begin.astimezone(UTC) for begin in begins]
    ends = [*moments[1:], until + timedelta(1)]
    return [begin for begin, at, after in zip(begins, moments, ends, strict=True) if at <= until and of < after]


def is_twice(at: datetime) -> bool:
    """True if the wall clock shows this local time twice, an hour (or less) apart, because it is put back."""
    return at.replace(fold=0).utcoffset() != at.replace(fold=1).utcoffset()


def offset(at: datetime) -> str:
    """The offset of a moment with a zone: `UTC+05:45`."""
    return f"UTC{at.isoformat()[-6:]}" if at.utcoffset() is not None else "UTC"


def written(at: datetime, pattern: str = SECONDS, zone: ZoneInfo | None = None) -> str:
    """The wall-clock time (`strftime`), with the offset only where it would be ambiguous.

    >>> from datetime import UTC
    >>> berlin = ZoneInfo("Europe/Berlin")
    >>> written(datetime(2026, 11, 22, 15, 50, 28, tzinfo=UTC), zone=berlin)
    '2026-11-22 16:50:28'
    >>> written(datetime(2026, 10, 25, 1, 30, tzinfo=UTC), MINUTES, berlin)
    '2026-10-25 02:30 UTC+01:00'
    """
    there = at.astimezone(zone or plant_zone())
    text = there.strftime(pattern)
    return f"{text} {offset(there)}" if is_twice(there) else text


def in_sentence(at: datetime | None) -> str:
    """A moment inside a sentence that programs may read as well: RFC 3339, to the second, in the zone of the plant."""
    return local(at).isoformat(timespec="seconds") if at else "?"


def on_axis(at: datetime) -> str:
    """A moment as a chart takes it: RFC 3339 in the zone of the plant. What is drawn is the wall-clock time in it."""
    return local(at).isoformat()
