"""The load by alarms of each position and of the plant, and what makes the noise. Never writes.

A position is a machine, or the plant where one person watches it all. Alarms of a period are found by `alarm_raised_idx`, active
ones by `alarm_active_idx`.
"""

from collections import defaultdict
from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any, NamedTuple

from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from app.core.alarm_load import DAYS, STALE, TOP, Annunciation, Load, Noise, load, noisiest
from app.core.decision.limits import nanometres
from app.core.period import Period
from app.errors import Invalid, TooManyRequests
from app.language.i18n import _
from app.loop.characteristics.queries import characteristic_named
from app.loop.machines.queries import machine_named, machines
from app.loop.summaries import queries as statistics
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.quality.what_if import queries as what_if
from app.web.fields import HISTORY_BEGINS

MOST_ALARMS = MOST_MACHINES = 100_000
MOST_DAYS = 400
EARLIEST_YEAR = 1900
WIDER = 1.25
"""Factor of a wear limit that is tried as the quieter one."""
SOONER, REPLAYED = 0.5, 1000
"""Factor of the zero range R33 with which that many readings are replayed: the loop corrects sooner."""
PATIENCE = 1.0
"""Seconds that the page waits for its turn among the replays; else this one is not computed."""
LONGER = 3.0
"""Factor of the silence after which a bridge counts as silent, tried likewise."""

_BEYOND = text("""
SELECT a.id, max(abs(r.decided)) AS most, min(CAST(a.data ->> 'limit' AS float8)) AS wear_limit
FROM alarm a
JOIN reading r ON r.machine_id = a.machine_id AND r.characteristic_id = a.characteristic_id
    AND r.sequence BETWEEN a.sequence AND coalesce(a.last_sequence, a.sequence) AND a.id = ANY(r.alarms)
WHERE a.machine_id = :machine AND a.characteristic_id = :characteristic AND a.id = ANY(CAST(:alarms AS bigint[]))
GROUP BY a.id
""")


class Cause(NamedTuple):
    """The trouble behind alarms, by the numbers of the tables."""

    kind: str
    machine_id: int
    characteristic_id: int | None
    tool: int | None
    place: str | None = None


class Position(NamedTuple):
    """The load at a machine; at the plant without one."""

    machine: Machine | None
    load: Load
    stale: int


class Quieter(NamedTuple):
    """The effect of a quieter setting: how many of the alarms would have been raised all the same.

    Of over- and undersize it is about the parts of the last `REPLAYED` readings that are out of tolerance, replayed.
    """

    alarms: int
    left: int
    factor: float | None


class Loud(NamedTuple):
    """One of the noisiest causes. quieter: None where it is not computed."""

    noise: Noise
    cause: Cause
    machine: Machine
    characteristic: Characteristic | None
    rule: str | None
    quieter: Quieter | None


class Stale(NamedTuple):
    """An alarm that has been active for too long."""

    alarm: Alarm
    machine: Machine


class AlarmLoad(NamedTuple):
    """The load by alarms in a period. positions: the plant first, where it is not about one machine; then each machine.

    cut: only the newest `MOST_ALARMS` were counted, from `period.start` on, which has moved.
    """

    period: Period
    machine: Machine | None
    positions: list[Position]
    top: list[Loud]
    stale: list[Stale]
    cut: bool

    @property
    def enough(self) -> bool:
        """Tell if the period is as long as the standard asks for."""
        assert self.period.start is not None
        assert self.period.end is not None
        return self.period.end - self.period.start >= timedelta(days=DAYS)

    @property
    def share_of_top(self) -> float:
        """Share that the noisiest have of all alarms."""
        return sum(each.noise.share for each in self.top)


def alarm_load(
    session: Session, period: Period, now: datetime, silent_after: float, machine: str | None = None
) -> AlarmLoad:
    """The load in a period, of all machines or of one; the last 30 days, or all of a younger plant, where none is named. Raises `NotFound`, `Invalid`.

    silent_after: seconds after which a bridge counts as silent, as it is set.
    """
    chosen = machine_named(session, machine) if machine is not None else None
    end = min(period.end or now, now)
    if end.year < EARLIEST_YEAR:
        raise Invalid.at("to", _("must not lie before {year}").format(year=EARLIEST_YEAR))
    start = period.start or max(_round(end - timedelta(days=DAYS)), _begin(session, chosen, end))
    if start >= end or end - start > timedelta(days=MOST_DAYS):
        raise Invalid.at("from", _("must lie before the end, and at most {n} days before it").format(n=MOST_DAYS))
    rows = _rows(session, Period(start, end), chosen)
    cut = len(rows) > MOST_ALARMS
    if cut:
        rows = rows[:MOST_ALARMS]
        start = rows[-1].raised_at
    known = {each.id: each for each in ([chosen] if chosen else machines(session, limit=MOST_MACHINES))}
    stale = _stale(session, now, chosen)
    by_machine: dict[int, list[datetime]] = defaultdict(list)
    for row in rows:
        by_machine[row.machine_id].append(row.raised_at)
    quiet = load((), start, end)  # of a thousand machines most are
    loads = {number: load(moments, start, end) for number, moments in by_machine.items()}
    positions = [
        Position(each, loads.get(number, quiet), sum(one.machine.id == number for one in stale))
        for number, each in known.items()
    ]
    if chosen is None:
        positions.insert(0, Position(None, load((row.raised_at for row in rows), start, end), len(stale)))
    top = _top(session, rows, known, now, silent_after)
    return AlarmLoad(Period(start, end), chosen, positions, top, stale, cut)


def _begin(session: Session, machine: Machine | None, end: datetime) -> datetime:
    """The first ten minutes of the plant, or of a machine: a rate is not thinned by the time before. Only before `end`."""
    of = () if machine is None else (machine.id,)
    made = select(func.min(Machine.created_at)).where(*(Machine.id == each for each in of)).scalar_subquery()
    raised = select(func.min(Alarm.raised_at)).where(*(Alarm.machine_id == each for each in of)).scalar_subquery()
    begin = session.scalar(select(func.least(made, raised)))
    return HISTORY_BEGINS if begin is None or _round(begin) >= end else _round(begin)


def _round(at: datetime) -> datetime:
    """Down to the ten minutes of the clock: without it, what is counted together would change from look to look."""
    return at.replace(minute=at.minute // 10 * 10, second=0, microsecond=0)


def _rows(session: Session, period: Period, machine: Machine | None) -> Sequence[Any]:
    """The newest first, one more than are counted."""
    query = (
        select(
            Alarm.id,
            Alarm.kind,
            Alarm.machine_id,
            Alarm.characteristic_id,
            Alarm.tool_memory,
            Alarm.raised_at,
            Alarm.acknowledged_at,
            Alarm.count.label("happened"),
            Alarm.last_at,
            Alarm.data["location"].astext.label("place"),
            Alarm.data["rule"].astext.label("rule"),
            Alarm.data["received_at"].astext.label("heard_at"),
        )
        .where(Alarm.raised_at >= period.start, Alarm.raised_at < period.end)
        .order_by(Alarm.raised_at.desc())
        .limit(MOST_ALARMS + 1)
    )
    return session.execute(query if machine is None else query.where(Alarm.machine_id == machine.id)).all()


def _stale(session: Session, now: datetime, machine: Machine | None) -> list[Stale]:
    query = (
        select(Alarm, Machine)
        .join(Machine, Machine.id == Alarm.machine_id)
        .where(Alarm.acknowledged_at.is_(None), Alarm.raised_at < now - STALE)
        .order_by(Alarm.raised_at)
        .limit(1000)
    )
    if machine is not None:
        query = query.where(Alarm.machine_id == machine.id)
    return [Stale(*row) for row in session.execute(query)]


def _top(
    session: Session, rows: Sequence[Any], known: dict[int, Machine], now: datetime, silent_after: float
) -> list[Loud]:
    of: dict[Cause, list[Any]] = defaultdict(list)
    for row in rows:
        of[Cause(row.kind, row.machine_id, row.characteristic_id, row.tool_memory, row.place)].append(row)
    alarms = [
        Annunciation(cause, row.raised_at, row.acknowledged_at, row.happened, row.last_at)
        for cause, of_cause in of.items()
        for row in of_cause
    ]
    found: list[Loud] = []
    replays: dict[int, Quieter | None] = {}
    for noise in noisiest(alarms, TOP):
        cause = noise.cause
        assert isinstance(cause, Cause)
        of_cause = of[cause]
        characteristic = None
        if cause.characteristic_id is not None:
            characteristic = session.get(Characteristic, (cause.machine_id, cause.characteristic_id))
        if cause.kind in {"oversize", "undersize"} and characteristic is not None:
            if characteristic.id not in replays:
                replays[characteristic.id] = _corrected_sooner(session, characteristic.key)
            quieter = replays[characteristic.id]
        else:
            quieter = _quieter(session, cause, of_cause, now, silent_after)
        rule = next((row.rule for row in of_cause if row.rule), None)
        found.append(Loud(noise, cause, known[cause.machine_id], characteristic, rule, quieter))
    return found


def _quieter(session: Session, cause: Cause, rows: Sequence[Any], now: datetime, silent_after: float) -> Quieter | None:
    """The replay of a quieter setting from what is stored beside the alarms: the readings behind them, the last heartbeat before them."""
    if cause.kind == "signal":
        return Quieter(len(rows), 0, None)
    if cause.kind == "bridge_silent":
        longest = timedelta(seconds=silent_after * LONGER)
        silences = [(row.acknowledged_at or now) - datetime.fromisoformat(row.heard_at) for row in rows if row.heard_at]
        return Quieter(len(silences), sum(silence > longest for silence in silences), LONGER) if silences else None
    if cause.kind == "tool_worn" and cause.characteristic_id is not None:
        where = {
            "machine": cause.machine_id,
            "characteristic": cause.characteristic_id,
            "alarms": [row.id for row in rows],
        }
        read = [row for row in session.execute(_BEYOND, where) if row.wear_limit]
        left = sum(nanometres(row.most) >= nanometres(WIDER * row.wear_limit) for row in read)
        return Quieter(len(read), left, WIDER) if read else None
    return None


def _corrected_sooner(session: Session, key: str) -> Quieter | None:
    """Parts out of tolerance with today's settings and with a smaller R33, both replayed as *What if* does; None where it cannot."""
    current = characteristic_named(session, key)
    parameters = current.parameters
    if not parameters.tool_memory or parameters.measures_only or parameters.zero_range <= 0:
        return None
    settings = what_if.Settings(zero_range=round(SOONER * parameters.zero_range, 6))
    try:
        with what_if.turn(PATIENCE):
            window = statistics.window_of(session, current.characteristic, last=REPLAYED)
            both = what_if.side_by_side(session, what_if.load(session, current, window), settings)
    except (Invalid, TooManyRequests):
        return None
    return Quieter(both.today.rejects, both.other.rejects, SOONER)
