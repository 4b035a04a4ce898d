"""The picture on which a baseline is chosen: readings, the period, and its limits as soon as it has any. Never writes."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from sqlalchemy.orm import Session

from app.core.spc import quantity
from app.core.spc.quantity import Quantity
from app.core.spc.rules import RuleName
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries.queries import Window
from app.quality.baselines.draft_queries import draft_of
from app.quality.baselines.queries import Baseline
from app.quality.baselines.schemas import ExcludedIn, PeriodIn
from app.quality.baselines.series_queries import read
from app.quality.control_charts import charts
from app.quality.control_charts.view import Marks, View
from app.web.forms import parsed

PICKED = r"^([1-9]\d{0,14}-[1-9]\d{0,14}(,[1-9]\d{0,14}-[1-9]\d{0,14})*)?$"


class EditorChoice(NamedTuple):
    """Choices so far; a period only if both its ends are chosen."""

    quantity: Quantity
    chart: str = "individuals"
    grouping: str | None = None
    group_size: int | None = None
    group_pause: float | None = None
    pooled: bool = False
    settle: int | None = None
    first: int | None = None
    last: int | None = None
    excluded: str = ""
    limits: Mapping[str, float] = MappingProxyType({})

    @property
    def runs(self) -> list[tuple[int, int]]:
        """The runs that are left out."""
        pairs = (run.split("-") for run in self.excluded.split(",") if run)
        return [(int(low), int(high)) for low, high in pairs]

    def period(self) -> PeriodIn | None:
        """As the period of a baseline. Raises `Invalid`."""
        if self.first is None or self.last is None:
            return None
        return parsed(
            PeriodIn,
            {
                "chart": self.chart,
                "quantity": self.quantity,
                "grouping": self.grouping,
                "group_size": self.group_size,
                "group_pause": self.group_pause,
                "pooled": self.pooled,
                "settle": self.settle,
                "first_sequence": self.first,
                "last_sequence": self.last,
                "limits": dict(self.limits) or None,
                "excluded": [ExcludedIn(first=low, last=high, reason="–").model_dump() for low, high in self.runs],
            },
        )


def picture_of(
    session: Session, current: CurrentCharacteristic, picked: EditorChoice, window: Window
) -> tuple[View, Marks | None]:
    """The readings of the window by the baseline that would be; single values without limits while there is none."""
    marked = None
    if picked.first is not None and picked.last is not None and picked.first <= picked.last:
        marked = Marks(picked.first, picked.last, _("Period"), picked.runs)
    try:
        period = picked.period()
        draft = None if period is None else draft_of(session, current, period).baseline
    except Invalid:  # the page says it; the picture shows what there is
        draft = None
    if draft is not None:
        return charts.view(session, current, draft, window, watched=[RuleName.NELSON_1]), marked
    plain = Baseline(
        quantity=picked.quantity.value,
        excluded=[],
        first_sequence=1,
        last_sequence=0,
        factor=current.parameters.factor,
    )
    series = read(session, current, plain, window).series
    if picked.quantity is Quantity.DIFFERENCES:
        return charts.of_series(quantity.differences(series), picked.quantity), marked
    # Residuals are about a line that is not known yet.
    which = Quantity.WITHOUT_CORRECTIONS if picked.quantity is Quantity.WEAR_RESIDUALS else picked.quantity
    return charts.of_series(series, which), marked
