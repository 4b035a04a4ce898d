"""Pictures of a characteristic. Pure: values in, Plotly figures as plain dicts (or small SVG pictures) out; lengths in mm.

zone_chart(…)        the face of the product: readings in their zones, average, corrections, tool changes, alarms
histogram_figure(…)  how the deviations are spread, beside the limits
run_figure(…)        measured sizes over time
result_figure(…)     what the measuring variant yields beside the value
touches_picture(…)   where the part was touched
band_picture(…)      the last deviation in its zone, small enough for a list
sparkline(…)         the trend of the last deviations, in a line's height
"""

from app.characteristics.figures.blocks import Block
from app.characteristics.figures.by_hand import HandPoint
from app.characteristics.figures.distribution import (
    RunPoint,
    histogram_counts,
    histogram_edges,
    histogram_figure,
    run_figure,
)
from app.characteristics.figures.glance import band_picture, sparkline
from app.characteristics.figures.results import ResultPoint, ResultRange, result_figure
from app.characteristics.figures.scale import ScaleName, TrueScale, ZoneScale, bands
from app.characteristics.figures.touches import angle_of, residuals_of, touches_picture
from app.characteristics.figures.zones import Mark, Point, Step, zone_chart

__all__ = [
    "Block",
    "HandPoint",
    "Mark",
    "Point",
    "ResultPoint",
    "ResultRange",
    "RunPoint",
    "ScaleName",
    "Step",
    "TrueScale",
    "ZoneScale",
    "angle_of",
    "band_picture",
    "bands",
    "histogram_counts",
    "histogram_edges",
    "histogram_figure",
    "residuals_of",
    "result_figure",
    "run_figure",
    "sparkline",
    "touches_picture",
    "zone_chart",
]
