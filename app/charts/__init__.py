"""Charts: described once, drawn by two small renderers.

description  what a chart shows: panels, marks, axes; colours by what they are for
palette      which colour that is, in the light and in the dark
strata       looks that tell series and strata apart
plotly       in the browser: the dict of plotly.js
paper        in reports: lines, areas and words (scales, marks), for PDF and SVG (svg)
"""

from app.charts.description import (
    Across,
    Axis,
    Bars,
    Chart,
    Dots,
    Ground,
    Labels,
    Mark,
    Note,
    Panel,
    Pen,
    Room,
    Rule,
    Series,
    Shades,
    Share,
    Spread,
    band,
    bold,
    empty,
    nothing,
    reading_axis,
    time_axis,
)
from app.charts.palette import BANDS, PALETTES, Colour, Faded, Role, ThemeName
from app.charts.paper import to_drawing
from app.charts.plotly import to_plotly
from app.charts.strata import distinguished, look
from app.charts.svg import svg

__all__ = [
    "BANDS",
    "PALETTES",
    "Across",
    "Axis",
    "Bars",
    "Chart",
    "Colour",
    "Dots",
    "Faded",
    "Ground",
    "Labels",
    "Mark",
    "Note",
    "Panel",
    "Pen",
    "Role",
    "Room",
    "Rule",
    "Series",
    "Shades",
    "Share",
    "Spread",
    "ThemeName",
    "band",
    "bold",
    "distinguished",
    "empty",
    "look",
    "nothing",
    "reading_axis",
    "svg",
    "time_axis",
    "to_drawing",
    "to_plotly",
]
