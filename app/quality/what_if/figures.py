"""Chart of deviations with the current and the selected settings, and of what the corrections took out. Pure; mm in, µm on the axes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from app.charts import Axis, Chart, Dots, Panel, Pen, Room, Rule, Series, bold, reading_axis
from app.core.natural_limit import NaturalLimit, tolerance_about_target
from app.language.i18n import _

FAR = 3.0  # times the tolerance: what deviates further is drawn at the edge
SPLIT = 0.36  # of the height is for the offsets


@dataclass(frozen=True)
class Course:
    """A course: numbers of readings and what they have, mm."""

    sequence: Sequence[int]
    values: Sequence[float]


@dataclass(frozen=True)
class CourseChart:
    """Values to draw. half: of the tolerance; taken: what corrections had taken out of the size when a part was cut."""

    key: str
    today: Course
    other: Course
    today_taken: Course
    other_taken: Course
    half: float
    readings: int
    natural_limit: NaturalLimit = NaturalLimit.NONE


def course_figure(chart: CourseChart, *, width: int = 1240) -> Chart:
    """Deviations above, offsets below, on one axis of readings."""
    edge = FAR * chart.half
    reach = [min(edge, abs(value)) for line in (chart.today, chart.other) for value in line.values]
    high = max([chart.half * 1.25, *reach]) * 1000 * 1.05
    same = chart.other == chart.today and chart.other_taken == chart.today_taken  # nothing else is asked
    today = Pen("steady" if same else "faint", 1.25)
    courses = [(chart.today, chart.today_taken, _("Current settings"), today, "circle-open")]
    if not same:
        courses.append((chart.other, chart.other_taken, _("Other settings"), Pen("correction"), "circle"))
    alone = chart.readings <= 300
    above = [
        Series(
            list(line.sequence),
            [round(min(max(value, -edge), edge) * 1000, 3) for value in line.values],
            pen,
            Dots(symbol, 5, pen.colour) if alone else None,
            meta="course",
            name=name,
            hover=bold(_("Reading") + " %{x}") + f"<br>%{{y:+.1f}} µm<br>{name}",
        )
        for line, _taken, name, pen, symbol in courses
    ]
    below = [
        Series(
            list(taken.sequence),
            [round(value * 1000, 3) for value in taken.values],
            replace(pen, steps="hv"),
            meta="taken",
            hover=bold(_("Reading") + " %{x}") + "<br>%{y:+.1f} µm " + _("taken out") + f"<br>{name}",
        )
        for _line, taken, name, pen, _symbol in courses
    ]
    judged = tolerance_about_target(chart.half, chart.natural_limit).judged
    limits = [Rule(Pen("ink", 1.25, "dash"), limit * 1000) for limit in judged]
    shape = "+.0f" if high > 8 else "+.1f"
    deviations = Axis(_("Deviation, µm"), reach=(-high, high), format=shape, ticks=7, zero="faint")
    return Chart(
        [
            Panel([*limits, *above], deviations, (SPLIT + 0.06, 1)),
            Panel(below, Axis(_("Taken out, µm"), format="+.0f", ticks=4), (0, SPLIT)),
        ],
        reading_axis((chart.today.sequence[0] - 1, chart.today.sequence[-1] + 1), width),
        Room(left=76, bottom=48, top=40),
    )
