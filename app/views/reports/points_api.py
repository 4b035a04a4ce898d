"""JSON routes: the points of a control chart as CSV, for a spreadsheet or another program."""

import csv
import io
from collections.abc import Iterator
from typing import Annotated, Any

import numpy as np
from fastapi import Query, Response

from app.access.deps import AnyCaller
from app.core.spc.shewhart import Chart
from app.files.documents.content import Format
from app.files.documents.files import MEDIA_TYPES
from app.loop.characteristics import queries as characteristics
from app.loop.summaries import queries as statistics
from app.quality.baselines import queries
from app.quality.control_charts import charts
from app.quality.control_charts.charts import View
from app.web.api import CharacteristicKey, api_router, problems
from app.web.choice import Chosen
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.downloads import download
from app.web.fields import LARGEST_SERIAL

router = api_router("reports", FROM_REPLICA)
COLUMNS = (
    "chart",
    "baseline",
    "first_reading",
    "last_reading",
    "readings",
    "value_mm",
    "lower_sum_mm",
    "lower_limit_mm",
    "centre_mm",
    "upper_limit_mm",
    "signals",
)
EXAMPLE = f"{','.join(COLUMNS)}\r\nindividuals,3,812,812,1,0.0052,,-0.00363,0.0,0.00363,nelson_1\r\n"
FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "One line per point",
        "content": {"text/csv": {"schema": {"type": "string"}, "example": EXAMPLE}},
    }
}


@router.get(
    "/characteristics/{characteristic}/control.csv",
    responses=problems(404) | FILE,
    response_model=None,
    response_class=Response,
)
def get_control_points(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    choice: Chosen,
    chart: Annotated[
        Chart | None,
        Query(description="Which chart; individuals or X-bar, whichever the baseline is for, if left out."),
    ] = None,
    version: Annotated[
        int | None,
        Query(ge=1, le=LARGEST_SERIAL, alias="baseline", description="Judge by this version, not by the one in force."),
    ] = None,
) -> Response:
    """All points of a control chart with the limits of each and the rules that speak of it, as CSV; lengths in mm.

    Without a baseline in force: deviations and no limits.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    window = statistics.window_of(session, current.characteristic, **choice._asdict())
    baseline = (
        queries.baseline_in_force(session, current.characteristic)
        if version is None
        else queries.baseline_of(session, current.characteristic, version)
    )
    view = (
        charts.unjudged(session, current, window)
        if baseline is None
        else charts.view(session, current, baseline, window, chart)
    )
    file = io.StringIO(newline="")
    writer = csv.writer(file, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    writer.writerows(_rows(view, "" if baseline is None else baseline.version))
    name = f"control-{current.characteristic.key}-{view.kind.value}.csv"
    return download(("\ufeff" + file.getvalue()).encode(), name, MEDIA_TYPES[Format.CSV])


def _rows(view: View, baseline: int | str) -> Iterator[tuple[Any, ...]]:
    signals: list[list[str]] = [[] for _point in range(len(view))]
    for run in view.signals or ():
        for at in range(run.start, run.end + 1):
            if run.rule.value not in signals[at]:
                signals[at].append(run.rule.value)

    def column(values: Any) -> list[Any]:
        spread_out: list[Any] = np.broadcast_to(np.asarray("" if values is None else values), len(view)).tolist()
        return spread_out

    numbers = (view.first, view.last, view.sizes, view.points, view.below, view.lower, view.centre, view.upper)
    for *row, spoken in zip(*map(column, numbers), signals, strict=True):
        yield (view.kind.value, baseline, *row, " ".join(spoken))
