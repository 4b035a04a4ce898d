"""A drawing laid down on a page of the PDF, as vectors."""

import re

from reportlab.lib.colors import Color
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable

from app.charts.marks import Area, Dot, Drawing, Line, Mark, Words
from app.files.documents.files.fonts import BOLD, CHINESE, REGULAR, runs, width_of


def colour(text: str) -> Color:
    """A colour as style sheets write it.

    >>> colour("#ff0000").rgb(), colour("rgba(0,0,255,0.5)").alpha
    ((1.0, 0.0, 0.0), 0.5)
    """
    if text.startswith("#"):
        number = text[1:] if len(text) == 7 else "".join(digit * 2 for digit in text[1:4])
        red, green, blue = (int(number[at : at + 2], 16) / 255 for at in (0, 2, 4))
        return Color(red, green, blue)
    parts = [float(part) for part in re.findall(r"[\d.]+", text)]
    red, green, blue, *alpha = [*(part / 255 for part in parts[:3]), *parts[3:]] if len(parts) >= 3 else [0.0, 0.0, 0.0]
    return Color(red, green, blue, alpha[0] if alpha else 1)


class Chart(Flowable):
    """A drawing, as wide as it is ordered to be."""

    def __init__(self, drawing: Drawing, width: float) -> None:
        super().__init__()
        self.drawing = drawing
        self.scale = width / drawing.width
        self.width, self.height = width, drawing.height * self.scale

    def wrap(self, _available_width: float, _available_height: float) -> tuple[float, float]:
        return self.width, self.height

    def draw(self) -> None:
        canvas: Canvas = self.canv
        canvas.saveState()
        canvas.translate(0, self.height)
        canvas.scale(self.scale, -self.scale)
        canvas.setLineJoin(1)
        for group in self.drawing.groups:
            canvas.saveState()
            if group.clip is not None:
                path = canvas.beginPath()
                path.rect(group.clip.left, group.clip.top, group.clip.width, group.clip.height)
                canvas.clipPath(path, stroke=0, fill=0)
            for mark in group.marks:
                lay_down(canvas, mark)
            canvas.restoreState()
        canvas.restoreState()


def lay_down(canvas: Canvas, mark: Mark) -> None:
    """One mark, in pixels that run downward."""
    match mark:
        case Line():
            canvas.setStrokeColor(colour(mark.colour))
            canvas.setLineWidth(mark.width)
            canvas.setDash(list(mark.dash))
            path = canvas.beginPath()
            path.moveTo(*mark.places[0])
            for place in mark.places[1:]:
                path.lineTo(*place)
            canvas.drawPath(path, stroke=1, fill=0)
        case Area():
            path = canvas.beginPath()
            path.moveTo(*mark.places[0])
            for place in mark.places[1:]:
                path.lineTo(*place)
            path.close()
            canvas.drawPath(path, **_paint(canvas, mark))
        case Dot():
            canvas.circle(*mark.at, mark.radius, **_paint(canvas, mark))
        case Words():
            _write(canvas, mark)


def _paint(canvas: Canvas, mark: Area | Dot) -> dict[str, int]:
    edge = bool(mark.edge and mark.width)
    if mark.fill:
        canvas.setFillColor(colour(mark.fill))
    if edge and mark.edge:
        canvas.setStrokeColor(colour(mark.edge))
        canvas.setLineWidth(mark.width)
        canvas.setDash([])
    return {"stroke": int(edge), "fill": int(bool(mark.fill))}


def _write(canvas: Canvas, mark: Words) -> None:
    wide = width_of(mark.text, mark.size, bold=mark.bold)
    canvas.saveState()
    canvas.translate(*mark.at)
    if mark.turned:
        canvas.rotate(-90)
    canvas.scale(1, -1)
    canvas.setFillColor(colour(mark.colour))
    x = {"start": 0.0, "middle": -wide / 2, "end": -wide}[mark.anchor]
    for piece, chinese in runs(mark.text):
        font = CHINESE if chinese else BOLD if mark.bold else REGULAR
        canvas.setFont(font, mark.size)
        canvas.drawString(x, 0, piece)
        x += canvas.stringWidth(piece, font, mark.size)
    canvas.restoreState()
