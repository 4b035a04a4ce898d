"""Looks that tell series or strata apart: a colour and a shape each, so that nothing is said by colour alone."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from app.charts.description import Chart, Dots, Mark, Series
from app.charts.palette import Colour

LOOKS: tuple[tuple[Colour, str], ...] = (
    ("steady", "circle"),
    ("correction", "square"),
    ("wear", "diamond"),
    ("attention", "triangle-up"),
    ("corrected", "cross"),
    ("ink", "star"),
)
NONE: tuple[Colour, str] = ("faint", "circle")


def look(number: int) -> tuple[Colour, str]:
    """Colour and shape of one of up to 36; of a negative number that of nothing known.

    >>> look(0), look(7), look(-1)
    (('steady', 'circle'), ('correction', 'diamond'), ('faint', 'circle'))
    """
    if number < 0:
        return NONE
    colour, _shape = LOOKS[number % len(LOOKS)]
    return colour, LOOKS[(number + number // len(LOOKS)) % len(LOOKS)][1]


def distinguished(chart: Chart, meta: str, labels: Sequence[int] | Mapping[Any, int], names: Sequence[str]) -> Chart:
    """The chart with the points of the series `meta` in the look of their stratum, and the names of the strata in its legend.

    labels: the number of each point's name, negative for none; by the place of the point, or by its x.
    """
    panels = []
    for at, panel in enumerate(chart.panels):
        marks = [
            _distinguished(mark, labels, names) if isinstance(mark, Series) and mark.meta == meta else mark
            for mark in panel.marks
        ]
        if at == 0:
            marks += [_legend(number, name) for number, name in enumerate(names)]
        panels.append(replace(panel, marks=marks))
    return replace(chart, panels=panels)


def _legend(number: int, name: str) -> Series:
    colour, symbol = look(number)
    return Series([None], [None], dots=Dots(symbol, 9, colour, "surface"), meta="stratum", name=name)


def _distinguished(drawn: Series, labels: Sequence[int] | Mapping[Any, int], names: Sequence[str]) -> Mark:
    of = [labels.get(x, -1) for x in drawn.x] if isinstance(labels, Mapping) else list(labels)
    dots = drawn.dots or Dots(size=4)
    before = [dots.symbol] * len(of) if isinstance(dots.symbol, str) else dots.symbol
    looks = [look(number) for number in of]
    symbols = [
        symbol + ("-open" if old.endswith("-open") else "")
        for (_colour, symbol), old in zip(looks, before, strict=True)
    ]
    colours = [colour for colour, _symbol in looks]
    hover = drawn.hover
    if not isinstance(hover, str):
        hover = [f"{words}<br>{names[n]}" if n >= 0 else words for words, n in zip(hover, of, strict=True)]
    return replace(drawn, dots=replace(dots, symbol=symbols, colour=colours, edge=None), hover=hover, name="")
