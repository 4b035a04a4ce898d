"""Pictures of a characteristic. Pure: values in, Plotly figures as plain dicts (or small SVG pictures) out; lengths in mm.

zone_chart(…)        the face of the product: readings in their zones, average, corrections, tool changes, alarms
histogram_figure(…)  how the deviations are spread, beside the limits
run_figure(…)        measured sizes over time
band_picture(…)      the last deviation in its zone, small enough for a list
sparkline(…)         the trend of the last deviations, in a line's height
"""

from app.characteristics.figures.blocks import Block
from app.characteristics.figures.distribution import (
    RunPoint,
    histogram_counts,
    histogram_edges,
    histogram_figure,
    run_figure,
)
from app.characteristics.figures.glance import band_picture, sparkline
from app.characteristics.figures.scale import ScaleName, TrueScale, ZoneScale, bands
from app.characteristics.figures.zones import Mark, Point, Step, zone_chart

__all__ = [
    "Block",
    "Mark",
    "Point",
    "RunPoint",
    "ScaleName",
    "Step",
    "TrueScale",
    "ZoneScale",
    "band_picture",
    "bands",
    "histogram_counts",
    "histogram_edges",
    "histogram_figure",
    "run_figure",
    "sparkline",
    "zone_chart",
]
