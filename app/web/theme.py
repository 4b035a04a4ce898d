"""Common look of all charts: zone names, their shapes and colours, and the theme of a chart.

ISA-101: quiet greys while all is well; colour only for what needs someone, and never colour alone – every zone and every
state has a shape and a word as well. The colours are those of `frontend/static/css/tokens.css` (a test compares them).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, cast

from app import charts
from app.charts import BANDS, Role
from app.charts import ThemeName as ThemeName  # noqa: PLC0414
from app.language.times import on_axis, plant_zone
from app.web.states import tone_of, word_of

FONT = '"IBM Plex Sans", "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", system-ui, sans-serif'


@dataclass(frozen=True)
class Palette:
    """The colours of one theme, named by what they are for."""

    surface: str  # behind a chart
    ink: str  # what is read first
    quiet: str  # what is read second
    faint: str  # axis lines
    grid: str
    steady: str  # readings that need nobody
    average: str  # the running average
    attention: str  # out of tolerance
    wear: str  # tool worn
    stop: str  # probe fault, machine stopped
    waiting: str  # waits for a person or for the machine
    correction: str  # corrections and offsets
    bands: tuple[str, str, str, str, str, str]  # behind the readings, from the target outward


PALETTES: dict[ThemeName, Palette] = {
    theme: Palette(
        **{role: colour for role, colour in colours.items() if "-" not in role and role != "mended"},
        bands=tuple(colours[role] for role in BANDS),  # type: ignore[arg-type]
    )
    for theme, colours in charts.PALETTES.items()
}

# The same shapes for Plotly (its symbols) and for badges and small pictures (paths in a 24 × 24 box).
ZONE_SYMBOLS = {
    "zero": "circle",
    "average": "diamond",
    "full": "square",
    "oversize": "triangle-up",
    "undersize": "triangle-down",
    "wear": "hexagon2",
    "probe_fault": "x",
}
ZONE_OUTLINES = {
    "zero": "M12 6a6 6 0 1 0 0 12a6 6 0 0 0 0-12z",
    "average": "M12 3.5 20.5 12 12 20.5 3.5 12z",
    "full": "M5 5h14v14H5z",
    "oversize": "M12 3 22 20H2z",
    "undersize": "M12 21 2 4h20z",
    "wear": "M7 3h10l5 9-5 9H7l-5-9z",
    "probe_fault": "M7 2 12 7l5-5 5 5-5 5 5 5-5 5-5-5-5 5-5-5 5-5-5-5z",
}


def zone_name(zone: str) -> str:
    """The zone in one or two words."""
    return word_of(zone)


def zone_colour(zone: str, colours: Palette) -> str:
    """Grey inside the tolerance; a colour where someone is needed."""
    tone: str = getattr(colours, tone_of(zone))
    return tone


def zone_role(zone: str) -> Role:
    """Grey inside the tolerance; a colour where someone is needed."""
    return cast("Role", tone_of(zone))


def palette(theme: ThemeName) -> Palette:
    return PALETTES[theme]


def layout(theme: ThemeName, **more: Any) -> dict[str, Any]:
    """The layout that every chart begins with."""
    colours = palette(theme)
    axis = {
        "color": colours.quiet,
        "gridcolor": colours.grid,
        "linecolor": colours.faint,
        "zeroline": False,
        "ticks": "",
        "tickfont": {"size": 12},
        "automargin": False,
    }
    base: dict[str, Any] = {
        "autosize": True,
        "font": {"family": FONT, "size": 13, "color": colours.ink},
        "paper_bgcolor": colours.surface,
        "plot_bgcolor": colours.surface,
        "margin": {"l": 64, "r": 16, "t": 16, "b": 44, "pad": 0},
        "showlegend": False,
        "hovermode": "closest",
        "hoverlabel": {
            "bgcolor": colours.surface,
            "bordercolor": colours.faint,
            "font": {"family": FONT, "size": 13, "color": colours.ink},
            "align": "left",
        },
        "dragmode": "zoom",
        "uirevision": "keep",
        "separators": ".\N{NARROW NO-BREAK SPACE}",
        "xaxis": dict(axis),
        "yaxis": dict(axis),
    }
    for key, value in more.items():
        base[key] = base[key] | value if isinstance(base.get(key), dict) and isinstance(value, dict) else value
    return base


def date_axis(moments: Iterable[datetime] = (), **more: Any) -> dict[str, Any]:
    """An axis of time: 24 hours, day before month. Moments carry their offset; drawn is the wall clock of the plant, whose zone the axis names.

    moments: of what is drawn. Where all are of one hour it shows half a day before and after: else it would count seconds.
    """
    day = 86_400_000
    known = sorted(moments)
    if known and known[-1] - known[0] <= timedelta(hours=1):
        half = timedelta(hours=12)
        more = {"range": [on_axis(known[0] - half), on_axis(known[-1] + half)]} | more
    return {
        "type": "date",
        "title": {"text": plant_zone().key, "font": {"size": 12}, "standoff": 4},
        "automargin": "height",
        "showgrid": False,
        "showline": True,
        "tickformatstops": [
            {"dtickrange": [None, 59_999], "value": "%H:%M:%S\n%-d %b %Y"},
            {"dtickrange": [60_000, day - 1], "value": "%H:%M\n%-d %b %Y"},
            {"dtickrange": [day, None], "value": "%-d %b\n%Y"},
        ],
    } | more


def legend(theme: ThemeName, **more: Any) -> dict[str, Any]:
    """The names of what is drawn, in a row above the chart; to touch one hides nothing."""
    return {
        "orientation": "h",
        "x": 0,
        "xanchor": "left",
        "y": 1.02,
        "yanchor": "bottom",
        "font": {"size": 13, "color": palette(theme).quiet},
        "itemclick": False,
        "itemdoubleclick": False,
    } | more


def nothing_drawn(theme: ThemeName, words: str) -> dict[str, Any]:
    """A figure that says why there is nothing in it."""
    middle = {"xref": "paper", "yref": "paper", "x": 0.5, "y": 0.5, "showarrow": False, "text": f"<b>{words}</b>"}
    return {
        "data": [],
        "layout": layout(
            theme,
            xaxis={"visible": False},
            yaxis={"visible": False},
            annotations=[middle | {"font": {"size": 15, "color": palette(theme).quiet}}],
        ),
    }
