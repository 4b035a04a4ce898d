"""The wear curve of a characteristic, what it predicts, and whether its loop hunts. Never writes.

The newest readings are read one by one. Of a longer run, what is older is read as evenly spread groups of neighbouring
readings, each drawn as its mean: wear is slow, and a curve of a million readings costs what one of two thousand does.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from itertools import pairwise
from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from app.core import forecast, hunting, wear
from app.core.decision.limits import nanometres
from app.core.forecast import NO_RECORD, Forecast, Record
from app.core.hunting import Hunting, Settings
from app.core.wear import Fit, Step, Towards, Values
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.tables.characteristics import ParametersVersion
from app.loop.tables.readings import Stream
from app.loop.tables.tools import OUTSTANDING, Correction, Tool, ToolEvent
from app.loop.tools.queries import OFFSET_TOLERANCE
from app.quality.wear import wording
from app.quality.wear.tables import Outlook

MOST_READINGS = 1_200  # read one by one
LIVES_LOOKED_BACK = 6_000  # readings on whose tool lives forecasts are tested
MOST_GROUPS, GROUP = 300, 16  # what is older: this many groups of this many readings
FEW = hunting.LONGEST  # of a tool that has cut fewer parts the chart shows the one before too
PLANNED, NEAR = 500, 100  # parts: what lies further ahead is not shown on the plant's page; what is nearer stands out
MOST_EVENTS = 5_000  # steps of the tool's offset that are looked through
OVERCORRECTS = (hunting.LoopVerdict.HUNTING.value, hunting.LoopVerdict.SWINGING.value)
SETTINGS = ("zero_range", "averaging_limit", "weighting_factor", "factor", "tool_memory", "average_memory", "mode")

# Every deviation from the target of now, by the empirical value of then: that belongs to the probe.
_WANTED = """
    r.machine_id = :machine AND r.characteristic_id = :characteristic AND r.compensated IS NOT NULL
    AND r.zone <> 'probe_fault' AND NOT EXISTS (
        SELECT FROM exclusion e
        WHERE e.machine_id = r.machine_id AND e.characteristic_id = r.characteristic_id AND e.sequence = r.sequence)
"""
_VERSIONS = (
    "JOIN unnest(CAST(:versions AS int[]), CAST(:targets AS float8[])) AS v(version, target) "
    "ON v.version = r.parameters_version"
)
_SINGLE = f"""
SELECT r.sequence, r.deviation + (v.target - :target), r.compensated, r.measured - r.deviation - v.target, r.received_at,
    1, r.parameters_version, r.paused_by IS NULL
FROM reading r {_VERSIONS}
WHERE {_WANTED} AND r.sequence BETWEEN :first AND :last
ORDER BY r.sequence
"""  # noqa: S608 - made of constants
_GROUPS = f"""
SELECT max(g.sequence), avg(g.deviation), avg(g.compensated), avg(g.empirical), max(g.received_at), count(*), max(g.version), false
FROM generate_series(CAST(:first AS bigint), CAST(:last AS bigint), CAST(:stride AS bigint)) AS place(sequence)
CROSS JOIN LATERAL (
    SELECT r.sequence, r.deviation + (v.target - :target) AS deviation, r.compensated, r.received_at,
        r.measured - r.deviation - v.target AS empirical, r.parameters_version AS version
    FROM reading r {_VERSIONS}
    WHERE {_WANTED} AND r.sequence BETWEEN place.sequence AND least(place.sequence + :group - 1, :last)
) g
GROUP BY place.sequence
HAVING NOT EXISTS (SELECT FROM unnest(CAST(:changes AS timestamptz[])) AS c(at) WHERE c.at > min(g.received_at) AND c.at <= max(g.received_at))
ORDER BY 1
"""  # noqa: S608 - made of constants


class _Row(NamedTuple):
    sequence: int
    deviation: float
    compensated: float
    empirical: float
    received_at: datetime
    readings: int
    version: int
    judged: bool


@dataclass(frozen=True)
class Curve:
    """Readings of one tool life, ascending; mm. counts: how many readings each of them is the mean of.

    worn: the wear curve. removed: what had been taken out of it when the part was cut; worn - removed are the deviations.
    lifted: by how much the end was lifted over steps of the reference.
    """

    sequence: NDArray[np.int64]
    worn: Values
    removed: Values
    counts: NDArray[np.int64]
    lifted: float = 0.0


@dataclass(frozen=True)
class Wear:
    """The wear curve with what follows from it. `now`: the tool in the machine (its readings of the window); lives: those before.

    total: corrections issued since the tool change, mm of offset. changed_at: when it was changed. record: how the
    forecasts of edges before came out; `NO_RECORD` where none was tested yet.
    """

    current: CurrentCharacteristic
    window: Window
    now: Curve
    lives: list[Curve]
    total: float
    changed_at: datetime | None
    hunting: Hunting | None
    record: Record = NO_RECORD

    @cached_property
    def fit(self) -> Fit | None:
        single = self.now.counts == 1
        return wear.fit(self.now.sequence[single], self.now.worn[single])

    @cached_property
    def forecasts(self) -> dict[Towards, Forecast]:
        """Parts left to each limit; empty where no wear is to be seen, or the window does not reach the present."""
        if self.fit is None or not self.fit.is_wear or not self.window.reaches_now:
            return {}
        made = {name: forecast.forecast(self.fit, limit, self.record.widening) for name, limit in self.limits.items()}
        return {name: each for name, each in made.items() if each is not None}

    @cached_property
    def limits(self) -> dict[Towards, float]:
        """Position of each limit on the wear curve, the way that it wears, mm."""
        way = self.fit.slope if self.fit is not None else 1.0
        return wear.limits_of(self.current.parameters, way, self.total, self.now.lifted)

    @property
    def first(self) -> tuple[Towards, Forecast] | None:
        """The limit that comes first while the loop does what it does now: a loop that corrects stays in its tolerance."""
        corrects = not self.current.parameters.measures_only
        coming = [(name, each) for name, each in self.forecasts.items() if not (corrects and name is Towards.TOLERANCE)]
        return min(coming, key=lambda each: each[1].parts, default=None)


def life_of(session: Session, current: CurrentCharacteristic) -> Window:
    """The readings since the tool was changed."""
    stream = _stream(session, current)
    return Window(stream.sequence_at_tool_change + 1, stream.sequence, stream.sequence)


def shown(session: Session, current: CurrentCharacteristic, last: str | None) -> Window:
    """The readings that a chart is asked for: `tool` (of few, those before too), `all`, or the last N."""
    if last in (None, "tool"):
        life = life_of(session, current)
        return life if life.count >= FEW else statistics.window_of(session, current.characteristic, last=FEW)
    return statistics.window_of(session, current.characteristic, last=None if last == "all" else int(last or FEW))


def wear_of(session: Session, current: CurrentCharacteristic, window: Window, *, singly: int = MOST_READINGS) -> Wear:
    """The wear curve over these readings, the newest `singly` of them one by one.

    The numbers are those of the tool that is in the machine.
    """
    stream, parameters = _stream(session, current), current.parameters
    versions = _versions(session, current)
    events = _events(session, current) if parameters.tool_memory else []
    changes = [at for kind, at, _step in events if kind == "change"]
    where = {
        "machine": current.machine.id,
        "characteristic": current.characteristic.id,
        "versions": list(versions),
        "targets": [version["target"] for version in versions.values()],
        "target": parameters.target,
    }
    newest = max(window.first, window.last - singly + 1)
    earliest = max(1, min(newest, window.last - hunting.LONGEST + 1))
    read = _rows(session, _SINGLE, where | {"first": earliest, "last": window.last})
    judged = _hunting(session, current, versions, read)
    rows = [row for row in read if row.sequence >= newest]
    if newest > window.first:
        stride = max(GROUP, -(-(newest - window.first) // MOST_GROUPS))
        older = where | {
            "first": window.first,
            "last": newest - 1,
            "stride": stride,
            "group": GROUP,
            "changes": changes,
        }
        rows = [*_rows(session, _GROUPS, older), *rows]
    sequence = np.array([row.sequence for row in rows], dtype=np.int64)
    removed = np.array([row.compensated for row in rows], dtype=np.float64) / parameters.factor
    worn = np.array([row.deviation for row in rows], dtype=np.float64) + removed
    counts = np.array([row.readings for row in rows], dtype=np.int64)
    arrived = [row.received_at for row in rows]
    steps = [Step(int(sequence[at]), size) for at, size in _empirical(rows)]
    steps += [
        Step(int(sequence[at]), step / parameters.factor)
        for kind, moment, step in events
        if kind != "change" and (at := bisect_right(arrived, moment)) < len(rows)
    ]

    def piece(low: int, high: int) -> Curve:
        inside = [step for step in steps if low < len(rows) and sequence[low] < step.sequence]
        joined, lifted = wear.joined(sequence[low:high], worn[low:high], inside)
        lift = joined - worn[low:high]
        return Curve(sequence[low:high], joined, removed[low:high] + lift, counts[low:high], lifted)

    begins = int(np.searchsorted(sequence, stream.sequence_at_tool_change, side="right"))
    cuts = sorted({at for change in changes if (at := bisect_right(arrived, change)) < begins} | {0, begins})
    return Wear(
        current,
        window,
        piece(begins, len(rows)),
        [piece(low, high) for low, high in pairwise(cuts) if high > low],
        _total(session, current),
        changes[-1] if changes else None,
        judged,
        record_of(session.get(Outlook, (current.machine.id, current.characteristic.id))),
    )


def record_of(outlook: Outlook | None) -> Record:
    """Accuracy of the forecasts of earlier edges, as the periodic job noted it; `NO_RECORD` where none was tested."""
    if outlook is None or not outlook.tested or outlook.lives is None or outlook.held is None:
        return NO_RECORD
    widening = forecast.widening_after(outlook.lives, outlook.widening or 0.0)  # a note of an earlier version has less
    return Record(outlook.lives, outlook.tested, outlook.held, widening)


def backtested(session: Session, current: CurrentCharacteristic) -> Record:
    """Test forecasts on the tool lives among the last `LIVES_LOOKED_BACK` readings before the tool change."""
    changed = _stream(session, current).sequence_at_tool_change
    before = Window(max(1, changed - LIVES_LOOKED_BACK + 1), changed, changed)
    if not before.count:
        return NO_RECORD
    lives = wear_of(session, current, before, singly=LIVES_LOOKED_BACK).lives
    return forecast.backtest([(life.sequence, life.worn) for life in lives])


def _rows(session: Session, statement: str, where: dict[str, Any]) -> list[_Row]:
    return [_Row(*row) for row in session.execute(text(statement), where)]


def _stream(session: Session, current: CurrentCharacteristic) -> Stream:
    return session.scalars(
        select(Stream).where(
            Stream.machine_id == current.machine.id, Stream.characteristic_id == current.characteristic.id
        )
    ).one()


def _versions(session: Session, current: CurrentCharacteristic) -> dict[int, dict[str, Any]]:
    rows = session.execute(
        select(ParametersVersion.version, ParametersVersion.parameters)
        .where(
            ParametersVersion.machine_id == current.machine.id,
            ParametersVersion.characteristic_id == current.characteristic.id,
        )
        .order_by(ParametersVersion.version)
    )
    return {row.version: row.parameters for row in rows}


def _events(session: Session, current: CurrentCharacteristic) -> list[tuple[str, datetime, float]]:
    """Changes of the tool, and steps of its offset that no correction asked for (mm), oldest first."""
    newest = (
        select(ToolEvent)
        .where(ToolEvent.machine_id == current.machine.id, ToolEvent.number == current.parameters.tool_memory)
        .order_by(ToolEvent.id.desc())
        .limit(MOST_EVENTS)
        .subquery()
    )
    beyond = newest.c.offset_after - newest.c.offset_before - func.coalesce(Correction.amount, 0.0)
    rows = session.execute(
        select(newest.c.kind, newest.c.at, beyond)
        .outerjoin(
            Correction,
            (Correction.machine_id == newest.c.machine_id) & (Correction.number == newest.c.correction),
        )
        .where((newest.c.kind != "correction") | (func.abs(func.round(beyond * 1_000_000)) > OFFSET_TOLERANCE))
        .order_by(newest.c.id)
    )
    return [(kind, at, step) for kind, at, step in rows]


def _total(session: Session, current: CurrentCharacteristic) -> float:
    """Corrections of the tool since it was changed, those on their way included, mm."""
    number = current.parameters.tool_memory
    if not number:
        return 0.0
    applied = session.scalar(select(Tool.total).where(Tool.machine_id == current.machine.id, Tool.number == number))
    coming = session.scalar(
        select(func.sum(Correction.amount)).where(
            Correction.machine_id == current.machine.id,
            Correction.tool_memory == number,
            Correction.status.in_(OUTSTANDING),
        )
    )
    return (applied or 0.0) + (coming or 0.0)


def _empirical(rows: Sequence[_Row]) -> list[tuple[int, float]]:
    """Changes of the empirical value, with their size: parts that did not move deviate by so much less from then on."""
    values = [row.empirical for row in rows]
    return [
        (at, now - before) for at, (before, now) in enumerate(pairwise(values), start=1) if nanometres(now - before)
    ]


def _hunting(
    session: Session,
    current: CurrentCharacteristic,
    versions: dict[int, dict[str, Any]],
    rows: Sequence[_Row],
) -> Hunting | None:
    """Of the newest readings judged with the settings of now; None where nothing is corrected."""
    parameters = current.parameters
    if parameters.measures_only:
        return None
    since = _since(versions)
    mine = [row for row in rows if row.version >= since and row.judged][-hunting.LONGEST :]
    sizes: Sequence[float] = ()
    if mine:
        sizes = session.scalars(
            select(Correction.size_error)
            .where(
                Correction.machine_id == current.machine.id,
                Correction.characteristic_id == current.characteristic.id,
                Correction.sequence.between(mine[0].sequence, mine[-1].sequence),
                Correction.status.in_(("applied", *OUTSTANDING)),
            )
            .order_by(Correction.sequence)
        ).all()
    return hunting.judge(
        sizes,
        len(mine),
        wear.scatter_of(np.array([row.deviation + row.compensated / parameters.factor for row in mine])),
        Settings(
            parameters.zero_range,
            parameters.averaging_limit,
            parameters.weighting_factor,
            parameters.average_memory > 0,
        ),
        floor=current.machine.zero_range_floor,
    )


def _since(versions: dict[int, dict[str, Any]]) -> int:
    """The version from which on the loop was set as it is now."""
    numbers = sorted(versions, reverse=True)
    now = versions[numbers[0]]
    since = numbers[0]
    for number in numbers:
        if any(versions[number].get(name) != now.get(name) for name in SETTINGS):
            break
        since = number
    return since


class Coming(NamedTuple):
    """Next event of a characteristic, in words, for a line of the plant's page. held: how many earlier forecasts held."""

    parts: str
    towards: str
    near: bool
    held: str


def next_event(outlook: Outlook | None) -> Coming | None:
    """The forecast of the periodic job, if it is not too far off to plan for; near when it may come within `NEAR` parts."""
    if outlook is None or outlook.towards is None or outlook.parts is None or outlook.parts > PLANNED:
        return None
    high = inf if outlook.parts_high is None else outlook.parts_high
    return Coming(
        wording.parts_left(Forecast(outlook.parts, outlook.parts_low or 0.0, high)),
        wording.towards_parts(Towards(outlook.towards), reached=outlook.parts <= 0),
        outlook.parts <= NEAR,
        wording.held_of(record_of(outlook)),
    )
