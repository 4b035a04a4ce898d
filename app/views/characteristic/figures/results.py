"""Chart of a variant's results beside the value (run-out, out-of-roundness, taper, repeatability) over the readings, in µm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from app.language.i18n import _
from app.language.numbers import NO_BREAK_SPACE, signed
from app.views.characteristic.figures.blocks import see_through
from app.web.theme import Palette, ThemeName, layout, palette

SIGNED = frozenset({"taper"})  # the others are sizes without a sign


@dataclass(frozen=True)
class ResultPoint:
    """One result of one reading, mm. `link` opens the reading."""

    sequence: int
    value: float
    excluded: bool = False
    link: str | None = None


@dataclass(frozen=True)
class ResultRange:
    """The results of many readings in one, mm. `link` opens this part of the chart."""

    first: int
    last: int
    minimum: float
    maximum: float
    mean: float
    link: str | None = None


def result_figure(
    name: str,
    title: str,
    points: Sequence[ResultPoint],
    ranges: Sequence[ResultRange] = (),
    *,
    theme: ThemeName = "light",
) -> dict[str, Any]:
    """The course of one result; `title` is what it is called. Of very many readings each block with its extremes."""
    colours = palette(theme)
    empty = not points and not ranges
    return {
        "data": _envelope(name, ranges, colours) if ranges else _points(name, points, colours),
        "layout": layout(
            theme,
            margin={"l": 78, "r": 20, "t": 12, "b": 48},
            xaxis={
                "title": {"text": _("Reading number"), "font": {"size": 13, "color": colours.quiet}, "standoff": 6},
                "tickformat": "d",
                "showgrid": False,
                "showline": True,
                "nticks": 9,
            },
            yaxis={
                "title": {"text": f"{title}, µm", "font": {"size": 13, "color": colours.quiet}, "standoff": 6},
                "fixedrange": True,
                "nticks": 5,
                "rangemode": "normal" if name in SIGNED else "tozero",
                "zeroline": name in SIGNED,
                "zerolinecolor": colours.faint,
            },
            annotations=[_nothing(colours)] if empty else [],
        ),
    }


def worded(name: str, value: float) -> str:
    """A result in µm, with its sign where it has one."""
    text = signed(value * 1000, 2) if name in SIGNED else f"{value * 1000:.2f}"
    return f"{text}{NO_BREAK_SPACE}µm"


def _points(name: str, points: Sequence[ResultPoint], colours: Palette) -> list[dict[str, Any]]:
    if not points:
        # Without a trace plotly would draw no axes.
        return [{"type": "scatter", "x": [1], "y": [0], "opacity": 0, "hoverinfo": "skip"}]
    return [
        {
            "type": "scatter",
            "mode": "lines+markers" if len(points) <= 400 else "markers",
            "meta": "results",
            "x": [point.sequence for point in points],
            "y": [point.value * 1000 for point in points],
            "line": {"width": 1, "color": colours.faint},
            "marker": {
                "symbol": ["circle-open" if point.excluded else "circle" for point in points],
                "size": 7 if len(points) <= 400 else 4,
                "color": colours.steady,
            },
            "customdata": [point.link for point in points],
            "text": [
                f"<b>{_('Reading {n}').format(n=point.sequence)}</b><br>{worded(name, point.value)}"
                + (f"<br>{_('excluded from statistics')}" if point.excluded else "")
                for point in points
            ],
            "hovertemplate": "%{text}<extra></extra>",
            "cliponaxis": False,
        }
    ]


def _envelope(name: str, ranges: Sequence[ResultRange], colours: Palette) -> list[dict[str, Any]]:
    text = [
        "<br>".join(
            (
                f"<b>{_('Readings {first} to {last}').format(first=block.first, last=block.last)}</b>",
                _("largest {value}").format(value=worded(name, block.maximum)),
                _("mean {value}").format(value=worded(name, block.mean)),
                _("smallest {value}").format(value=worded(name, block.minimum)),
            )
        )
        for block in ranges
    ]
    common = {
        "type": "scatter",
        "mode": "lines",
        "x": [(block.first + block.last) / 2 for block in ranges],
        "customdata": [block.link for block in ranges],
        "text": text,
        "hovertemplate": "%{text}<extra></extra>",
    }
    edge = {"width": 1, "color": see_through(colours.steady, 0.5)}
    return [
        common | {"meta": "minimum", "y": [block.minimum * 1000 for block in ranges], "line": edge},
        common
        | {
            "meta": "maximum",
            "y": [block.maximum * 1000 for block in ranges],
            "line": edge,
            "fill": "tonexty",
            "fillcolor": see_through(colours.steady),
        },
        common
        | {
            "meta": "mean",
            "y": [block.mean * 1000 for block in ranges],
            "line": {"width": 1.5, "color": colours.average},
        },
    ]


def _nothing(colours: Palette) -> dict[str, Any]:
    return {
        "xref": "paper",
        "yref": "paper",
        "x": 0.5,
        "y": 0.5,
        "text": f"<b>{_('Nothing yet')}</b>",
        "showarrow": False,
        "font": {"size": 15, "color": colours.quiet},
    }
