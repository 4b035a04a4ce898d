"""Periodic job that stores the signals of new readings, once a minute.

Signals decide no reading: the machine is locked only to raise an alarm.
"""

from collections import defaultdict
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import func, select, text
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.core.spc.watch import SignalSpan, Watch
from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.loop.characteristics.queries import CurrentCharacteristic, characteristic_named
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.tables.readings import Exclusion, Reading
from app.quality.baselines import queries
from app.quality.baselines.queries import Baseline
from app.quality.chart_rules.places import Do, Place, Watched, chart_at, piece_at, rules_at, settings_at
from app.quality.chart_rules.queries import rules_in_force
from app.quality.chart_signals.alarms import extend_alarms, raise_alarm
from app.quality.chart_signals.tables import Signal, Watching

CHUNK = 500_000  # readings that are looked at at once
NEIGHBOURS = 50  # readings before those that are looked at, which show where a tool began

# Characteristics with a baseline in force of which there is something to look at.
_TO_LOOK_AT = text("""
SELECT s.machine_id, s.characteristic_id, c.key FROM stream s
JOIN characteristic c ON c.machine_id = s.machine_id AND c.id = s.characteristic_id
CROSS JOIN LATERAL (
    SELECT version, last_sequence, retired_at FROM baseline
    WHERE machine_id = s.machine_id AND characteristic_id = s.characteristic_id ORDER BY version DESC LIMIT 1
) b
LEFT JOIN watching w ON w.machine_id = s.machine_id AND w.characteristic_id = s.characteristic_id
WHERE b.retired_at IS NULL AND (
    w.looked IS NULL OR w.looked <> s.sequence OR w.baseline_version <> b.version
    OR w.rules_version <> coalesce((SELECT max(version) FROM rule_set r
        WHERE r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id), 0)
    OR w.excluded <> (SELECT count(*) FROM exclusion e WHERE e.machine_id = s.machine_id
        AND e.characteristic_id = s.characteristic_id AND e.sequence BETWEEN b.last_sequence + 1 AND w.looked)
)
ORDER BY s.machine_id, c.key
""")

_COUNT_EXCLUDED = text("""
UPDATE signal s SET excluded = counted.n
FROM (
    SELECT id, (SELECT count(*) FROM exclusion e WHERE e.machine_id = s.machine_id
        AND e.characteristic_id = s.characteristic_id AND e.sequence BETWEEN s.first_sequence AND s.last_sequence) AS n
    FROM signal s WHERE s.machine_id = :machine AND s.characteristic_id = :which
) counted
WHERE s.machine_id = :machine AND s.id = counted.id AND s.excluded <> counted.n
""")

Key = tuple[Place, RuleName, int, int]


def to_look_at(session: Session) -> list[Unit]:
    """Characteristics whose rules have readings to judge."""
    return [
        Unit(f"characteristic/{key}", (key,), machine, characteristic)
        for machine, characteristic, key in session.execute(_TO_LOOK_AT)
    ]


def look_at(session: Session, unit: Unit) -> None:
    """Judge the new readings of one characteristic, and raise its alarm where rules are to."""
    current = characteristic_named(session, str(unit.key[0]))
    baseline = queries.baseline_in_force(session, current.characteristic)
    if baseline is None:
        return
    result = _Pass(session, current, baseline, rules_in_force(session, current.characteristic)).go()
    changes = [_news(current, max(result.touched))] if result.touched else []
    if result.alarming:
        changes.append(raise_alarm(session, current, result.alarming))
    # After the machine's lock was taken, as an acknowledgement takes it first.
    extend_alarms(session, result.grown)
    if changes:
        publish(session, *changes)


JOB = PeriodicJob("run_rules", to_look_at, look_at)


def _news(current: CurrentCharacteristic, number: int) -> dict[str, Any]:
    return {
        "kind": "signal",
        "machine": current.machine.key,
        "characteristic": current.characteristic.key,
        "id": number,
    }


@dataclass
class _PassResult:
    """Result of one pass: numbers of signals that are new or changed, those that alarm, those that go on."""

    touched: list[int]
    alarming: list[Signal]
    grown: list[Signal]


class _Pass:
    """One pass of the periodic job over one characteristic. from_start: all readings since the baseline are judged again."""

    def __init__(self, session: Session, current: CurrentCharacteristic, baseline: Baseline, watched: Watched) -> None:
        self.session, self.current, self.baseline, self.watched = session, current, baseline, watched
        row = self.row = self._row()
        self.newest = statistics.window_of(session, current.characteristic).newest
        self.same_baseline = row.baseline_version == baseline.version
        self.from_start = (
            not self.same_baseline or row.rules_version != watched.version or row.excluded != self._excluded(row.looked)
        )
        if not self.same_baseline:
            row.begun = self._begun()
        self.known_through = row.looked if self.same_baseline else row.begun

    def _row(self) -> Watching:
        """Progress of a characteristic, locked: no other session watches it meanwhile."""
        key = {"machine_id": self.current.machine.id, "characteristic_id": self.current.characteristic.id}
        self.session.execute(insert(Watching).values(**key).on_conflict_do_nothing())
        return self.session.get_one(Watching, key, with_for_update=True, populate_existing=True)

    def go(self) -> _PassResult:
        """Judge the new readings, store the signals, and note the progress."""
        memory = {} if self.from_start else self.row.memory
        looked, pointed = self.row.looked, self.row.pointed
        if self.from_start:
            looked = pointed = self.baseline.last_sequence
        spans, memory, pointed = self._judged(memory, looked, pointed)
        result = self._keep(spans)
        row = self.row
        if self.from_start:
            self.session.execute(_COUNT_EXCLUDED, {"machine": row.machine_id, "which": row.characteristic_id})
        row.baseline_version, row.rules_version = self.baseline.version, self.watched.version
        row.looked, row.pointed, row.memory = self.newest, pointed, memory
        row.excluded, row.at = self._excluded(self.newest), datetime.now(UTC)
        self.session.flush()
        return result

    def _judged(
        self, memory: dict[str, Any], looked: int, pointed: int
    ) -> tuple[dict[Key, SignalSpan], dict[str, Any], int]:
        """The signals, as far as their runs have come, by what they are known by; the memory; the last point's last reading."""
        since: dict[Place, dict[RuleName, int]] = defaultdict(dict)
        for place, name, setting in self.watched.each():
            if name in rules_at(self.baseline, place):
                since[place][name] = setting.after(self.baseline, self.row.begun)
        watches = {
            place: Watch(settings_at(self.baseline, place), rules, memory.get(place.value))
            for place, rules in since.items()
        }
        spans: dict[Key, SignalSpan] = {}
        while looked < self.newest and watches:
            last = min(looked + CHUNK, self.newest)
            window = Window(max(1, pointed + 1 - NEIGHBOURS), last, last)
            charted = queries.charted(self.session, self.current, self.baseline, window)
            for place, watch in watches.items():
                piece = piece_at(charted, place, looked if place.remembers else pointed)
                if piece is not None:
                    for span in watch.feed(piece):
                        spans[place, span.rule, span.side, span.first] = span
            looked, pointed = last, max(pointed, int(charted.last[-1]) if len(charted) else 0)
        return spans, {place.value: watch.memory() for place, watch in watches.items()}, pointed

    def _keep(self, spans: dict[Key, SignalSpan]) -> _PassResult:
        """Each run is one signal: it is added, or goes on. Judged from the start, a signal that no longer fires is withdrawn."""
        now = datetime.now(UTC)
        before = self._stored(spans)
        rows = self._matched(before, spans)
        added, changed = [], []
        for key, run in spans.items():
            row = rows.get(key)
            if row is None:
                rows[key] = self._added(chart_at(self.baseline, key[0]), run)
                added.append(key)
            elif (row.first_sequence, row.last_sequence, row.points) != run[2:] or row.withdrawn_at is not None:
                row.first_sequence, row.last_sequence, row.points = run[2:]
                row.last_at, row.withdrawn_at = now, None
                changed.append(row)
        added.sort(key=lambda key: (spans[key].last, spans[key].first))  # numbers go up with the readings
        gone = self._gone(before, set(rows.values())) if self.from_start and self.same_baseline else []
        for row in gone:
            row.withdrawn_at = now
        new = [rows[key] for key in added]
        self.session.add_all(new)
        self.session.flush()
        alarming = [rows[key] for key in added if self._alarms(key, spans[key])]
        grown = [row for row in changed if row.alarm is not None]
        return _PassResult([row.id for row in (*new, *changed, *gone)], alarming, grown)

    def _alarms(self, key: Key, run: SignalSpan) -> bool:
        """Not of readings that were there before the rule, the baseline, or the look before this one."""
        setting = self.watched.rules[key[0]][key[1]]
        return setting.do is Do.ALARM and run.last > max(self.known_through, setting.since)

    def _matched(self, before: list[Signal], spans: dict[Key, SignalSpan]) -> dict[Key, Signal]:
        """The signals that these runs are: those that begin there, else the first that shares readings with it."""
        runs = {
            key: (chart_at(self.baseline, key[0]).value, run.rule.value, run.side, run.first)
            for key, run in spans.items()
        }
        beginning = {(row.chart, row.rule, row.side, row.first_sequence): row for row in before}
        rows = {key: beginning[known] for key, known in runs.items() if known in beginning}
        there = set(rows.values())
        left = [row for row in before if row not in there]
        for key, (chart, rule, side, first) in runs.items():
            if key not in rows:
                for row in left:
                    alike = (row.chart, row.rule, row.side) == (chart, rule, side)
                    if alike and row.first_sequence <= spans[key].last and row.last_sequence >= first:
                        rows[key] = row
                        left.remove(row)
                        break
        return rows

    def _stored(self, spans: dict[Key, SignalSpan]) -> list[Signal]:
        """The signals by this baseline that may be meant: all of them when judged from the start."""
        query = select(Signal).where(
            Signal.machine_id == self.row.machine_id,
            Signal.characteristic_id == self.row.characteristic_id,
            Signal.baseline_version == self.baseline.version,
        )
        if not self.from_start:
            query = query.where(
                Signal.last_sequence >= min((run.first for run in spans.values()), default=self.newest + 1)
            )
        return list(self.session.scalars(query.order_by(Signal.first_sequence)))

    def _added(self, chart: Chart, run: SignalSpan) -> Signal:
        return Signal(
            machine_id=self.row.machine_id,
            characteristic_id=self.row.characteristic_id,
            chart=chart.value,
            rule=run.rule.value,
            side=run.side,
            first_sequence=run.first,
            last_sequence=run.last,
            points=run.points,
            baseline_version=self.baseline.version,
            rules_version=self.watched.version,
        )

    def _gone(self, before: list[Signal], there: set[Signal]) -> list[Signal]:
        """Those that the readings do not show any more; what rules have found that are off now, or were, stays."""
        after = {
            (chart_at(self.baseline, place).value, name.value): setting.after(self.baseline, self.row.begun)
            for place, name, setting in self.watched.each()
        }
        return [
            row
            for row in before
            if row not in there
            and row.withdrawn_at is None
            and row.first_sequence > after.get((row.chart, row.rule), row.first_sequence)
        ]

    def _excluded(self, through: int) -> int:
        """Number of readings after the baseline, up to this one, that are excluded from the statistics."""
        query = select(func.count()).where(
            Exclusion.machine_id == self.row.machine_id,
            Exclusion.characteristic_id == self.row.characteristic_id,
            Exclusion.sequence.between(self.baseline.last_sequence + 1, through),
        )
        return self.session.scalar(query) or 0

    def _begun(self) -> int:
        """The newest reading that was there when the baseline came into force."""
        query = (
            select(Reading.sequence)
            .where(
                Reading.machine_id == self.row.machine_id,
                Reading.characteristic_id == self.row.characteristic_id,
                Reading.received_at <= self.baseline.at,
            )
            .order_by(Reading.sequence.desc())
            .limit(1)
        )
        return max(self.session.scalar(query) or 0, self.baseline.last_sequence)
