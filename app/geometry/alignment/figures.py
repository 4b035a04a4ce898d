"""Pictures of alignments: pure, values in, charts out. mm in.

The part is seen from above one of its corners, from where the touched faces are seen: grey as it should lie, in colour as it
does, displacements enlarged so that they can be seen. Beside each touch stand its number and its deviation in µm.
"""

from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import Any, NamedTuple

import numpy as np

from app.charts import Across, Axis, Chart, Dots, Labels, Mark, Note, Panel, Pen, Role, Room, Series
from app.core.geometry.points import Floats
from app.language.formatting import signed
from app.language.i18n import _

SEEN = 0.09  # of the part's size: so large the greatest displacement is drawn
FACING = 0.7  # cosine: so far a face looks along an axis
MOST = 10_000  # times: what has to be enlarged more is nothing
FAINTEST = 1e-7  # mm: what has moved by less has not moved
BOX = ((0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6), (3, 7))


class DrawnPoint(NamedTuple):
    """Point in the picture: place, normal of the face, deviation along it, and True if it does not fit."""

    place: Sequence[float]
    normal: Sequence[float]
    off: float
    misfit: bool = False


def part_figure(motion: Floats, touches: Sequence[DrawnPoint]) -> Chart:
    """The part as it should lie and as it lies, with its touches."""
    places = np.array([touch.place for touch in touches], dtype=np.float64)
    normals = np.array([touch.normal for touch in touches], dtype=np.float64)
    view, depth = _view(normals, places)
    corners = _corners(places, normals)
    size = float(np.ptp(corners, axis=0).max())
    moved = (np.column_stack([corners, np.ones(8)]) @ motion.T)[:, :3] - corners
    largest = max(float(np.linalg.norm(moved, axis=1).max()), *(abs(touch.off) for touch in touches), FAINTEST)
    times = enlargement(SEEN * size / largest)
    return _framed(
        [
            *_box(corners, view, depth, "faint", _("Nominal position")),
            *_box(
                corners + times * moved,
                view,
                depth,
                "correction",
                _("Measured position, {times} ×").format(times=times),
            ),
            *_axes(corners, view, size),
            *_touches(touches, places, normals, times, view),
        ]
    )


def plane_figure(
    motion: Floats, nominal: Sequence[Sequence[float]], measured_points: Sequence[Sequence[float]]
) -> Chart:
    """Two points of a side, or two holes, from above; displacements enlarged."""
    places, measured = np.array(nominal, dtype=np.float64), np.array(measured_points, dtype=np.float64)
    size = max(float(np.linalg.norm(np.ptp(places, axis=0))), 1e-9)
    off = measured - places
    times = enlargement(2 * SEEN * size / max(float(np.linalg.norm(off, axis=1).max()), FAINTEST))
    flat = np.column_stack([places, np.zeros(len(places)), np.ones(len(places))])
    fitted = places + times * ((flat @ motion.T)[:, :2] - places)
    enlarged = places + times * off
    words = [
        Note(
            f"<b>{at + 1}</b> {signed(off[at][0] * 1000, 1)} {signed(off[at][1] * 1000, 1)} µm",
            *_at(place),
            shift=(0, 22),
            size=14,
            colour="ink",
        )
        for at, place in enumerate(enlarged)
    ]
    cross = Dots("cross-thin-open", 16, "attention", "attention", 2.5)
    return _framed(
        [
            Series(*_xy(places), Pen("faint", 2), Dots("circle-open", 16, "faint"), name=_("Nominal position")),
            Series(*_xy(fitted), Pen("correction", 2), name=_("Measured position, {times} ×").format(times=times)),
            Series(*_xy(enlarged), dots=cross, name=_("Found")),
            *words,
        ]
    )


def enlargement(factor: float) -> int:
    """The next of 1, 2, 5 times a power of ten below what would fill the picture; from 1 to `MOST`.

    >>> enlargement(734.0), enlargement(0.3), enlargement(20.0)
    (500, 1, 20)
    """
    if factor < 2:
        return 1
    factor = min(factor, MOST)
    power = 10 ** floor(log10(factor * (1 + 1e-9)))
    return int(next(step * power for step in (5, 2, 1) if step * power <= factor * (1 + 1e-9)))


def _ends(places: Floats, normals: Floats) -> Floats:
    """Ends of the part that are probed, by axis: -1, 1, both (2) or none (0).

    Found by where the touches lie, so that it does not matter whether a normal points out of the part or into it.
    """
    low, high = places.min(axis=0), places.max(axis=0)
    ends = np.zeros(3)
    for axis in range(3):
        facing = np.abs(normals[:, axis]) > FACING
        if not facing.any():
            continue
        if high[axis] - low[axis] < FAINTEST:  # all at one height: the normal tells
            ends[axis] = np.sign(normals[facing, axis].sum()) or 1.0
            continue
        beyond = places[facing, axis] > (low[axis] + high[axis]) / 2
        ends[axis] = 2.0 if beyond.any() and not beyond.all() else 1.0 if beyond.all() else -1.0
    return ends


def _view(normals: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Two rows, right and up of the picture, for one who sees the touched faces; and the way towards that one."""
    ends = _ends(places, normals)
    usual = np.array([-1.0, -1.0, 1.0])
    towards = np.where(np.abs(ends) == 1, ends, usual) * np.array([1.0, 1.4, 1.0])
    towards /= np.linalg.norm(towards)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right)]), towards


def _corners(places: Floats, normals: Floats) -> Floats:
    """Corners of the box that holds the points: it ends where it was probed, elsewhere a little beyond."""
    low, high = places.min(axis=0), places.max(axis=0)
    room = 0.15 * float(np.ptp(places, axis=0).max() or 1.0)
    for axis, end in enumerate(_ends(places, normals)):
        if end in (0, 1):
            low[axis] -= room
        if end in (0, -1):
            high[axis] += room
    return np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])


def _box(corners: Floats, view: Floats, towards: Floats, colour: Role, name: str) -> list[Series]:
    """The edges of a box: those behind it dotted."""
    flat = corners @ view.T
    hidden = int((corners @ towards).argmin())
    lines = []
    for behind, pen in ((True, Pen(colour, 1.2, "dot")), (False, Pen(colour, 2.5))):
        x: list[float | None] = []
        y: list[float | None] = []
        for a, b in BOX:
            if (hidden in (a, b)) is behind:
                x += [float(flat[a][0]), float(flat[b][0]), None]
                y += [float(flat[a][1]), float(flat[b][1]), None]
        lines.append(Series(x, y, pen, name="" if behind else name))
    return lines


def _axes(corners: Floats, view: Floats, size: float) -> list[Series]:
    """X, Y and Z from below the part, so that one knows from where it is seen."""
    flat = corners @ view.T
    start = np.array([flat[:, 0].min() - 0.12 * size, flat[:, 1].min() - 0.02 * size])
    ends = [start + 0.16 * size * view[:, axis] for axis in range(3)]
    beside = [
        "top center" if axis == 2 else "middle right" if end[0] > start[0] else "middle left"
        for axis, end in enumerate(ends)
    ]
    return [
        Series(*_xy(np.array([start, end])), Pen("quiet"), labels=Labels(["", "XYZ"[axis]], beside[axis], size=13))
        for axis, end in enumerate(ends)
    ]


def _touches(
    touches: Sequence[DrawnPoint], places: Floats, normals: Floats, times: int, view: Floats
) -> list[Series | Note]:
    """Arrows from where a touch should have been to where it was, their marks, and the words beside them."""
    ends = places + times * normals * np.array([[touch.off] for touch in touches])
    begin, end = places @ view.T, ends @ view.T
    drawn: list[Series | Note] = [
        Series(*_xy(np.array([begin[at], end[at]])), Pen("stop" if touch.misfit else "ink", 2))
        for at, touch in enumerate(touches)
    ]
    for misfits, name, dots in (
        (False, _("Probed points"), Dots("circle", 9, "ink")),
        (True, _("Does not fit"), Dots("x", 12, "stop")),
    ):
        chosen = [at for at, touch in enumerate(touches) if touch.misfit is misfits]
        if chosen:
            said = [
                _("point {n}: {off} µm along its face's normal").format(n=at + 1, off=signed(touches[at].off * 1000, 1))
                for at in chosen
            ]
            drawn.append(Series(*_xy(end[chosen]), dots=dots, name=name, hover=said))
    outward = _outward(places, normals) @ view.T
    for at, touch in enumerate(touches):
        way = outward[at] / max(float(np.linalg.norm(outward[at])), 1e-9)
        across: Across = "center"
        shift = (0.0, 18.0 if way[1] >= 0 else -18.0)
        if abs(way[0]) > 0.5:
            across, shift = ("left", (9.0, float(4 * way[1]))) if way[0] > 0 else ("right", (-9.0, float(4 * way[1])))
        text = f"<b>{at + 1}</b> {signed(touch.off * 1000, 1)}"
        drawn.append(Note(text, *_at(end[at]), across, shift=shift, size=14, colour="ink", ground=True))
    return drawn


def _outward(places: Floats, normals: Floats) -> Floats:
    """Axis of each point's face, away from the middle of the part: where words have room."""
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    ways = np.zeros_like(normals)
    for at, axis in enumerate(np.abs(normals).argmax(axis=1)):
        off = places[at, axis] - middle[axis]
        ways[at, axis] = np.sign(off if abs(off) > FAINTEST else normals[at, axis]) or 1.0
    return ways


def _xy(points: Floats) -> tuple[list[float], list[float]]:
    return [float(value) for value in points[:, 0]], [float(value) for value in points[:, 1]]


def _at(place: Floats) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _framed(marks: Sequence[Mark]) -> Chart:
    hidden = Axis(hidden=True, fixed=True)
    return Chart([Panel(marks, hidden, equal=True)], hidden, Room(24, 24, 24, 40), drag="nothing")


def touches_of(inputs: Mapping[str, Any], result: Mapping[str, Any]) -> list[DrawnPoint]:
    """Points to draw for an alignment by points."""
    misfits = {at for group in result.get("misfits", []) for at in group}
    return [
        DrawnPoint(
            touch["nominal"], np.array(touch["normal"]) / np.linalg.norm(touch["normal"]), off, number in misfits
        )
        for number, (touch, off) in enumerate(zip(inputs["touches"], result["deviations"], strict=True), 1)
    ]
