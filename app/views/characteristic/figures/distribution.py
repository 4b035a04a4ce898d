"""Histogram of the deviations, and chart of the sizes over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from app.charts import Axis, Bars, Chart, Dots, Note, Panel, Pen, Room, Rule, Series, bold, empty, time_axis
from app.core.decision.limits import HasLimits, Limits, in_nanometres
from app.core.natural_limit import NaturalLimit, half_of, natural_of, tolerance_about_target
from app.language.formatting import grouped, um
from app.language.i18n import _
from app.views.characteristic.figures.blocks import Block, envelope, summed_up
from app.views.characteristic.figures.labels import LIMIT, TARGET, TOLERANCE
from app.views.characteristic.figures.scale import TrueScale, ends_of
from app.views.characteristic.figures.sizes import SizeAxis, size_lines
from app.web.theme import ZONE_SYMBOLS, zone_name, zone_role

Floats = NDArray[np.float64]

BARS_PER_SIDE = 15  # whole bars between target and tolerance limit, so that the limits fall between bars
REACH = 1.4  # the histogram ends at this many times the tolerance; what lies further out is in the two end bars
WHOLE_BARS = round(BARS_PER_SIDE * REACH)  # on each side of the target
BEYOND_NATURAL = 3  # bars beyond a natural limit, where nothing but the scatter of measuring is
JOINED = 300  # readings, of more a line only hides them, and over a night none would be true
FEW = 4  # readings in the longest bar up to which they are counted by ones: there are no half readings


@dataclass(frozen=True)
class RunPoint:
    """One reading and when; mm. size: corrected by the empirical value of then; measured: as the machine sent it."""

    sequence: int
    at: datetime
    deviation: float
    zone: str
    excluded: bool = False
    link: str | None = None
    size: float | None = None
    measured: float | None = None


def _numbers(limits: HasLimits) -> range:
    """The edges between the bars, counted from the target in bars."""
    natural = natural_of(limits)
    first = BEYOND_NATURAL if natural is NaturalLimit.LOWER else WHOLE_BARS
    last = BEYOND_NATURAL if natural is NaturalLimit.UPPER else WHOLE_BARS
    return range(-first, last + 1)


def histogram_edges(limits: HasLimits) -> list[float]:
    """The edges (mm) between the bars, ascending; bars 0 and n are open to the outside (as width_bucket counts them)."""
    half = max(Limits.of(limits).tolerance, 1)
    return [half * i / BARS_PER_SIDE / 1e6 for i in _numbers(limits)]


def counting_edges(limits: HasLimits) -> list[float]:
    """The edges as deviations in whole nanometres are counted by. A value on an edge is in the upper bar, but on the
    tolerance limit itself it is good, so it counts inside.
    """
    half = max(Limits.of(limits).tolerance, 1)
    return [half * i / BARS_PER_SIDE + (0.5 if i == BARS_PER_SIDE else 0.0) for i in _numbers(limits)]


def histogram_centres(limits: HasLimits) -> list[float]:
    """Centres of the bars, µm; the two open ones as if they were as wide as the others."""
    edges = [edge * 1000 for edge in histogram_edges(limits)]
    half = (edges[1] - edges[0]) / 2
    return [edges[0] - half, *(edge + half for edge in edges)]


def histogram_counts(deviations: Sequence[float] | Floats, limits: HasLimits) -> list[int]:
    """Number of deviations (mm) in each bar; one bar more than there are edges."""
    edges = counting_edges(limits)
    bars = np.searchsorted(edges, in_nanometres(np.asarray(deviations, np.float64)), side="right")
    return [int(count) for count in np.bincount(bars, minlength=len(edges) + 1)]


def histogram_figure(counts: Sequence[int], limits: HasLimits, *, of: int = 0) -> Chart:
    """The spread, lying beside the zone chart: deviation upward (µm), bars to the right; the limits drawn in.

    of: how many readings there are, where only the newest are counted.
    """
    edges = [edge * 1000 for edge in histogram_edges(limits)]
    width = edges[1] - edges[0]
    centres = histogram_centres(limits)
    half, natural = half_of(limits) * 1000, natural_of(limits)
    judged = tolerance_about_target(half, natural).judged
    total = sum(counts)
    names = [_("{low} to {high} µm").format(low=f"{c - width / 2:+.1f}", high=f"{c + width / 2:+.1f}") for c in centres]
    names[0], names[-1] = (
        _("below {low} µm").format(low=f"{edges[0]:+.1f}"),
        _("above {high} µm").format(high=f"{edges[-1]:+.1f}"),
    )
    reach = (edges[0] - width, edges[-1] + width)
    bars = Bars(
        counts,
        centres,
        ["attention" if abs(c) > half else "steady" for c in centres],
        width * 0.9,
        lying=True,
        meta="histogram",
        hover=[
            f"<b>{name}</b><br>"
            + _("{n} readings, {share}").format(n=count, share=f"{count / total:.1%}" if total else "–")
            for name, count in zip(names, counts, strict=True)
        ],
    )
    lines = [
        Rule(pen, sign * limit, front=True)
        for limit, pen in (
            (half, TOLERANCE),
            (limits.averaging_limit * 1000, LIMIT),
            (limits.zero_range * 1000, LIMIT),
            (0.0, TOLERANCE if natural.side else TARGET),
        )
        for sign in ((1, -1) if limit else (1,))
        if reach[0] <= sign * limit <= reach[1] and sign * (limit or 1) * natural.side <= 0
    ]
    deviation = Axis(
        _("Deviation, µm"),
        reach=reach,
        at=sorted([0.0, *judged]),
        words=[um(at / 1000).replace("\xa0µm", "") if at else "0" for at in sorted([0.0, *judged])],
        grid=False,
        fixed=True,
    )
    many = max(counts) > FEW
    return Chart(
        [Panel([bars, *lines, *([] if total else [empty(_("No readings yet"))])], deviation)],
        Axis(
            _("Newest {n} of {all} readings").format(n=grouped(total), all=grouped(of)) if of else _("Readings"),
            ticks=4,
            every=None if many else 1,
            from_zero=True,
            format="d",
            fixed=True,
        ),
    )


def run_figure(
    points: Sequence[RunPoint], limits: HasLimits, *, sizes: SizeAxis, blocks: Sequence[Block] = ()
) -> Chart:
    """Corrected sizes (mm) over time, with target and tolerance as the drawing has them.

    What lies far outside the tolerance is at the edge with its deviation: one probe fault would press all else into a line.
    blocks: of a long history the older part, by time.
    """
    target, natural = sizes.target, natural_of(limits)
    judged = tolerance_about_target(half_of(limits), natural).judged
    ends = [end for block in blocks for end in (block.minimum, block.maximum)]
    scale = TrueScale.of(limits, [*(point.deviation for point in points), *ends])
    low, high = (end / 1000 for end in ends_of(scale))

    def size(deviation: float) -> float:
        return round(target + scale.position(deviation) / 1000, 9)

    course = Series(
        [point.at for point in points],
        [size(point.deviation) for point in points],
        Pen("faint", 1) if len(points) <= JOINED else None,
        Dots(
            [ZONE_SYMBOLS.get(p.zone, "circle") + ("-open" if p.excluded else "") for p in points],
            [6 if p.zone in ("zero", "average", "full") else 10 for p in points],
            [zone_role(p.zone) for p in points],
        ),
        meta="run",
        hover=[
            "<br>".join(
                (
                    bold(_("Reading {n}").format(n=p.sequence)),
                    f"{um(p.deviation)} · {zone_name(p.zone)}",
                    *size_lines(p.size, p.measured),
                )
            )
            for p in points
        ],
        links=[point.link for point in points],
    )
    lines = [
        Rule(pen, y, words=f"{y:.4f}")
        for y, pen in (
            *((target + limit, TOLERANCE) for limit in reversed(judged)),
            (target, TOLERANCE if natural.side else TARGET),
        )
    ]
    said = _at_the_edge(points, scale, target) if points or blocks else [empty(_("No readings yet"))]
    height = Axis(sizes.title, format=".4f", ticks=6, reach=(target + 1.08 * low, target + 1.08 * high))
    older = envelope(blocks, size, Limits.of(limits), over_time=True)
    axis = time_axis()
    axis = replace(axis, title=" · ".join([axis.title, *summed_up(blocks, len(points))]))
    return Chart([Panel([*lines, *older, course, *said], height)], axis, Room(left=92, right=110))


def _at_the_edge(points: Sequence[RunPoint], scale: TrueScale, target: float) -> list[Note]:
    """The deviations of the readings that are drawn at the edge, the newest first, as many as there is room for."""
    apart = (points[-1].at - points[0].at) / 12 if points else timedelta()
    labelled: list[RunPoint] = []
    for point in reversed(points):
        if not scale.fits(point.deviation) and (not labelled or labelled[-1].at - point.at > apart):
            labelled.append(point)
    return [
        Note(
            f"<b>{um(point.deviation, 0)}</b>",
            point.at,
            target + scale.position(point.deviation) / 1000,
            shift=(0, -14 if point.deviation > 0 else 14),
            colour=zone_role(point.zone),
        )
        for point in labelled
    ]
