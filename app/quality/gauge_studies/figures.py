"""Gauge studies drawn: values in order, linearity, components, by part and by operator. Pure; mm in, µm on the axes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.core.spc.gauge.crossed import Study
from app.core.spc.gauge.linearity import Linearity
from app.core.spc.gauge.single import Bias
from app.language.i18n import _
from app.quality.gauge_studies.evaluation import Evaluation
from app.quality.gauge_studies.labels import components
from app.web.theme import Palette, ThemeName, layout, legend, palette

SHARE = 0.1  # of the tolerance on either side of the reference: what the gauge may take (type 1)
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "x", "star", "hexagon")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "5px,2px", "2px,6px")
MOST_TRACES = 12


def figure_of(
    picture: str,
    kind: str,
    settings: Mapping[str, Any],
    rows: Sequence[Mapping[str, Any]],
    found: Evaluation,
    *,
    theme: ThemeName = "light",
) -> dict[str, Any]:
    """The chart of a study; an empty one where the study has no such picture."""
    if kind == "linearity":
        return _linearity(rows, found, theme)
    if kind != "grr":
        return _repeats(settings, rows, found, theme)
    if picture == "components":
        return _components(settings, found, theme)
    return _crossed(found, theme, by_operator=picture == "operators")


def _repeats(
    settings: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], found: Evaluation, theme: ThemeName
) -> dict[str, Any]:
    """Values in order of time, less the reference, with their mean and what they may take of the tolerance."""
    colours = palette(theme)
    off = (np.array(rows[0]["values"]) - settings["reference"]) * 1000
    data = [_points(list(range(1, len(off) + 1)), off, _("Values"), colours.steady, lines=True)]
    lines = [_level(0.0, colours.ink, _("reference"), 1.75)]
    if isinstance(found.bias, Bias):
        mean, s = found.bias.bias * 1000, found.bias.repeatability * 1000
        lines.append(_level(mean, colours.correction, _("mean"), 2))
        lines += [
            _level(mean + side * 3 * s, colours.correction, f"{'+' if side > 0 else '−'}3 s", 1, "4px,4px")
            for side in (-1, 1)
        ]
    tolerance = settings.get("tolerance")
    if tolerance:
        lines += [
            _level(side * SHARE * tolerance * 1000, colours.attention, _("10 % of the tolerance"), 1.5, "8px,4px")
            for side in (-1, 1)
        ]
    heights = [*off.tolist(), *(line["y0"] for line, _label in lines)]
    return _drawn(data, lines, heights, theme, _("Value"), _("Value less reference, µm"), x_range=[0, len(off) + 1])


def _linearity(rows: Sequence[Mapping[str, Any]], found: Evaluation, theme: ThemeName) -> dict[str, Any]:
    """Biases over the reference, their means, the line and its band; where the band leaves 0 out, the gauge is biased."""
    colours = palette(theme)
    x = [row["reference"] for row in rows for _value in row["values"]]
    y = [(value - row["reference"]) * 1000 for row in rows for value in row["values"]]
    data = [_points(x, y, _("Values"), colours.steady)]
    heights = [0.0, *y]
    if isinstance(found.linearity, Linearity):
        line = found.linearity
        at = np.linspace(min(x), max(x), 41)
        band = np.array([line.line_at(float(size)) for size in at]) * 1000
        quiet = {"type": "scatter", "mode": "lines", "x": at.tolist(), "hoverinfo": "skip"}
        data = [
            quiet | {"y": band[:, 1].tolist(), "line": {"width": 0}, "showlegend": False, "meta": "low"},
            quiet
            | {"y": band[:, 2].tolist(), "line": {"width": 0}, "fill": "tonexty", "fillcolor": _faded(colours.correction), "name": _("95 % band of the line"), "meta": "band"},
            quiet | {"y": band[:, 0].tolist(), "line": {"width": 2, "color": colours.correction}, "name": _("Line"), "meta": "line"},
            *data,
            _points(list(line.biases), [1000 * bias for bias in line.biases.values()], _("Mean bias"), colours.ink, size=11, symbol="diamond"),
        ]  # fmt: skip
        heights += band.reshape(-1).tolist()
    lines = [_level(0.0, colours.ink, "", 1.75)]
    room = 0.05 * (max(x) - min(x) or 1.0)
    return _drawn(
        data,
        lines,
        heights,
        theme,
        _("Reference, mm"),
        _("Bias, µm"),
        x_range=[min(x) - room, max(x) + room],
        named=True,
        tickformat="~g",
    )


def _components(settings: Mapping[str, Any], found: Evaluation, theme: ThemeName) -> dict[str, Any]:
    """Percent of the total variation and of the tolerance, side by side, with 10 and 30 %."""
    colours = palette(theme)
    if not isinstance(found.anova, Study):
        return {"data": [], "layout": layout(theme)}
    study, tolerance = found.anova, settings.get("tolerance")
    rows = components(study)[:-1]
    names = [name for name, _sigma in rows]
    series = [(_("of the variation"), [study.percent(sigma) for _name, sigma in rows], colours.steady)]
    if tolerance:
        shares = [study.percent_tolerance(sigma, tolerance) for _name, sigma in rows]
        series.append((_("of the tolerance"), shares, colours.correction))
    data: list[dict[str, Any]] = [
        {
            "type": "bar",
            "name": name,
            "meta": "components",
            "x": names,
            "y": values,
            "marker": {"color": colour},
            "text": [f"{value:.0f}" for value in values],
            "textposition": "outside",
            "cliponaxis": False,
            "hovertemplate": "%{x}: %{y:.1f} %<extra></extra>",
        }
        for name, values, colour in series
    ]
    top = max(value for _name, values, _colour in series for value in values)
    lines = [
        _level(10.0, colours.quiet, "10 %", 1.5, "4px,4px"),
        _level(30.0, colours.attention, "30 %", 1.5, "8px,4px"),
    ]
    figure = _drawn(data, lines, [0.0, top], theme, None, _("Share, %"), x_range=None, named=True)
    figure["layout"]["yaxis"] |= {"range": [0, max(top, 32) * 1.12], "tickformat": "~g"}
    figure["layout"] |= {"bargap": 0.25, "bargroupgap": 0.08}
    return figure


def _crossed(found: Evaluation, theme: ThemeName, *, by_operator: bool) -> dict[str, Any]:
    """Values by part, each operator with a shape and a line of means; or by operator, all parts about their own mean."""
    colours = palette(theme)
    block = found.block
    assert block is not None
    tones = (colours.steady, colours.correction, colours.wear, colours.ink)
    data: list[dict[str, Any]] = []
    if by_operator:
        # What operators differ by shows when each part's own mean is taken off.
        off = (block - block.mean(axis=(1, 2), keepdims=True)) * 1000
        for place, name in enumerate(found.operators):
            values = off[:, place, :].reshape(-1)
            data.append(_points([name] * len(values), values, name, colours.steady))
        means = off.mean(axis=(0, 2))
        data.append(
            _points(list(found.operators), means, _("Mean"), colours.ink, size=12, symbol="diamond", lines=True)
        )
        return _drawn(data, [_level(0.0, colours.quiet, "", 1, "4px,4px")], off.reshape(-1).tolist(), theme, _("Operator"), _("Value less the part's mean, µm"), x_range=None)  # fmt: skip
    off = (block - block.mean()) * 1000
    for place, name in enumerate(found.operators[:MOST_TRACES]):
        tone, symbol = tones[place % len(tones)], SYMBOLS[place % len(SYMBOLS)]
        trials = off.shape[2]
        x = [part for part in found.parts for _trial in range(trials)]
        data.append(_points(x, off[:, place, :].reshape(-1), name, tone, symbol=symbol) | {"showlegend": False})
        mean = _points(list(found.parts), off[:, place, :].mean(axis=1), name, tone, symbol=symbol, size=9, lines=True)
        mean["line"] |= {"dash": DASHES[place % len(DASHES)]}
        data.append(mean)
    return _drawn(data, [_level(0.0, colours.quiet, "", 1, "4px,4px")], off.reshape(-1).tolist(), theme, _("Part"), _("Value less the mean of all, µm"), x_range=None, named=len(found.operators) > 1)  # fmt: skip


def _points(
    x: Sequence[Any], y: Any, name: str, colour: str, *, size: int = 7, symbol: str = "circle", lines: bool = False
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines+markers" if lines else "markers",
        "name": name,
        "meta": "values",
        "x": list(x),
        "y": [float(value) for value in y],
        "marker": {"symbol": symbol, "size": size, "color": colour, "opacity": 0.85},
        "line": {"width": 1.25, "color": colour},
        "hovertemplate": "%{x}: %{y:+.2f} µm<extra></extra>",
        "cliponaxis": False,
    }


def _level(
    y: float, colour: str, text: str, width: float, dash: str = "solid"
) -> tuple[dict[str, Any], dict[str, Any]]:
    line = {
        "type": "line",
        "layer": "below",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": y,
        "y1": y,
        "line": {"color": colour, "width": width, "dash": dash},
    }
    label = {
        "xref": "paper",
        "x": 1,
        "xanchor": "left",
        "xshift": 6,
        "y": y,
        "yanchor": "middle",
        "text": text,
        "showarrow": False,
        "font": {"size": 12, "color": colour},
    }
    return line, label


def _drawn(
    data: list[dict[str, Any]],
    lines: list[tuple[dict[str, Any], dict[str, Any]]],
    heights: Sequence[float],
    theme: ThemeName,
    x_title: str | None,
    y_title: str,
    *,
    x_range: list[float] | None,
    named: bool = False,
    tickformat: str = "d",
) -> dict[str, Any]:
    colours = palette(theme)
    low, high = min(heights), max(heights)
    room = max(0.1 * (high - low), 0.01)
    xaxis: dict[str, Any] = {"showgrid": False, "showline": True}
    if x_title is not None:
        xaxis["title"] = _title(x_title, colours)
    xaxis |= {"type": "category"} if x_range is None else {"range": x_range, "tickformat": tickformat, "nticks": 10}
    labelled = any(label["text"] for _line, label in lines)
    return {
        "data": data,
        "layout": layout(
            theme,
            margin={"l": 76, "r": 140 if labelled and x_range is not None else 44, "t": 40 if named else 20, "b": 56},
            showlegend=named,
            legend=legend(theme),
            xaxis=xaxis,
            yaxis={
                "range": [low - room, high + room],
                "tickformat": "+.4~g",
                "nticks": 7,
                "title": _title(y_title, colours),
            },
            shapes=[line for line, _label in lines],
            annotations=[label for _line, label in lines if label["text"]],
        ),
    }


def _title(text: str, colours: Palette) -> dict[str, Any]:
    return {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 8}


def _faded(colour: str) -> str:
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.18)"
