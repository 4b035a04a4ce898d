"""Limits that a customer or a standard gives, as the centre and sigma of a baseline. Pure. Lengths in mm."""

from collections.abc import Sequence
from math import isclose, sqrt

from app.core.spc import shewhart
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.quality.baselines.schemas import PeriodIn

MIDDLE = 1e-6  # of the distance between the limits: so far the centre may lie from their middle


def limits_of(period: PeriodIn) -> shewhart.Baseline | None:
    """Centre, and sigma of a single value; None where none are given. Raises `Invalid`."""
    limits = period.limits
    if limits is None:
        return None
    if errors := against(period):
        raise refused(errors)
    if limits.lower is None or limits.upper is None:
        return shewhart.given(limits.centre or 0.0, limits.sigma or 0.0)
    size = 1 if period.chart == "individuals" else period.group_size or 1
    centre = round((limits.lower + limits.upper) / 2, 12)  # as it would be typed, not 0.00039999999999999986
    return shewhart.given(centre, (limits.upper - limits.lower) / 6 * sqrt(size))


def against(period: PeriodIn) -> list[FieldError]:
    """Errors of the limits: not the two that belong together, or of subgroups that have no one limit."""
    limits = period.limits
    if limits is None:
        return []
    errors = [FieldError("pooled", _("sigma is given with the limits; leave it out"))] if period.pooled else []
    if (limits.lower is None) != (limits.upper is None):
        missing = "lower" if limits.lower is None else "upper"
        return [*errors, FieldError(f"limits.{missing}", _("is missing: limits are a lower and an upper one"))]
    if limits.lower is None or limits.upper is None:
        wrong = _("is missing: give centre and sigma, or lower and upper")
        missing_ones = [name for name in ("centre", "sigma") if getattr(limits, name) is None]
        return [*errors, *(FieldError(f"limits.{name}", wrong) for name in missing_ones)]
    if limits.sigma is not None:
        wrong = _("follows from lower and upper; leave it out, or leave out these two")
        return [*errors, FieldError("limits.sigma", wrong)]
    apart = limits.upper - limits.lower
    if apart <= 0:
        errors.append(FieldError("limits.lower", _("must be below the upper limit")))
    elif period.chart != "individuals" and period.grouping != "consecutive":
        wrong = _("subgroups of several sizes have several limits: give centre, and the sigma of a single value")
        errors.append(FieldError("limits.lower", wrong))
    elif limits.centre is not None and not isclose(
        2 * limits.centre, limits.lower + limits.upper, rel_tol=0, abs_tol=2 * MIDDLE * apart
    ):
        wrong = _("is not in the middle of lower and upper: leave it out, or give it with sigma instead of the two")
        errors.append(FieldError("limits.centre", wrong))
    return errors


def refused(errors: Sequence[FieldError]) -> Invalid:
    """Error that names the first wrong field of a period, and lists all."""
    return Invalid(
        _("This period cannot be made a baseline: {field}: {message}.").format(
            field=errors[0].field, message=errors[0].message
        ),
        _("Correct the named fields and send it again."),
        errors=list(errors),
    )
