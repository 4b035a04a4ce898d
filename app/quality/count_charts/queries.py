"""Charts of counts as routes ask for them: what does not belong together is refused by its field. Nothing is stored."""

from collections.abc import Sequence

from app.core.spc.counts import CountChart, Counts, counts_chart
from app.core.spc.refusal import Refused
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.quality.count_charts import wording

MOST = 10_000
MOST_ON_A_PAGE = 200


def chart_of(
    chart: CountChart,
    counts: Sequence[float],
    inspected: Sequence[float] | float | None,
    *,
    baseline: int | None = None,
    centre: float | None = None,
) -> Counts:
    """The chart. Raises `Invalid`: lengths that differ, parts rejected that were not inspected, unequal samples for np and c."""
    if isinstance(inspected, Sequence) and len(inspected) != len(counts):
        raise Invalid.at(
            "inspected",
            _("has {n} samples, counts has {m}").format(n=len(inspected), m=len(counts)),
            do=_("Send one number for each sample, or one for all."),
        )
    if inspected is None and chart is not CountChart.C:
        raise Invalid.at("inspected", _("is missing: how many parts or units were looked at?"))
    try:
        return counts_chart(chart, counts, inspected, baseline=baseline, centre=centre)
    except Refused as refused:
        field, wrong, do = wording.refusal(refused, chart)
        raise Invalid(wrong, do, errors=[FieldError(field, wrong)]) from None
