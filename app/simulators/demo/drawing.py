"""Pictures of the demonstration plant: a worn cutting edge, and a stylus that coolant has dirtied. Drawn here, so they are anybody's."""

from base64 import b64encode
from collections.abc import Callable
from io import BytesIO

from PIL import Image, ImageDraw

WIDTH, HEIGHT = 640, 400
INK, METAL, CARBIDE, MARK = "#1c2733", "#c9d1d9", "#d8b44a", "#c62828"


def chipped_edge() -> str:
    """An insert in its seat with a chip out of the edge, marked; a PNG in base64."""

    def draw(on: ImageDraw.ImageDraw) -> None:
        on.polygon([(0, 250), (250, 140), (330, 400), (0, 400)], METAL, INK, 4)
        on.polygon([(120, 200), (380, 60), (520, 250), (260, 370)], CARBIDE, INK, 5)
        on.ellipse((270, 170, 370, 270), METAL, INK, 4)
        on.polygon([(470, 182), (530, 262), (500, 262), (484, 240), (494, 226), (476, 216)], "white", INK, 3)
        on.ellipse((430, 150, 590, 310), None, MARK, 8)
        on.line([(600, 60), (560, 150)], MARK, 8)
        on.polygon([(545, 145), (577, 158), (549, 182)], MARK)

    return _png(draw)


def dirty_stylus() -> str:
    """A probe above a part, with a drop on its ball, marked; a PNG in base64."""

    def draw(on: ImageDraw.ImageDraw) -> None:
        on.rectangle((250, 0, 390, 110), METAL, INK, 4)
        on.rectangle((308, 110, 332, 250), METAL, INK, 4)
        on.ellipse((285, 235, 355, 305), MARK, INK, 4)
        on.rectangle((60, 320, 580, 396), METAL, INK, 4)
        on.ellipse((338, 258, 396, 316), "#8ec5e8", INK, 3)
        on.ellipse((310, 220, 430, 340), None, MARK, 8)

    return _png(draw)


def _png(draw: Callable[[ImageDraw.ImageDraw], None]) -> str:
    picture = Image.new("RGB", (WIDTH, HEIGHT), "white")
    draw(ImageDraw.Draw(picture))
    target = BytesIO()
    picture.save(target, "PNG", optimize=True)
    return b64encode(target.getvalue()).decode()
