"""From what a person asks to what is replayed, one at a turn."""

from dataclasses import replace

from sqlalchemy.orm import Session

from app.core.policy_map import with_settings
from app.core.spc.refusal import Refused
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.control_plan import queries as plans
from app.loop.summaries import queries as statistics
from app.quality.what_if import map_axes, queries
from app.quality.what_if.queries import Map, Sampling, Settings, Simulation
from app.quality.what_if.schemas import MapIn, ReplayPeriodIn, SampledIn, SettingsIn, WhatIfIn
from app.quality.what_if.tool_history import ToolHistory
from app.quality.what_if.turn_limit import turn


def replayed(session: Session, current: CurrentCharacteristic, given: WhatIfIn) -> Simulation:
    """Side by side. Raises `Invalid`, `TooManyRequests`."""
    with turn():
        past = _past(session, current, given)
        answer = queries.side_by_side(session, past, settings(past, given))
        _said = answer.effect  # worked out in turn, too
    return answer


def mapped(session: Session, current: CurrentCharacteristic, given: MapIn) -> Map:
    """The map. Raises `Invalid`, `TooManyRequests`."""
    with turn():
        return map_of(_past(session, current, given), given)


def sampled(session: Session, current: CurrentCharacteristic, given: SampledIn) -> Sampling:
    """With 1 in N parts measured. Raises `Invalid`, `TooManyRequests`."""
    with turn():
        return sampling_of(session, _past(session, current, given), given)


def sampling_of(session: Session, past: ToolHistory, given: SampledIn) -> Sampling:
    """The same of a past that is loaded already; what is not given of the tightening is as the plan in force has it."""
    plan = plans.stated(plans.plan_of(session, past.current))
    change = plan.after_change if given.after_change is None else given.after_change
    alarm = plan.after_alarm if given.after_alarm is None else given.after_alarm
    tightened = replace(plan, after_change=change, after_alarm=alarm)
    return queries.sampling_of(past, settings(past, given), tightened, given.every)


def map_of(past: ToolHistory, given: MapIn) -> Map:
    """The map of a past that is loaded already."""
    today = past.current.parameters
    r34 = today.averaging_limit if given.averaging_limit is None else given.averaging_limit
    chosen = Settings(averaging_limit=given.averaging_limit, factor=given.factor)
    queries.check_order(with_settings(chosen.applied_to(today), zero_range=0.0), chosen)
    ks, r33s = map_axes.weighting_factors(today), map_axes.zero_ranges(today, r34)
    if len(ks) * len(r33s) * len(past.trace.free) > queries.MOST_DECISIONS:
        ks, r33s = map_axes.coarser(ks, today.weighting_factor), map_axes.coarser(r33s, today.zero_range)
    return queries.map_of(
        past,
        settings(past, given),
        ks if given.weighting_factors is None else given.weighting_factors,
        r33s if given.zero_ranges is None else given.zero_ranges,
        given.criterion,
    )


def everything(
    session: Session, current: CurrentCharacteristic, given: SampledIn, around: MapIn
) -> tuple[Simulation, Sampling, Map | Invalid]:
    """Side by side, with fewer parts measured, and the map of the same period, or why there is none."""
    with turn():
        past = _past(session, current, given)
        answer = queries.side_by_side(session, past, settings(past, given))
        _said, fewer = answer.effect, sampling_of(session, past, given)
        try:
            return answer, fewer, map_of(past, around)
        except Invalid as refused:
            return answer, fewer, refused


def settings(past: ToolHistory, given: SettingsIn) -> Settings:
    """The settings asked for; a measured effect is measured. Raises `Invalid` where it cannot be."""
    effect = 1.0
    if given.effect is None:
        measured = queries.effect_of(past)
        if isinstance(measured, Refused):
            message = _("These readings do not show the effect of corrections.")
            raise Invalid(message, _("Assume that they act in full."), errors=[FieldError("effect", message)])
        effect = measured.value
        if not 0.05 <= effect <= 5:
            message = _("The effect that was measured, {value}, is none to replay with.").format(value=f"{effect:.2f}")
            raise Invalid(message, _("Look at the factor first."), errors=[FieldError("effect", message)])
    else:
        effect = given.effect
    one = given if isinstance(given, WhatIfIn) else None
    return Settings(
        weighting_factor=one.weighting_factor if one else None,
        zero_range=one.zero_range if one else None,
        averaging_limit=given.averaging_limit,
        factor=given.factor,
        delay=given.delay,
        effect=effect,
    )


def _past(session: Session, current: CurrentCharacteristic, given: ReplayPeriodIn) -> ToolHistory:
    window = statistics.window_of(session, current.characteristic, last=given.newest, period=given.period)
    return queries.load(session, current, window)
