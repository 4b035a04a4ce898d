"""From what somebody asks to what is replayed, one at a turn."""

from sqlalchemy.orm import Session

from app.characteristics.queries import Standing
from app.core.policy_map import with_settings
from app.core.spc.refusal import Refused
from app.errors import FieldError, Invalid
from app.statistics import queries as statistics
from app.web.i18n import _
from app.whatif import grid, queries
from app.whatif.past import Past
from app.whatif.queries import Answer, Map, Settings
from app.whatif.schemas import MapIn, PeriodIn, SettingsIn, WhatIfIn
from app.whatif.turns import turn


def replayed(session: Session, standing: Standing, given: WhatIfIn) -> Answer:
    """Side by side. Raises `Invalid`, `TooManyRequests`."""
    with turn():
        past = _past(session, standing, given)
        answer = queries.side_by_side(session, past, settings(past, given))
        _said = answer.effect  # worked out in turn, too
    return answer


def mapped(session: Session, standing: Standing, given: MapIn) -> Map:
    """The map. Raises `Invalid`, `TooManyRequests`."""
    with turn():
        return map_of(_past(session, standing, given), given)


def map_of(past: Past, given: MapIn) -> Map:
    """The map of a past that is loaded already."""
    today = past.standing.parameters
    r34 = today.averaging_limit if given.averaging_limit is None else given.averaging_limit
    asked = Settings(averaging_limit=given.averaging_limit, factor=given.factor)
    queries.check_order(with_settings(asked.applied_to(today), zero_range=0.0), asked)
    ks, r33s = grid.weighting_factors(today), grid.zero_ranges(today, r34)
    if len(ks) * len(r33s) * len(past.way.free) > queries.MOST_DECISIONS:
        ks, r33s = grid.coarser(ks, today.weighting_factor), grid.coarser(r33s, today.zero_range)
    return queries.map_of(
        past,
        settings(past, given),
        ks if given.weighting_factors is None else given.weighting_factors,
        r33s if given.zero_ranges is None else given.zero_ranges,
        given.criterion,
    )


def both(session: Session, standing: Standing, given: WhatIfIn, around: MapIn) -> tuple[Answer, Map | Invalid]:
    """Side by side, and the map of the same period, or why there is none."""
    with turn():
        past = _past(session, standing, given)
        answer = queries.side_by_side(session, past, settings(past, given))
        _said = answer.effect
        try:
            return answer, map_of(past, around)
        except Invalid as refused:
            return answer, refused


def settings(past: Past, given: SettingsIn) -> Settings:
    """The settings asked for; a measured effect is measured. Raises `Invalid` where it cannot be."""
    effect = 1.0
    if given.effect is None:
        found = queries.effect_of(past)
        if isinstance(found, Refused):
            message = _("The effect of corrections cannot be told from these readings.")
            raise Invalid(message, _("Assume that they act in full."), errors=[FieldError("effect", message)])
        effect = found.value
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


def _past(session: Session, standing: Standing, given: PeriodIn) -> Past:
    if given.start is not None and given.end is not None and given.start > given.end:
        message = _("is later than `to`; exchange the two moments")
        raise Invalid(f"from: {message}.", errors=[FieldError("from", message)])
    window = statistics.window_of(session, standing.characteristic, last=given.newest, start=given.start, end=given.end)
    return queries.load(session, standing, window)
