"""Blocks of readings: for charts of more than can be drawn one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from app.core.decision.limits import Limits, classify
from app.language.i18n import _
from app.language.numbers import um
from app.views.characteristic.figures.scale import Scale
from app.web.theme import ZONE_SYMBOLS, Palette, zone_colour, zone_name


@dataclass(frozen=True)
class Block:
    """Many readings in one: for charts of more than can be drawn. `link` opens its part of the chart; mm.

    minimum, maximum: of all of them. mean: without probe faults and excluded readings, of which there are `left_out`; None
    where there are no others.
    """

    first: int
    last: int
    minimum: float
    maximum: float
    mean: float | None
    average: float | None = None
    link: str | None = None
    left_out: int = 0

    @property
    def middle(self) -> float:
        return (self.first + self.last) / 2


def envelope(blocks: Sequence[Block], ruler: Scale, edges: Limits, colours: Palette) -> list[dict[str, Any]]:
    """Smallest and largest reading of every block, filled between; extremes that need someone keep their shapes."""
    if not blocks:
        return []
    x = [block.middle for block in blocks]
    text = [
        "<br>".join(
            (
                f"<b>{_('Readings {first} to {last}').format(first=block.first, last=block.last)}</b>",
                _("largest {value}").format(value=um(block.maximum)),
                *_mean(block),
                _("smallest {value}").format(value=um(block.minimum)),
            )
        )
        for block in blocks
    ]
    edge = {"width": 1, "color": see_through(colours.steady, 0.5), "shape": "hvh"}
    common = {"type": "scatter", "mode": "lines", "x": x, "customdata": [block.link for block in blocks], "text": text}
    common |= {"hovertemplate": "%{text}<extra></extra>"}
    lower = common | {
        "y": [ruler.position(b.minimum) for b in blocks],
        "line": edge,
        "showlegend": False,
        "meta": "minimum",
    }
    upper = common | {
        "y": [ruler.position(b.maximum) for b in blocks],
        "line": edge,
        "fill": "tonexty",
        "fillcolor": see_through(colours.steady),
        "name": _("Smallest to largest"),
        "meta": "maximum",
    }
    mean = common | {
        "y": [None if b.mean is None else ruler.position(b.mean) for b in blocks],
        "line": {"width": 1.5, "color": colours.average},
        "name": _("Mean"),
        "meta": "mean",
    }
    extremes = [
        (block, value, zone)
        for block in blocks
        for value in dict.fromkeys((block.minimum, block.maximum))
        if (zone := classify(value, edges)) not in {"zero", "average", "full"}
    ]
    marks = {
        "type": "scatter",
        "mode": "markers",
        "meta": "extremes",
        "x": [block.middle for block, _value, _zone in extremes],
        "y": [ruler.position(value) for _block, value, _zone in extremes],
        "marker": {
            "symbol": [ZONE_SYMBOLS[zone] for _block, _value, zone in extremes],
            "size": 9,
            "color": [zone_colour(zone, colours) for _block, _value, zone in extremes],
        },
        "customdata": [block.link for block, _value, _zone in extremes],
        "text": [f"<b>{um(value)}</b> · {zone_name(zone)}" for _block, value, zone in extremes],
        "hovertemplate": "%{text}<extra></extra>",
        "showlegend": False,
        "cliponaxis": False,
    }
    return [lower, upper, mean, *([marks] if extremes else [])]


def _mean(block: Block) -> list[str]:
    words = [] if block.mean is None else [_("mean {value}").format(value=um(block.mean))]
    if block.left_out:
        words.append(_("without {n} that are probe faults or excluded").format(n=block.left_out))
    return words


def see_through(colour: str, share: float = 0.28) -> str:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{share})"
