"""Histogram with fitted curve and limits, and the normal probability plot. Pure; mm in, µm on the axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, exp, pi, sqrt
from typing import Any

import numpy as np
from scipy.special import ndtri

from app.core.spc.capability import Limits
from app.core.spc.refusal import Floats
from app.core.spc.spread import far_off
from app.language.i18n import _, ngettext
from app.language.numbers import signed
from app.web.theme import Palette, ThemeName, layout, legend, nothing_drawn, palette

MOST_BARS, FEWEST_BARS = 60, 8
CURVE = 161  # points of a drawn curve
MOST_POINTS, TAIL = 600, 40  # of the probability plot, and of each of its ends that are drawn whichever
SHARES = (0.00135, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.99865)


@dataclass(frozen=True)
class CapabilityChart:
    """Values to draw. within: the sigma within, None where it may not be shown; percentiles: 0.135 %, 50 %, 99.865 %."""

    values: Floats
    limits: Limits
    mean: float | None
    overall: float | None
    within: float | None
    percentiles: Sequence[float] | None
    normal: bool


def histogram(drawn: CapabilityChart, *, theme: ThemeName = "light") -> dict[str, Any]:
    """Bars of equal width, the fitted normal curve (overall; dashed: within) or the percentiles, and the limits."""
    colours = palette(theme)
    if not len(drawn.values):
        return nothing_drawn(theme, _("No readings here"))
    near = _near(drawn)
    edges = edges_of(near)
    counts, _edges = np.histogram(near, edges)
    width = float(edges[1] - edges[0])
    centres = (edges[:-1] + edges[1:]) / 2
    low, high = _range(drawn, edges)
    beyond = [_outside(float(centre), drawn.limits) for centre in centres]
    data: list[dict[str, Any]] = [
        {
            "type": "bar",
            "name": _("Readings"),
            "showlegend": False,
            "meta": "histogram",
            "x": (centres * 1000).tolist(),
            "y": counts.tolist(),
            "width": width * 1000 * 0.92,
            "marker": {"color": [colours.attention if out else colours.steady for out in beyond], "opacity": 0.75},
            "hovertemplate": _("%{x:+.2f} µm: %{y} readings") + "<extra></extra>",
        }
    ]
    if drawn.mean is not None and drawn.normal:
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
                data.append(_curve(name, at, height, colours, dash))
    lines, names = _limit_lines(drawn, colours, (low, high))
    return {
        "data": data,
        "layout": _layout(
            theme,
            bargap=0,
            xaxis=_axis(_("Deviation, µm"), colours, (low, high)),
            yaxis={"rangemode": "tozero", "nticks": 5, "title": _title(_("Readings"), colours)},
            shapes=lines,
            annotations=[*names, *_beyond(drawn, colours)],
        ),
    }


def probability(drawn: CapabilityChart, *, theme: ThemeName = "light") -> dict[str, Any]:
    """Ordered readings against normal quantiles: normal readings lie on the line. Of many, the ends and a thinned middle."""
    colours = palette(theme)
    if len(drawn.values) < 2:
        return nothing_drawn(theme, _("No readings here"))
    ordered = np.sort(drawn.values)
    n = len(ordered)
    at = np.arange(n) if n <= MOST_POINTS else _spread(n)
    z = ndtri((at + 1 - 0.3) / (n + 0.4))  # median ranks, Benard
    near = _near(drawn)
    low, high = _range(drawn, np.array([near.min(), near.max()]))
    reach = max(3.4, float(np.abs(z).max()) + 0.2)
    data: list[dict[str, Any]] = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": _("Readings"),
            "meta": "readings",
            "x": (ordered[at] * 1000).tolist(),
            "y": z.tolist(),
            "marker": {"size": 6, "color": colours.steady, "opacity": 0.8},
            "hovertemplate": "%{x:+.2f} µm<extra></extra>",
        }
    ]
    if drawn.mean is not None and drawn.overall:
        data.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": _("Normal distribution"),
                "meta": "line",
                "x": [(drawn.mean + side * reach * drawn.overall) * 1000 for side in (-1, 1)],
                "y": [-reach, reach],
                "line": {"width": 2, "color": colours.correction},
                "hoverinfo": "skip",
            }
        )
    lines, names = _limit_lines(drawn, colours, (low, high), percentiles=False)
    return {
        "data": data,
        "layout": _layout(
            theme,
            xaxis=_axis(_("Deviation, µm"), colours, (low, high)),
            yaxis={
                "range": [-reach, reach],
                "tickmode": "array",
                "tickvals": [float(ndtri(share)) for share in SHARES],
                "ticktext": [f"{share * 100:g} %" for share in SHARES],
                "title": _title(_("Share of the readings below"), colours),
            },
            shapes=lines,
            annotations=[*names, *_beyond(drawn, colours)],
        ),
    }


def _near(drawn: CapabilityChart) -> Floats:
    """The readings that the picture shows: those far from all others would leave nothing to be seen of the rest."""
    return np.asarray(drawn.values[~far_off(drawn.values)])


def _beyond(drawn: CapabilityChart, colours: Palette) -> list[dict[str, Any]]:
    """Note below the picture: the number of readings outside it."""
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
    anchor = {"xref": "paper", "x": 1.0, "xanchor": "right", "yref": "paper", "y": -0.2, "yanchor": "top"}
    return [anchor | {"text": "  ".join(words), "showarrow": False, "font": {"size": 13, "color": colours.attention}}]


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


def _curve(name: str, at: Floats, height: list[float], colours: Palette, dash: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "meta": dash,
        "x": (at * 1000).tolist(),
        "y": height,
        "line": {"width": 2, "color": colours.correction, "dash": dash},
        "hoverinfo": "skip",
    }


def _limit_lines(
    drawn: CapabilityChart, colours: Palette, extent: tuple[float, float], *, percentiles: bool = True
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    marks: list[tuple[float, str, str, float, str]] = []
    for limit, name in ((drawn.limits.lower, _("lower limit")), (drawn.limits.upper, _("upper limit"))):
        if limit is not None:
            marks.append((limit, name, colours.ink, 2, "solid"))
    marks.append((0.0, _("target"), colours.quiet, 1, "4px,4px"))
    if percentiles and not drawn.normal and drawn.percentiles is not None:
        names = ("0.135 %", "50 %", "99.865 %")
        marks += [
            (value, name, colours.correction, 1.5, "6px,3px")
            for value, name in zip(drawn.percentiles, names, strict=True)
        ]
    lines = [
        {
            "type": "line",
            "yref": "paper",
            "y0": 0,
            "y1": 1,
            "x0": at * 1000,
            "x1": at * 1000,
            "line": {"color": colour, "width": width, "dash": dash},
        }
        for at, _name, colour, width, dash in marks
        if extent[0] <= at <= extent[1]
    ]
    labels = [
        {
            "x": at * 1000,
            "yref": "paper",
            "y": 1,
            "yanchor": "bottom",
            "xanchor": "center",
            "yshift": 14 if colour == colours.correction else 0,
            "text": name,
            "showarrow": False,
            "font": {"size": 12, "color": colour if colour != colours.ink else colours.quiet},
        }
        for at, name, colour, _width, _dash in marks
        if extent[0] <= at <= extent[1]
    ]
    return lines, labels


def _title(text: str, colours: Palette) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 8}


def _axis(title: str, colours: Palette, extent: tuple[float, float]) -> dict[str, Any]:
    return {
        "range": [extent[0] * 1000, extent[1] * 1000],
        "tickformat": "+.4~g",
        "nticks": 9,
        "showline": True,
        "title": _title(title, colours),
    }


def _layout(theme: ThemeName, **more: Any) -> dict[str, Any]:
    return layout(
        theme,
        margin={"l": 76, "r": 28, "t": 44, "b": 96},
        showlegend=True,
        legend=legend(theme, y=-0.2, yanchor="top"),
        **more,
    )
