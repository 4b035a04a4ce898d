"""Charts on paper: a figure of the pages (a Plotly dict) as lines, areas and letters, and these as SVG. Pure."""

from app.charts.marks import Area, Box, Dot, Drawing, Group, Line, Mark, Words
from app.charts.svg import svg
from app.files.documents.drawing.plot import drawing_of

__all__ = ["Area", "Box", "Dot", "Drawing", "Group", "Line", "Mark", "Words", "drawing_of", "svg"]
