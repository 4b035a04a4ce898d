"""The capability of a characteristic over a run of readings. Never writes. Lengths in mm.

Every deviation is one from the target that was in force when the part was judged, and a part is good by the tolerance
that was in force; indices take the limits of the newest reading. Left out are readings that somebody excluded, and probe
faults, which are no measurement of a part.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from app.capability.ranking import LOOKED_BACK, Ranked, capability_by_characteristic
from app.characteristics import queries as characteristics
from app.characteristics.queries import Standing
from app.control import queries as control
from app.control.series_queries import read as read_series
from app.core.spc import in_time, normality, stability, uncompensated
from app.core.spc.capability import (
    ENOUGH_READINGS,
    FEWEST_READINGS,
    Capability,
    Caution,
    Fallout,
    Limits,
    PercentileCapability,
    capability,
    expected,
    percentile,
)
from app.core.spc.in_time import InTime
from app.core.spc.normality import MOST_FOR_SHAPIRO, Normality
from app.core.spc.refusal import Floats, Refused
from app.core.spc.spread import far_off
from app.core.spc.stability import Stability
from app.core.spc.uncompensated import Uncompensated
from app.core.zones import Zone
from app.statistics import queries as statistics
from app.statistics.queries import History, Window

__all__ = [
    "CONFIDENCE",
    "LOOKED_BACK",
    "USUAL",
    "InForce",
    "Ranked",
    "Side",
    "Study",
    "capability_by_characteristic",
    "capability_of",
    "scatter_of_parts",
]

Side = Literal["both", "upper", "lower"]
USUAL = 1000
"""Readings that are looked at if nothing else is asked for."""
CONFIDENCE = 0.95
FAULT = list(Zone).index(Zone.PROBE_FAULT)
Found = TypeVar("Found")


@dataclass(frozen=True, slots=True)
class InForce:
    """Parameters by which some of the readings were judged: target and half the tolerance, mm."""

    version: int
    target: float
    half: float
    readings: int


@dataclass(frozen=True)
class Study:
    """Everything that is said of one run of readings. What could not be said is the `Refused` that says why.

    values: deviations, mm, ascending in time. excluded: sequences that somebody took out; faults: probe faults.
    far: readings that lie far from all others (`far_off`), and how far the furthest is, mm.
    fallout: parts outside the tolerance in force, per million; outside: how many. baseline: version of the frozen baseline
    that stability was judged by, None where the readings had to judge themselves. without: None where nothing is
    compensated; unknown: readings of it that do not say with which corrections they were cut.
    """

    standing: Standing
    window: Window
    side: Side
    confidence: float
    sequence: NDArray[np.int64]
    values: Floats
    first_at: datetime | None
    last_at: datetime | None
    excluded: list[int]
    faults: list[int]
    far: list[int]
    furthest: float | None
    limits: Limits
    versions: list[InForce]
    outside: int
    fallout: Fallout | None
    found: Capability | Refused
    within: Fallout | None
    overall: Fallout | None
    by_percentile: PercentileCapability | Refused
    anderson: Normality | Refused
    shapiro: Normality | Refused
    stability: Stability | Refused
    baseline: int | None
    in_time: InTime | Refused
    compensated: bool
    without: Uncompensated | Refused | None
    unknown: int

    @property
    def limits_differ(self) -> bool:
        """Whether parts were judged by tolerances of different widths."""
        return len({round(each.half * 1e6) for each in self.versions}) > 1

    @property
    def targets_differ(self) -> bool:
        """Whether the target changed."""
        return len({round(each.target * 1e6) for each in self.versions}) > 1

    @property
    def normal(self) -> bool:
        """Whether the normal distribution may be taken for all readings together."""
        if isinstance(self.found, Refused):
            return False
        return Caution.NOT_NORMAL not in self.found.cautions

    @property
    def stable(self) -> bool | None:
        """Whether the process is stable; None where too little is known."""
        if isinstance(self.stability, Refused):
            return None
        steady = isinstance(self.in_time, Refused) or self.in_time.model.steady
        return self.stability.stable and steady

    @property
    def potential_allowed(self) -> bool:
        """Whether Cp and Cpk may be quoted: only of a process that is stable."""
        return self.stable is True

    @property
    def quote(self) -> Literal["cpk", "ppk", "percentile", "none"]:
        """Which number may be quoted: Cpk of a stable, normal process only, Ppk of any, by percentiles if it is not normal."""
        if isinstance(self.found, Refused):
            return "none"
        if not self.normal:
            return "ppk" if isinstance(self.by_percentile, Refused) else "percentile"
        return "cpk" if self.potential_allowed else "ppk"

    @property
    def ppk(self) -> float | None:
        """The number to quote: Ppk by the normal distribution, or by percentiles where that does not hold."""
        if isinstance(self.found, Refused):
            return None
        if self.normal or isinstance(self.by_percentile, Refused):
            return self.found.ppk.value
        return self.by_percentile.ppk


def capability_of(
    session: Session,
    standing: Standing,
    window: Window,
    *,
    side: Side = "both",
    confidence: float = CONFIDENCE,
) -> Study:
    """Judge the readings of the window. Raises `Invalid` for more than ten million."""
    columns = ("deviation", "parameters_version", "zone", "measured_at", "compensated")
    history = statistics.history_of(session, standing.characteristic, window, columns)
    faulty = history["zone"] == FAULT
    kept = history.only(~history.excluded & ~faulty)
    values: Floats = kept["deviation"]
    versions = _versions(session, standing, kept)
    half = versions[-1].half if versions else standing.parameters.tolerance_width / 2
    limits = Limits(None if side == "upper" else -half, None if side == "lower" else half, 0.0)
    outside, fallout = _outside(kept, versions, side)
    compensated = not standing.parameters.measures_only and bool((np.nan_to_num(kept["compensated"]) != 0).any())
    cautions = (Caution.COMPENSATED,) if compensated else ()
    found = _or_refused(lambda: capability(values, limits, confidence=confidence, cautions=cautions))
    known = None if isinstance(found, Refused) else found
    judged, baseline = _stability(session, standing, window, kept)
    without, unknown = _without(session, standing, window, kept, limits, confidence) if compensated else (None, 0)
    at, far = kept["measured_at"], far_off(values)
    return Study(
        standing=standing,
        window=window,
        side=side,
        confidence=confidence,
        sequence=kept["sequence"],
        values=values,
        first_at=_moment(at.min()) if len(at) else None,
        last_at=_moment(at.max()) if len(at) else None,
        excluded=history["sequence"][history.excluded].tolist(),
        faults=history["sequence"][faulty & ~history.excluded].tolist(),
        far=kept["sequence"][far].tolist(),
        furthest=max(values[far].tolist(), key=abs, default=None),
        limits=limits,
        versions=versions,
        outside=outside,
        fallout=fallout,
        found=found,
        within=None if known is None else expected(limits, known.mean, known.within.value),
        overall=None if known is None else expected(limits, known.mean, known.overall.value),
        by_percentile=_or_refused(lambda: percentile(values, limits, minimum=ENOUGH_READINGS)),
        anderson=_or_refused(lambda: normality.anderson_darling(_thinned(values))),
        shapiro=_or_refused(lambda: normality.shapiro_wilk(_thinned(values))),
        stability=judged,
        baseline=baseline,
        in_time=_or_refused(lambda: in_time.in_time(values)),
        compensated=compensated,
        without=without,
        unknown=unknown,
    )


def _or_refused(compute: Callable[[], Found]) -> Found | Refused:
    try:
        return compute()
    except Refused as refused:
        return refused


def _moment(at: np.datetime64) -> datetime:
    moment: datetime = at.astype("datetime64[us]").item()
    return moment.replace(tzinfo=UTC)


def _thinned(values: Floats) -> Floats:
    """At most 5000 readings, taken evenly: of more, the tests of normality would see that readings are rounded."""
    if len(values) <= MOST_FOR_SHAPIRO:
        return values
    at = np.linspace(0, len(values) - 1, MOST_FOR_SHAPIRO).round().astype(np.int64)
    return np.asarray(values[at])


def _versions(session: Session, standing: Standing, kept: History) -> list[InForce]:
    """By which versions the readings were judged, in the order in which these came last."""
    numbers, counts = np.unique(kept["parameters_version"], return_counts=True)
    made = []
    for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
        p = characteristics.parameters_of(session, standing.machine.id, standing.characteristic.id, number)
        made.append(InForce(number, p.target, p.tolerance_width / 2, count))
    if made:  # the newest reading's last
        newest = int(kept["parameters_version"][-1])
        made.sort(key=lambda each: (each.version == newest, each.version))
    return made


def _outside(kept: History, versions: list[InForce], side: Side) -> tuple[int, Fallout | None]:
    """Parts beyond the limits in force, in whole nanometres; a part on the limit is good."""
    if not len(kept):
        return 0, None
    halves = np.zeros(max(each.version for each in versions) + 1)
    for each in versions:
        halves[each.version] = round(each.half * 1e6)
    deviation, half = np.round(kept["deviation"] * 1e6), halves[kept["parameters_version"]]
    below = 0 if side == "upper" else int((deviation < -half).sum())
    above = 0 if side == "lower" else int((deviation > half).sum())
    return below + above, Fallout(below / len(kept) * 1e6, above / len(kept) * 1e6)


def _stability(
    session: Session, standing: Standing, window: Window, kept: History
) -> tuple[Stability | Refused, int | None]:
    """By the baseline in force, if it is one of deviations and tells of these readings; else by the readings themselves."""
    baseline = control.baseline_in_force(session, standing.characteristic)
    if baseline is not None and baseline.quantity == "deviation" and window.count:
        charted = control.charted(session, standing, baseline, window)
        if charted.chart is not None:
            inside = np.isin(charted.last, kept["sequence"])
            z, rules = charted.chart.z[inside], control.rules_of(baseline)
            return stability.stability(z, rules, frozen=True), baseline.version
    return _or_refused(lambda: stability.of_readings(kept["deviation"])), None


@dataclass(slots=True)
class _Rebuilt:
    """How the wear curve is read: single readings, nothing left out but what is left out everywhere."""

    factor: float
    quantity: str = "without_corrections"
    grouping: str | None = None
    group_size: int | None = None
    group_pause: float | None = None
    first_sequence: int = 0
    last_sequence: int = 0
    excluded: list[Any] = field(default_factory=list)


def _without(
    session: Session, standing: Standing, window: Window, kept: History, limits: Limits, confidence: float
) -> tuple[Uncompensated | Refused, int]:
    """The same readings with what was corrected taken out again, tool life by tool life."""
    made = read_series(session, standing, _Rebuilt(standing.parameters.factor), window)
    series = made.series.only(np.isin(made.series.sequence, kept["sequence"]))
    controlled = kept["deviation"][np.isin(kept["sequence"], series.sequence)]
    found = _or_refused(
        lambda: uncompensated.uncompensated(series.values, series.begins, controlled, limits, confidence=confidence)
    )
    return found, len(kept) - len(series)


def scatter_of_parts(session: Session, standing: Standing, last: int) -> tuple[float | None, int]:
    """Sigma from part to part of the last readings, wear and corrections taken out, mm, and of how many; None of too few."""
    window = statistics.window_of(session, standing.characteristic, last=last)
    if not window.count:
        return None, 0
    series = read_series(session, standing, _Rebuilt(standing.parameters.factor), window).series
    if len(series) < FEWEST_READINGS:
        return None, len(series)
    found = _or_refused(lambda: uncompensated.scatter(series.values, series.begins))
    return (None if isinstance(found, Refused) else found.value), len(series)
