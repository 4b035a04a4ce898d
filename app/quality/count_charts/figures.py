"""Charts of counts. Pure: values in, a figure out."""

from typing import Any

from app.charts import Axis, Chart, Dots, Panel, Pen, Room, Series
from app.core.spc.counts import Counts
from app.language.i18n import _
from app.quality.count_charts import wording


def counts_figure(found: Counts) -> Chart:
    """The points, joined, with centre and limits; those beyond a limit are orange triangles."""
    x: list[Any] = list(range(1, len(found.points) + 1))
    outside = found.outside
    marks = [
        *(
            Series(x, values.tolist(), pen, meta=name)
            for name, values, pen in (
                ("centre", found.centre, Pen("quiet", steps="hvh")),
                ("lower", found.lower, Pen("ink", dash="dash", steps="hvh")),
                ("upper", found.upper, Pen("ink", dash="dash", steps="hvh")),
            )
        ),
        Series(x, found.points.tolist(), Pen("faint", 1.2), Dots(size=6), meta="points", hover="%{x}: %{y:.4~g}"),
    ]
    if outside.any():
        at = outside.nonzero()[0]
        symbols = ["triangle-up" if found.points[i] > found.upper[i] else "triangle-down" for i in at]
        marks.append(
            Series(
                [int(i) + 1 for i in at],
                found.points[at].tolist(),
                dots=Dots(symbols, 12, "attention", "surface", 1),
                meta="outside",
                hover="%{x}: %{y:.4~g}",
            )
        )
    top = max(float(found.points.max()), float(found.upper.max()))
    height = Axis(wording.name(found.chart), reach=(0.0, top * 1.06), ticks=6)
    sample = Axis(_("Sample"), reach=(0.5, len(found.points) + 0.5), ticks=9)
    return Chart([Panel(marks, height)], sample, Room(76, 28, 44, 44))
