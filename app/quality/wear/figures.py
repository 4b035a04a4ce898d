"""The wear curve as a chart. Pure; lengths in mm in, µm on the axis.

Dots are the wear curve, the step line is what the corrections had taken out of it when the part was cut, with the tolerance as a
band about it: the gap between dot and step is the deviation, and a dot in the band is a good part. From the newest reading
on, the line goes on into its forecast, the band stays as if nothing were corrected any more.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from app.charts import (
    Axis,
    Chart,
    Dots,
    Faded,
    Mark,
    Note,
    Panel,
    Pen,
    Role,
    Room,
    Rule,
    Series,
    Share,
    band,
    bold,
    nothing,
    reading_axis,
)
from app.core import forecast
from app.core.forecast import PUBLIC_WIDENING, Forecast
from app.core.natural_limit import NaturalLimit, tolerance_about_target
from app.core.wear import Fit, Towards
from app.language.formatting import um
from app.language.i18n import _
from app.quality.wear.wording import parts_left, per_part, towards_name

AHEAD, LEAST_AHEAD = 0.6, 20  # how far the forecast is drawn at most, in shares of what is shown; in parts
STEPS = 24  # points of a curved edge
SYMBOLS = {-1: "triangle-down", 0: "circle", 1: "triangle-up"}  # beyond the edges of the chart, drawn on them
FAR = 4  # times the tolerance: what deviates further does not stretch the chart
NARROW, LEFT = 700, 76  # px: below that width the right margin holds no label; the left margin
CHANGE_LABEL = 130  # px that the label of a tool change takes in any language
TOLERANCE = Pen("ink", 1.75)
ROOM = 0.06  # above and below, in shares of the height


@dataclass(frozen=True)
class Life:
    """One edge: readings, its wear curve, what was taken out of it, and how many readings each point stands for."""

    sequence: Sequence[int]
    worn: Sequence[float]
    removed: Sequence[float]
    counts: Sequence[int]


@dataclass(frozen=True)
class WearChart:
    """Values to draw. half: of the tolerance; removed: what the corrections issued so far take out; limits lie on the wear curve.

    widening: of the interval of the forecast, see `app.core.forecast.Record`.
    """

    key: str
    now: Life
    lives: Sequence[Life]
    fit: Fit | None
    forecasts: Mapping[Towards, Forecast]
    limits: Mapping[Towards, float]
    half: float
    removed: float
    corrects: bool
    widening: float = PUBLIC_WIDENING
    natural_limit: NaturalLimit = NaturalLimit.NONE

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends of the tolerance, from the target; the target itself is one where it is a natural limit."""
        tolerance = tolerance_about_target(self.half, self.natural_limit)
        return tolerance.lower or 0.0, tolerance.upper or 0.0


def wear_figure(chart: WearChart, *, width: int = 1240) -> Chart:
    """The wear curve of the edge and of those before it, and its forecast."""
    lives = [*chart.lives, chart.now]
    sequences = [n for life in lives for n in life.sequence]
    if not sequences:
        return nothing(_("No readings of this tool yet"))
    last = sequences[-1]
    ahead = _ahead(chart, len(range(sequences[0], last)) + 1)
    near = {
        name: chart.limits[name]
        for name, forecast in chart.forecasts.items()
        if forecast.parts <= ahead and not (chart.corrects and name is Towards.TOLERANCE)
    }
    heights = [
        value
        for life in lives
        for worn, removed in zip(life.worn, life.removed, strict=True)
        for value in (
            *([worn] if abs(worn - removed) <= FAR * chart.half else ()),
            removed + chart.ends[0],
            removed + chart.ends[1],
        )
    ]
    heights += [*(chart.removed + end for end in chart.ends), *near.values()]
    if chart.fit is not None and ahead:
        edge, wide = chart.fit.at(ahead), chart.fit.half_width(ahead, single=True)
        heights += [edge - wide, edge + wide]
    low, high = min(heights) * 1000, max(heights) * 1000
    room = (high - low) * ROOM
    shown = (sequences[0] - 1, last + max(ahead, 2))
    right = 20 if width < NARROW else 150
    cut = [life for life in lives if life.sequence]
    marks: list[Mark] = [
        *_changes(cut, shown[1] - (shown[1] - shown[0]) * CHANGE_LABEL / (width - LEFT - right)),
        *(
            Rule(TOLERANCE, limit * 1000, words=f"{towards_name(name)} {um(limit)}", on=True, colour="ink", front=True)
            for name, limit in near.items()
        ),
        *(mark for life in cut for mark in _band(life, chart, ahead if life is chart.now else 0)),
        *(mark for life in cut for mark in _life(life, chart, (low, high), is_now=life is chart.now)),
    ]
    if chart.fit is not None:
        marks += _line(chart.fit, ahead, chart.widening, (low - room, high + room))
        marks += _labels(chart, chart.fit, ahead) if width >= NARROW else []
    shape = "+.0f" if high - low > 8 else "+.1f"
    return Chart(
        [Panel(marks, Axis(_("Wear, µm"), reach=(low - room, high + room), format=shape, ticks=7, zero="faint"))],
        reading_axis(shown, width),
        Room(LEFT, right, 48, 44),
    )


def _ahead(chart: WearChart, shown: int) -> float:
    """Length of the forecast in the picture, in parts: to the limit that comes first, if it is near."""
    if chart.fit is None or not chart.forecasts:
        return 0.0
    coming = [
        forecast.parts
        for name, forecast in chart.forecasts.items()
        if not (chart.corrects and name is Towards.TOLERANCE)
    ]
    tolerance = chart.forecasts.get(Towards.TOLERANCE)
    nearest = min([*coming, *([tolerance.parts] if tolerance else [])], default=0.0)
    return max(float(LEAST_AHEAD), min(nearest * 1.15, AHEAD * shown))


def _band(life: Life, chart: WearChart, ahead: float) -> list[Series]:
    """The tolerance about what was taken out."""
    x = [*life.sequence, *([life.sequence[-1] + ahead] if ahead else [])]
    centre = [*life.removed, *([chart.removed] if ahead else [])]
    if ahead:
        centre[-2] = chart.removed
    low, high = ([_um(value + end) for value in centre] for end in chart.ends)
    name = _("Tolerance about it") if life is chart.now else ""
    return band(x, low, high, "band-1", metas=("tolerance", "tolerance"), pen=Pen("faint", 0, steps="hv"), name=name)


def _life(life: Life, chart: WearChart, edges: tuple[float, float], *, is_now: bool) -> list[Series]:
    taken = Series(
        list(life.sequence),
        [_um(value) for value in life.removed],
        Pen("correction", 2, steps="hv"),
        meta="taken",
        name=_("Taken out by corrections") if is_now else "",
    )
    size = 5 if len(life.sequence) <= 400 else 4
    far = [(_um(value) > edges[1]) - (_um(value) < edges[0]) for value in life.worn]
    calm: Role = "steady" if is_now else "faint"
    worn = Series(
        list(life.sequence),
        [min(max(_um(value), edges[0]), edges[1]) for value in life.worn],
        dots=Dots(
            [SYMBOLS[beyond] for beyond in far],
            [10 if beyond else size + (count > 1) for beyond, count in zip(far, life.counts, strict=True)],
            ["attention" if beyond else calm for beyond in far],
        ),
        meta="wear",
        name=_("Wear curve") if is_now else "",
        hover=[
            (
                bold(_("Reading {n}").format(n=number))
                if count == 1
                else bold(_("{count} readings up to {n}").format(count=count, n=number))
            )
            + "<br>"
            + _("wear {worn}, of which {taken} corrected").format(worn=um(worn), taken=um(removed))
            + "<br>"
            + _("deviation {deviation}").format(deviation=um(worn - removed))
            for number, worn, removed, count in zip(life.sequence, life.worn, life.removed, life.counts, strict=True)
        ],
        links=[f"/characteristics/{chart.key}/readings/{number}" for number in life.sequence],
    )
    return [taken, worn] if chart.corrects or any(life.removed) else [worn]


def _line(fit: Fit, ahead: float, widening: float, between: tuple[float, float]) -> list[Series]:
    """The fitted line, and its forecast with the interval of a single part, as far as the chart reaches (`between`, µm)."""
    said = per_part(fit.slope) + " " + _("per part")
    line = Series(
        [fit.first, fit.last],
        [_um(fit.at(fit.first - fit.last)), _um(fit.level)],
        Pen("wear", 2.5),
        meta="line",
        name=_("Line through the newest readings"),
        hover=said,
    )
    if not ahead:
        return [line]
    places = [ahead * step / STEPS for step in range(STEPS + 1)]
    low, high = (
        [min(max(_um(end), between[0]), between[1]) for end in ends.tolist()]
        for ends in forecast.cone(fit, np.array(places), widening)
    )
    cone = band(
        [fit.last + place for place in places],
        low,
        high,
        Faded("wear", 0.14),
        metas=("forecast", "forecast"),
        pen=Pen("faint", 1),
        name=_("Forecast, 95 % interval"),
    )
    ends = [_um(fit.level), _um(fit.at(ahead))]
    coming = Series([fit.last, fit.last + ahead], ends, Pen("wear", 2.5, "dash"), meta="line", hover=said)
    return [*cone, line, coming]


def _changes(lives: Sequence[Life], end: float) -> list[Rule | Note]:
    """Lines and labels of the tool changes; those beyond `end` are labelled on the left, clear of the right margin."""
    places = [life.sequence[0] - 0.5 for life in lives[1:]]
    return [
        *(Rule(Pen("quiet", 1.25, "dot"), x=place) for place in places),
        *(
            Note(_("Tool changed"), place, Share(0), "right", "bottom", (-4, 0))
            if place > end
            else Note(_("Tool changed"), place, Share(0), "left", "bottom", (4, 0))
            for place in places[-6:]
        ),
    ]


def _labels(chart: WearChart, fit: Fit, ahead: float) -> list[Note]:
    """At the right: the slope, and when what comes first comes."""
    lines = [f"<b>{per_part(fit.slope)}</b>", _("per part")] if fit.is_wear else [_("no wear visible")]
    tolerance = chart.forecasts.get(Towards.TOLERANCE)
    if tolerance is not None and tolerance.parts <= ahead:
        lines += ["", towards_name(Towards.TOLERANCE), parts_left(tolerance)]
    return [Note("<br>".join(lines), Share(1), _um(fit.at(ahead)), "left", shift=(10, 0), colour="ink")]


def _um(length: float) -> float:
    return round(length * 1000, 3)
