"""Current and selected settings side by side, the map, and the accuracy of the simulation. Never writes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite, sqrt

import numpy as np
from sqlalchemy import all_, func, select
from sqlalchemy.orm import Session

from app.core.control_plan import Plan
from app.core.decision.limits import FAULT, WEAR, in_nanometres, nanometres, reaches, within
from app.core.decision.loops import ReplayResult, Whole
from app.core.decision.step import OFFSET_LIMIT
from app.core.measured_gain import Effect, measured_effect
from app.core.parameters import Feature, ParameterError, Parameters, read
from app.core.policy_map import Criterion, Region, best_region, in_order, with_settings
from app.core.replay import FEWEST_FOR_PPK, Figures, Sampled, agreement, figures_of, run, sampled
from app.core.spc import USUAL_READINGS
from app.core.spc.capability import Limits
from app.core.spc.quoting import Quote, Quoting, quoting_of
from app.core.spc.refusal import Reason, Refused
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics import wording
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries.queries import Window
from app.loop.tables.tools import Correction
from app.quality.what_if import map_axes
from app.quality.what_if.proposals import count_open, proposals
from app.quality.what_if.tool_history import HELD, ToolHistory, past_of
from app.quality.what_if.turn_limit import on_all_cores, turn

__all__ = [
    "USUAL",
    "Map",
    "Sampling",
    "Settings",
    "Simulation",
    "ToolHistory",
    "count_open",
    "map_axes",
    "map_of",
    "on_all_cores",
    "past_of",
    "proposals",
    "sampling_of",
    "side_by_side",
    "turn",
]

USUAL = USUAL_READINGS  # that are replayed unless it is set otherwise
SETTINGS = ("zero_range", "averaging_limit", "weighting_factor", "factor")
MOST_CELLS = 2_500
MOST_DECISIONS = 200_000_000  # in one map: some seconds
WELL, ROUGHLY = (0.05, 0.10), (0.15, 0.30)  # how far spread and corrections of the replay may be off
FEW_CORRECTIONS = 3
UNRESOLVED = Quoting(Quote.NONE, why=Reason.UNRESOLVED.value)


@dataclass(frozen=True, slots=True)
class Settings:
    """Selected settings of the loop in place of the current ones (None: as now), mm; parts; the share of a correction that acts.

    `delay` None: as it was most often.
    """

    weighting_factor: float | None = None
    zero_range: float | None = None
    averaging_limit: float | None = None
    factor: float | None = None
    delay: int | None = None
    effect: float = 1.0

    def applied_to(self, parameters: Parameters) -> Parameters:
        """The parameters with these settings."""
        return with_settings(
            parameters,
            weighting_factor=self.weighting_factor,
            zero_range=self.zero_range,
            averaging_limit=self.averaging_limit,
            factor=self.factor,
        )


@dataclass(frozen=True, slots=True)
class Likeness:
    """Accuracy of the simulated loop, set as it was then, against what truly happened.

    off: root mean square of the difference, mm; same: share of parts that are the same to 0.1 µm. verdict: well, roughly, badly, or
    unknown of too few readings.
    """

    figures: Figures
    off: float | None
    same: float | None
    verdict: str


@dataclass(frozen=True)
class Simulation:
    """Side by side: what was, today's settings and the others, replayed."""

    past: ToolHistory
    settings: Settings
    delay: int
    truly: Figures
    likeness: Likeness
    today: Figures
    other: Figures
    today_result: ReplayResult
    other_result: ReplayResult
    parameters: Parameters

    @cached_property
    def quotes(self) -> tuple[Quoting, Quoting, Quoting]:
        """The index that may be quoted of what truly happened, of today's settings and of the others.

        None is of readings that are too coarse: a replay only shifts them, and shifted steps look finer than they are.
        """
        parameters = self.past.current.parameters
        tolerance, side = parameters.tolerance, parameters.natural_limit.side
        counted, mine = ~self.past.history.excluded, self.past.mine
        true = self.past.history["deviation"]
        if not self.past.resolved:
            return (UNRESOLVED,) * 3
        truly, today, other = (
            quoting_of(deviations[self.past.inner(deviations) & counted], Limits(*tolerance, 0.0), side=side)
            for deviations in (true, self.today_result.deviation[mine], self.other_result.deviation[mine])
        )
        return truly, today, other

    @cached_property
    def effect(self) -> Effect | Refused:
        """The measured effect of past corrections, or why it cannot be determined."""
        return effect_of(self.past)


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of a map; figures None where R33 < R34 ≤ R35/2 does not hold."""

    weighting_factor: float
    zero_range: float
    figures: Figures | None


@dataclass(frozen=True)
class Map:
    """Cells row by row, a row a k. today: figures of today's settings; region: where it is best by the criterion."""

    past: ToolHistory
    weighting_factors: Sequence[float]
    zero_ranges: Sequence[float]
    averaging_limit: float
    delay: int
    criterion: Criterion
    cells: list[Cell]
    today: Figures
    region: Region


@dataclass(frozen=True)
class Sampling:
    """The same readings with 1 in N parts measured, a row each N. plan: the rules by which every part is measured for a while."""

    past: ToolHistory
    delay: int
    parameters: Parameters
    plan: Plan
    rows: list[Sampled]

    @property
    def has_gaps(self) -> bool:
        """Tell if the plan in force leaves parts out by itself, which are not among these readings."""
        return (self.plan.every or 1) > 1


def load(session: Session, current: CurrentCharacteristic, window: Window) -> ToolHistory:
    """The past, and a refusal in words where there is nothing that could be replayed. Raises `Invalid`."""
    past = past_of(session, current, window)
    if len(past.history) < 2:
        raise Invalid(
            _("This period holds {count} readings that can be replayed; a loop needs two at least.").format(
                count=len(past.history)
            ),
            _("Choose a longer period.")
            if not past.unknown
            else _("Choose another period: the corrections of {count} of its readings are not known.").format(
                count=past.unknown
            ),
        )
    return past


def side_by_side(session: Session, past: ToolHistory, settings: Settings) -> Simulation:
    """Replay today's settings and the others, and hold the replay against what truly happened."""
    today = past.current.parameters
    other = settings.applied_to(today)
    check_order(other, settings)
    delay = _delay(past, settings)
    trace = past.with_effect(settings.effect)
    then_result, then = run(trace, past.as_then(delay, settings.effect))
    today_result, today_figures = run(trace, past.policy(today, delay, settings.effect))
    other_result, other_figures = run(trace, past.policy(other, delay, settings.effect))
    truly = truly_of(session, past)
    return Simulation(
        past=past,
        settings=settings,
        delay=delay,
        truly=truly,
        likeness=_likeness(past, truly, past.carried(then), then_result),
        today=past.carried(today_figures),
        other=past.carried(other_figures),
        today_result=today_result,
        other_result=other_result,
        parameters=other,
    )


def sampling_of(past: ToolHistory, settings: Settings, plan: Plan, intervals: Sequence[int]) -> Sampling:
    """Replay these settings with 1 in N parts measured, tightened as the plan says."""
    parameters = settings.applied_to(past.current.parameters)
    check_order(parameters, settings)
    delay, trace = _delay(past, settings), past.with_effect(settings.effect)
    policy = past.policy(parameters, delay, settings.effect)
    plans = [replace(plan, every=every) for every in intervals]
    rows = [row._replace(figures=past.carried(row.figures)) for row in sampled(trace, policy, plans)]
    return Sampling(past, delay, parameters, plan, rows)


def map_of(
    past: ToolHistory,
    settings: Settings,
    weighting_factors: Sequence[float],
    zero_ranges: Sequence[float],
    criterion: Criterion,
) -> Map:
    """Replay a grid of k and R33 with the R34 of `settings`. Raises `Invalid` for a grid that would take too long."""
    cells = len(weighting_factors) * len(zero_ranges)
    readings = len(past.trace.free)
    if cells > MOST_CELLS or cells * readings > MOST_DECISIONS:
        most = min(MOST_CELLS, MOST_DECISIONS // max(1, readings))
        raise Invalid(
            _("A map of {cells} settings over {readings} readings takes too long; {most} settings can be had.").format(
                cells=cells, readings=readings, most=most
            ),
            _("Ask for fewer settings, or for a shorter period."),
        )
    today, delay = past.current.parameters, _delay(past, settings)
    base = settings.applied_to(today)
    trace = past.with_effect(settings.effect)
    grid = [with_settings(base, weighting_factor=k, zero_range=r33) for k in weighting_factors for r33 in zero_ranges]
    valid = [at for at, parameters in enumerate(grid) if in_order(parameters)]
    policies = [past.policy(today, delay, settings.effect)]
    policies += [past.policy(grid[at], delay, settings.effect) for at in valid]
    of_today, *results = map(past.carried, on_all_cores(lambda share: figures_of(trace, share), policies))
    figures = dict(zip(valid, results, strict=True))
    map_cells = [
        Cell(parameters.weighting_factor, parameters.zero_range, figures.get(at)) for at, parameters in enumerate(grid)
    ]
    region = best_region([cell.figures for cell in map_cells], criterion, of_today)
    return Map(
        past=past,
        weighting_factors=weighting_factors,
        zero_ranges=zero_ranges,
        averaging_limit=base.averaging_limit,
        delay=delay,
        criterion=criterion,
        cells=map_cells,
        today=of_today,
        region=region,
    )


def effect_of(past: ToolHistory) -> Effect | Refused:
    """Measure by the readings of the period if corrections act in full."""
    try:
        usable, begins = past.steady
        deviation, compensated = past.history["deviation"][usable], past.history["compensated"][usable]
        return measured_effect(deviation, compensated, past.current.parameters.factor, begins)
    except Refused as refused:
        return refused


def check_order(parameters: Parameters, settings: Settings) -> None:
    """Raises `Invalid` with the pair that is out of order, as the set-up would, at the setting of it that was given."""
    names = [name for name in SETTINGS if getattr(settings, name) is not None]
    try:
        read(parameters.as_dict())
    except ParameterError as error:
        errors = []
        for field, message in wording.field_errors(error.problems):
            name = field.removeprefix("parameters.")
            errors.append(FieldError(name if name in names or not names else names[0], message))
        limits = {error.field for error in errors} & {"zero_range", "averaging_limit"}
        raise Invalid(
            "; ".join(error.message.rstrip(".") for error in errors[:3]) + ".",
            _("Choose settings that hold to R33 < R34 ≤ R35/2.") if limits else _("Choose another value."),
            errors=errors,
        ) from None


def _delay(past: ToolHistory, settings: Settings) -> int:
    if settings.delay is not None:
        return settings.delay
    return past.delay or 0


def truly_of(session: Session, past: ToolHistory) -> Figures:
    """Count what truly happened as a replay counts it; each part by the tolerance that was in force."""
    history = past.history
    counted = ~history.excluded
    limits = {lane: known.parameters.limits for lane, known in enumerate(past.then.lanes)}
    lane = past.trace.lane[past.mine]
    tolerance, wear, confidence = (
        np.array([getattr(limits[at], name) for at in range(len(limits))])[lane]
        for name in ("tolerance", "wear", "confidence")
    )
    deviation = history["deviation"]
    size = in_nanometres(deviation)
    current = past.current.parameters
    judged = history["decided"] if current.rules.of_tool else deviation
    zone, code = history["zone"], history["code"]
    fault, worn = zone == FAULT, zone == WEAR
    outside = ~within(in_nanometres(judged), tolerance) & ~fault & ~worn
    bad = ~within(size, tolerance) & (current.feature is not Feature.TOOL)
    issued = (history["correction"] >= 0) & counted
    held = issued & np.isin(code, HELD)
    inner = deviation[~reaches(size, wear) & counted]
    spread = float(inner.std(ddof=1)) if len(inner) > 1 else None
    if spread is not None and not nanometres(spread * 1000):
        spread = 0.0
    mean = float(inner.mean()) if len(inner) else None
    ppk = None
    if spread and mean is not None and len(inner) >= FEWEST_FOR_PPK and past.resolved:
        ppk = past.current.parameters.tolerance.room(mean) / (3 * spread)
    return Figures(
        readings=int(counted.sum()),
        rejects=int((bad & ~reaches(size, confidence) & counted).sum()),
        oversize=int((outside & (judged > 0) & counted).sum()),
        undersize=int((outside & (judged < 0) & counted).sum()),
        worn=int((worn & counted).sum()),
        faults=int((fault & counted).sum()),
        offset_limit=int(((code == OFFSET_LIMIT) & counted).sum()),
        corrections=int((issued & ~held).sum()),
        of_tool=past.of_tool,
        held=int(held.sum()),
        mean_size=_mean_size(session, past, history["sequence"][held | ((history["correction"] >= 0) & ~counted)]),
        inner=len(inner),
        mean=mean,
        spread=spread,
        ppk=ppk,
        largest=float(np.abs(inner).max()) if len(inner) else None,
    )


def _mean_size(session: Session, past: ToolHistory, but: Whole) -> float | None:
    """Mean size error that the corrections of these readings removed, mm; not those of the readings `but`."""
    sequence = past.history["sequence"]
    return session.scalar(
        select(func.avg(func.abs(Correction.size_error))).where(
            Correction.machine_id == past.current.machine.id,
            Correction.characteristic_id == past.current.characteristic.id,
            Correction.sequence.between(int(sequence[0]), int(sequence[-1])),
            Correction.sequence != all_(but.tolist()),
        )
    )


def _likeness(past: ToolHistory, truly: Figures, then: Figures, result: ReplayResult) -> Likeness:
    if past.imported:
        return Likeness(then, None, None, "unknown")  # no loop was at work that the replay could be like
    counted = ~past.history.excluded & past.inner(past.history["deviation"])
    off, same = agreement(result.deviation[past.mine][counted], past.history["deviation"][counted])
    if not isfinite(off):
        return Likeness(then, None, None, "unknown")
    verdict = "unknown"
    if truly.spread and then.spread is not None and truly.inner >= FEWEST_FOR_PPK:
        verdict = next(
            (word for word, bounds in (("well", WELL), ("roughly", ROUGHLY)) if _near(truly, then, *bounds)), "badly"
        )
    return Likeness(then, off, same, verdict)


def _near(truly: Figures, then: Figures, of_spread: float, of_corrections: float) -> bool:
    assert truly.spread is not None
    assert then.spread is not None
    room = max(of_spread, 2 / sqrt(2 * truly.inner)) * truly.spread
    allowed = max(FEW_CORRECTIONS, of_corrections * truly.corrections)
    return abs(then.spread - truly.spread) <= room and abs(then.corrections - truly.corrections) <= allowed
