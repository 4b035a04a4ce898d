"""Keeping the signals of new readings, once a minute, and saying what a signal was.

Readings are not decided by signals: no machine is locked to look at them, only to raise an alarm.
"""

from collections import defaultdict
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import func, select, text
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.audit.actions import record
from app.characteristics.queries import Standing, characteristic_named
from app.control import queries, signals_queries
from app.control.rules_queries import rules_in_force
from app.control.signal_tables import Signal, Watching
from app.control.signals_alarms import extend_alarms, raise_alarms
from app.control.signals_queries import SignalRow
from app.control.signals_wording import Cause
from app.control.tables import Baseline
from app.control.watching import Do, Place, Watched, chart_at, drawn_at, piece_at, rules_at
from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.core.spc.watch import Found, Watch
from app.db.events import publish
from app.people.callers import Caller
from app.readings.tables import Exclusion, Reading
from app.statistics import queries as statistics
from app.statistics.queries import Window

CHUNK = 500_000  # readings that are looked at at once
NEIGHBOURS = 50  # readings before those that are looked at, which tell where a tool began

# Characteristics with a baseline in force of which there is something to look at, by machine.
_TO_LOOK_AT = text("""
SELECT s.machine_id, c.key FROM stream s
JOIN characteristic c ON c.machine_id = s.machine_id AND c.id = s.characteristic_id
CROSS JOIN LATERAL (
    SELECT version, last_sequence, retired_at FROM baseline
    WHERE machine_id = s.machine_id AND characteristic_id = s.characteristic_id ORDER BY version DESC LIMIT 1
) b
LEFT JOIN watching w ON w.machine_id = s.machine_id AND w.characteristic_id = s.characteristic_id
WHERE s.machine_id > :after AND b.retired_at IS NULL AND (
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


class SignalRounds:
    """The chore: the machines one after the other, each in a transaction of its own and once on a round."""

    def __init__(self) -> None:
        self._after = 0

    def look(self, session: Session) -> bool:
        """Judge what came in since; whether another machine may have something too."""
        rows = session.execute(_TO_LOOK_AT, {"after": self._after}).all()
        if not rows:
            self._after = 0
            return False
        self._after = rows[0][0]  # whatever happens to this one, the next is looked at after it
        look_at(session, [key for machine, key in rows if machine == self._after])
        return True


def look_at(session: Session, characteristics: list[str]) -> None:
    """Judge the new readings of these characteristics of one machine, and raise alarms where rules are to."""
    changes: list[dict[str, Any]] = []
    alarming: list[tuple[Standing, list[Signal]]] = []
    grown: list[Signal] = []
    for key in characteristics:
        standing = characteristic_named(session, key)
        baseline = queries.baseline_in_force(session, standing.characteristic)
        if baseline is None:
            continue
        watched = rules_in_force(session, standing.characteristic)
        kept = _Look(session, standing, baseline, watched).go()
        if kept.touched:
            changes.append(_news(standing, max(kept.touched)))
        if kept.alarming:
            alarming.append((standing, kept.alarming))
        grown += kept.grown
    changes += raise_alarms(session, alarming)
    extend_alarms(session, grown)  # after the machine's lock was taken, as whoever acknowledges them takes it first
    if changes:
        publish(session, *changes)


def _news(standing: Standing, number: int) -> dict[str, Any]:
    return {
        "kind": "signal",
        "machine": standing.machine.key,
        "characteristic": standing.characteristic.key,
        "id": number,
    }


@dataclass
class _Kept:
    """What a look has come to: numbers of signals that are new or changed, those that alarm, those that go on."""

    touched: list[int]
    alarming: list[Signal]
    grown: list[Signal]


class _Look:
    """One look at one characteristic."""

    def __init__(self, session: Session, standing: Standing, baseline: Baseline, watched: Watched) -> None:
        self.session, self.standing, self.baseline, self.watched = session, standing, baseline, watched
        row = self.row = self._row()
        self.newest = statistics.window_of(session, standing.characteristic).newest
        self.same_baseline = row.baseline_version == baseline.version
        self.anew = (
            not self.same_baseline or row.rules_version != watched.version or row.excluded != self._excluded(row.looked)
        )
        if not self.same_baseline:
            row.begun = self._begun()
        self.heard = row.looked if self.same_baseline else row.begun

    def _row(self) -> Watching:
        """How far was looked; nobody else looks meanwhile."""
        key = {"machine_id": self.standing.machine.id, "characteristic_id": self.standing.characteristic.id}
        self.session.execute(insert(Watching).values(**key).on_conflict_do_nothing())
        return self.session.get_one(Watching, key, with_for_update=True, populate_existing=True)

    def go(self) -> _Kept:
        """Judge, keep, and note how far."""
        memory = {} if self.anew else self.row.memory
        looked, pointed = self.row.looked, self.row.pointed
        if self.anew:
            looked = pointed = self.baseline.last_sequence
        found, memory, pointed = self._judged(memory, looked, pointed)
        kept = self._keep(found)
        row = self.row
        if self.anew:
            self.session.execute(_COUNT_EXCLUDED, {"machine": row.machine_id, "which": row.characteristic_id})
        row.baseline_version, row.rules_version = self.baseline.version, self.watched.version
        row.looked, row.pointed, row.memory = self.newest, pointed, memory
        row.excluded, row.at = self._excluded(self.newest), datetime.now(UTC)
        self.session.flush()
        return kept

    def _judged(
        self, memory: dict[str, Any], looked: int, pointed: int
    ) -> tuple[dict[Key, Found], dict[str, Any], int]:
        """The signals, as far as their runs have come, by what they are known by; the memory; the last point's last reading."""
        since: dict[Place, dict[RuleName, int]] = defaultdict(dict)
        for place, name, setting in self.watched.each():
            if name in rules_at(self.baseline, place):
                since[place][name] = setting.after(self.baseline, self.row.begun)
        watches = {
            place: Watch(drawn_at(self.baseline, place), rules, memory.get(place.value))
            for place, rules in since.items()
        }
        found: dict[Key, Found] = {}
        while looked < self.newest and watches:
            last = min(looked + CHUNK, self.newest)
            window = Window(max(1, pointed + 1 - NEIGHBOURS), last, last)
            charted = queries.charted(self.session, self.standing, self.baseline, window)
            for place, watch in watches.items():
                piece = piece_at(charted, place, looked if place.remembers else pointed)
                if piece is not None:
                    for each in watch.feed(piece):
                        found[place, each.rule, each.side, each.first] = each
            looked, pointed = last, max(pointed, int(charted.last[-1]) if len(charted) else 0)
        return found, {place.value: watch.memory() for place, watch in watches.items()}, pointed

    def _keep(self, found: dict[Key, Found]) -> _Kept:
        """Each run is one signal: it is added, or goes on. Looked at anew, what is none any more is withdrawn."""
        now = datetime.now(UTC)
        before = self._stored(found)
        rows = self._matched(before, found)
        added, changed = [], []
        for key, run in found.items():
            row = rows.get(key)
            if row is None:
                rows[key] = self._added(chart_at(self.baseline, key[0]), run)
                added.append(key)
            elif (row.first_sequence, row.last_sequence, row.points) != run[2:] or row.withdrawn_at is not None:
                row.first_sequence, row.last_sequence, row.points = run[2:]
                row.last_at, row.withdrawn_at = now, None
                changed.append(row)
        added.sort(key=lambda key: (found[key].last, found[key].first))  # numbers go up with the readings
        gone = self._gone(before, set(rows.values())) if self.anew and self.same_baseline else []
        for row in gone:
            row.withdrawn_at = now
        new = [rows[key] for key in added]
        self.session.add_all(new)
        self.session.flush()
        alarming = [rows[key] for key in added if self._alarms(key, found[key])]
        grown = [row for row in changed if row.alarm is not None]
        return _Kept([row.id for row in (*new, *changed, *gone)], alarming, grown)

    def _alarms(self, key: Key, run: Found) -> bool:
        """Not of readings that were there before the rule, the baseline, or the look before this one."""
        setting = self.watched.rules[key[0]][key[1]]
        return setting.do is Do.ALARM and run.last > max(self.heard, setting.since)

    def _matched(self, before: list[Signal], found: dict[Key, Found]) -> dict[Key, Signal]:
        """The signals that these runs are: those that begin there, else the first that shares readings with it."""
        runs = {
            key: (chart_at(self.baseline, key[0]).value, run.rule.value, run.side, run.first)
            for key, run in found.items()
        }
        beginning = {(row.chart, row.rule, row.side, row.first_sequence): row for row in before}
        rows = {key: beginning[known] for key, known in runs.items() if known in beginning}
        there = set(rows.values())
        left = [row for row in before if row not in there]
        for key, (chart, rule, side, first) in runs.items():
            if key not in rows:
                for row in left:
                    alike = (row.chart, row.rule, row.side) == (chart, rule, side)
                    if alike and row.first_sequence <= found[key].last and row.last_sequence >= first:
                        rows[key] = row
                        left.remove(row)
                        break
        return rows

    def _stored(self, found: dict[Key, Found]) -> list[Signal]:
        """The signals by this baseline that may be meant: all of them when it is looked at anew."""
        query = select(Signal).where(
            Signal.machine_id == self.row.machine_id,
            Signal.characteristic_id == self.row.characteristic_id,
            Signal.baseline_version == self.baseline.version,
        )
        if not self.anew:
            query = query.where(
                Signal.last_sequence >= min((run.first for run in found.values()), default=self.newest + 1)
            )
        return list(self.session.scalars(query.order_by(Signal.first_sequence)))

    def _added(self, chart: Chart, run: Found) -> Signal:
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
        """How many of the readings looked at are taken out of the statistics."""
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


def explain(session: Session, number: int, cause: Cause, comment: str, caller: Caller) -> SignalRow:
    """Say what a signal was; said again it is said otherwise, and the record keeps both. Raises `NotFound`."""
    row = signals_queries.signal(session, number)
    found = row.signal
    before = None if found.explained_at is None else {"cause": found.cause, "comment": found.comment}
    found.explained_at, found.explained_by = datetime.now(UTC), caller.name
    found.cause, found.comment = cause.value, comment
    session.flush()
    record(
        session,
        caller.name,
        "signal explained",
        f"signal/{number}",
        before,
        {"cause": cause.value, "comment": comment, "characteristic": row.characteristic.key},
        comment,
    )
    publish(
        session,
        {
            "kind": "signal",
            "machine": row.machine.key,
            "characteristic": row.characteristic.key,
            "id": number,
        },
    )
    return signals_queries.signal(session, number)
