"""The zone chart: what came in, how it was judged, what was done about it.

From top to bottom: a lane of events (alarms, tool changes), the bands with the readings and the running average, a lane with
the sum of the corrections. At the left the sizes at the limits, at the right each limit with its name and value and, in the
band that begins there, what happens in it – as in the diagram of the cycles' manual.

Nothing is only in a hover text: the list below the chart says everything too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from app.core.decision.limits import HasLimits, Limits
from app.language.i18n import _
from app.language.numbers import um
from app.language.times import plant_zone, written
from app.views.characteristic.figures.blocks import Block, envelope
from app.views.characteristic.figures.by_hand import HandPoint, hand_marks
from app.views.characteristic.figures.labels import band_shapes, limit_labels, limit_lines, size_ticks
from app.views.characteristic.figures.lanes import Mark, Step, event_lane, offset_lane
from app.views.characteristic.figures.scale import Scale, ScaleName, TrueScale, ZoneScale
from app.views.characteristic.figures.sizes import SizeAxis, size_lines
from app.web.theme import ZONE_SYMBOLS, Palette, ThemeName, layout, legend, palette, zone_colour, zone_name

__all__ = ["Block", "Mark", "Point", "Step", "zone_chart"]

WIDE = 1500  # pixels from which on there is room for a larger font
NARROW = 640  # pixels below which there is room for the name and value of a limit only
WORD = 70  # pixels that a value in the chart takes
EVENTS, READINGS, OFFSETS = [0.915, 1.0], [0.18, 0.91], [0.0, 0.14]  # of the height, from the bottom


@dataclass(frozen=True)
class Point:
    """One reading; lengths in mm. `average` is M after it, None where there is no memory. `link` opens it.

    size: corrected by the empirical value of then; measured: as the machine sent it.
    """

    sequence: int
    deviation: float
    zone: str
    average: float | None = None
    at: datetime | None = None
    excluded: bool = False
    link: str | None = None
    size: float | None = None
    measured: float | None = None


def zone_chart(
    points: Sequence[Point],
    limits: HasLimits,
    *,
    blocks: Sequence[Block] = (),
    steps: Sequence[Step] = (),
    marks: Sequence[Mark] = (),
    hands: Sequence[HandPoint] = (),
    scale: ScaleName = "zones",
    theme: ThemeName = "light",
    sizes: SizeAxis | None = None,
    total_before: float = 0.0,
    width: int = 1240,
    ringed: int | Literal["newest"] | None = "newest",
) -> dict[str, Any]:
    """The figure.

    points: readings by ascending sequence. blocks: older ones, thinned; every block's extremes are drawn.
    steps: corrections by ascending sequence of the reading that caused them; total_before: their sum before the first (mm).
    marks: alarms and tool changes. hands: what was measured by hand. sizes: for the sizes at the left; without them deviations stand there.
    width: of the chart in pixels, about: decides which words have room.
    ringed: the number of the reading with a ring about it; `newest` is the last one.
    """
    colours = palette(theme)
    ruler: Scale
    if scale == "zones":
        ruler = ZoneScale.of(limits)
    else:
        ends = [end for block in blocks for end in (block.minimum, block.maximum)]
        ruler = TrueScale.of(limits, [*(point.deviation for point in points), *ends])
    # Room at the right for the longest words in the font of any system (Liberation Sans and 5 % more).
    font_size, left, right = (14, 104, 342) if width >= WIDE else (12, 92, 292) if width >= NARROW else (12, 64, 104)
    first = min([block.first for block in blocks] + [point.sequence for point in points], default=1)
    last = max([block.last for block in blocks] + [point.sequence for point in points], default=first + 9)
    room = max((last - first) * 0.02, 0.6)
    span = (first - room, last + max(room * 1.5, 1.2))  # what came after the last reading stands at the next number

    traces = [
        *envelope(blocks, ruler, Limits.of(limits), colours),
        *_average(blocks, points, ruler, colours),
        *_readings(points, ruler, colours),
        *_ring(points, ringed, ruler, colours),
        *hand_marks(hands, ruler, colours),
    ]
    pixels = max(width - left - right, 200)
    events, event_notes, event_lines = event_lane(marks, span, pixels, colours)
    brief = width < NARROW
    offsets, offset_notes = offset_lane(steps, marks, span, total_before, colours, brief=brief)
    notes = [
        *limit_labels(limits, ruler, colours, font_size, brief=brief),
        *event_notes,
        *offset_notes,
        *_beyond(points, ruler, span, pixels, colours),
    ]
    if not points and not blocks:
        traces.append(_invisible(first))
        notes.append(_no_readings(colours))
    return {
        "data": [*traces, *events, *offsets],
        "layout": layout(
            theme,
            margin={"l": left, "r": right, "t": 34, "b": 48},
            hoverdistance=24,
            showlegend=True,
            legend=legend(theme, y=1.008, bgcolor="rgba(0,0,0,0)"),
            xaxis={
                "range": list(span),
                "anchor": "y3",
                "title": {"text": _("Reading number"), "font": {"size": 13, "color": colours.quiet}, "standoff": 6},
                "tickformat": "d",
                "showgrid": False,
                "showline": True,
                **({"dtick": 1} if last - first <= 12 else {"nticks": 9}),
            },
            yaxis=_size_axis(limits, ruler, sizes, colours, font_size, brief=brief),
            yaxis2=_lane(EVENTS, [-1, 1], colours, showticklabels=False),
            yaxis3=_lane(
                OFFSETS,
                None,
                colours,
                nticks=3,
                tickformat="+.1f",
                gridcolor=colours.grid,
                showgrid=True,
                zeroline=True,
                zerolinecolor=colours.faint,
                title={
                    "text": "" if brief else _("Σ correction, µm"),
                    "font": {"size": 12, "color": colours.quiet},
                    "standoff": 4,
                },
            ),
            shapes=[*band_shapes(limits, ruler, colours), *limit_lines(limits, ruler, colours), *event_lines],
            annotations=notes,
        ),
    }


def _size_axis(
    limits: HasLimits, ruler: Scale, sizes: SizeAxis | None, colours: Palette, font_size: int, *, brief: bool
) -> dict[str, Any]:
    ticks, words = size_ticks(limits, ruler, None if sizes is None else sizes.target)
    title = _("Deviation") if sizes is None else sizes.title
    return {
        "domain": READINGS,
        "range": [-ruler.extent, ruler.extent],
        "fixedrange": True,
        "showgrid": False,
        "tickmode": "array",
        "tickvals": ticks,
        "ticktext": words,
        "tickfont": {"size": font_size, "color": colours.quiet},
        "title": {"text": "" if brief else title, "font": {"size": 12, "color": colours.quiet}, "standoff": 4},
    }


def _invisible(x: int) -> dict[str, Any]:
    """Return a trace that shows nothing: without one Plotly would not know where the axis of the readings is."""
    return {"type": "scatter", "x": [x], "y": [0], "opacity": 0, "showlegend": False, "hoverinfo": "skip"}


def _no_readings(colours: Palette) -> dict[str, Any]:
    return {
        "xref": "paper",
        "yref": "y",
        "x": 0.5,
        "y": 0,
        "text": f"<b>{_('No readings yet')}</b>",
        "showarrow": False,
        "bgcolor": colours.surface,
        "borderpad": 6,
        "font": {"size": 15, "color": colours.quiet},
    }


def _lane(domain: list[float], extent: list[float] | None, colours: Palette, **more: Any) -> dict[str, Any]:
    lane: dict[str, Any] = {
        "domain": domain,
        "fixedrange": True,
        "color": colours.quiet,
        "anchor": "x",
        "zeroline": False,
    }
    lane |= {"showgrid": False, "ticks": "", "tickfont": {"size": 11}}
    return lane | ({"range": extent} if extent else {}) | more


def _hover(point: Point) -> str:
    lines = [f"<b>{_('Reading {n}').format(n=point.sequence)}</b>", f"{um(point.deviation)} · {zone_name(point.zone)}"]
    lines += size_lines(point.size, point.measured)
    if point.average is not None:
        lines.append(_("running average {average}").format(average=um(point.average, 2)))
    if point.excluded:
        lines.append(_("excluded from statistics"))
    if point.at is not None:
        lines.append(f"{written(point.at)} {plant_zone().key}")
    return "<br>".join(lines)


def _readings(points: Sequence[Point], ruler: Scale, colours: Palette) -> list[dict[str, Any]]:
    """Every reading: the shape of its zone; hollow if excluded; at the edge with its value if it lies beyond."""
    if not points:
        return []
    small = 9 if len(points) <= 120 else 7 if len(points) <= 400 else 4
    calm = {"zero", "average", "full"}
    colour = [zone_colour(point.zone, colours) for point in points]
    return [
        {
            "type": "scatter",
            "mode": "lines+markers" if len(points) <= 120 else "markers",  # a line through many only hides them
            "name": _("Reading"),
            "meta": "readings",
            "legendrank": 1,
            "x": [point.sequence for point in points],
            "y": [ruler.position(point.deviation) for point in points],
            "line": {"width": 1, "color": colours.faint},
            "marker": {
                "symbol": [
                    ZONE_SYMBOLS.get(point.zone, "circle") + ("-open" if point.excluded else "") for point in points
                ],
                "size": [small if point.zone in calm else max(small + 4, 12) for point in points],
                "color": colour,
                "line": {
                    "width": [1.5 if point.excluded else 0.75 for point in points],
                    "color": [
                        c if point.excluded else colours.surface for c, point in zip(colour, points, strict=True)
                    ],
                },
                "opacity": 1,
            },
            "customdata": [point.link for point in points],
            "text": [_hover(point) for point in points],
            "hovertemplate": "%{text}<extra></extra>",
            "cliponaxis": False,
        }
    ]


def _beyond(
    points: Sequence[Point], ruler: Scale, span: tuple[float, float], pixels: int, colours: Palette
) -> list[dict[str, Any]]:
    """The values of readings drawn at the edge because they lie further out; of those too close together the newest."""
    apart = (span[1] - span[0]) * WORD / pixels
    labelled: list[Point] = []
    for point in reversed(points):
        near = (other for other in labelled if (other.deviation > 0) == (point.deviation > 0))
        if not ruler.fits(point.deviation) and all(other.sequence - point.sequence > apart for other in near):
            labelled.append(point)
    return [
        {
            "x": point.sequence,
            "y": ruler.position(point.deviation),
            "yshift": -14 if point.deviation > 0 else 14,
            "text": f"<b>{um(point.deviation, 0)}</b>",
            "showarrow": False,
            "font": {"size": 12, "color": zone_colour(point.zone, colours)},
        }
        for point in labelled
    ]


def _ring(
    points: Sequence[Point], ringed: int | Literal["newest"] | None, ruler: Scale, colours: Palette
) -> list[dict[str, Any]]:
    """A ring about the newest reading, or about the one that the page is about, found from two metres away."""
    sequence = points[-1].sequence if ringed == "newest" and points else ringed
    point = next((point for point in points if point.sequence == sequence), None)
    if point is None:
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "name": _("Newest") if ringed == "newest" else _("This reading"),
            "meta": "newest",
            "x": [point.sequence],
            "y": [ruler.position(point.deviation)],
            "marker": {
                "symbol": "circle-open",
                "size": 20,
                "color": zone_colour(point.zone, colours),
                "line": {"width": 2.5},
            },
            "hoverinfo": "skip",
            "cliponaxis": False,
        }
    ]


def _average(blocks: Sequence[Block], points: Sequence[Point], ruler: Scale, colours: Palette) -> list[dict[str, Any]]:
    """M, as it stood after each reading; a gap where there was no memory."""
    # Of very many readings M at the end of each block would be noise: the mean of the block says more.
    course = [(block.middle, block.average) for block in blocks if len(blocks) <= 150] + [
        (point.sequence, point.average) for point in points
    ]
    if all(value is None for _x, value in course):
        return []
    return [
        {
            "type": "scatter",
            "mode": "lines",
            "name": _("Running average M"),
            "meta": "average",
            "x": [x for x, _value in course],
            "y": [None if value is None else ruler.position(value) for _x, value in course],
            "line": {"width": 1.75, "color": colours.average, "shape": "hv" if len(course) <= 400 else "linear"},
            "hoverinfo": "skip",
        }
    ]
