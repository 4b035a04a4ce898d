"""Gauge studies drawn: values in order, linearity, components, by part and by operator. Pure; mm in, µm on the axes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from app.charts import Axis, Bars, Chart, Dots, Faded, Mark, Panel, Pen, Role, Room, Rule, Series, band, nothing
from app.core.spc.gauge.crossed import Study
from app.core.spc.gauge.linearity import Linearity
from app.core.spc.gauge.single import Bias
from app.language.i18n import _
from app.quality.gauge_studies.evaluation import Evaluation
from app.quality.gauge_studies.labels import components

SHARE = 0.1  # of the tolerance on either side of the reference: what the gauge may take (type 1)
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "x", "star", "hexagon")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "5px,2px", "2px,6px")
TONES: tuple[Role, ...] = ("steady", "correction", "wear", "ink")
MOST_TRACES = 12


def figure_of(
    picture: str,
    kind: str,
    settings: Mapping[str, Any],
    rows: Sequence[Mapping[str, Any]],
    found: Evaluation,
) -> Chart:
    """The chart of a study; an empty one where the study has no such picture."""
    if kind == "linearity":
        return _linearity(rows, found)
    if kind != "grr":
        return _repeats(settings, rows, found)
    if picture == "components":
        return _components(settings, found)
    return _crossed(found, by_operator=picture == "operators")


def _repeats(settings: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], found: Evaluation) -> Chart:
    """Values in order of time, less the reference, with their mean and what they may take of the tolerance."""
    off = (np.array(rows[0]["values"]) - settings["reference"]) * 1000
    lines = [_level(0.0, "ink", _("reference"), 1.75)]
    if isinstance(found.bias, Bias):
        mean, s = found.bias.bias * 1000, found.bias.repeatability * 1000
        lines.append(_level(mean, "correction", _("mean"), 2))
        lines += [
            _level(mean + side * 3 * s, "correction", f"{'+' if side > 0 else '−'}3 s", 1, "4px,4px")
            for side in (-1, 1)
        ]
    if tolerance := settings.get("tolerance"):
        lines += [
            _level(side * SHARE * tolerance * 1000, "attention", _("10 % of the tolerance"), 1.5, "8px,4px")
            for side in (-1, 1)
        ]
    course = _points(range(1, len(off) + 1), off, "steady", lines=True)
    x = Axis(_("Value"), reach=(0, len(off) + 1), format="d", ticks=10, grid=False)
    heights = [*off.tolist(), *(line.y for line in lines)]
    return _chart([*lines, course], x, _height(_("Value less reference, µm"), heights), right=140)


def _linearity(rows: Sequence[Mapping[str, Any]], found: Evaluation) -> Chart:
    """Biases over the reference, their means, the line and its band; where the band leaves 0 out, the gauge is biased."""
    x = [row["reference"] for row in rows for _value in row["values"]]
    y = [(value - row["reference"]) * 1000 for row in rows for value in row["values"]]
    data = [_points(x, y, "steady", name=_("Values"))]
    heights = [0.0, *y]
    if isinstance(found.linearity, Linearity):
        line = found.linearity
        at = np.linspace(min(x), max(x), 41)
        course = np.array([line.line_at(float(size)) for size in at]) * 1000
        middle, low, high = (course[:, column].tolist() for column in range(3))
        name, over = _("95 % band of the line"), at.tolist()
        means = [1000 * bias for bias in line.biases.values()]
        data = [
            *band(over, low, high, Faded("correction", 0.18), metas=("low", "band"), name=name),
            Series(over, middle, Pen("correction", 2), meta="line", name=_("Line")),
            *data,
            _points(list(line.biases), means, "ink", name=_("Mean bias"), size=11, symbol="diamond"),
        ]
        heights += course.reshape(-1).tolist()
    room = 0.05 * (max(x) - min(x) or 1.0)
    reach = (min(x) - room, max(x) + room)
    across = Axis(_("Reference, mm"), reach=reach, format="~g", ticks=10, grid=False)
    return _chart([_level(0.0, "ink", "", 1.75), *data], across, _height(_("Bias, µm"), heights))


def _components(settings: Mapping[str, Any], found: Evaluation) -> Chart:
    """Percent of the total variation and of the tolerance, side by side, with 10 and 30 %."""
    if not isinstance(found.anova, Study):
        return nothing("")
    study, tolerance = found.anova, settings.get("tolerance")
    rows = components(study)[:-1]
    series: list[tuple[str, list[float], Role]] = [
        (_("of the variation"), [study.percent(sigma) for _name, sigma in rows], "steady")
    ]
    if tolerance:
        shares = [study.percent_tolerance(sigma, tolerance) for _name, sigma in rows]
        series.append((_("of the tolerance"), shares, "correction"))
    bars = [
        Bars(
            [name for name, _sigma in rows],
            values,
            colour,
            texts=[f"{value:.0f}" for value in values],
            meta="components",
            name=name,
            hover="%{x}: %{y:.1f} %",
        )
        for name, values, colour in series
    ]
    top = max(value for _name, values, _colour in series for value in values)
    lines = [_level(10.0, "quiet", "10 %", 1.5, "4px,4px"), _level(30.0, "attention", "30 %", 1.5, "8px,4px")]
    height = Axis(_("Share, %"), reach=(0, max(top, 32) * 1.12), format="~g", ticks=7)
    return _chart([*bars, *lines], Axis(kind="names", grid=False), height)


def _crossed(found: Evaluation, *, by_operator: bool) -> Chart:
    """Values by part, each operator with a shape and a line of means; or by operator, all parts about their own mean."""
    block = found.block
    assert block is not None
    zero = _level(0.0, "quiet", "", 1, "4px,4px")
    if by_operator:
        # What operators differ by shows when each part's own mean is taken off.
        off = (block - block.mean(axis=(1, 2), keepdims=True)) * 1000
        data = [
            _points([name] * off[:, place, :].size, off[:, place, :].reshape(-1), "steady")
            for place, name in enumerate(found.operators)
        ]
        data.append(_points(found.operators, off.mean(axis=(0, 2)), "ink", size=12, symbol="diamond", lines=True))
        x, title = Axis(_("Operator"), "names", grid=False), _("Value less the part's mean, µm")
        return _chart([zero, *data], x, _height(title, off.reshape(-1).tolist()))
    data = []
    off = (block - block.mean()) * 1000
    for place, name in enumerate(found.operators[:MOST_TRACES]):
        tone, symbol = TONES[place % len(TONES)], SYMBOLS[place % len(SYMBOLS)]
        x_of_all = [part for part in found.parts for _trial in range(off.shape[2])]
        data.append(_points(x_of_all, off[:, place, :].reshape(-1), tone, symbol=symbol))
        mean = _points(found.parts, off[:, place, :].mean(axis=1), tone, symbol=symbol, size=9, lines=True)
        pen = Pen(tone, 1.25, DASHES[place % len(DASHES)])
        data.append(replace(mean, pen=pen, name=name if len(found.operators) > 1 else ""))
    x, title = Axis(_("Part"), "names", grid=False), _("Value less the mean of all, µm")
    return _chart([zero, *data], x, _height(title, off.reshape(-1).tolist()))


def _points(
    x: Sequence[Any],
    y: Any,
    colour: Role,
    *,
    name: str = "",
    size: int = 7,
    symbol: str = "circle",
    lines: bool = False,
) -> Series:
    return Series(
        list(x),
        [float(value) for value in y],
        Pen(colour, 1.25) if lines else None,
        Dots(symbol, size, colour, opacity=0.85),
        meta="values",
        name=name,
        hover="%{x}: %{y:+.2f} µm",
    )


def _level(y: float, colour: Role, words: str, width: float, dash: str = "solid") -> Rule:
    return Rule(Pen(colour, width, dash), y, words=words, colour=colour)


def _height(title: str, heights: Sequence[float | None]) -> Axis:
    known = [height for height in heights if height is not None]
    low, high = min(known), max(known)
    room = max(0.1 * (high - low), 0.01)
    return Axis(title, reach=(low - room, high + room), format="+.4~g", ticks=7)


def _chart(marks: Sequence[Mark], x: Axis, y: Axis, right: int = 44) -> Chart:
    chart = Chart([Panel(marks, y)], x)
    return replace(chart, room=Room(76, right, 56, 40 if chart.named else 20))
