"""Pictures of alignments: pure, values in, Plotly figures as dicts out. mm in.

The part is seen from above one of its corners, from where the touched faces are seen: grey as it should lie, in colour as it
does, displacements enlarged so that they can be seen. Beside each touch stand its number and its deviation in µm.
"""

from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import Any, NamedTuple

import numpy as np

from app.core.geometry.points import Floats
from app.language.i18n import _
from app.language.numbers import signed
from app.web.theme import Palette, ThemeName, layout, legend, palette

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


def part_figure(motion: Floats, touches: Sequence[DrawnPoint], *, theme: ThemeName = "light") -> dict[str, Any]:
    """The part as it should lie and as it lies, with its touches."""
    colours = palette(theme)
    places = np.array([touch.place for touch in touches], dtype=np.float64)
    normals = np.array([touch.normal for touch in touches], dtype=np.float64)
    view, depth = _view(normals, places)
    corners = _corners(places, normals)
    size = float(np.ptp(corners, axis=0).max())
    moved = (np.column_stack([corners, np.ones(8)]) @ motion.T)[:, :3] - corners
    largest = max(float(np.linalg.norm(moved, axis=1).max()), *(abs(touch.off) for touch in touches), FAINTEST)
    times = enlargement(SEEN * size / largest)
    data = _box(corners, view, depth, colours.faint, _("Nominal position"))
    data += _box(
        corners + times * moved, view, depth, colours.correction, _("Measured position, {times} ×").format(times=times)
    )
    data += _axes(corners, view, size, colours)
    arrows, marks, words = _touches(touches, places, normals, times, view, colours)
    return {"data": [*data, *arrows, *marks], "layout": _framed(theme, words)}


def plane_figure(
    motion: Floats,
    nominal: Sequence[Sequence[float]],
    measured_points: Sequence[Sequence[float]],
    theme: ThemeName = "light",
) -> dict[str, Any]:
    """Two points of a side, or two holes, from above; displacements enlarged."""
    colours = palette(theme)
    places, measured = np.array(nominal, dtype=np.float64), np.array(measured_points, dtype=np.float64)
    size = max(float(np.linalg.norm(np.ptp(places, axis=0))), 1e-9)
    off = measured - places
    times = enlargement(2 * SEEN * size / max(float(np.linalg.norm(off, axis=1).max()), FAINTEST))
    flat = np.column_stack([places, np.zeros(len(places)), np.ones(len(places))])
    fitted = places + times * ((flat @ motion.T)[:, :2] - places)
    enlarged = places + times * off
    data = [
        _line(
            places,
            colours.faint,
            _("Nominal position"),
            mode="lines+markers",
            marker={"symbol": "circle-open", "size": 16},
        ),
        _line(fitted, colours.correction, _("Measured position, {times} ×").format(times=times)),
        _line(
            enlarged,
            colours.attention,
            _("Found"),
            mode="markers",
            marker={"symbol": "cross-thin-open", "size": 16, "line": {"width": 2.5}},
        ),
    ]
    words = [
        _word(
            enlarged[at],
            f"<b>{at + 1}</b> {signed(off[at][0] * 1000, 1)} {signed(off[at][1] * 1000, 1)} µm",
            colours,
            yshift=22,
            bgcolor=None,
        )
        for at in range(len(places))
    ]
    return {"data": data, "layout": _framed(theme, words)}


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

    Told by where the touches lie, so that it does not matter whether a normal points out of the part or into it.
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


def _box(corners: Floats, view: Floats, towards: Floats, colour: str, name: str) -> list[dict[str, Any]]:
    """The edges of a box: those behind it dotted."""
    flat = corners @ view.T
    hidden = int((corners @ towards).argmin())
    lines = []
    for behind in (True, False):
        x: list[float | None] = []
        y: list[float | None] = []
        for a, b in BOX:
            if (hidden in (a, b)) is behind:
                x += [float(flat[a][0]), float(flat[b][0]), None]
                y += [float(flat[a][1]), float(flat[b][1]), None]
        style = {"color": colour, "width": 1.2 if behind else 2.5, "dash": "dot" if behind else "solid"}
        lines.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": x,
                "y": y,
                "line": style,
                "name": name,
                "showlegend": not behind,
                "hoverinfo": "skip",
            }
        )
    return lines


def _axes(corners: Floats, view: Floats, size: float, colours: Palette) -> list[dict[str, Any]]:
    """X, Y and Z from below the part, so that one knows from where it is seen."""
    flat = corners @ view.T
    start = np.array([flat[:, 0].min() - 0.12 * size, flat[:, 1].min() - 0.02 * size])
    traces = []
    for axis, name in enumerate("XYZ"):
        end = start + 0.16 * size * view[:, axis]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+text",
                "x": [float(start[0]), float(end[0])],
                "y": [float(start[1]), float(end[1])],
                "text": ["", name],
                "textposition": "top center" if axis == 2 else "middle right" if end[0] > start[0] else "middle left",
                "textfont": {"size": 13, "color": colours.quiet},
                "line": {"color": colours.quiet, "width": 1.5},
                "showlegend": False,
                "hoverinfo": "skip",
                "cliponaxis": False,
            }
        )
    return traces


def _touches(
    touches: Sequence[DrawnPoint], places: Floats, normals: Floats, times: int, view: Floats, colours: Palette
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], list[dict[str, Any]]]:
    """Arrows from where a touch should have been to where it was, their marks, and the words beside them."""
    ends = places + times * normals * np.array([[touch.off] for touch in touches])
    begin, end = places @ view.T, ends @ view.T
    arrows = [
        _line(np.array([begin[at], end[at]]), colours.stop if touch.misfit else colours.ink, None)
        for at, touch in enumerate(touches)
    ]
    marks, words = [], []
    for misfits, name, symbol in ((False, _("Probed points"), "circle"), (True, _("Does not fit"), "x")):
        chosen = [at for at, touch in enumerate(touches) if touch.misfit is misfits]
        if chosen:
            colour = colours.stop if misfits else colours.ink
            marks.append(
                _line(
                    end[chosen],
                    colour,
                    name,
                    mode="markers",
                    marker={"symbol": symbol, "size": 12 if misfits else 9, "color": colour},
                    hoverinfo="text",
                    hovertext=[
                        _("point {n}: {off} µm along its face's normal").format(
                            n=at + 1, off=signed(touches[at].off * 1000, 1)
                        )
                        for at in chosen
                    ],
                )
            )
    outward = _outward(places, normals) @ view.T
    for at, touch in enumerate(touches):
        way = outward[at] / max(float(np.linalg.norm(outward[at])), 1e-9)
        beside = abs(way[0]) > 0.5
        anchor = {"xanchor": "left" if way[0] > 0 else "right", "xshift": 9 if way[0] > 0 else -9} if beside else {}
        rise = float(4 * way[1]) if beside else (18.0 if way[1] >= 0 else -18.0)
        words.append(_word(end[at], f"<b>{at + 1}</b> {signed(touch.off * 1000, 1)}", colours, yshift=rise, **anchor))
    return arrows, marks, words


def _outward(places: Floats, normals: Floats) -> Floats:
    """Axis of each point's face, away from the middle of the part: where words have room."""
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    ways = np.zeros_like(normals)
    for at, axis in enumerate(np.abs(normals).argmax(axis=1)):
        off = places[at, axis] - middle[axis]
        ways[at, axis] = np.sign(off if abs(off) > FAINTEST else normals[at, axis]) or 1.0
    return ways


def _line(points: Floats, colour: str, name: str | None, **more: Any) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": [float(value) for value in points[:, 0]],
        "y": [float(value) for value in points[:, 1]],
        "line": {"color": colour, "width": 2},
        "name": name,
        "showlegend": name is not None,
        "hoverinfo": "skip",
        "cliponaxis": False,
    } | ({"marker": {"color": colour} | more.pop("marker", {})} | more)


def _word(place: Floats, text: str, colours: Palette, **more: Any) -> dict[str, Any]:
    return {
        "x": float(place[0]),
        "y": float(place[1]),
        "text": text,
        "showarrow": False,
        "font": {"size": 14, "color": colours.ink},
        "bgcolor": colours.surface,
        "borderpad": 1,
    } | more


def _framed(theme: ThemeName, words: list[dict[str, Any]]) -> dict[str, Any]:
    hidden = {"visible": False, "fixedrange": True}
    return layout(
        theme,
        margin={"l": 24, "r": 24, "t": 40, "b": 24},
        showlegend=True,
        legend=legend(theme),
        xaxis=hidden,
        yaxis=hidden | {"scaleanchor": "x", "scaleratio": 1},
        annotations=words,
        dragmode=False,
    )


def touches_of(inputs: Mapping[str, Any], result: Mapping[str, Any]) -> list[DrawnPoint]:
    """Points to draw for an alignment by points."""
    misfits = {at for group in result.get("misfits", []) for at in group}
    return [
        DrawnPoint(
            touch["nominal"], np.array(touch["normal"]) / np.linalg.norm(touch["normal"]), off, number in misfits
        )
        for number, (touch, off) in enumerate(zip(inputs["touches"], result["deviations"], strict=True), 1)
    ]
