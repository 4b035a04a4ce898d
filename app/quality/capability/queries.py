"""The capability of a characteristic over a run of readings. Never writes. Lengths in mm.

Every deviation is one from the target that was in force when the part was judged, and a part is good by the tolerance
that was in force; indices take the limits of the newest reading. A natural limit is a fact of the characteristic: readings from
before it was entered are judged by it, too. Left out are readings that a person excluded, and probe
faults, which are no measurement of a part.
"""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from app.core.decision.limits import FAULT, in_nanometres, nanometres, within
from app.core.natural_limit import NaturalLimit, tolerance_about_target
from app.core.spc import USUAL_READINGS, in_time, normality, stability, uncompensated
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
from app.core.spc.fitting import Fitted
from app.core.spc.in_time import InTime
from app.core.spc.normality import MOST_FOR_SHAPIRO, Normality
from app.core.spc.outliers import far_off
from app.core.spc.quoting import Quoting, fit_if_needed, or_refused, quoting, stable
from app.core.spc.refusal import Floats, Refused
from app.core.spc.stability import Stability
from app.core.spc.tolerance_interval import ToleranceInterval, tolerance_interval
from app.core.spc.uncompensated import Uncompensated
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import History, Window
from app.quality.baselines import queries as control
from app.quality.baselines.series_queries import read as read_series
from app.quality.capability.kinds import SigmaBy
from app.quality.capability.sigma_within import sigma_within

__all__ = [
    "CONFIDENCE",
    "COVERAGE",
    "USUAL",
    "InForce",
    "Judgement",
    "Side",
    "Study",
    "capability_of",
    "judgement_of",
    "scatter_of_parts",
]

Side = Literal["both", "upper", "lower"]
USUAL = USUAL_READINGS
CONFIDENCE = 0.95
COVERAGE = 0.9973
"""Share of the parts that a tolerance interval holds, unless another is asked for: six sigma."""


@dataclass(frozen=True, slots=True)
class InForce:
    """Parameters by which some of the readings were judged: target, and the distance from it to a limit that is judged, mm."""

    version: int
    target: float
    half: float
    readings: int
    natural_limit: NaturalLimit = NaturalLimit.NONE


@dataclass(frozen=True)
class Judgement:
    """The indices of one run of readings, and which of them may be quoted. What could not be said is the `Refused` that says why.

    values: deviations, mm, ascending in time. far: readings that lie far from all others (`far_off`), and how far the furthest
    is, mm. baseline: version of the frozen baseline that statistical control was judged by, None where the readings had to
    judge themselves. by_fit: the distribution that fits, None where the normal one does. sigma_by: whose differences sigma within
    is of.
    """

    current: CurrentCharacteristic
    window: Window
    side: Side
    confidence: float
    sequence: NDArray[np.int64]
    values: Floats
    first_at: datetime | None
    last_at: datetime | None
    far: list[int]
    furthest: float | None
    limits: Limits
    versions: list[InForce]
    compensated: bool
    indices: Capability | Refused
    by_percentile: PercentileCapability | Refused
    by_fit: Fitted | Refused | None
    stability: Stability | Refused
    baseline: int | None
    in_time: InTime | Refused
    sigma_by: SigmaBy

    @property
    def half(self) -> float:
        """Distance from the target to a limit that is judged, mm."""
        reach = self.limits.lower if self.limits.upper is None else self.limits.upper
        return abs(reach or 0.0)

    @property
    def natural_limit(self) -> NaturalLimit:
        """The side that carries no index, if any."""
        return self.current.parameters.natural_limit

    @property
    def limits_differ(self) -> bool:
        """True if parts were judged by tolerances of different widths."""
        return len({nanometres(version.half) for version in self.versions}) > 1

    @property
    def targets_differ(self) -> bool:
        """True if the target changed."""
        return len({nanometres(version.target) for version in self.versions}) > 1

    @property
    def normal(self) -> bool:
        """True if the normal distribution may be taken for all readings together."""
        if isinstance(self.indices, Refused):
            return False
        return Caution.NOT_NORMAL not in self.indices.cautions

    @property
    def stable(self) -> bool | None:
        """In control by the run rules, and constant in time by ISO 22514; None where too little is known."""
        return stable(self.stability, self.in_time)

    @property
    def in_control(self) -> bool | None:
        """In statistical control, by the run rules; None where too little is known."""
        return None if isinstance(self.stability, Refused) else self.stability.in_control

    @property
    def constant_in_time(self) -> bool | None:
        """Mean and scatter constant by the model in time (ISO 22514); None where too little is known."""
        return None if isinstance(self.in_time, Refused) else self.in_time.model.steady

    @cached_property
    def quoting(self) -> Quoting:
        """The index that may be quoted, with its interval; the one decision that pages, reports and cautions follow."""
        return quoting(self.indices, self.by_percentile, stable=self.stable, far=bool(self.far), by_fit=self.by_fit)

    @property
    def potential_allowed(self) -> bool:
        """True if Cp and Cpk may be quoted."""
        return self.quote == "cpk"

    @property
    def quote(self) -> Literal["cpk", "ppk", "fitted", "percentile", "none"]:
        """The index that may be quoted."""
        return self.quoting.quote.value

    @property
    def quoted(self) -> float | None:
        """Its value; None where none may be quoted."""
        return self.quoting.value


@dataclass(frozen=True)
class Study(Judgement):
    """Everything that is said of one run of readings.

    excluded: sequences that a person took out; faults: probe faults. fallout: parts outside the tolerance in force, per
    million; outside: how many. without: None where nothing is compensated; unknown: readings of it that do not say with which
    corrections they were cut. tolerance: the interval that holds a share of all parts.
    """

    excluded: list[int]
    faults: list[int]
    outside: int
    fallout: Fallout | None
    within: Fallout | None
    overall: Fallout | None
    anderson: Normality | Refused
    shapiro: Normality | Refused
    without: Uncompensated | Refused | None
    unknown: int
    tolerance: ToleranceInterval | Refused


def judgement_of(session: Session, current: CurrentCharacteristic, window: Window) -> Judgement:
    """Judge the readings of the window by every limit that is no natural one, for the index alone. Raises `Invalid` for more than ten million."""
    counted = _read(session, current, window).counted
    return Judgement(**_judged(session, current, window, counted, "both", CONFIDENCE))


def capability_of(
    session: Session,
    current: CurrentCharacteristic,
    window: Window,
    *,
    side: Side = "both",
    confidence: float = CONFIDENCE,
    coverage: float = COVERAGE,
    sigma_by: SigmaBy = SigmaBy.NEIGHBOURS,
) -> Study:
    """Judge the readings of the window. Raises `Invalid` for more than ten million."""
    if current.parameters.natural_limit is not NaturalLimit.NONE:
        side = "upper" if current.parameters.natural_limit is NaturalLimit.LOWER else "lower"
    history, faulty, counted = _read(session, current, window)
    judged = _judged(session, current, window, counted, side, confidence, sigma_by)
    values, limits, result = judged["values"], judged["limits"], judged["indices"]
    outside, fallout = _outside(counted, judged["versions"], side)
    known = None if isinstance(result, Refused) else result
    without, unknown = (
        _without(session, current, window, counted, limits, confidence) if judged["compensated"] else (None, 0)
    )
    return Study(
        **judged,
        excluded=history["sequence"][history.excluded].tolist(),
        faults=history["sequence"][faulty & ~history.excluded].tolist(),
        outside=outside,
        fallout=fallout,
        within=None if known is None else expected(limits, known.mean, known.within.value),
        overall=None if known is None else expected(limits, known.mean, known.overall.value),
        anderson=or_refused(lambda: normality.anderson_darling(_thinned(values))),
        shapiro=or_refused(lambda: normality.shapiro_wilk(_thinned(values))),
        without=without,
        unknown=unknown,
        tolerance=or_refused(
            lambda: tolerance_interval(
                values,
                coverage,
                confidence,
                lower=limits.lower is not None,
                upper=limits.upper is not None,
                normal=known is not None and Caution.NOT_NORMAL not in known.cautions and judged["by_fit"] is None,
            )
        ),
    )


class _Readings(NamedTuple):
    """Readings of the window, which of them are probe faults, and those that count."""

    history: History
    faulty: NDArray[np.bool_]
    counted: History


def _read(session: Session, current: CurrentCharacteristic, window: Window) -> _Readings:
    columns = ("deviation", "parameters_version", "zone", "measured_at", "compensated")
    history = statistics.history_of(session, current.characteristic, window, columns)
    faulty = history["zone"] == FAULT
    return _Readings(history, faulty, history.only(~history.excluded & ~faulty))


def _judged(
    session: Session,
    current: CurrentCharacteristic,
    window: Window,
    counted: History,
    side: Side,
    confidence: float,
    sigma_by: SigmaBy = SigmaBy.NEIGHBOURS,
) -> dict[str, Any]:
    """The fields of a `Judgement`."""
    versions = _versions(session, current, counted)
    values, half, natural = _about_target(current, counted, versions)
    judged = tolerance_about_target(half, natural)
    limits = Limits(None if side == "upper" else judged.lower, None if side == "lower" else judged.upper, 0.0)
    compensated = not current.parameters.measures_only and bool((np.nan_to_num(counted["compensated"]) != 0).any())
    cautions = (Caution.COMPENSATED,) if compensated else ()
    indices = or_refused(
        lambda: capability(
            values,
            limits,
            within=sigma_within(session, current, window, counted, values, sigma_by),
            confidence=confidence,
            cautions=cautions,
        )
    )
    control_verdict, baseline = _stability(session, current, window, counted, values)
    at, far = counted["measured_at"], far_off(values)
    return {
        "current": current,
        "window": window,
        "side": side,
        "confidence": confidence,
        "sequence": counted["sequence"],
        "values": values,
        "first_at": moment(at.min()) if len(at) else None,
        "last_at": moment(at.max()) if len(at) else None,
        "far": counted["sequence"][far].tolist(),
        "furthest": max(values[far].tolist(), key=abs, default=None),
        "limits": limits,
        "versions": versions,
        "compensated": compensated,
        "indices": indices,
        "by_percentile": or_refused(lambda: percentile(values, limits, confidence=confidence, minimum=ENOUGH_READINGS)),
        "by_fit": fit_if_needed(values, limits, indices, side=natural.side, confidence=confidence),
        "stability": control_verdict,
        "baseline": baseline,
        "in_time": or_refused(lambda: in_time.in_time(values)),
        "sigma_by": sigma_by,
    }


def _about_target(
    current: CurrentCharacteristic, counted: History, versions: list[InForce]
) -> tuple[Floats, float, NaturalLimit]:
    """The deviations, half the tolerance, and the natural limit that they are judged by, mm.

    Readings from before the natural limit was entered, or after it was taken away, are brought to the target of now.
    """
    p, values = current.parameters, counted["deviation"]
    others = [version for version in versions if version.natural_limit != p.natural_limit]
    if not others:
        return values, versions[-1].half if versions else p.half, p.natural_limit
    shift = np.zeros(max(version.version for version in versions) + 1)
    for version in others:
        shift[version.version] = version.target - p.target
    same = [version.half for version in versions if version not in others]
    return np.round(values + shift[counted["parameters_version"]], 9), (same or [p.half])[-1], p.natural_limit


def moment(at: np.datetime64) -> datetime:
    """A moment of a column, in UTC."""
    moment: datetime = at.astype("datetime64[us]").item()
    return moment.replace(tzinfo=UTC)


def _thinned(values: Floats) -> Floats:
    """At most 5000 readings, taken evenly: of more, the tests of normality would see that readings are rounded."""
    if len(values) <= MOST_FOR_SHAPIRO:
        return values
    at = np.linspace(0, len(values) - 1, MOST_FOR_SHAPIRO).round().astype(np.int64)
    return np.asarray(values[at])


def _versions(session: Session, current: CurrentCharacteristic, counted: History) -> list[InForce]:
    """By which versions the readings were judged, in the order in which these came last."""
    numbers, counts = np.unique(counted["parameters_version"], return_counts=True)
    versions = []
    for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
        p = characteristics.parameters_of(session, current.machine.id, current.characteristic.id, number)
        versions.append(InForce(number, p.target, p.half, count, p.natural_limit))
    if versions:  # the newest reading's last
        newest = int(counted["parameters_version"][-1])
        versions.sort(key=lambda each: (each.version == newest, each.version))
    return versions


def _outside(counted: History, versions: list[InForce], side: Side) -> tuple[int, Fallout | None]:
    """Parts beyond the limits in force, in whole nanometres; a part on the limit is good."""
    if not len(counted):
        return 0, None
    halves = np.zeros(max(version.version for version in versions) + 1, np.int64)
    for version in versions:
        halves[version.version] = nanometres(version.half)
    deviation = in_nanometres(counted["deviation"])
    outside = ~within(deviation, halves[counted["parameters_version"]])
    below = 0 if side == "upper" else int((outside & (deviation < 0)).sum())
    above = 0 if side == "lower" else int((outside & (deviation > 0)).sum())
    return below + above, Fallout(below / len(counted) * 1e6, above / len(counted) * 1e6)


def _stability(
    session: Session, current: CurrentCharacteristic, window: Window, counted: History, values: Floats
) -> tuple[Stability | Refused, int | None]:
    """By the baseline in force, if it is one of deviations and tells of these readings; else by the readings themselves."""
    baseline = control.baseline_in_force(session, current.characteristic)
    if baseline is not None and baseline.quantity == "deviation" and window.count:
        charted = control.charted(session, current, baseline, window)
        if charted.chart is not None:
            z = charted.chart.z[np.isin(charted.last, counted["sequence"])]
            if len(z):
                return stability.stability(z, control.rules_of(baseline), frozen=True), baseline.version
    return or_refused(lambda: stability.of_readings(values)), None


@dataclass(slots=True)
class Singles:
    """Plan of a series of single readings: none left out but those that are left out everywhere."""

    factor: float
    quantity: str
    grouping: str | None = None
    group_size: int | None = None
    group_pause: float | None = None
    shifts: str | None = None
    first_sequence: int = 0
    last_sequence: int = 0
    excluded: list[Any] = field(default_factory=list)


def _without(
    session: Session,
    current: CurrentCharacteristic,
    window: Window,
    counted: History,
    limits: Limits,
    confidence: float,
) -> tuple[Uncompensated | Refused, int]:
    """The same readings with what was corrected taken out again, tool life by tool life."""
    rebuilt = read_series(session, current, Singles(current.parameters.factor, "without_corrections"), window)
    series = rebuilt.series.only(np.isin(rebuilt.series.sequence, counted["sequence"]))
    controlled = counted["deviation"][np.isin(counted["sequence"], series.sequence)]
    result = or_refused(
        lambda: uncompensated.uncompensated(series.values, series.begins, controlled, limits, confidence=confidence)
    )
    return result, len(counted) - len(series)


def scatter_of_parts(session: Session, current: CurrentCharacteristic, last: int) -> tuple[float | None, int]:
    """Sigma from part to part of the last readings, wear and corrections taken out, mm, and of how many; None of too few."""
    window = statistics.window_of(session, current.characteristic, last=last)
    if not window.count:
        return None, 0
    series = read_series(session, current, Singles(current.parameters.factor, "without_corrections"), window).series
    if len(series) < FEWEST_READINGS:
        return None, len(series)
    sigma = or_refused(lambda: uncompensated.scatter(series.values, series.begins))
    return (None if isinstance(sigma, Refused) else sigma.value), len(series)
