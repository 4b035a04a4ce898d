"""Drafts of baselines: their numbers for a period, and the cautions before it is frozen. Never writes."""

from dataclasses import dataclass

import numpy as np
from sqlalchemy.orm import Session

from app.core.spc import quantity, shewhart
from app.core.spc.normality import anderson_darling
from app.core.spc.quantity import Quantity, Series, WearLine
from app.core.spc.refusal import Floats, Reason, Refused
from app.core.spc.spread import Estimator, Subgroups, summary
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.language.times import shifts_now
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.loop.summaries.wording import refusal
from app.quality.baselines import queries, wording
from app.quality.baselines.given_limits import against, limits_of, refused
from app.quality.baselines.schemas import PeriodIn
from app.quality.baselines.series_queries import LeftOut, ReadingSeries, read
from app.quality.baselines.tables import Baseline
from app.quality.baselines.wording import Caution

MOST_READINGS = 1_000_000  # in a period
LOOKED_AT = 2_000  # readings that say whether a tool wears
WEARS = 4.0  # standard errors from which on a slope is taken for wear
CORRELATED = 0.3  # lag 1
NOT_NORMAL = 0.005
ESTIMATORS = {"xbar_r": Estimator.RANGES, "xbar_s": Estimator.STANDARD_DEVIATIONS}


@dataclass(frozen=True, slots=True)
class Draft:
    """A baseline that is not stored. left_out: readings of its period that count for nothing."""

    baseline: Baseline
    left_out: LeftOut
    cautions: list[tuple[Caution, int]]

    @property
    def texts(self) -> list[tuple[str, str]]:
        """The cautions as code and words."""
        return [(which.value, wording.caution(which, count)) for which, count in self.cautions]


def suited(session: Session, current: CurrentCharacteristic) -> Quantity:
    """Quantity that suits this characteristic best: its newest readings, over all their edges, show if its tool wears."""
    if current.parameters.measures_only:
        return wording.suits(corrects=False, wears=False)
    newest = statistics.window_of(session, current.characteristic).newest
    plan = Baseline(
        quantity=Quantity.WITHOUT_CORRECTIONS.value,
        excluded=[],
        first_sequence=1,
        last_sequence=0,
        factor=current.parameters.factor,
    )
    readings = read(session, current, plan, Window(max(1, newest - LOOKED_AT + 1), newest, newest))
    try:
        line = _line(readings.series)
    except Refused:  # it is not known yet
        return wording.suits(corrects=True, wears=True)
    return wording.suits(corrects=True, wears=abs(line.slope) > WEARS * line.error)


def draft_of(session: Session, current: CurrentCharacteristic, given: PeriodIn) -> Draft:
    """Centre and sigma of the period. Raises `Invalid`: no such readings, too few of them, all equal, or settings that clash."""
    newest = statistics.window_of(session, current.characteristic).newest
    _check(given, newest)
    baseline = _plan(current, given)
    limits = limits_of(given)
    window = Window(given.first_sequence, given.last_sequence, newest)
    readings = read(session, current, baseline, window)
    try:
        rests = limits is None or given.quantity is Quantity.WEAR_RESIDUALS  # on the readings of the period
        line = _line(readings.series) if rests or len(readings.series) >= shewhart.FEWEST_READINGS else None
        if line is not None and baseline.quantity == Quantity.WEAR_RESIDUALS:
            baseline.slope, baseline.slope_error = line.slope, line.error
            baseline.settle = given.settle or _run_in(session, current, baseline, readings, window)
        _take(baseline, limits or _estimated(session, current, baseline, readings, window))
    except Refused as refused:
        wrong = refusal(refused)
        raise Invalid(
            _("There are no limits for readings {first} to {last}. {why}").format(
                first=given.first_sequence, last=given.last_sequence, why=wrong
            ),
            _("Choose a longer period, or leave out less of it."),
            errors=[FieldError("last_sequence", wrong)],
        ) from None
    return Draft(baseline, readings.left_out, _cautions(session, current, baseline, readings, line, window))


def _check(given: PeriodIn, newest: int) -> None:
    errors = []
    if given.first_sequence > given.last_sequence:
        errors.append(FieldError("first_sequence", _("is beyond the end of the period; exchange the two")))
    if given.last_sequence > newest:
        errors.append(FieldError("last_sequence", _("there are {n} readings so far").format(n=newest)))
    if given.last_sequence - given.first_sequence >= MOST_READINGS:
        errors.append(FieldError("first_sequence", _("a period holds at most {n} readings").format(n=MOST_READINGS)))
    if given.chart == "individuals":
        wrong = [
            name for name, is_said in (("grouping", given.grouping is not None), ("pooled", given.pooled)) if is_said
        ]
        errors += [FieldError(name, _("is for charts of subgroups; leave it out for individuals")) for name in wrong]
    elif given.quantity is Quantity.DIFFERENCES:
        errors.append(FieldError("chart", _("differences are charted one by one: choose individuals")))
    elif given.grouping is None:
        errors.append(
            FieldError(
                "grouping", _("is missing; choose how readings form subgroups: consecutive, pause, part, shift or nest")
            )
        )
    elif given.grouping == "consecutive" and given.group_size is None:
        errors.append(FieldError("group_size", _("how many readings make a subgroup?")))
    elif given.grouping == "pause" and given.group_pause is None:
        errors.append(FieldError("group_pause", _("how long a pause ends a subgroup?")))
    errors += against(given)
    if given.cusum_headstart >= given.cusum_h:
        errors.append(FieldError("cusum_headstart", _("must be below h")))
    errors += [
        FieldError(f"excluded[{at}].first", _("must not be larger than the last of the run"))
        for at, run in enumerate(given.excluded)
        if run.first > run.last
    ]
    errors += [
        FieldError(
            f"excluded[{at}].first",
            _("{first} to {last} lies outside of the period: there is nothing of it to leave out").format(
                first=run.first, last=run.last
            ),
        )
        for at, run in enumerate(given.excluded)
        if given.first_sequence <= given.last_sequence
        and run.first <= run.last
        and (run.last < given.first_sequence or run.first > given.last_sequence)
    ]
    if errors:
        raise refused(errors)


def _plan(current: CurrentCharacteristic, given: PeriodIn) -> Baseline:
    settings = given.model_dump(include=set(PeriodIn.model_fields) - {"excluded", "quantity", "pooled", "limits"})
    return Baseline(
        **settings,
        quantity=given.quantity.value,
        shifts=shifts_now() if given.grouping == "shift" else None,
        excluded=[run.model_dump() for run in given.excluded],
        factor=current.parameters.factor,
        parameters_version=current.version.version,
        machine_id=current.machine.id,
        characteristic_id=current.characteristic.id,
        centre=0.0,
        sigma=1.0,
        estimator=(Estimator.POOLED if given.pooled else Estimator.GIVEN).value,
        freedom=1.0,
        readings=0,
        groups=0,
    )


def _run_in(
    session: Session, current: CurrentCharacteristic, baseline: Baseline, series: ReadingSeries, window: Window
) -> int:
    """Number of readings that the edges of the period take to run in, by all of their readings."""
    lines = quantity.individuals_of(series.series, Quantity.WEAR_RESIDUALS, baseline.slope or 0.0)
    whole = queries.read_back(session, current, baseline, window)
    return quantity.run_in(whole.series, window.first, baseline.slope or 0.0, lines.sigma.value)


def _line(series: Series) -> WearLine:
    if len(series) < shewhart.FEWEST_READINGS:
        raise Refused(Reason.TOO_FEW_READINGS, have=len(series), needed=shewhart.FEWEST_READINGS)
    return quantity.wear_line(series)


def _estimated(
    session: Session, current: CurrentCharacteristic, baseline: Baseline, series: ReadingSeries, window: Window
) -> shewhart.Baseline:
    which = Quantity(baseline.quantity)
    if baseline.grouping is None:
        return quantity.individuals_of(series.series, which, baseline.slope or 0.0)
    groups = _groups(session, current, baseline, window)
    limits = shewhart.subgroup_baseline(groups, Estimator.POOLED if baseline.pooled else ESTIMATORS[baseline.chart])
    if which is Quantity.WEAR_RESIDUALS:  # they are about their own edge's level: by design about 0
        return shewhart.Baseline(0.0, limits.sigma, provisional=limits.provisional)
    return limits


def _groups(session: Session, current: CurrentCharacteristic, baseline: Baseline, window: Window) -> Subgroups:
    """The complete subgroups that lie in the period."""
    points = queries.charted(session, current, baseline, window)
    if points.groups is None:
        raise Refused(Reason.TOO_FEW_SUBGROUPS, have=0, needed=shewhart.FEWEST_SUBGROUPS)
    inside, groups = points.first >= window.first, points.groups
    return Subgroups(groups.sizes[inside], groups.means[inside], groups.ranges[inside], groups.deviations[inside])


def _take(baseline: Baseline, baseline_limits: shewhart.Baseline) -> None:
    baseline.centre, baseline.sigma = baseline_limits.centre, baseline_limits.sigma.value
    baseline.estimator, baseline.freedom = (
        baseline_limits.sigma.estimator.value,
        baseline_limits.sigma.degrees_of_freedom,
    )
    baseline.readings, baseline.groups = baseline_limits.sigma.readings, baseline_limits.sigma.groups


def _cautions(
    session: Session,
    current: CurrentCharacteristic,
    baseline: Baseline,
    series: ReadingSeries,
    line: WearLine | None,
    window: Window,
) -> list[tuple[Caution, int]]:
    """Cautions against freezing it; its own signals and normality are noted in the baseline."""
    points = queries.charted(session, current, baseline, window)
    values = _flat(baseline, series.series)
    baseline.signals = _signals(baseline, points)
    baseline.normal_p = _normal_p(values)
    cautions: list[tuple[Caution, int]] = []
    if baseline.provisional:
        cautions.append((Caution.PROVISIONAL, baseline.readings))
    if baseline.signals:
        cautions.append((Caution.BEYOND_GIVEN if baseline.given else Caution.SIGNALS, baseline.signals))
    if baseline.normal_p is not None and baseline.normal_p < NOT_NORMAL:
        cautions.append((Caution.NOT_NORMAL, 0))
    correlation = summary(values).autocorrelation if len(values) > 1 else None
    which = Quantity(baseline.quantity)
    wears = which is Quantity.WITHOUT_CORRECTIONS and line is not None and abs(line.slope) > WEARS * line.error
    if wears:
        cautions.append((Caution.WEARS, 0))
    elif correlation is not None and correlation > CORRELATED:
        cautions.append((Caution.CORRELATED, round(correlation * 100)))
    steps = int(series.series.begins[1:].sum())
    if steps and which in (Quantity.DEVIATION, Quantity.WITHOUT_CORRECTIONS):
        cautions.append((Caution.STEPS, steps))
    if which is Quantity.DEVIATION and not current.parameters.measures_only:
        corrections = statistics.numbers_of(session, current.characteristic, window).corrections
        if corrections:
            cautions.append((Caution.CORRECTED, corrections))
    if len(series.left_out.unknown):
        cautions.append((Caution.UNKNOWN, len(series.left_out.unknown)))
    return cautions


def _flat(baseline: Baseline, series: Series) -> Floats:
    """The values of the period as they scatter: of residuals about the level of their own stretch."""
    match Quantity(baseline.quantity):
        case Quantity.DIFFERENCES:
            return quantity.differences(series).values
        case Quantity.WEAR_RESIDUALS:
            edge = series.edge
            flat = series.values - (baseline.slope or 0.0) * (series.sequence - series.sequence[0])
            levels = np.bincount(edge, flat) / np.maximum(np.bincount(edge), 1)
            return np.asarray(flat - levels[edge], np.float64)
        case _:
            return series.values


def _signals(baseline: Baseline, points: queries.Charted) -> int:
    if points.chart is None:
        return 0
    count = int(points.chart.outside.sum())
    if points.groups is not None:
        whole = points.groups.sizes > 1
        pairs = Subgroups(
            points.groups.sizes[whole],
            points.groups.means[whole],
            points.groups.ranges[whole],
            points.groups.deviations[whole],
        )
        judge = shewhart.ranges if baseline.chart == "xbar_r" else shewhart.deviations
        count += int(judge(queries.judged_by(baseline), pairs).outside.sum()) if len(pairs) else 0
    return count


def _normal_p(values: Floats) -> float | None:
    try:
        return anderson_darling(values).p_value
    except Refused:
        return None
