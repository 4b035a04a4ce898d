"""The picture of the touches: what is touched, the tip at every touch, the way it came, and the zero. Pure; drawn as SVG.

Everything is in the units of the picture (720 × 480, Y downwards); the part is drawn to scale, the tip too, but never
smaller than can be seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, hypot, radians, sin
from typing import Any

WIDTH, HEIGHT = 720.0, 480.0
MARGIN = 92.0
SMALLEST_TIP = 9.0
ARROW = 40.0
STEPS = {"+X": (1.0, 0.0), "-X": (-1.0, 0.0), "+Y": (0.0, 1.0), "-Y": (0.0, -1.0)}
INSIDE = {"bore", "pocket"}

# A touch of each kind for the form, before there is any: half sizes of a part of 100 × 64 and a tip of 12.
SCHEMATIC = {
    "pocket": [("-X", -44.0, 8.0), ("+X", 44.0, 8.0), ("-Y", 10.0, -26.0), ("+Y", 10.0, 26.0)],
    "web": [("+X", -56.0, 8.0), ("-X", 56.0, 8.0), ("+Y", 10.0, -38.0), ("-Y", 10.0, 38.0)],
    "bore": [("-X", -34.0, 0.0), ("+X", 34.0, 0.0), ("-Y", 0.0, -34.0), ("+Y", 0.0, 34.0)],
    "boss": [("+X", -46.0, 0.0), ("-X", 46.0, 0.0), ("+Y", 0.0, -46.0), ("-Y", 0.0, 46.0)],
    "corner": [("+X", -6.0, 24.0), ("+Y", 30.0, -6.0), ("+X", -6.0, 52.0), ("+Y", 70.0, -6.0)],
}


@dataclass(frozen=True)
class Tip:
    """The tip at a touch. ways: where its arrow begins and ends, None for one without a direction."""

    number: int
    x: float
    y: float
    radius: float
    arrow: tuple[float, float, float, float] | None
    label: tuple[float, float]


@dataclass(frozen=True)
class Picture:
    """Picture of a probed part.

    outline: of the part, as an SVG path; sides: what of a corner's outline is its own; circle: x, y, radius; zero: where it
    lies, by axis; size: as it is written to the part.
    """

    kind: str
    outline: str
    sides: str
    circle: tuple[float, float, float] | None
    zero: tuple[float | None, float | None]
    tips: tuple[Tip, ...]
    size: str
    inside: bool
    width: float = WIDTH
    height: float = HEIGHT


def schematic(kind: str) -> Picture:
    """Picture of how a kind of part is probed."""
    touches = [{"approach": approach, "x": x, "y": y} for approach, x, y in SCHEMATIC[kind]]
    sizes = {
        "pocket": {"length": 100.0, "width": 64.0},
        "web": {"length": 100.0, "width": 64.0},
        "bore": {"diameter": 80.0},
        "boss": {"diameter": 80.0},
    }.get(kind, {})
    return draw(kind, touches, {"x": 0.0, "y": 0.0} | sizes, 12.0, named=False)


def draw(
    kind: str,
    touches: Sequence[Mapping[str, Any]],
    values: Mapping[str, float | None],
    tip: float,
    *,
    named: bool = True,
) -> Picture:
    """The picture of these touches and what they came to; named: with the sizes written to it."""
    angle = radians(values.get("rotation") or 0.0)
    places = [(touch.get("x"), touch.get("y")) for touch in touches]
    middle = (_centre(values.get("x"), places, 0), _centre(values.get("y"), places, 1))
    tip_places = [
        (middle[0] if x is None else float(x), middle[1] if y is None else float(y)) for x, y in places
    ]  # where the axis was not said, the tip is drawn in the middle
    corners, circle = _part(kind, touches, tip_places, values, middle, angle, tip)
    scale, put = _fitted([*corners, *tip_places, middle] + _box(circle), tip)
    return Picture(
        kind=kind,
        outline=_path(corner_points) + "Z" if (corner_points := [put(corner) for corner in corners]) else "",
        sides=_path(corner_points[:3]) if kind == "corner" else "",
        circle=None if circle is None else (*put(circle[:2]), circle[2] * scale),
        zero=tuple(None if values.get(name) is None else at for name, at in zip("xy", put(middle), strict=True)),  # type: ignore[arg-type]
        tips=tuple(
            _tip(number, put(place), max(SMALLEST_TIP, tip / 2 * scale), touch.get("approach"))
            for number, (touch, place) in enumerate(zip(touches, tip_places, strict=True), 1)
        ),
        size=_size(values) if named else "",
        inside=kind in INSIDE,
    )


def _centre(centre: float | None, places: Sequence[tuple[float | None, float | None]], axis: int) -> float:
    if centre is not None:
        return centre
    coordinates = [float(value) for place in places if (value := place[axis]) is not None]
    return sum(coordinates) / len(coordinates) if coordinates else 0.0


Place = tuple[float, float]


def _part(
    kind: str,
    touches: Sequence[Mapping[str, Any]],
    tip_places: Sequence[Place],
    values: Mapping[str, float | None],
    middle: Place,
    angle: float,
    tip: float,
) -> tuple[list[Place], tuple[float, float, float] | None]:
    """The corners of the part, or its circle."""
    if kind in {"bore", "boss"}:
        return [], (*middle, (values.get("diameter") or 10.0) / 2)
    if kind == "corner":
        arm = 1.3 * max([8 * tip, *(hypot(x - middle[0], y - middle[1]) for x, y in tip_places)])
        into = []
        for axis in (0, 1):
            signs = [STEPS[a][axis] for touch in touches if (a := touch.get("approach")) and STEPS[a][axis]]
            into.append(signs[0] if signs else 1.0)
        ends = [(0.0, into[1] * arm), (0.0, 0.0), (into[0] * arm, 0.0), (into[0] * arm, into[1] * arm)]
        return [_turned(end, angle, middle) for end in ends], None
    long, wide = values.get("length"), values.get("width")
    half = ((long or (wide or 10.0) * 1.6) / 2, (wide or (long or 10.0) * 0.64) / 2)
    ends = [(-half[0], -half[1]), (half[0], -half[1]), (half[0], half[1]), (-half[0], half[1])]
    return [_turned(end, angle, middle) for end in ends], None


def _turned(place: Place, angle: float, middle: Place) -> Place:
    x, y = place
    return middle[0] + cos(angle) * x - sin(angle) * y, middle[1] + sin(angle) * x + cos(angle) * y


def _box(circle: tuple[float, float, float] | None) -> list[Place]:
    if circle is None:
        return []
    x, y, radius = circle
    return [(x - radius, y - radius), (x + radius, y + radius)]


def _fitted(places: Sequence[Place], tip: float) -> tuple[float, Any]:
    """The scale, and what puts a place of the machine into the picture."""
    low = [min(place[axis] for place in places) - tip / 2 for axis in (0, 1)]
    high = [max(place[axis] for place in places) + tip / 2 for axis in (0, 1)]
    scale = min(
        (WIDTH - 2 * MARGIN) / max(high[0] - low[0], 1e-9), (HEIGHT - 2 * MARGIN) / max(high[1] - low[1], 1e-9), 1e6
    )
    left = (WIDTH - scale * (high[0] - low[0])) / 2
    top = (HEIGHT - scale * (high[1] - low[1])) / 2

    def put(place: Place) -> Place:
        return round(left + scale * (place[0] - low[0]), 2), round(top + scale * (high[1] - place[1]), 2)

    return scale, put


def _path(corners: Sequence[Place]) -> str:
    first, *others = corners
    return f"M{first[0]} {first[1]}" + "".join(f"L{x} {y}" for x, y in others)


def _tip(number: int, place: Place, radius: float, approach: str | None) -> Tip:
    x, y = place
    step = STEPS.get(approach or "")
    if step is None:
        return Tip(number, x, y, radius, None, (x, y - radius - 16))
    along, up = step[0], -step[1]
    begin, end = radius + ARROW, radius + 4
    arrow = (x - along * begin, y - up * begin, x - along * end, y - up * end)
    far = radius + ARROW + 16
    return Tip(number, x, y, radius, arrow, (x - along * far, y - up * far))


def _size(values: Mapping[str, float | None]) -> str:
    """The size as it is written to the part; nothing for a corner."""
    if (diameter := values.get("diameter")) is not None:
        return f"⌀{diameter:.3f}"
    known = [f"{value:.3f}" for name in ("length", "width") if (value := values.get(name)) is not None]
    return " \N{MULTIPLICATION SIGN} ".join(known)
