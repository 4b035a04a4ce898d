"""The axes of a figure: from a value to its place, and where ticks stand and what they say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from math import ceil, floor, isfinite, log10
from typing import Any

from app.charts.marks import Box
from app.language.numbers import MINUS
from app.language.times import plant_zone

Layout = Mapping[str, Any]
NARROW = "\N{NARROW NO-BREAK SPACE}"


def position(value: Any) -> float | None:
    """A value of an axis as a number; moments in seconds. None for a gap."""
    if isinstance(value, str):
        try:
            return datetime.fromisoformat(value).timestamp()
        except ValueError:
            return None
    return float(value) if value is not None and isfinite(value) else None


@dataclass(frozen=True)
class Axis:
    """One axis: `low` lies at `start` (pixels), `high` at `end`."""

    low: float
    high: float
    start: float
    end: float
    layout: Layout
    is_time: bool = False

    def place(self, value: Any) -> float | None:
        """Place of a value, pixels."""
        at = position(value)
        if at is None:
            return None
        return self.start + (at - self.low) / (self.high - self.low) * (self.end - self.start)

    def share(self, part: float) -> float:
        """Place of a share of the axis, pixels."""
        return self.start + part * (self.end - self.start)

    def ticks(self) -> list[tuple[float, str]]:
        """Places of the ticks (pixels) with their labels."""
        if self.layout.get("showticklabels") is False or self.layout.get("visible") is False:
            return []
        if values := self.layout.get("tickvals"):
            labels = self.layout.get("ticktext") or [f"{value:g}".replace("-", MINUS) for value in values]
            ticks = [(self.place(value), str(text)) for value, text in zip(values, labels, strict=False)]
            return [(at, text) for at, text in ticks if at is not None and self._inside(at)]
        if self.is_time:
            return [(self.share(part), self._moment(part)) for part in (0.02, 0.26, 0.5, 0.74, 0.98)]
        step = float(self.layout.get("dtick") or _step(self.high - self.low, int(self.layout.get("nticks") or 6)))
        first = ceil(self.low / step - 1e-9)
        values = [number * step for number in range(first, floor(self.high / step + 1e-9) + 1)]
        return [(self.place(value) or 0.0, self._word(value, step)) for value in values[:50]]

    def _inside(self, at: float) -> bool:
        low, high = sorted((self.start, self.end))
        return low - 1 <= at <= high + 1

    def _word(self, value: float, step: float) -> str:
        shape = str(self.layout.get("tickformat") or "")
        value = 0.0 if abs(value) < step / 1e6 else value
        if shape in {"d", ",d"}:
            return f"{round(value):,}".replace(",", NARROW).replace("-", MINUS)
        if shape.endswith("f"):
            return f"{value:{shape}}".replace("-", MINUS)
        decimals = max(0, -floor(log10(step) + 1e-9))
        sign = "+" if shape.startswith("+") else ""
        return f"{value:{sign}.{decimals}f}".replace("-", MINUS)

    def _moment(self, part: float) -> str:
        at = datetime.fromtimestamp(self.low + part * (self.high - self.low), plant_zone())
        return f"{at:%H:%M}" if self.high - self.low < 86_400 else f"{at:%d.%m. %H:%M}"


def _step(span: float, most: int) -> float:
    """A step of 1, 2 or 5 that gives no more ticks than that.

    >>> _step(100, 6), _step(0.013, 6)
    (20.0, 0.005)
    """
    rough = max(span, 1e-12) / max(most, 1)
    unit = 10.0 ** floor(log10(rough))
    return next((factor * unit for factor in (1.0, 2.0, 5.0) if factor * unit >= rough * (1 - 1e-9)), 10.0 * unit)


def axis_of(layout: Layout, name: str, values: Sequence[Any], plot: Box) -> Axis:
    """The axis `x`, `y`, `y2` … of a figure; without a range of its own it reaches over the values."""
    described = layout.get(f"{name[0]}axis{name[1:]}") or {}
    low_share, high_share = described.get("domain") or (0.0, 1.0)
    ends = (plot.left, plot.right) if name[0] == "x" else (plot.bottom, plot.top)
    start = ends[0] + low_share * (ends[1] - ends[0])
    end = ends[0] + high_share * (ends[1] - ends[0])
    is_time = described.get("type") == "date"
    low, high = _reach(described, values)
    return Axis(low, high, start, end, described, is_time)


def _reach(described: Layout, values: Sequence[Any]) -> tuple[float, float]:
    limits = [position(value) for value in described.get("range") or ()]
    if len(limits) == 2 and limits[0] is not None and limits[1] is not None and limits[0] != limits[1]:
        return limits[0], limits[1]
    known = [at for at in map(position, values) if at is not None]
    low, high = min(known, default=0.0), max(known, default=1.0)
    if described.get("rangemode") == "tozero":
        low, high = min(low, 0.0), max(high, 0.0) * 1.05
    else:
        room = (high - low) * 0.06
        low, high = low - room, high + room
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def spread(places: Sequence[tuple[float, str]], least: float) -> list[tuple[float, str]]:
    """Ticks without those that would write over the one before."""
    if all(abs(after[0] - before[0]) >= least for before, after in pairwise(places)):
        return list(places)
    places_apart: list[tuple[float, str]] = []
    for place in places:
        if not places_apart or abs(place[0] - places_apart[-1][0]) >= least:
            places_apart.append(place)
    return places_apart
