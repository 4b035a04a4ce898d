"""Readings by hand on the zone chart: a mark of their own beside the machine's reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.charts import Dots, Series, bold
from app.language.formatting import um
from app.language.i18n import _
from app.views.characteristic.figures.scale import Scale


@dataclass(frozen=True)
class HandPoint:
    """One measurement by hand; deviation in mm. `good`: the person's verdict, None where none was given."""

    sequence: int
    deviation: float
    good: bool | None
    by: str
    link: str | None = None


def hand_marks(points: Sequence[HandPoint], ruler: Scale) -> list[Series]:
    """A star for each, hollow where the verdict is scrap; words in the legend and when pointed at."""
    if not points:
        return []
    verdicts = {True: _("part is good"), False: _("part is scrap"), None: _("no verdict")}
    stars = ["star-open" if point.good is False else "star" for point in points]
    return [
        Series(
            [point.sequence for point in points],
            [ruler.position(point.deviation) for point in points],
            dots=Dots(stars, 15, "waiting", edge="waiting"),
            meta="by-hand",
            name=_("Measured by hand"),
            hover=[
                bold(_("Reading {n}, by hand").format(n=point.sequence))
                + f"<br>{um(point.deviation)} · {verdicts[point.good]}<br>{point.by}"
                for point in points
            ],
            links=[point.link for point in points],
        )
    ]
