"""Page: a chart of counts that are typed or pasted. Nothing is stored; the address holds the counts."""

import re
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import require
from app.core.spc.counts import CountChart
from app.errors import Invalid
from app.language.i18n import _
from app.quality.count_charts import wording
from app.quality.count_charts.queries import MOST_ON_A_PAGE, chart_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)

NUMBER = re.compile(r"\d+(?:[.,]\d+)?")


def typed(data: str, size: str) -> tuple[list[float], list[float] | float | None]:
    """Counts, and parts or units of each, of lines with one number or two. Raises `Invalid`."""
    lines = [line.strip() for line in data.splitlines() if line.strip()]
    rows = [[float(each.replace(",", ".")) for each in NUMBER.findall(line)] for line in lines]
    for at, (line, row) in enumerate(zip(lines, rows, strict=True), 1):
        if len(row) not in {1, 2} or re.sub(NUMBER, "", line).strip(" \t;/"):
            raise Invalid.at(
                "data", _("line {n} is no count, or count and sample: {line}").format(n=at, line=line[:40])
            )
    if not 2 <= len(rows) <= MOST_ON_A_PAGE:
        raise Invalid.at("data", _("takes 2 to {most} lines").format(most=MOST_ON_A_PAGE))
    if len({len(row) for row in rows}) > 1:
        raise Invalid.at("data", _("some lines have a sample size and others have none"))
    if len(rows[0]) == 2:
        return [row[0] for row in rows], [row[1] for row in rows]
    if not size.strip():
        return [row[0] for row in rows], None
    if not NUMBER.fullmatch(size.strip()):
        raise Invalid.at("size", _("must be a number such as 50"))
    return [row[0] for row in rows], float(size.strip().replace(",", "."))


@router.get("/count-charts", dependencies=[require("viewer")])
def count_chart_page(
    request: Request,
    chart: CountChart = CountChart.P,
    data: Annotated[str, Query(max_length=6000)] = "",
    size: Annotated[str, Query(max_length=20)] = "",
) -> Response:
    """Show the form, and the chart of what was typed."""
    shown: dict[str, Any] = {"found": None, "refusal": None, "figure": None}
    if data.strip():
        try:
            counts, inspected = typed(data, size)
            shown["found"] = chart_of(chart, counts, inspected)
            asked = {"chart": chart.value, "counts": _listed(counts)}
            if inspected is not None:
                asked["inspected"] = _listed(inspected if isinstance(inspected, list) else [inspected])
            shown["figure"] = f"/api/v1/figures/count-chart?{urlencode(asked)}"
        except Invalid as invalid:
            shown["refusal"] = invalid
    return page(
        request,
        "count_charts/counts.html",
        chart=chart,
        charts=[(each.value, wording.name(each)) for each in CountChart],
        data=data,
        size=size,
        wording=wording,
        **shown,
    )


def _listed(numbers: list[float]) -> str:
    return ",".join(f"{number:g}" for number in numbers)
