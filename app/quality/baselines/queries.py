"""Baselines, and the readings as points of the chart that they judge. Never writes. Lengths in mm."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

from app.core.spc import quantity, shewhart
from app.core.spc.quantity import SETTLE, Quantity, Series
from app.core.spc.refusal import Floats
from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart, ControlChart
from app.core.spc.spread import Estimator, Sigma, Subgroups, subgroups
from app.errors import NotFound
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries.queries import Window
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Exclusion
from app.quality.baselines.series_queries import Moments, Plan, ReadingSeries, Whole, groups_of, read
from app.quality.baselines.tables import Baseline

__all__ = [
    "LOOK_AHEAD",
    "LOOK_BACK",
    "Baseline",
    "Charted",
    "baseline_in_force",
    "baseline_of",
    "baselines",
    "charted",
    "excluded_since",
    "judged_by",
    "main_chart",
    "newest_version",
    "points_of",
    "read_back",
    "restarts",
    "rules_of",
    "series_of",
]
LOOK_BACK = 100_000
"""Readings before the window that are looked through for what its first points need: the beginning of the edge, of the subgroup."""
LOOK_AHEAD = 1_000
"""Readings after the window that tell whether its last subgroup, by pause, part, shift or nest, ends in it; by size, that many."""


def baseline_in_force(session: Session, characteristic: Characteristic) -> Baseline | None:
    """Baseline that judges readings now: the newest version, or None if there is none or it is retired."""
    newest = session.scalars(_of(characteristic).order_by(Baseline.version.desc()).limit(1)).one_or_none()
    return None if newest is None or newest.retired_at is not None else newest


def newest_version(session: Session, characteristic: Characteristic) -> int:
    """The newest baseline, in force or not; 0 if there was none."""
    newest = session.scalars(_of(characteristic).order_by(Baseline.version.desc()).limit(1)).one_or_none()
    return 0 if newest is None else newest.version


def baselines(
    session: Session, characteristic: Characteristic, *, before: int | None = None, limit: int = 1000
) -> Sequence[Baseline]:
    """All versions, newest first; those before version `before` where it is given."""
    query = _of(characteristic).order_by(Baseline.version.desc()).limit(limit)
    return session.scalars(query if before is None else query.where(Baseline.version < before)).all()


def baseline_of(session: Session, characteristic: Characteristic, version: int) -> Baseline:
    """One version. Raises `NotFound`."""
    baseline = session.scalars(_of(characteristic).where(Baseline.version == version)).one_or_none()
    if baseline is None:
        raise NotFound(
            _("{key} has no baseline {version}.").format(key=characteristic.key, version=version),
            _("GET /api/v1/characteristics/{key}/baselines lists them.").format(key=characteristic.key),
        )
    return baseline


def _of(characteristic: Characteristic) -> Select[Baseline]:
    return select(Baseline).where(
        Baseline.machine_id == characteristic.machine_id, Baseline.characteristic_id == characteristic.id
    )


def excluded_since(session: Session, baseline: Baseline) -> int:
    """Number of readings of its period that were excluded from the statistics after it was frozen; its numbers hold them still."""
    query = select(func.count()).where(
        Exclusion.machine_id == baseline.machine_id,
        Exclusion.characteristic_id == baseline.characteristic_id,
        Exclusion.sequence.between(baseline.first_sequence, baseline.last_sequence),
        Exclusion.at > baseline.at,
    )
    return session.scalar(query) or 0


def main_chart(baseline: Baseline) -> Chart:
    """The chart that `charted` answers: individuals or X-bar."""
    return Chart.INDIVIDUALS if baseline.chart == "individuals" else Chart.XBAR


def rules_of(baseline: Baseline) -> tuple[RuleName, ...]:
    """Rules that make sense on the individuals or X-bar chart of this baseline; `nelson_1` alone on differences."""
    return quantity.fitting(Quantity(baseline.quantity), main_chart(baseline))


def judged_by(baseline: Baseline, width: float = 3.0) -> shewhart.Baseline:
    """The baseline as the core knows it: centre and sigma of a single value."""
    sigma = Sigma(baseline.sigma, Estimator(baseline.estimator), baseline.readings, baseline.groups, baseline.freedom)
    return shewhart.Baseline(baseline.centre, sigma, width, provisional=baseline.provisional)


@dataclass(frozen=True, slots=True)
class Charted:
    """Points of the individuals or X-bar chart, ascending, judged by a frozen baseline.

    chart: the points, their centre and limits, and z, which rules look at (`app.core.spc.rules.Scan(rules).feed(chart.z)`);
    None where there is no point. first, last: the sequences of the readings that each point is made of (of individuals
    both the same). measured_at: of the last of them, UTC. sizes: how many they are. begins: the point comes first of a tool,
    or after a step of the reference. read: the readings themselves. series: the values that are grouped or charted singly.
    waiting: readings of the last subgroup, which is not complete and no point yet. settling: readings that set the level
    of an edge and are judged by nothing.
    """

    baseline: Baseline
    chart: ControlChart | None
    groups: Subgroups | None
    first: Whole
    last: Whole
    measured_at: Moments
    sizes: Whole
    begins: NDArray[np.bool_]
    series: Series
    series_at: Moments
    read: ReadingSeries
    waiting: int
    settling: int

    def __len__(self) -> int:
        """Number of points."""
        return len(self.last)


def restarts(baseline: Baseline, first: Whole) -> list[int]:
    """The points at which the rules begin again: the first of the baseline's period, and the first that is monitored.

    What lies before the period was another process. The stored signals begin with the first reading after it.
    first: the first reading of each point, rising.
    """
    return [int(at) for at in np.searchsorted(first, [baseline.first_sequence, baseline.last_sequence + 1])]


def charted(session: Session, current: CurrentCharacteristic, baseline: Baseline, window: Window) -> Charted:
    """The points whose last reading lies in the window: what a point is does not depend on where the window begins.

    Streaming: ask for Window(last judged sequence + 1, newest, newest) and feed z to a `Scan` that has seen the points
    before. Only complete subgroups are points. Readings of the baseline's own period are judged too; monitoring begins at
    ``baseline.last_sequence + 1``. Raises `Invalid` for more than ten million readings.
    """
    return points_of(baseline, read_back(session, current, baseline, window), window)


def read_back(session: Session, current: CurrentCharacteristic, baseline: Baseline, window: Window) -> ReadingSeries:
    """The readings of the window, and those before it without which its first point would be another one."""
    return read(session, current, baseline, _to_read(baseline, window))


def _to_read(plan: Plan, window: Window) -> Window:
    ahead = 0 if plan.grouping is None else plan.group_size or LOOK_AHEAD
    return Window(_earliest(plan, window), min(window.newest, window.last + ahead), window.newest)


def _earliest(plan: Plan, window: Window) -> int:
    """From where readings have to be read for the first point of the window to be what it always is."""
    if plan.quantity == Quantity.WEAR_RESIDUALS or plan.grouping not in (None, "consecutive"):
        return max(1, window.first - LOOK_BACK)
    back = 1 if plan.grouping is None else plan.group_size or 1
    if plan.quantity == Quantity.DIFFERENCES:
        back += 100  # the one before may be excluded, and those before it
    return max(1, window.first - back)


def series_of(baseline: Baseline, series: ReadingSeries) -> Series:
    """The quantity itself, of what was read."""
    match Quantity(baseline.quantity):
        case Quantity.DIFFERENCES:
            return quantity.differences(series.series)
        case Quantity.WEAR_RESIDUALS:
            return quantity.residuals(series.series, baseline.slope or 0.0, baseline.settle or SETTLE)
        case _:
            return series.series


def points_of(baseline: Baseline, made: ReadingSeries, window: Window) -> Charted:
    """Readings as points; those whose last reading lies in the window. made: what `read_back` gives for it."""
    series = series_of(baseline, made)
    charted = np.isin(made.series.sequence, series.sequence, assume_unique=True)
    inside = (made.series.sequence >= window.first) & (made.series.sequence <= window.last)
    settling = int((inside & ~charted).sum()) if baseline.quantity == Quantity.WEAR_RESIDUALS else 0
    points_read = ReadingSeries(series, made.measured_at[charted], made.labels[charted], made.left_out)
    if baseline.grouping is None:
        return _singly(baseline, made, points_read, window, settling)
    number, waiting = groups_of(baseline, points_read, _to_read(baseline, window))
    complete = number >= 0
    starts = np.flatnonzero(np.diff(number[complete], prepend=-1))
    lasts = np.append(starts[1:], complete.sum())[: len(starts)] - 1
    sequence, at = series.sequence[complete], points_read.measured_at[complete]
    # A subgroup that began before what was read is not whole, unless it begins exactly there.
    points = (sequence[lasts] >= window.first) & (sequence[lasts] <= window.last)
    groups = None
    if len(starts):
        whole = subgroups(series.values[complete], lasts - starts + 1)
        groups = Subgroups(whole.sizes[points], whole.means[points], whole.ranges[points], whole.deviations[points])
    starts, lasts = starts[points], lasts[points]
    begins = np.add.reduceat(series.begins[complete].astype(np.int64), starts) > 0 if len(starts) else points
    chart = shewhart.means(judged_by(baseline), groups) if groups is not None and len(starts) else None
    until_end = series.sequence <= window.last
    return Charted(
        baseline=baseline,
        chart=chart,
        groups=groups if len(starts) else None,
        first=sequence[starts],
        last=sequence[lasts],
        measured_at=at[lasts],
        sizes=lasts - starts + 1,
        begins=begins,
        series=series.only(until_end),
        series_at=points_read.measured_at[until_end],
        read=_through(made, window.last),
        waiting=waiting,
        settling=settling,
    )


def _through(series: ReadingSeries, last: int) -> ReadingSeries:
    """Without what was read of the time after the window."""
    until_end = series.series.sequence <= last
    left_out = series.left_out.within(1, last)
    return ReadingSeries(
        series.series.only(until_end), series.measured_at[until_end], series.labels[until_end], left_out
    )


def _singly(baseline: Baseline, series: ReadingSeries, shown: ReadingSeries, window: Window, settling: int) -> Charted:
    inside = shown.series.sequence >= window.first
    sequence, at = shown.series.sequence[inside], shown.measured_at[inside]
    values: Floats = shown.series.values[inside]
    chart = shewhart.individuals(judged_by(baseline), values) if len(values) else None
    return Charted(
        baseline=baseline,
        chart=chart,
        groups=None,
        first=sequence,
        last=sequence,
        measured_at=at,
        sizes=np.ones(len(values), np.int64),
        begins=shown.series.begins[inside],
        series=shown.series,
        series_at=shown.measured_at,
        read=series,
        waiting=0,
        settling=settling,
    )
