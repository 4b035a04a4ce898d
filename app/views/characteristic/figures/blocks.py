"""Blocks of readings: for charts of more than can be drawn one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.charts import Dots, Faded, Pen, Series, band
from app.core.decision.limits import Limits, classify
from app.language.i18n import _
from app.language.numbers import um
from app.views.characteristic.figures.scale import Scale
from app.web.theme import ZONE_SYMBOLS, zone_name, zone_role

BETWEEN, EDGE = Faded("steady", 0.28), Faded("steady", 0.5)  # the smallest to the largest reading, and its edges


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


def envelope(blocks: Sequence[Block], ruler: Scale, edges: Limits) -> list[Series]:
    """Smallest and largest reading of every block, filled between; extremes that need someone keep their shapes."""
    if not blocks:
        return []
    x = [block.middle for block in blocks]
    links = [block.link for block in blocks]
    said = [
        block_words(block.first, block.last, um(block.maximum), um(block.minimum), *_mean(block)) for block in blocks
    ]
    means = [None if block.mean is None else ruler.position(block.mean) for block in blocks]
    extremes = [
        (block, value, zone)
        for block in blocks
        for value in dict.fromkeys((block.minimum, block.maximum))
        if (zone := classify(value, edges)) not in {"zero", "average", "full"}
    ]
    marks = Series(
        [block.middle for block, _value, _zone in extremes],
        [ruler.position(value) for _block, value, _zone in extremes],
        dots=Dots(
            [ZONE_SYMBOLS[zone] for _block, _value, zone in extremes],
            9,
            [zone_role(zone) for _block, _value, zone in extremes],
        ),
        meta="extremes",
        hover=[f"<b>{um(value)}</b> · {zone_name(zone)}" for _block, value, zone in extremes],
        links=[block.link for block, _value, _zone in extremes],
    )
    return [
        *band(
            x,
            [ruler.position(block.minimum) for block in blocks],
            [ruler.position(block.maximum) for block in blocks],
            BETWEEN,
            metas=("minimum", "maximum"),
            pen=Pen(EDGE, 1, steps="hvh"),
            name=_("Smallest to largest"),
            hover=said,
            links=links,
        ),
        Series(x, means, Pen("average"), meta="mean", name=_("Mean"), hover=said, links=links),
        *([marks] if extremes else []),
    ]


def block_words(first: int, last: int, largest: str, smallest: str, *middle: str) -> str:
    """Words of a block when it is pointed at, from the largest value downward."""
    head = f"<b>{_('Readings {first} to {last}').format(first=first, last=last)}</b>"
    ends = _("largest {value}").format(value=largest), _("smallest {value}").format(value=smallest)
    return "<br>".join((head, ends[0], *middle, ends[1]))


def _mean(block: Block) -> list[str]:
    words = [] if block.mean is None else [_("mean {value}").format(value=um(block.mean))]
    if block.left_out:
        words.append(_("without {n} that are probe faults or excluded").format(n=block.left_out))
    return words
