"""Blocks of readings: for charts of more than can be drawn one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime

from app.charts import Dots, Faded, Pen, Series, band, bold
from app.core.decision.limits import Limits, classify
from app.language.formatting import grouped, um
from app.language.i18n import _
from app.web.theme import ZONE_SYMBOLS, zone_name, zone_role

BETWEEN, EDGE = Faded("steady", 0.28), Faded("steady", 0.5)  # the smallest to the largest reading, and its edges


@dataclass(frozen=True)
class Block:
    """Many readings in one: for charts of more than can be drawn. `link` opens its part of the chart; mm.

    minimum, maximum: of all of them. mean: without probe faults and excluded readings, of which there are `left_out`; None
    where there are no others. at: the middle of the time in which they were measured.
    """

    first: int
    last: int
    minimum: float
    maximum: float
    mean: float | None
    average: float | None = None
    link: str | None = None
    left_out: int = 0
    at: datetime | None = None

    @property
    def middle(self) -> float:
        return (self.first + self.last) / 2

    @property
    def count(self) -> int:
        return self.last - self.first + 1


def summed_up(blocks: Sequence[Block], single: int) -> list[str]:
    """Words for the axis of a chart of blocks and `single` readings: how many readings there are, and how many in a block."""
    if not blocks:
        return []
    count, most = single + sum(block.count for block in blocks), max(block.count for block in blocks)
    return [_("{count} readings, summed up by {n}").format(count=grouped(count), n=grouped(most))]


def envelope(
    blocks: Sequence[Block],
    position: Callable[[float], float],
    edges: Limits,
    *,
    over_time: bool = False,
    extremes: Sequence[Block] | None = None,
) -> list[Series]:
    """Smallest and largest reading of every block, filled between; extremes that need someone keep their shapes.

    position: where a deviation (mm) is drawn. over_time: each block at its moment, not at its number. extremes: blocks whose
    readings are not drawn besides; all if left out.
    """
    if not blocks:
        return []
    x = [block.at if over_time else block.middle for block in blocks]
    links = [block.link for block in blocks]
    said = [
        block_words(block.first, block.last, um(block.maximum), um(block.minimum), *_mean(block)) for block in blocks
    ]
    means = [None if block.mean is None else position(block.mean) for block in blocks]
    alone = blocks if extremes is None else extremes
    far = [
        (block, place, value, zone)
        for block, place in zip(blocks[: len(alone)], x, strict=False)
        for value in dict.fromkeys((block.minimum, block.maximum))
        if (zone := classify(value, edges)) not in {"zero", "average", "full"}
    ]
    marks = Series(
        [place for _block, place, _value, _zone in far],
        [position(value) for _block, _place, value, _zone in far],
        dots=Dots(
            [ZONE_SYMBOLS[zone] for *_of, zone in far],
            9,
            [zone_role(zone) for *_of, zone in far],
        ),
        meta="extremes",
        hover=[f"<b>{um(value)}</b> · {zone_name(zone)}" for _block, _place, value, zone in far],
        links=[block.link for block, *_what in far],
    )
    return [
        *band(
            x,
            [position(block.minimum) for block in blocks],
            [position(block.maximum) for block in blocks],
            BETWEEN,
            metas=("minimum", "maximum"),
            pen=Pen(EDGE, 1, steps="hvh"),
            name=_("Smallest to largest"),
            hover=said,
            links=links,
        ),
        Series(x, means, Pen(Faded("average", 0.8), 1.25), meta="mean", name=_("Mean"), hover=said, links=links),
        *([marks] if far else []),
    ]


def block_words(first: int, last: int, largest: str, smallest: str, *middle: str) -> str:
    """Words of a block when it is pointed at, from the largest value downward."""
    head = bold(_("Readings {first} to {last}").format(first=first, last=last))
    ends = _("largest {value}").format(value=largest), _("smallest {value}").format(value=smallest)
    return "<br>".join((head, ends[0], *middle, ends[1]))


def _mean(block: Block) -> list[str]:
    words = [] if block.mean is None else [_("mean {value}").format(value=um(block.mean))]
    if block.left_out:
        words.append(_("without {n} that are probe faults or excluded").format(n=block.left_out))
    return words
