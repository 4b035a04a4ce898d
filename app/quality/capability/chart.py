"""A capability study as the values that its pictures are drawn from."""

from app.core.spc.fitting import Fitted
from app.core.spc.refusal import Refused
from app.quality.capability.figures import CapabilityChart
from app.quality.capability.queries import Study


def drawn(study: Study) -> CapabilityChart:
    """Values of the histogram and of the probability plot."""
    result = None if isinstance(study.indices, Refused) else study.indices
    fitted = study.by_fit if isinstance(study.by_fit, Fitted) else None
    by_percentile = fitted or (None if isinstance(study.by_percentile, Refused) else study.by_percentile)
    return CapabilityChart(
        study.values,
        study.limits,
        result.mean if result else None,
        result.overall.value if result else None,
        result.within.value if result and study.potential_allowed else None,
        (by_percentile.low, by_percentile.median, by_percentile.high) if by_percentile else None,
        study.normal or result is None,
        fitted,
    )
