"""The zone chart: what came in, how it was judged, what was done about it.

From top to bottom: a lane of events (alarms, tool changes), the bands with the readings and the running average, a lane with
the sum of the corrections. At the left the sizes at the limits, at the right each limit with its name and value and, in the
band that begins there, what happens in it – as in the diagram of the cycles' manual.

Nothing is only in a hover text: the list below the chart says everything too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import fsum
from typing import Literal

from app.charts import Axis, Chart, Dots, Faded, Note, Panel, Pen, Room, Series, bold, empty
from app.charts import Mark as Drawn
from app.core.decision.limits import HasLimits, Limits
from app.core.natural_limit import half_of
from app.language.formatting import as_read, read_um, um
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.timeline.figures import Event, event_lane
from app.views.characteristic.figures.blocks import Block, envelope, summed_up
from app.views.characteristic.figures.by_hand import HandPoint, hand_marks
from app.views.characteristic.figures.labels import band_grounds, limit_labels, limit_lines, size_ticks
from app.views.characteristic.figures.lanes import Step, offset_lane
from app.views.characteristic.figures.scale import Scale, ScaleName, TrueScale, ZoneScale, ends_of
from app.views.characteristic.figures.sizes import SizeAxis, size_lines
from app.web.theme import ZONE_SYMBOLS, zone_name, zone_role

__all__ = ["Block", "Point", "Step", "zone_chart"]

WIDE = 1500  # pixels from which on there is room for a larger font
NARROW = 640  # pixels below which there is room for the name and value of a limit only
MANY = 300  # readings, of more the eye is led by the envelope of as many neighbours that there are GROUPS of them
GROUPS = 150
WORD = 70  # pixels that a value in the chart takes
EVENTS, READINGS, OFFSETS = (0.935, 1.0), (0.165, 0.93), (0.0, 0.135)  # of the height, from the bottom


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
    events: Sequence[Event] = (),
    hands: Sequence[HandPoint] = (),
    scale: ScaleName = "zones",
    sizes: SizeAxis | None = None,
    total_before: float = 0.0,
    width: int = 1240,
    ringed: int | Literal["newest"] | None = "newest",
    left_out: Sequence[str] = (),
    at_20: Mapping[int, float] | None = None,
) -> Chart:
    """The chart: readings, below them the lane of the corrections, above them that of the events.

    points: readings by ascending sequence. blocks: older ones, thinned; every block's extremes are drawn.
    steps: corrections by ascending sequence of the reading that caused them; total_before: their sum before the first (mm).
    events: alarms, tool changes and others. hands: what was measured by hand. sizes: for the sizes at the left; without them deviations are there.
    width: of the chart in pixels, about: decides which words have room.
    ringed: the number of the reading with a ring about it; `newest` is the last one. left_out: words about what is not drawn.
    at_20: the deviations at 20 °C of those readings that have one, mm, by their numbers.
    """
    ruler: Scale
    if scale == "zones":
        ruler = ZoneScale.of(limits)
    else:
        ends = [end for block in blocks for end in (block.minimum, block.maximum)]
        ruler = TrueScale.of(limits, [*(point.deviation for point in points), *ends])
    # Room at the right for the longest words in the font of any system (Liberation Sans and 5 % more).
    letters, left, right = (14, 104, 322) if width >= WIDE else (12, 92, 276) if width >= NARROW else (12, 64, 104)
    brief = width < NARROW
    first = min([block.first for block in blocks] + [point.sequence for point in points], default=1)
    last = max([block.last for block in blocks] + [point.sequence for point in points], default=first + 9)
    room = max((last - first) * 0.02, 0.6)
    span = (first - room, last + max(room * 1.5, 1.2))  # what came after the last reading is at the next number
    pixels = max(width - left - right, 200)
    readings: list[Drawn] = [
        *band_grounds(limits, ruler),
        *limit_lines(limits, ruler),
        *envelope([*blocks, *_in_groups(points)], ruler.position, Limits.of(limits), extremes=blocks),
        *_average(blocks, points, ruler),
        *_at_20(at_20 or {}, ruler),
        *_readings(points, ruler, half_of(limits)),
        *_ring(points, ringed, ruler),
        *hand_marks(hands, ruler),
        *limit_labels(limits, ruler, letters, brief=brief),
        *_beyond(points, ruler, span, pixels),
        *([] if points or blocks else [empty(_("No readings yet"))]),
    ]
    offsets = offset_lane(steps, events, span, total_before, half=half_of(limits), brief=brief)
    total = Axis(
        "" if brief else _("Σ, µm"),  # the lane is low; the key names it in full
        ticks=3, format="+.1f", zero="faint", line=False, fixed=True, letters=11, title_letters=12,
    )  # fmt: skip
    hidden = Axis(reach=(-1, 1), grid=False, line=False, labelled=False, fixed=True)
    return Chart(
        [
            Panel(readings, _size_axis(limits, ruler, sizes, letters, brief=brief), READINGS),
            Panel(event_lane(events, span, pixels, right, low=brief), hidden, EVENTS),
            Panel(offsets, total, OFFSETS),
        ],
        Axis(
            " · ".join([_("Reading number"), *summed_up(blocks, len(points)), *left_out]),
            reach=span,
            format="d",
            ticks=9,
            every=1 if last - first <= 12 else None,
            grid=False,
        ),
        Room(left, right, 48, top=12 if brief else None),
        "below" if brief else "above",  # on a phone the readings come first
    )


def _size_axis(limits: HasLimits, ruler: Scale, sizes: SizeAxis | None, letters: int, *, brief: bool) -> Axis:
    ticks, words = size_ticks(limits, ruler, None if sizes is None else sizes.target)
    title = _("Deviation") if sizes is None else sizes.title
    return Axis(
        "" if brief else title,
        reach=ends_of(ruler),
        at=ticks,
        words=words,
        grid=False,
        fixed=True,
        letters=letters,
        title_letters=12,
    )


def _hover(point: Point, half: float) -> str:
    lines = [
        bold(_("Reading {n}").format(n=point.sequence)),
        f"{read_um(point.deviation, half)} · {zone_name(point.zone)}",
    ]
    lines += size_lines(point.size, point.measured)
    if point.average is not None:
        lines.append(_("running average {average}").format(average=read_um(point.average, half)))
    if point.excluded:
        lines.append(_("excluded from statistics"))
    if point.at is not None:
        lines.append(f"{as_read(point.at)} {plant_zone().key}")
    return "<br>".join(lines)


def _in_groups(points: Sequence[Point]) -> list[Block]:
    """Of many single readings, neighbours with their extremes; of few none. Faults and excluded readings are in none."""
    if len(points) <= MANY:
        return []
    size = -(-len(points) // GROUPS)
    groups = [
        [point for point in points[at : at + size] if not point.excluded and point.zone != "probe_fault"]
        for at in range(0, len(points), size)
    ]
    return [
        Block(
            group[0].sequence,
            group[-1].sequence,
            min(point.deviation for point in group),
            max(point.deviation for point in group),
            fsum(point.deviation for point in group) / len(group),
            link=f"{group[0].link}" if group[0].link else None,
        )
        for group in groups
        if group
    ]


def _readings(points: Sequence[Point], ruler: Scale, half: float) -> list[Series]:
    """Every reading: the shape of its zone; hollow if excluded; at the edge with its value if it lies beyond."""
    if not points:
        return []
    small = 9 if len(points) <= 120 else 7 if len(points) <= MANY else 3
    calm = {"zero", "average", "full"}
    colours = [zone_role(point.zone) for point in points]
    dots = Dots(
        [ZONE_SYMBOLS.get(point.zone, "circle") + ("-open" if point.excluded else "") for point in points],
        [small if point.zone in calm else max(small + 4, 12) for point in points],
        colours,
        [colour if point.excluded else "surface" for colour, point in zip(colours, points, strict=True)],
        [1.5 if point.excluded else 0.75 for point in points],
    )
    return [
        Series(
            [point.sequence for point in points],
            [ruler.position(point.deviation) for point in points],
            Pen("faint", 1) if len(points) <= 120 else None,  # a line through many only hides them
            dots,
            meta="readings",
            name=_("Reading"),
            hover=[_hover(point, half) for point in points],
            links=[point.link for point in points],
            first=True,
        )
    ]


def _at_20(deviations: Mapping[int, float], ruler: Scale) -> list[Series]:
    """Sizes at 20 °C, beside the measured ones: nothing was decided by them."""
    if not deviations:
        return []
    return [
        Series(
            list(deviations),
            [ruler.position(deviation) for deviation in deviations.values()],
            dots=Dots("diamond-open", 8 if len(deviations) <= MANY else 4, "average", "average"),
            meta="at-20",
            name=_("At 20 °C"),
            hover=[
                bold(_("Reading {n}").format(n=number))
                + "<br>"
                + _("at 20 °C {deviation}; nothing was decided by it").format(deviation=um(deviation, 2))
                for number, deviation in deviations.items()
            ],
        )
    ]


def _beyond(points: Sequence[Point], ruler: Scale, span: tuple[float, float], pixels: int) -> list[Note]:
    """The values of readings drawn at the edge because they lie further out; of those too close together the newest."""
    apart = (span[1] - span[0]) * WORD / pixels
    labelled: list[Point] = []
    for point in reversed(points):
        near = (other for other in labelled if (other.deviation > 0) == (point.deviation > 0))
        if not ruler.fits(point.deviation) and all(other.sequence - point.sequence > apart for other in near):
            labelled.append(point)
    return [
        Note(
            f"<b>{um(point.deviation, 0)}</b>",
            point.sequence,
            ruler.position(point.deviation),
            shift=(0, -14 if point.deviation > 0 else 14),
            colour=zone_role(point.zone),
        )
        for point in labelled
    ]


def _ring(points: Sequence[Point], ringed: int | Literal["newest"] | None, ruler: Scale) -> list[Series]:
    """A ring about the newest reading, or about the one that the page is about, found from two metres away."""
    sequence = points[-1].sequence if ringed == "newest" and points else ringed
    point = next((point for point in points if point.sequence == sequence), None)
    if point is None:
        return []
    colour = zone_role(point.zone)
    return [
        Series(
            [point.sequence],
            [ruler.position(point.deviation)],
            dots=Dots("circle-open", 20, colour, colour, 2.5),
            meta="newest",
            name=_("Newest") if ringed == "newest" else _("This reading"),
        )
    ]


def _average(blocks: Sequence[Block], points: Sequence[Point], ruler: Scale) -> list[Series]:
    """M, as it was after each reading; a gap where there was no memory."""
    # Of very many readings M would be noise: the mean of neighbours says more.
    if len(points) > MANY:
        return []
    course = [(block.middle, block.average) for block in blocks if len(blocks) <= GROUPS] + [
        (point.sequence, point.average) for point in points
    ]
    if all(value is None for _x, value in course):
        return []
    return [
        Series(
            [x for x, _value in course],
            [None if value is None else ruler.position(value) for _x, value in course],
            Pen(Faded("average", 0.7), 1.25, steps="hv" if len(course) <= 400 else "linear"),
            meta="average",
            name=_("Running average M"),
        )
    ]
