"""The two scales of the zone chart.

The bands between the limits R33, R34, R35/2, R37, R36 differ in width by a factor of a thousand. `ZoneScale` makes each
equally tall and is linear inside; the open band beyond R36 is compressed into the same height. `TrueScale` is linear in µm
around the tolerance; what lies further out is drawn at its edge.

Beyond a natural limit (`app.core.natural_limit`) there is only the scatter of measuring, within R33, and one open band of what cannot
be: the chart is short on that side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

from app.core.decision.limits import HasLimits, nanometres
from app.core.decision.limits import Limits as Nanometres
from app.core.natural_limit import NaturalLimit, half_of, natural_of

ScaleName = Literal["zones", "true"]

# The bands from the target outward; the two out-of-tolerance zones are one band seen from both sides.
BANDS = ("zero", "average", "full", "out_of_tolerance", "wear", "probe_fault")
LIMITS = ("R33", "R34", "R35/2", "R37", "R36")


@dataclass(frozen=True)
class Band:
    """One band on the side of positive deviations; mm.

    number: its place from the target outward (0–5), whatever other bands are missing.
    lower, upper: its edges; `upper` is None in the open band beyond R36.
    limits: R names of the limit it begins at, more than one where limits coincide; none in the middle band.
    """

    number: int
    lower: float
    upper: float | None
    limits: tuple[str, ...]

    @property
    def name(self) -> str:
        return BANDS[self.number]

    @property
    def begins_outside(self) -> bool:
        """Tell if it begins at the limit of the tolerance."""
        return "R35/2" in self.limits or "R35" in self.limits


def bands(limits: HasLimits) -> tuple[Band, ...]:
    """The bands that have a width, from the target outward. Limits that coincide leave out the band between them."""
    inner = [0, *Nanometres.of(limits)]
    wide: list[Band] = []
    names: tuple[str, ...] = ()
    natural = natural_of(limits) is not NaturalLimit.NONE
    for number, lower in enumerate(inner):
        if number > 0:
            names = (*names, "R35" if natural and LIMITS[number - 1] == "R35/2" else LIMITS[number - 1])
        upper = inner[number + 1] if number < len(LIMITS) else None
        if upper is None or upper > lower:
            wide.append(Band(number, lower / 1e6, None if upper is None else upper / 1e6, names))
            names = ()
    return tuple(wide)


class Scale(Protocol):
    """Scale of the deviations on the chart."""

    @property
    def natural(self) -> NaturalLimit:
        """The limit on whose side nothing is judged."""

    @property
    def extent(self) -> float:
        """The chart reaches from -extent to +extent, but for the side of a natural limit."""

    @property
    def beyond(self) -> float:
        """Reach of the chart beyond a natural limit."""

    def position(self, deviation: float) -> float:
        """The place of a deviation (mm), inside the extent."""

    def fits(self, deviation: float) -> bool:
        """False for a deviation that is drawn at the edge instead of at its place."""


@dataclass(frozen=True)
class ZoneScale:
    """Every band one unit tall, linear inside; symmetric about the target; strictly increasing.

    >>> from types import SimpleNamespace
    >>> scale = ZoneScale.of(SimpleNamespace(zero_range=0.001, averaging_limit=0.005, tolerance_width=0.016,
    ...     wear_limit=0.3, confidence_limit=1.0))
    >>> scale.position(0.003), scale.position(-0.008), scale.position(2.0)
    (1.5, -3.0, 5.5)
    >>> round(scale.deviation(1.5), 9)
    0.003
    """

    edges: tuple[float, ...]  # mm: 0 and the limits from the target outward, each once
    natural: NaturalLimit = NaturalLimit.NONE
    zero_range: float = 0.0  # mm, R33

    @classmethod
    def of(cls, limits: HasLimits) -> ZoneScale:
        return cls(tuple(band.lower for band in bands(limits)), natural_of(limits), limits.zero_range)

    @cached_property
    def extent(self) -> float:
        return float(len(self.edges))

    @cached_property
    def beyond(self) -> float:
        return 2.0 if self.zero_range else 1.0

    @cached_property
    def _reach(self) -> float:
        return self.zero_range or self.edges[1]

    def position(self, deviation: float) -> float:
        size = abs(deviation)
        sign = -1.0 if deviation < 0 else 1.0
        if sign == self.natural.side and size > self.zero_range:
            over = size - self.zero_range  # what cannot be, in one open band
            return sign * (self.beyond - 1 + over / (over + self._reach))
        last = len(self.edges) - 1
        if size >= self.edges[last]:
            # The open band: 1 - R36/|D| goes from 0 at R36 to 1 at infinity.
            return sign * (last + (1 - self.edges[last] / size)) if size else 0.0
        band = next(i for i in range(last) if size < self.edges[i + 1])
        return sign * (band + (size - self.edges[band]) / (self.edges[band + 1] - self.edges[band]))

    def deviation(self, position: float) -> float:
        """The deviation (mm) at a place strictly inside the extent: the inverse of `position`."""
        place = abs(position)
        sign = -1.0 if position < 0 else 1.0
        if sign == self.natural.side and place > self.beyond - 1:
            return sign * (self.zero_range + self._reach / (self.beyond - place) - self._reach)
        band = int(place)
        last = len(self.edges) - 1
        if band >= last:
            return sign * self.edges[last] / (1 - (place - last))
        return sign * (self.edges[band] + (place - band) * (self.edges[band + 1] - self.edges[band]))

    def fits(self, deviation: float) -> bool:
        return True


@dataclass(frozen=True)
class TrueScale:
    """Linear in µm; deviations further out than `extent` (µm) are drawn at the edge."""

    extent: float
    natural: NaturalLimit = NaturalLimit.NONE
    zero_range: float = 0.0  # mm, R33

    @classmethod
    def of(cls, limits: HasLimits, deviations: Sequence[float] = ()) -> TrueScale:
        """Around the tolerance: a little beyond it, further for readings that are not much further out."""
        tolerance = max(nanometres(half_of(limits)), nanometres(limits.averaging_limit), 1) / 1000
        near = (size for size in (abs(deviation) * 1000 for deviation in deviations) if size <= 2.75 * tolerance)
        extent = max(1.35 * tolerance, 1.1 * max(near, default=0.0))
        return cls(extent, natural_of(limits), limits.zero_range)

    @cached_property
    def beyond(self) -> float:
        return max(2 * self.zero_range * 1000, 0.12 * self.extent)

    def position(self, deviation: float) -> float:
        low, high = ends_of(self)
        return max(low, min(high, deviation * 1000))

    def fits(self, deviation: float) -> bool:
        low, high = ends_of(self)
        return low <= deviation * 1000 <= high


def ends_of(scale: Scale) -> tuple[float, float]:
    """From where to where the chart reaches."""
    return (
        -(scale.beyond if scale.natural is NaturalLimit.LOWER else scale.extent),
        scale.beyond if scale.natural is NaturalLimit.UPPER else scale.extent,
    )
