"""JSON routes: charts of counts. Nothing is stored: who counts sends all counts that the chart is of."""

from math import inf
from typing import Annotated

from fastapi import Query, Response
from pydantic import ConfigDict, Field

from app.access.deps import require
from app.core.spc.counts import CountChart
from app.errors import Invalid
from app.language.i18n import _
from app.quality.count_charts import wording
from app.quality.count_charts.figures import counts_figure
from app.quality.count_charts.queries import MOST, chart_of
from app.web.api import FIGURE, Theme, api_router, chart_answer
from app.web.fields import Body

router = api_router("control charts")

LARGEST = 1e12
Count = Annotated[float, Field(strict=True, ge=0, le=LARGEST)]
Inspected = Annotated[float, Field(strict=True, gt=0, le=LARGEST)]


class CountsIn(Body):
    """Counts in order of time."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    chart: CountChart = Field(
        description="`p` share of rejected parts, `np` their number, `c` nonconformities, `u` those per unit; `p_prime` and `u_prime` are Laney's, for large samples that scatter more than chance explains."
    )
    counts: list[Count] = Field(
        min_length=2, max_length=MOST, description="Rejected parts (p, np) or nonconformities (c, u)."
    )
    inspected: list[Inspected] | Inspected | None = Field(
        None, description="Parts or units of each sample, one number for all; left out for `c`."
    )
    baseline: int | None = Field(
        None,
        ge=2,
        le=MOST,
        strict=True,
        description="Number of first samples that give centre and limits; all if left out.",
    )
    centre: float | None = Field(
        None, strict=True, gt=0, le=LARGEST, description="A share or rate that is given, and not estimated."
    )


class CountsOut(Body):
    """A chart of counts: columns of equal length."""

    chart: CountChart
    points: list[float] = Field(description="Of each sample: its count, share or rate, as the chart draws it.")
    centre: list[float] = Field(description="Centre line at each point.")
    lower: list[float] = Field(description="Lower control limit at each point.")
    upper: list[float] = Field(description="Upper control limit at each point.")
    outside: list[int] = Field(description="Samples beyond a limit, counted from 1.")
    sigma_z: float = Field(description="Scatter of the points as a share of what binomial or Poisson counts have.")
    provisional: bool = Field(description="Limits of fewer than 20 samples.")
    advice: list[str] = Field(description="Sentences on what to do about the samples or the chart.")


@router.post("/count-charts", dependencies=[require("viewer")])
def post_count_chart(given: CountsIn) -> CountsOut:
    """A p, np, c or u chart, or Laney's p' or u', of counts in order of time. Nothing is stored."""
    found = chart_of(given.chart, given.counts, given.inspected, baseline=given.baseline, centre=given.centre)
    return CountsOut(
        chart=found.chart,
        points=found.points.tolist(),
        centre=found.centre.tolist(),
        lower=found.lower.tolist(),
        upper=found.upper.tolist(),
        outside=[int(at) + 1 for at in found.outside.nonzero()[0]],
        sigma_z=found.sigma_z,
        provisional=found.provisional,
        advice=wording.advice(found),
    )


@router.get("/figures/count-chart", responses=FIGURE, response_model=None, dependencies=[require("viewer")])
def get_count_chart_figure(
    chart: Annotated[CountChart, Query(description="Kind of chart.", examples=["c"])],
    counts: Annotated[str, Query(max_length=4000, description="Counts, separated by commas.", examples=["4,2,5,3"])],
    inspected: Annotated[
        str,
        Query(max_length=4000, description="Parts or units of each sample, or one number for all.", examples=["50"]),
    ] = "",
    theme: Theme = "light",
) -> Response:
    """A chart of counts as a figure."""
    numbers, sizes = _numbers("counts", counts), _numbers("inspected", inspected)
    found = chart_of(chart, numbers, sizes[0] if len(sizes) == 1 else sizes or None)
    return chart_answer(counts_figure(found), theme)


def _numbers(field: str, text: str) -> list[float]:
    try:
        numbers = [float(each) for each in text.split(",") if each.strip()]
    except ValueError:
        numbers = [inf]
    if any(not 0 <= number <= LARGEST for number in numbers):
        raise Invalid.at(field, _("must be numbers of 0 and more, separated by commas"))
    return numbers
