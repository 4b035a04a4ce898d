"""Rules that watch a characteristic, and the signals that a rule would have given before it is switched on. Never writes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import pdtrc
from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.spc.false_alarms import FalseAlarms, by_chance
from app.core.spc.points import Piece
from app.core.spc.rules import RuleName
from app.core.spc.watch import SignalSpan, Watch
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.tables.characteristics import Characteristic
from app.quality.baselines.queries import baseline_in_force, charted, restarts
from app.quality.baselines.tables import Baseline
from app.quality.chart_rules.places import (
    DEFAULT,
    Place,
    Rules,
    Watched,
    piece_at,
    read_rules,
    rules_at,
    settings_at,
    size_of,
)
from app.quality.chart_rules.tables import RuleSet

MOST_PREVIEWED = 1_000_000  # readings
SELDOM = 0.01  # so rarely chance alone brings as many signals


def rules_in_force(session: Session, characteristic: Characteristic) -> Watched:
    """The newest version of the rules; the default where none is set."""
    newest = session.scalars(
        select(RuleSet)
        .where(RuleSet.machine_id == characteristic.machine_id, RuleSet.characteristic_id == characteristic.id)
        .order_by(RuleSet.version.desc())
        .limit(1)
    ).one_or_none()
    if newest is None:
        return Watched(DEFAULT)
    return _watched(newest)


def rules_history(session: Session, characteristic: Characteristic, limit: int = 20) -> list[Watched]:
    """The versions of the rules, newest first."""
    query = (
        select(RuleSet)
        .where(RuleSet.machine_id == characteristic.machine_id, RuleSet.characteristic_id == characteristic.id)
        .order_by(RuleSet.version.desc())
        .limit(limit)
    )
    return [_watched(row) for row in session.scalars(query)]


def _watched(row: RuleSet) -> Watched:
    return Watched(read_rules(row.rules), row.version, row.at, row.actor, row.reason)


@dataclass(frozen=True)
class RuleTrial:
    """One rule on some readings: the signals it would have given, and how often chance alone gives one."""

    signals: int
    points: int  # that were looked at
    inside: int  # points that lie in a signal
    chance: FalseAlarms

    @property
    def expected(self) -> float:
        """Signals that chance alone would have given."""
        return self.chance.expected(self.points)

    @cached_property
    def more_than_chance(self) -> bool:
        """True if there are more than chance explains: it would give that many or more less than once in a hundred times."""
        return self.signals > 0 and float(pdtrc(self.signals - 1, self.expected)) < SELDOM


@dataclass(frozen=True)
class Preview:
    """Signals that every rule would have given on some readings by the baseline in force.

    tried: by chart and rule, all that have a sense. together: of the rules that are switched on, by chart, and all at once.
    """

    baseline: Baseline
    window: Window
    tried: dict[tuple[Place, RuleName], RuleTrial]
    together: dict[Place, RuleTrial]
    everything: RuleTrial


def preview(session: Session, current: CurrentCharacteristic, rules: Rules, last: int | None = None) -> Preview | None:
    """Signals of these rules, and of every other one, on the last N readings; None without a baseline.

    Of more than a million readings the last million is looked at.
    """
    baseline = baseline_in_force(session, current.characteristic)
    if baseline is None:
        return None
    window = statistics.window_of(session, current.characteristic, last=min(last or MOST_PREVIEWED, MOST_PREVIEWED))
    points = charted(session, current, baseline, window)
    tried: dict[tuple[Place, RuleName], RuleTrial] = {}
    together: dict[Place, RuleTrial] = {}
    for place in Place:
        names = rules_at(baseline, place)
        piece = piece_at(points, place, window.first - 1)
        spans = _found(baseline, place, names, piece)
        on = [name for name in rules.get(place, {}) if name in names]
        tried |= {(place, name): _tried(baseline, place, [name], spans, piece) for name in names}
        if on:
            together[place] = _tried(baseline, place, on, spans, piece)
    return Preview(baseline, window, tried, together, _sum(list(together.values()), len(points)))


def _found(baseline: Baseline, place: Place, names: tuple[RuleName, ...], piece: Piece | None) -> list[SignalSpan]:
    """By the points of the baseline's period, and again by those after it and before it, as the chart and the job do."""
    if piece is None or not names:
        return []
    at = np.searchsorted(restarts(baseline, piece.first), np.arange(len(piece.first)), side="right")
    pieces = (piece.only(at == part) for part in np.unique(at))
    return [span for each in pieces for span in Watch(settings_at(baseline, place), dict.fromkeys(names, 0)).feed(each)]


def _tried(
    baseline: Baseline, place: Place, names: list[RuleName], spans: list[SignalSpan], piece: Piece | None
) -> RuleTrial:
    mine = [span for span in spans if span.rule in names]
    return RuleTrial(
        len(mine),
        0 if piece is None else len(piece.last),
        sum(span.points for span in mine),
        by_chance(settings_at(baseline, place), names, size_of(baseline)),
    )


def _sum(tried: list[RuleTrial], points: int) -> RuleTrial:
    """All charts together: rates add up, as long as they are small."""
    rate = sum(1 / trial.chance.every for trial in tried)
    chance = FalseAlarms(1 / rate if rate else float("inf"), exact=len(tried) == 1 and tried[0].chance.exact)
    return RuleTrial(sum(trial.signals for trial in tried), points, sum(trial.inside for trial in tried), chance)
