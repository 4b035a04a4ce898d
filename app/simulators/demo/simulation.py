"""The physics of a machine tool, as far as a probe sees it. Pure: seeded, no clock, no input or output.

The size of a feature when it is cut::

    size = target + bias + wears * recession(parts, chip) + warmth * theta + gain * offset + nest + scatter

`recession` grows quickly while a fresh edge runs in, then in proportion to the parts, and twice as fast near the end of its life; a
chip adds to it at once. `theta`
goes from 0 (cold) to 1 (warm) while the machine cuts and back while it stands. A part is measured some parts later.

Every part draws the same number of random numbers whatever the server decides, so a machine with corrections and one
without meet the same scatter, the same chips and the same dirt, and may be compared.
"""

from collections import deque
from dataclasses import dataclass, field
from math import exp
from random import Random

from app.simulators.demo import plant

WARM_UP = 45 * 60.0  # s, time constant while cutting
COOL_DOWN = 80 * 60.0
RUN_IN = 20.0  # parts
STEEP_END = 0.85  # of the life of an edge: from there on it wears twice as fast
COLD, WARMER = 21.0, 5.5  # °C of a part of the cold machine, and how much warmer those of the warm one are
SHIFT = 4 * 3600.0  # s of work between two breaks
BREAK = 25 * 60.0
NIGHT = 24 * 3600.0 - 2 * SHIFT - BREAK  # after two of them
WEEKEND = 2 * 24 * 3600.0  # and after five days
CHIP_RATE = 1 / 700  # per part
DIRT_RATE = 1 / 450
OUTLIER_RATE = 1 / 180


@dataclass
class Edge:
    """A tool in its holder, and what the control and the machine's memory hold for it."""

    tool: plant.Tool
    bias: float  # how far off it was set, in mm of size
    offset: float = 0.0
    parts: int = 0
    chip: float = 0.0
    applied: set[int] = field(default_factory=set)  # corrections that are in the offset
    in_effect: int = 0  # the last of them

    @property
    def recession(self) -> float:
        """Recession of the cutting edge, mm."""
        steeply = max(0.0, self.parts - STEEP_END * self.tool.life)
        return self.tool.run_in * (1 - exp(-self.parts / RUN_IN)) + self.tool.wear * (self.parts + steeply) + self.chip

    def correct(self, number: int, amount: float) -> float:
        """Change the offset, once per correction; the offset after it."""
        if number not in self.applied:
            self.applied.add(number)
            self.in_effect = max(self.in_effect, number)
            self.offset = round(self.offset + amount, 9)
        return self.offset

    def replace(self, offset: float, bias: float) -> None:
        """A fresh edge."""
        self.offset, self.bias, self.parts, self.chip = offset, bias, 0, 0.0


@dataclass(frozen=True)
class Part:
    """A part on its way from the cut to the probe: true sizes, and what was in effect when it was cut."""

    serial: int
    cut_at: float
    due: int  # measured after this part was cut
    sizes: dict[str, float]
    in_effect: dict[str, int]
    temperature: float  # °C, as its sensor shows it


@dataclass(frozen=True)
class Probe:
    """One reading as the probe gives it: a size, or the touches it is made of."""

    feature: plant.Feature
    part: Part
    measured_at: float
    size: float
    touches: list[list[float]] | None


class Machine:
    """A machine tool that cuts parts one after the other and measures them a little later."""

    def __init__(self, spec: plant.Machine, seed: int, *, incidents: bool = True, drawn_as: str | None = None) -> None:
        """Random numbers are those of the seed and of the machine's key, or of the key `drawn_as`."""
        self.spec = spec
        self.at = 0.0
        self.serial = 0
        self.live_parts: int | None = None  # counted from `begin_live` on
        self.theta = 0.0
        self.dirt = 0.0
        self.pipeline: deque[Part] = deque()
        self._incidents = incidents
        self._cutting, self._probing, self._fate = (
            Random(f"{seed}:{drawn_as or spec.key}:{what}") for what in ("cutting", "probing", "fate")
        )
        self._next_break = SHIFT * self._fate.uniform(0.4, 1.0)
        self.breaks = 0
        self.edges = {tool.number: Edge(tool, self._setting_error()) for tool in spec.tools}

    def begin_live(self) -> None:
        """From here on edges may chip and the stylus may get dirty: the past before it was uneventful."""
        self.live_parts = 0

    def cut(self) -> None:
        """Cut one part with the offsets of this moment."""
        self._warm(self.spec.cycle)
        self.at += self.spec.cycle
        self.serial += 1
        sizes: dict[str, float] = {}
        for feature in self.spec.features:
            edge = self.edges[feature.tool]
            sizes[feature.key] = (
                feature.target
                + edge.bias
                + feature.effect.wears * edge.recession
                + feature.warmth * self.theta
                + feature.effect.gain * edge.offset
                + (feature.by_nest[self.serial % len(feature.by_nest)] if feature.by_nest else 0.0)
                + self._cutting.gauss(0.0, feature.scatter)
            )
        in_effect = {feature.key: self.edges[feature.tool].in_effect for feature in self.spec.features}
        due = self.serial + self._probing.randint(*self.spec.pipeline)
        if self.pipeline:
            due = max(due, self.pipeline[-1].due)
        self.pipeline.append(Part(self.serial, self.at, due, sizes, in_effect, round(COLD + WARMER * self.theta, 1)))
        for edge in self.edges.values():
            edge.parts += 1
        self._incident()

    def measure(self, *, drain: bool = False) -> list[Probe]:
        """Probe the parts that have come to the probe; with `drain` the next one in any case."""
        probes: list[Probe] = []
        while self.pipeline and (self.pipeline[0].due <= self.serial or drain):
            part = self.pipeline.popleft()
            probed = [self._probe(at, feature, part) for at, feature in enumerate(self.spec.features)]
            probes += [probe for probe in probed if (self.live_parts or 0) not in range(*probe.feature.skipped)]
            if drain:
                break
        return probes

    def stand(self, until: float) -> None:
        """Do nothing and cool down."""
        pause = max(0.0, until - self.at)
        self.theta *= exp(-pause / COOL_DOWN)
        self.at += pause

    def rest(self, *, nights: bool = False) -> bool:
        """Take the break that is due, if one is; with `nights` every second one lasts until the next working day."""
        if self.at < self._next_break:
            return False
        self.breaks += 1
        pause = BREAK
        if nights and self.breaks % 2 == 0:
            pause = NIGHT + (WEEKEND if self.breaks % 10 == 0 else 0.0)
        self.stand(self.at + pause)
        self._next_break = self.at + SHIFT
        return True

    def fresh_edge(self, number: int, offset: float) -> None:
        """A person put a fresh edge in and set its offset."""
        self.edges[number].replace(offset, self._setting_error())

    def settle(self, offsets: dict[int, float]) -> None:
        """Come back after a stop of the program: the offsets found are right for the tools as they are now."""
        for feature in self.spec.features:
            edge = self.edges[feature.tool]
            edge.offset = offsets[feature.tool]
            edge.bias = -feature.effect.gain * edge.offset - feature.effect.wears * edge.recession

    def clean_stylus(self) -> None:
        """A person wiped the stylus."""
        self.dirt = 0.0

    def _setting_error(self) -> float:
        return self._fate.gauss(0.0, 0.006)

    def _warm(self, seconds: float) -> None:
        self.theta += (1.0 - self.theta) * (1 - exp(-seconds / WARM_UP))

    def _incident(self) -> None:
        chip, dirt, which, how_far = (self._fate.random() for _each in range(4))
        if self.live_parts is not None:
            self.live_parts += 1
        if not self._incidents or self.live_parts is None:
            return
        early, tool = self.spec.first_chip
        if self.live_parts == early:
            self._chip(self.edges[tool], how_far)
        elif chip < CHIP_RATE:
            brittle = [edge for edge in self.edges.values() if edge.tool.chips]
            self._chip(brittle[int(which * len(brittle))], how_far)
        elif dirt < DIRT_RATE:
            self.dirt = 1.2 + how_far

    def _chip(self, edge: Edge, how_far: float) -> None:
        """Break enough off the edge to reach the wear zone (R37 = 0.3 mm) and not the probe fault (R36 = 1 mm)."""
        edge.chip += 0.36 + 0.24 * how_far

    def _probe(self, at: int, feature: plant.Feature, part: Part) -> Probe:
        outlier, sign = self._probing.random(), self._probing.choice((-1, 1))
        size = part.sizes[feature.key] + self.dirt
        if outlier < OUTLIER_RATE and not feature.clean:  # a chip or a drop of coolant under the stylus, once
            size += sign * feature.scatter * 6
        touches = None
        if feature.touches:
            points, repeats = feature.touches
            touches = [
                [round(size + off + self._probing.gauss(0.0, feature.scatter / 2), 5) for _repeat in range(repeats)]
                for off in (feature.shape or (0.0,) * points)
            ]
        return Probe(feature, part, self.at + 4.0 * at, round(size, 5), touches)
