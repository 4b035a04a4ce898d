"""Marks of a drawing. Pixels; x to the right, y downward. Colours as style sheets write them."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

Place = tuple[float, float]
Anchor = Literal["start", "middle", "end"]


class Line(NamedTuple):
    """A line through places."""

    places: tuple[Place, ...]
    colour: str
    width: float = 1.0
    dash: tuple[float, ...] = ()


class Area(NamedTuple):
    """A filled outline; `edge` is the colour of its border."""

    places: tuple[Place, ...]
    fill: str | None
    edge: str | None = None
    width: float = 1.0


class Dot(NamedTuple):
    """A round dot."""

    at: Place
    radius: float
    fill: str | None
    edge: str | None = None
    width: float = 1.0


class Words(NamedTuple):
    """One line of letters; `at` is on its base line. `turned`: read from below to above."""

    at: Place
    text: str
    size: float
    colour: str
    anchor: Anchor = "start"
    bold: bool = False
    turned: bool = False


Mark = Line | Area | Dot | Words


class Box(NamedTuple):
    """A rectangle, its left, top, right and bottom edge."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.bottom - self.top


@dataclass
class Group:
    """Marks, in the order in which they are laid down; nothing of them is seen outside `clip`."""

    clip: Box | None = None
    marks: list[Mark] = field(default_factory=list)


@dataclass
class Drawing:
    """Groups from the back to the front."""

    width: float
    height: float
    groups: list[Group] = field(default_factory=list)


def symbol(name: str, at: Place, size: float, colour: str, edge: tuple[str | None, float]) -> list[Mark]:
    """A marker of the pages' charts: the shape tells the zone; one that is `-open` is hollow.

    >>> [type(mark).__name__ for mark in symbol("diamond", (0, 0), 8, "#000000", (None, 0))]
    ['Area']
    """
    (x, y), r = at, size / 2
    hollow = "-open" in name
    base = name.partition("-open")[0].removesuffix("-thin")
    fill = None if hollow else colour
    border, width = (colour, max(edge[1], 1.0)) if hollow else edge
    if base in {"line-ew", "line-ns"}:
        ends = ((x - r, y), (x + r, y)) if base == "line-ew" else ((x, y - r), (x, y + r))
        return [Line(ends, colour, 1.5)]
    if base in {"x", "cross"} or "-thin" in name:
        reach = r * 0.75
        return [
            Line(((x - reach, y - reach), (x + reach, y + reach)), colour, max(size / 5, 1.2)),
            Line(((x - reach, y + reach), (x + reach, y - reach)), colour, max(size / 5, 1.2)),
        ]
    outline = OUTLINES.get(base)
    if outline is None:
        return [Dot(at, r, fill, border, width)]
    return [Area(tuple((x + dx * r, y + dy * r) for dx, dy in outline), fill, border, width)]


# In units of half the marker's size.
OUTLINES: dict[str, tuple[Place, ...]] = {
    "square": ((-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)),
    "diamond": ((0, -1.25), (1.25, 0), (0, 1.25), (-1.25, 0)),
    "triangle-up": ((0, -1.1), (1.1, 0.9), (-1.1, 0.9)),
    "triangle-down": ((0, 1.1), (1.1, -0.9), (-1.1, -0.9)),
    "hexagon2": ((-0.55, -0.95), (0.55, -0.95), (1.1, 0), (0.55, 0.95), (-0.55, 0.95), (-1.1, 0)),
    "star-triangle-up": ((0, -1.3), (0.45, 0.1), (1.2, 0.9), (0, 0.55), (-1.2, 0.9), (-0.45, 0.1)),
}
