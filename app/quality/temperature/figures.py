"""Sizes by temperature as a chart. Pure; lengths in mm in, µm on the axis."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.charts import Axis, Chart, Dots, Faded, Mark, Panel, Pen, Room, Series, band, nothing
from app.core.regression import Effect
from app.language.i18n import _
from app.quality.temperature.wording import per


@dataclass(frozen=True)
class TemperatureChart:
    """Values to draw: of each reading its temperature (°C), and its size without level, warming up and wear.

    effect: None where the temperature has none. expected: by the expansion alone, mm/K.
    """

    key: str
    temperature: Sequence[float]
    apart: Sequence[float]
    sequence: Sequence[int]
    effect: Effect | None
    expected: float | None
    of: str


def temperature_figure(chart: TemperatureChart | None) -> Chart:
    """The readings, the line with its interval, and the line of the expansion alone."""
    if chart is None or not chart.temperature:
        return nothing(_("Too few readings with a temperature yet"))
    low, high = min(chart.temperature), max(chart.temperature)
    middle = sum(chart.temperature) / len(chart.temperature)
    ends = [low, middle, high]

    def line(slope: float) -> list[float]:
        return [round(slope * (at - middle) * 1000, 3) for at in ends]

    marks: list[Mark] = []
    if chart.effect is not None:
        e = chart.effect
        outer = [sorted(pair) for pair in zip(line(e.low), line(e.high), strict=True)]
        lower, upper = [pair[0] for pair in outer], [pair[1] for pair in outer]
        marks += band(ends, lower, upper, Faded("correction", 0.18), metas=("low", "band"), name=_("95 % interval"))
        said = per(e.value, "temperature")
        marks.append(Series(ends, line(e.value), Pen("correction", 2.5), meta="line", name=said, hover=said))
    if chart.expected is not None:
        said = per(chart.expected, "temperature")
        name = _("Expansion alone: {value}").format(value=said)
        marks.append(
            Series(ends, line(chart.expected), Pen("ink", 1.5, "dash"), meta="expected", name=name, hover=name)
        )
    marks.append(
        Series(
            list(chart.temperature),
            [round(value * 1000, 3) for value in chart.apart],
            dots=Dots(size=5, opacity=0.7),
            meta="readings",
            name=_("Readings"),
            hover="%{x:.1f} °C: %{y:+.2f} µm",
            links=[f"/characteristics/{chart.key}/readings/{number}" for number in chart.sequence],
        )
    )
    room = 0.04 * (high - low or 1.0)
    title = _("Temperature of the part, °C") if chart.of == "part" else _("Temperature of the machine, °C")
    across = Axis(title, reach=(low - room, high + room), format="~g", ticks=10, grid=False)
    return Chart(
        [Panel(marks, Axis(_("Size without warming up and wear, µm"), format="+.4~g", ticks=7, zero="faint"))],
        across,
        Room(76, 24, 56, 44),
    )
