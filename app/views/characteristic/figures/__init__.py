"""Pictures of a characteristic. Pure: values in, charts (or small SVG pictures) out; lengths in mm.

zone_chart(…)        the face of the product: readings in their zones, average, corrections, tool changes, alarms
histogram_figure(…)  how the deviations are spread, beside the limits
run_figure(…)        corrected sizes over time
result_figure(…)     what the measuring variant yields beside the value
touches_picture(…)   where the part was touched
"""

from app.views.characteristic.figures.blocks import Block
from app.views.characteristic.figures.by_hand import HandPoint
from app.views.characteristic.figures.distribution import (
    RunPoint,
    counting_edges,
    histogram_centres,
    histogram_counts,
    histogram_edges,
    histogram_figure,
    run_figure,
)
from app.views.characteristic.figures.results import ResultPoint, ResultRange, result_figure
from app.views.characteristic.figures.scale import ScaleName, TrueScale, ZoneScale, bands
from app.views.characteristic.figures.sizes import SizeAxis
from app.views.characteristic.figures.touches import angle_of, residuals_of, touches_picture
from app.views.characteristic.figures.zones import Point, Step, zone_chart

__all__ = [
    "Block",
    "HandPoint",
    "Point",
    "ResultPoint",
    "ResultRange",
    "RunPoint",
    "ScaleName",
    "SizeAxis",
    "Step",
    "TrueScale",
    "ZoneScale",
    "angle_of",
    "bands",
    "counting_edges",
    "histogram_centres",
    "histogram_counts",
    "histogram_edges",
    "histogram_figure",
    "residuals_of",
    "result_figure",
    "run_figure",
    "touches_picture",
    "zone_chart",
]
