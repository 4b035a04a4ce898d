"""Chart of a variant's results beside the value (run-out, out-of-roundness, taper, repeatability) over the readings, in µm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.charts import Axis, Chart, Dots, Mark, Panel, Pen, Room, Series, band, bold, empty
from app.language.formatting import NO_BREAK_SPACE, signed
from app.language.i18n import _
from app.views.characteristic.figures.blocks import BETWEEN, EDGE, block_words

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


def result_figure(name: str, title: str, points: Sequence[ResultPoint], ranges: Sequence[ResultRange] = ()) -> Chart:
    """The course of one result; `title` is what it is called. Of very many readings each block with its extremes."""
    marks: list[Mark] = [*_envelope(name, ranges)] if ranges else [*_points(name, points)]
    return Chart(
        [
            Panel(
                marks or [empty(_("Nothing yet"))],
                Axis(
                    f"{title}, µm",
                    ticks=5,
                    from_zero=name not in SIGNED,
                    zero="faint" if name in SIGNED else None,
                    fixed=True,
                ),
            )
        ],
        Axis(_("Reading number"), format="d", ticks=9, grid=False),
        Room(left=78, right=20, top=12, bottom=48),
    )


def worded(name: str, value: float) -> str:
    """A result in µm, with its sign where it has one."""
    text = signed(value * 1000, 2) if name in SIGNED else f"{value * 1000:.2f}"
    return f"{text}{NO_BREAK_SPACE}µm"


def _points(name: str, points: Sequence[ResultPoint]) -> list[Series]:
    if not points:
        return []
    few = len(points) <= 400
    symbols = ["circle-open" if point.excluded else "circle" for point in points]
    return [
        Series(
            [point.sequence for point in points],
            [point.value * 1000 for point in points],
            Pen("faint", 1) if few else None,
            Dots(symbols, 7 if few else 4),
            meta="results",
            hover=[
                bold(_("Reading {n}").format(n=point.sequence))
                + f"<br>{worded(name, point.value)}"
                + ("<br>" + _("excluded from statistics") if point.excluded else "")
                for point in points
            ],
            links=[point.link for point in points],
        )
    ]


def _envelope(name: str, ranges: Sequence[ResultRange]) -> list[Series]:
    x = [(block.first + block.last) / 2 for block in ranges]
    links = [block.link for block in ranges]
    said = [
        block_words(
            block.first,
            block.last,
            worded(name, block.maximum),
            worded(name, block.minimum),
            _("mean {value}").format(value=worded(name, block.mean)),
        )
        for block in ranges
    ]
    low, high, mean = ([getattr(block, which) * 1000 for block in ranges] for which in ("minimum", "maximum", "mean"))
    edges = band(x, low, high, BETWEEN, metas=("minimum", "maximum"), pen=Pen(EDGE, 1), hover=said, links=links)
    return [*edges, Series(x, mean, Pen("average"), meta="mean", hover=said, links=links)]
