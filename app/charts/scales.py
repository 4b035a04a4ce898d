"""The axes of a chart on paper: from a value to its place, and where ticks stand and what they say."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from math import ceil, floor, isfinite, log10

from app.charts.description import Axis, Value
from app.language.formatting import MINUS
from app.language.times import plant_zone

NARROW = "\N{NARROW NO-BREAK SPACE}"


@dataclass(frozen=True)
class Scale:
    """An axis as it is drawn: `low` lies at `start` (pixels), `high` at `end`. names: of an axis of names, in their order."""

    axis: Axis
    low: float
    high: float
    start: float
    end: float
    names: tuple[str, ...] = ()

    def number(self, value: Value) -> float | None:
        """A value as a number; moments in seconds. None for a gap."""
        if isinstance(value, str):
            return float(self.names.index(value)) if value in self.names else None
        return _number(value)

    def place(self, value: Value) -> float | None:
        """Place of a value, pixels."""
        at = self.number(value)
        if at is None:
            return None
        return self.start + (at - self.low) / (self.high - self.low) * (self.end - self.start)

    def share(self, part: float) -> float:
        """Place of a share of the axis, pixels."""
        return self.start + part * (self.end - self.start)

    def ticks(self) -> list[tuple[float, str]]:
        """Places of the ticks (pixels) with their labels."""
        axis = self.axis
        if not axis.labelled or axis.hidden:
            return []
        if self.names:
            return [(self.place(name) or 0.0, name) for name in self.names]
        if axis.at:
            labels = axis.words or [f"{value:g}".replace("-", MINUS) for value in axis.at]
            ticks = [(self.place(value), text) for value, text in zip(axis.at, labels, strict=False)]
            return [(at, text) for at, text in ticks if at is not None and self._inside(at)]
        if axis.kind == "time":
            return [(self.share(part), self._moment(part)) for part in (0.02, 0.26, 0.5, 0.74, 0.98)]
        step = float(axis.every or _step(self.high - self.low, axis.ticks or 6))
        first = ceil(self.low / step - 1e-9)
        values = [number * step for number in range(first, floor(self.high / step + 1e-9) + 1)]
        return [(self.place(value) or 0.0, self._word(value, step)) for value in values[:50]]

    def _inside(self, at: float) -> bool:
        low, high = sorted((self.start, self.end))
        return low - 1 <= at <= high + 1

    def _word(self, value: float, step: float) -> str:
        shape = self.axis.format
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


def scale_of(axis: Axis, values: Sequence[Value], start: float, end: float) -> Scale:
    """The scale of an axis between two places; without a reach of its own it goes over the values."""
    if axis.kind == "names":
        names = tuple(dict.fromkeys(value for value in values if isinstance(value, str)))
        return Scale(axis, -0.5, max(len(names), 1) - 0.5, start, end, names)
    return Scale(axis, *_reach(axis, values), start, end)


def _number(value: Value) -> float | None:
    if isinstance(value, datetime):
        return value.timestamp()
    return float(value) if value is not None and not isinstance(value, str) and isfinite(value) else None


def _step(span: float, most: int) -> float:
    """A step of 1, 2 or 5 that gives no more ticks than that.

    >>> _step(100, 6), _step(0.013, 6)
    (20.0, 0.005)
    """
    rough = max(span, 1e-12) / max(most, 1)
    unit = 10.0 ** floor(log10(rough))
    return next((factor * unit for factor in (1.0, 2.0, 5.0) if factor * unit >= rough * (1 - 1e-9)), 10.0 * unit)


def _reach(axis: Axis, values: Sequence[Value]) -> tuple[float, float]:
    limits = [_number(value) for value in axis.reach or ()]
    if len(limits) == 2 and limits[0] is not None and limits[1] is not None and limits[0] != limits[1]:
        return limits[0], limits[1]
    known = [at for at in map(_number, values) if at is not None]
    low, high = min(known, default=0.0), max(known, default=1.0)
    if axis.from_zero:
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
