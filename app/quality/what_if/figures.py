"""Chart of deviations with the current and the selected settings, and of what the corrections took out. Pure; mm in, µm on the axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from app.language.i18n import _
from app.web.theme import Palette, ThemeName, layout, palette

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


def course_figure(chart: CourseChart, *, theme: ThemeName = "light", width: int = 1240) -> dict[str, Any]:
    """The figure as Plotly takes it: deviations above, offsets below, on one axis of readings."""
    colours = palette(theme)
    edge = FAR * chart.half
    reach = [min(edge, abs(value)) for line in (chart.today, chart.other) for value in line.values]
    high = max([chart.half * 1.25, *reach]) * 1000 * 1.05
    same = chart.other == chart.today and chart.other_taken == chart.today_taken  # nothing else is asked
    today = colours.steady if same else colours.faint
    courses = [(chart.today, chart.today_taken, _("Current settings"), (today, 1.25, "circle-open"))]
    if not same:
        courses.append((chart.other, chart.other_taken, _("Other settings"), (colours.correction, 1.5, "circle")))
    alone = chart.readings <= 300
    data = [_course(line, name, look, edge, "y", alone=alone) for line, _taken, name, look in courses]
    data += [_steps(removed, name, look) for _line, removed, name, look in courses]
    first, last = chart.today.sequence[0], chart.today.sequence[-1]
    return {
        "data": data,
        "layout": layout(
            theme,
            margin={"l": 76, "r": 16, "t": 40, "b": 48},
            showlegend=True,
            legend={
                "orientation": "h",
                "x": 0,
                "xanchor": "left",
                "y": 1.01,
                "yanchor": "bottom",
                "font": {"size": 13, "color": colours.quiet},
            },
            xaxis={
                "range": [first - 1, last + 1],
                "showgrid": False,
                "showline": True,
                "tickformat": "d",
                "nticks": 8 if width > 900 else 5,
                "anchor": "y2",
                "title": _title(_("Reading"), colours),
            },
            yaxis={
                "domain": [SPLIT + 0.06, 1],
                "range": [-high, high],
                "tickformat": "+.0f" if high > 8 else "+.1f",
                "nticks": 7,
                "zeroline": True,
                "zerolinecolor": colours.faint,
                "title": _title(_("Deviation, µm"), colours),
            },
            yaxis2={
                "domain": [0, SPLIT],
                "color": colours.quiet,
                "gridcolor": colours.grid,
                "linecolor": colours.faint,
                "zeroline": False,
                "tickfont": {"size": 12},
                "tickformat": "+.0f",
                "nticks": 4,
                "title": _title(_("Taken out, µm"), colours),
            },
            shapes=[_limit(sign * chart.half, colours) for sign in (-1, 1)],
        ),
    }


def _course(
    line: Course, name: str, look: tuple[str, float, str], edge: float, axis: str, *, alone: bool
) -> dict[str, Any]:
    colour, width, symbol = look
    return {
        "type": "scatter",
        "mode": "lines+markers" if alone else "lines",
        "name": name,
        "meta": "course",
        "x": list(line.sequence),
        "y": [round(min(max(value, -edge), edge) * 1000, 3) for value in line.values],
        "yaxis": axis,
        "line": {"width": width, "color": colour},
        "marker": {"size": 5, "symbol": symbol, "color": colour},
        "hovertemplate": f"<b>{_('Reading')} %{{x}}</b><br>%{{y:+.1f}} µm<extra>{name}</extra>",
    }


def _steps(line: Course, name: str, look: tuple[str, float, str]) -> dict[str, Any]:
    colour, width, _symbol = look
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "meta": "taken",
        "showlegend": False,
        "x": list(line.sequence),
        "y": [round(value * 1000, 3) for value in line.values],
        "yaxis": "y2",
        "line": {"width": width, "color": colour, "shape": "hv"},
        "hovertemplate": f"<b>{_('Reading')} %{{x}}</b><br>%{{y:+.1f}} µm {_('taken out')}<extra>{name}</extra>",
    }


def _limit(height: float, colours: Palette) -> dict[str, Any]:
    return {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": height * 1000,
        "y1": height * 1000,
        "line": {"color": colours.ink, "width": 1.25, "dash": "dash"},
    }


def _title(text: str, colours: Palette) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 6}
