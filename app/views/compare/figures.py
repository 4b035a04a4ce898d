"""The chart of compared series: small multiples of one scale, or all in one panel. Pure; deviations in mm in, µm or % out."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from app.charts import (
    Axis,
    Chart,
    Dots,
    Faded,
    Mark,
    Note,
    Panel,
    Pen,
    Room,
    Rule,
    Series,
    Share,
    band,
    empty,
    look,
    nothing,
    time_axis,
)
from app.core.natural_limit import NaturalLimit, Tolerance, tolerance_about_target
from app.language.formatting import tolerance_um, um
from app.language.i18n import _

ROOM = Room(84, 72)  # at the right for the tolerance
BETWEEN = 0.05  # of the height, above each panel, for its name


@dataclass(frozen=True)
class Course:
    """One series. x: moments, or numbers counted from its beginning; mean, low, high: of single readings all the same.

    half: half the tolerance, mm. links: what a click opens.
    """

    name: str
    half: float
    x: Sequence[datetime] | Sequence[int]
    mean: Sequence[float | None]
    low: Sequence[float]
    high: Sequence[float]
    links: Sequence[str]
    natural_limit: NaturalLimit = NaturalLimit.NONE

    @property
    def tolerance(self) -> Tolerance:
        """The limits that are judged, mm from the target."""
        return tolerance_about_target(self.half, self.natural_limit)

    @property
    def is_thinned(self) -> bool:
        return list(self.low) != list(self.high)


def compare_figure(
    courses: Sequence[Course], *, overlaid: bool = False, of_tolerance: bool = False, own_scale: bool = False
) -> Chart:
    """Deviations of each series with its tolerance; in µm, or as a share of half the tolerance.

    own_scale: each panel reaches as far as its own readings; else all reach equally far.
    """
    if not any(course.x for course in courses):
        return nothing(_("No readings here"))
    in_time = any(isinstance(moment, datetime) for course in courses for moment in course.x)
    reach = None if own_scale and not overlaid else _reach(courses, of_tolerance)
    axis = time_axis() if in_time else Axis(_("Reading, counted from the beginning"), format="d", grid=False)
    if overlaid:
        marks = [
            mark for number, course in enumerate(courses) for mark in _marks(course, number, of_tolerance, named=True)
        ]
        limits = {course.tolerance for course in courses}
        common = len(limits) == 1
        words = tolerance_um(courses[0].half, courses[0].natural_limit) if common else _("tolerance")
        tolerance = _tolerance(courses[0], of_tolerance, words) if of_tolerance or common else []
        return Chart([Panel([*tolerance, *marks], _axis(reach, of_tolerance))], axis, ROOM)
    height = 1 / len(courses)
    panels = [
        Panel(
            [
                *_tolerance(course, of_tolerance, tolerance_um(course.half, course.natural_limit)),
                *_marks(course, 0, of_tolerance, named=False),
                Note(f"<b>{course.name}</b>", Share(0.0), Share(1, inside=True), "left", "bottom", (0, 3)),
                *([] if course.x else [empty(_("No readings here"))]),
            ],
            _axis(reach, of_tolerance, brief=len(courses) > 1),
            share=(1 - (number + 1) * height, 1 - number * height - BETWEEN),
        )
        for number, course in enumerate(courses)
    ]
    return Chart(panels, axis, ROOM)


def _value(deviation: float, course: Course, of_tolerance: bool) -> float:
    return deviation / course.half * 100 if of_tolerance else deviation * 1000


def _reach(courses: Sequence[Course], of_tolerance: bool) -> tuple[float, float]:
    values = [_value(value, course, of_tolerance) for course in courses for value in (*course.low, *course.high)]
    values += [_value(limit, course, of_tolerance) for course in courses for limit in (0.0, *course.tolerance.judged)]
    room = 0.06 * (max(values) - min(values))
    return min(values) - room, max(values) + room


def _axis(reach: tuple[float, float] | None, of_tolerance: bool, *, brief: bool = False) -> Axis:
    title = _("% of half the tolerance") if of_tolerance else _("µm") if brief else _("Deviation, µm")
    return Axis(title, reach=reach, format="+.4~g", ticks=5, zero="faint")


def _tolerance(course: Course, of_tolerance: bool, words: str) -> list[Mark]:
    """The limits, with words beside the upper one: those of both would meet where the scale is that of a wider tolerance."""
    limits = [_value(limit, course, of_tolerance) for limit in reversed(course.tolerance.judged)]
    return [Rule(Pen("quiet", 1.5), limits[0], words=words), *(Rule(Pen("quiet", 1.5), limit) for limit in limits[1:])]


def _marks(course: Course, number: int, of_tolerance: bool, *, named: bool) -> list[Mark]:
    colour, symbol = look(number)
    mean, low, high = (
        [None if value is None else _value(value, course, of_tolerance) for value in values]
        for values in (course.mean, course.low, course.high)
    )
    between = band(course.x, low, high, Faded(colour, 0.2), metas=("low", "high")) if course.is_thinned else []  # type: ignore[arg-type]
    in_time = any(isinstance(moment, datetime) for moment in course.x)
    dots = None if course.is_thinned else Dots(symbol, 6, colour)
    hover = [f"<b>{course.name}</b><br>{um(value)}" if value is not None else "" for value in course.mean]
    drawn = Series(
        course.x,
        mean,
        None
        if in_time and dots
        else Pen(colour, 1.75 if course.is_thinned else 1),  # over a night no line would be true
        dots,
        meta="readings",
        name=course.name if named else "",
        hover=hover,
        links=course.links,
    )
    return [*between, drawn]
