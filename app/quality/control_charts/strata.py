"""Points of a control chart apart by order, nest, operator …. Never writes."""

import numpy as np
from sqlalchemy.orm import Session

from app.charts import Chart, distinguished
from app.core.context import ContextField
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.readings.wording import field_word
from app.loop.summaries import queries as statistics
from app.quality.control_charts.view import View


def distinguished_by(
    session: Session, current: CurrentCharacteristic, view: View, figure: Chart, by: ContextField | None
) -> Chart:
    """The figure with its points in the look of their stratum; a subgroup of several has the look of none."""
    if by is None or not len(view):
        return figure
    start = int(view.first[0])
    strata = statistics.strata_of(session, current.characteristic, by, np.arange(start, int(view.last[-1]) + 1))
    spans = zip(view.first.tolist(), view.last.tolist(), strict=True)
    groups = {last: strata.labels[first - start : last - start + 1] for first, last in spans}
    labels = {last: int(group[0]) if (group == group[0]).all() else -1 for last, group in groups.items()}
    return distinguished(figure, "points", labels, [f"{field_word(by)} {name}" for name in strata.names])
