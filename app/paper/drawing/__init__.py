"""Charts on paper: a figure of the pages (a Plotly dict) as lines, areas and letters, and these as SVG. Pure."""

from app.paper.drawing.marks import Area, Box, Dot, Drawing, Group, Line, Mark, Words
from app.paper.drawing.plot import drawing_of
from app.paper.drawing.svg import svg

__all__ = ["Area", "Box", "Dot", "Drawing", "Group", "Line", "Mark", "Words", "drawing_of", "svg"]
