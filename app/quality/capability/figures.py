"""Histogram with fitted curve and limits, and the normal probability plot. Pure; mm in, µm on the axes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, time, timedelta
from math import ceil, exp, pi, sqrt
from typing import Any

import numpy as np
from scipy.special import ndtri

from app.charts import (
    Axis,
    Bars,
    Chart,
    Dots,
    Mark,
    Note,
    Panel,
    Pen,
    Room,
    Rule,
    Series,
    Share,
    nothing,
    time_axis,
)
from app.core.spc.capability import CAPABLE, VERY_CAPABLE, Limits
from app.core.spc.fitting import Fitted, density
from app.core.spc.outliers import far_off
from app.core.spc.refusal import Floats
from app.language.formatting import signed
from app.language.i18n import _, ngettext
from app.language.times import plant_zone
from app.quality.capability import fit_wording
from app.quality.capability.kinds import Week

MOST_BARS, FEWEST_BARS = 60, 8
CURVE = 161  # points of a drawn curve
MOST_POINTS, TAIL = 600, 40  # of the probability plot, and of each of its ends that are drawn whichever
BELOW = Share(-0.2)
MOST_CHANGES = 60  # lines of tool changes; more are a fence
SHARES = (0.00135, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.99865)


@dataclass(frozen=True)
class CapabilityChart:
    """Values to draw. within: the sigma within, None where it may not be shown; percentiles: 0.135 %, 50 %, 99.865 %, of the
    fitted distribution where there is one.
    """

    values: Floats
    limits: Limits
    mean: float | None
    overall: float | None
    within: float | None
    percentiles: Sequence[float] | None
    normal: bool
    fitted: Fitted | None = None


def histogram(drawn: CapabilityChart) -> Chart:
    """Bars of equal width, the fitted normal curve (overall; dashed: within) or the percentiles, and the limits."""
    if not len(drawn.values):
        return nothing(_("No readings here"))
    near = _near(drawn)
    edges = edges_of(near)
    counts, _edges = np.histogram(near, edges)
    width = float(edges[1] - edges[0])
    centres = (edges[:-1] + edges[1:]) / 2
    low, high = _range(drawn, edges)
    marks: list[Mark] = [
        Bars(
            (centres * 1000).tolist(),
            counts.tolist(),
            ["attention" if _outside(float(centre), drawn.limits) else "steady" for centre in centres],
            width * 1000 * 0.92,
            opacity=0.75,
            meta="histogram",
            hover=_("%{x:+.2f} µm: %{y} readings"),
        )
    ]
    if drawn.fitted is not None:
        at = np.linspace(low, high, 4 * CURVE)
        height = (len(drawn.values) * width * density(drawn.fitted, at)).tolist()
        name = fit_wording.name(drawn.fitted.fit.family)
        marks.append(Series((at * 1000).tolist(), height, Pen("correction", 2), meta="fitted", name=name))
    elif drawn.mean is not None and drawn.normal:
        at = np.linspace(low, high, CURVE)
        scale = len(drawn.values) * width
        for name, sigma, dash in (
            (_("Normal, sigma of all readings"), drawn.overall, "solid"),
            (_("Normal, sigma within"), drawn.within, "dash"),
        ):
            if sigma:
                height = [
                    scale * exp(-0.5 * ((x - drawn.mean) / sigma) ** 2) / (sigma * sqrt(2 * pi)) for x in at.tolist()
                ]
                marks.append(Series((at * 1000).tolist(), height, Pen("correction", 2, dash), meta=dash, name=name))
    beyond = _beyond(drawn, top=True)
    if not any(isinstance(mark, Series) and mark.name for mark in marks):
        beyond = [_below(note) for note in beyond]
    return _chart(
        [*marks, *_limit_lines(drawn, low, high), *beyond],
        low,
        high,
        Axis(_("Readings"), from_zero=True, ticks=5),
    )


def probability(drawn: CapabilityChart) -> Chart:
    """Ordered readings against normal quantiles: normal readings lie on the line. Of many, the ends and a thinned middle."""
    if len(drawn.values) < 2:
        return nothing(_("No readings here"))
    ordered = np.sort(drawn.values)
    n = len(ordered)
    at = np.arange(n) if n <= MOST_POINTS else _spread(n)
    z = ndtri((at + 1 - 0.3) / (n + 0.4))  # median ranks, Benard
    near = _near(drawn)
    low, high = _range(drawn, np.array([near.min(), near.max()]))
    reach = max(3.4, float(np.abs(z).max()) + 0.2)
    marks: list[Mark] = [
        Series(
            (ordered[at] * 1000).tolist(),
            z.tolist(),
            dots=Dots(size=6, opacity=0.8),
            meta="readings",
            name=_("Readings"),
            hover="%{x:+.2f} µm",
        )
    ]
    if drawn.mean is not None and drawn.overall:
        # Readings beyond the picture would tilt the line away from all that are in it.
        mean, sigma = (drawn.mean, drawn.overall) if near.size == n else (float(near.mean()), float(near.std(ddof=1)))
        name = _("Normal distribution") if near.size == n else _("Normal distribution of the readings shown")
        ends = [(mean + side * reach * sigma) * 1000 for side in (-1, 1)]
        marks.append(Series(ends, [-reach, reach], Pen("correction", 2), meta="line", name=name))
    shares = Axis(
        _("Share of the readings below"),
        reach=(-reach, reach),
        at=[float(ndtri(share)) for share in SHARES],
        words=[f"{share * 100:g} %" for share in SHARES],
    )
    return _chart(
        [*marks, *_limit_lines(drawn, low, high, percentiles=False), *_beyond(drawn, top=False)], low, high, shares
    )


def small(chart: Chart) -> Chart:
    """The same without a legend, for which there is no room; readings beyond are named in place of the axis below."""
    panels = [replace(panel, marks=[_small(mark) for mark in panel.marks]) for panel in chart.panels]
    beyond = any(isinstance(mark, Note) and mark.y == BELOW for panel in panels for mark in panel.marks)
    return replace(chart, panels=panels, x=replace(chart.x, title="") if beyond else chart.x, room=Room(78, 22, 54, 40))


def _small(mark: Mark) -> Mark:
    if isinstance(mark, Series | Bars):
        return replace(mark, name="")
    return _below(mark) if isinstance(mark, Note) and mark.ground else mark


def _below(note: Note) -> Note:
    """The note of the readings beyond where no legend is: below the picture."""
    return replace(note, y=BELOW, upward="top", ground=False)


def _near(drawn: CapabilityChart) -> Floats:
    """The readings that the picture shows: those far from all others would leave nothing to be seen of the rest."""
    return np.asarray(drawn.values[~far_off(drawn.values)])


def _beyond(drawn: CapabilityChart, *, top: bool) -> list[Note]:
    """Note at the right, where the picture is empty and no legend can meet it: the number of readings outside it."""
    far, middle = drawn.values[far_off(drawn.values)], float(np.median(drawn.values))
    words = []
    for left, values in ((True, far[far < middle]), (False, far[far > middle])):
        if len(values):
            furthest = values[np.abs(values - middle).argmax()] * 1000
            text = ngettext(
                "%(num)d reading beyond: %(at)s µm", "%(num)d readings beyond, up to %(at)s µm", len(values)
            )
            text %= {"num": len(values), "at": signed(furthest, 1)}
            words.append(f"◂ {text}" if left else f"{text} ▸")
    if not words:
        return []
    where = Share(1), Share(0.98 if top else 0.02, inside=True)
    return [
        Note("  ".join(words), *where, "right", "top" if top else "bottom", size=13, colour="attention", ground=True)
    ]


def edges_of(values: Floats) -> Floats:
    """Edges of bars of one width: Freedman and Diaconis' rule, whole multiples of the resolution of the readings.

    >>> edges_of(np.array([0.001, 0.002, 0.002, 0.003, 0.003, 0.003, 0.004, 0.005])).round(4).tolist()[:2]
    [0.0005, 0.0015]
    """
    low, high = float(values.min()), float(values.max())
    apart = np.diff(np.unique(values[:20_000]))
    resolution = max(float(apart[apart > 1e-9].min()) if (apart > 1e-9).any() else 0.001, 1e-6)
    quarter, three = np.quantile(values, [0.25, 0.75])
    freedman = 2 * float(three - quarter) / len(values) ** (1 / 3)
    freedman = min(max(freedman, (high - low) / MOST_BARS), max(high - low, resolution) / FEWEST_BARS)
    width = max(1, ceil(freedman / resolution - 1e-9)) * resolution
    first = low - resolution / 2
    bars = min(200, max(1, ceil((high + resolution / 2 - first) / width - 1e-9)))
    return np.asarray(first + width * np.arange(bars + 1) if bars < 200 else np.linspace(first, high + width / 2, 201))


def _spread(n: int) -> "np.ndarray[Any, np.dtype[np.int64]]":
    middle = np.linspace(TAIL, n - 1 - TAIL, MOST_POINTS - 2 * TAIL).round().astype(np.int64)
    return np.unique(np.concatenate((np.arange(TAIL), middle, np.arange(n - TAIL, n))))


def _outside(value: float, limits: Limits) -> bool:
    below = limits.lower is not None and value < limits.lower
    return below or (limits.upper is not None and value > limits.upper)


def _range(drawn: CapabilityChart, values: Floats) -> tuple[float, float]:
    held = [float(values[0]), float(values[-1])]
    held += [limit for limit in (drawn.limits.lower, drawn.limits.upper) if limit is not None]
    if drawn.mean is not None and drawn.overall and not far_off(drawn.values).any():
        held += [drawn.mean - 3.2 * drawn.overall, drawn.mean + 3.2 * drawn.overall]
    room = max(0.04 * (max(held) - min(held)), 1e-5)
    return min(held) - room, max(held) + room


def _limit_lines(drawn: CapabilityChart, low: float, high: float, *, percentiles: bool = True) -> list[Rule]:
    lines = [
        Rule(Pen("ink", 2), x=limit, words=name)
        for limit, name in ((drawn.limits.lower, _("lower limit")), (drawn.limits.upper, _("upper limit")))
        if limit is not None
    ]
    lines.append(Rule(Pen("quiet", 1, "4px,4px"), x=0.0, words=_("target")))
    if percentiles and drawn.percentiles is not None and (drawn.fitted is not None or not drawn.normal):
        pen = Pen("correction", dash="6px,3px")
        lines += [
            Rule(pen, x=value, words=name, colour="correction", raised=raised)
            for value, name, raised in zip(
                drawn.percentiles, ("0.135 %", "50 %", "99.865 %"), (14, 28, 14), strict=True
            )
        ]
    return [
        replace(line, x=line.x * 1000, front=True)
        for line in lines
        if isinstance(line.x, float) and low <= line.x <= high
    ]


def _chart(marks: Sequence[Mark], low: float, high: float, height: Axis) -> Chart:
    deviation = Axis(_("Deviation, µm"), reach=(low * 1000, high * 1000), format="+.4~g", ticks=9)
    return Chart([Panel(marks, height)], deviation, Room(76, 28, 96, 44), legend="below")


def index_over_weeks(weeks: Sequence[Week], changes: Sequence[datetime]) -> Chart:
    """The index of each week with its interval, against 1, 1.33 and 1.67; dotted, where a tool was changed (unless that is a fence)."""
    known = [week for week in weeks if week.value is not None]
    if not known:
        return nothing(_("No week has an index yet; it is computed every few minutes"))
    x = [datetime.combine(week.begins, time(12), plant_zone()) + timedelta(days=3) for week in known]
    marks: list[Mark] = [
        *(Rule(Pen("faint", 1, "dot"), x=at) for at in (changes if len(changes) <= MOST_CHANGES else ())),
        *(Rule(Pen("quiet", 1, "4px,4px"), y=mark, words=f"{mark:.2f}") for mark in (1.0, CAPABLE, VERY_CAPABLE)),
        *(
            Series(
                [at, at],
                [week.low if week.low is not None else 0.0, week.high if week.high is not None else week.value],
                Pen("steady", 4),
                meta="interval",
            )
            for at, week in zip(x, known, strict=True)
        ),
        Series(
            x,
            [week.value for week in known],
            Pen("faint", 1.2),
            Dots(size=9, colour="ink"),
            meta="index",
            hover=[f"{week.value:.2f}<br>{week.readings}" for week in known],
        ),
    ]
    highest = max(2.0, *(week.high or week.value or 0.0 for week in known))
    return Chart(
        [
            Panel(
                marks,
                Axis(
                    _("Cpk or Ppk"),
                    reach=(min(0.0, *(week.value or 0.0 for week in known)), highest * 1.05),
                    format=".2f",
                    ticks=6,
                ),
            )
        ],
        time_axis(x),
        Room(64, 60, 44, 16),
    )
