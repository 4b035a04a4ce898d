"""Machines, tools and features of the demonstration plant. Lengths in mm, times in simulated seconds."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple


class Effect(NamedTuple):
    """Effect of a tool on a feature.

    The factor that the server must know follows from it (domain §3), but is written at each feature by
    hand, as on a real shop floor: a wrong one makes the loop run away, and a test looks at just that.

    gain: change of size per change of offset. wears: +1, the feature grows as the edge recedes; -1, it shrinks.
    """

    gain: float
    wears: int


LATHE_OUTSIDE = Effect(1.0, 1)  # X offset kept in diameter
LATHE_INSIDE = Effect(1.0, -1)
LATHE_OUTSIDE_RADIUS = Effect(2.0, 1)  # X offset kept as radius (L1)
LATHE_INSIDE_RADIUS = Effect(2.0, -1)
LENGTH = Effect(1.0, 1)
MILLING_OUTSIDE = Effect(2.0, 1)  # a larger radius offset keeps the cutter away on both sides
MILLING_INSIDE = Effect(-2.0, -1)


@dataclass(frozen=True)
class Feature:
    """One characteristic of the part that a machine makes."""

    key: str
    name: str
    tool: int  # R10
    effect: Effect
    nominal: float
    upper: float
    lower: float
    factor: float
    average_memory: int = 0  # R11
    weighting_factor: float = 2.0  # R29
    zero_range: float = 0.001  # R33
    scatter: float = 0.0008  # one standard deviation
    warmth: float = 0.0  # change of size from cold to warm
    touches: tuple[int, int] | None = None  # points, repeats
    shape: tuple[float, ...] = ()  # how far each point lies from the size: run-out, out-of-roundness, taper
    more: dict[str, Any] = field(default_factory=dict)  # parameters beyond these
    plan: dict[str, Any] = field(default_factory=dict)  # how often it is measured
    expansion: dict[str, float] = field(default_factory=dict)  # of the part; its readings then carry its temperature
    by_nest: tuple[float, ...] = ()  # how far it lies off in each nest of the fixture
    clean: bool = False  # no chip and no drop of coolant gets under the stylus here
    skipped: tuple[int, int] = (0, 0)  # from this live part on until before that one the probe is switched off

    @property
    def target(self) -> float:
        """The middle of the tolerance."""
        return self.nominal + (self.upper + self.lower) / 2

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of the characteristic, as the API takes them."""
        points, repeats = self.touches or (1, 1)
        return {
            "tool_memory": self.tool,
            "average_memory": self.average_memory,
            "nominal": self.nominal,
            "upper_deviation": self.upper,
            "lower_deviation": self.lower,
            "zero_range": self.zero_range,
            "wear_limit": 0.3,
            "confidence_limit": 1.0,
            "weighting_factor": self.weighting_factor,
            "path_factor": 5,
            "factor": self.factor,
            "points": points,
            "repeats": repeats,
        } | self.more


@dataclass(frozen=True)
class Tool:
    """A cutting edge and how it goes."""

    number: int  # R10
    name: str
    wear: float  # recession of the edge per part
    run_in: float  # recession within the first parts of a fresh edge
    life: int  # parts until it is changed as a matter of routine
    chips: bool = True


@dataclass(frozen=True)
class Machine:
    """A machine tool, what it makes and how fast."""

    key: str
    name: str
    control: str
    part: str
    cycle: float  # s per part
    pipeline: tuple[int, int]  # parts between the cut and the probe, at least and at most
    tools: tuple[Tool, ...]
    features: tuple[Feature, ...]
    first_chip: tuple[int, int]  # after this many live parts the edge of this tool chips: something to see early
    signal_path: str = "direct"  # of the probe
    type: str = "other"
    nests: int = 0  # of its fixture, loaded in turn; 0: its readings say nothing of order and nest
    order: int = 120  # parts

    def context_of(self, feature: Feature, serial: int, temperature: float) -> dict[str, Any] | None:
        """The context of a reading: order and nest of its part, and its temperature, if its readings say them."""
        context: dict[str, Any] = {"part_temperature": temperature} if feature.expansion else {}
        if self.nests:
            context |= {"order": f"A-{4711 + serial // self.order}", "nest": 1 + serial % self.nests}
        return context or None


LATHE_1 = Machine(
    key="lathe-1",
    name="Lathe 1",
    control="sinumerik",
    type="lathe",
    part="shaft-0815",
    cycle=95.0,
    pipeline=(1, 3),
    tools=(
        Tool(3, "finishing tool, seats", wear=0.000_06, run_in=0.004, life=520),
        Tool(7, "facing tool", wear=0.000_05, run_in=0.005, life=610),
    ),
    features=(
        Feature(
            "shaft-d40", "Bearing seat Ø40 h6", 3, LATHE_OUTSIDE, 40.0, 0.0, -0.016, factor=-1,
            average_memory=5, warmth=0.009, more={"averaging_limit": 0.0053, "max_step": 0.5, "direction": "negative"},
            plan={"every": 1, "per_shift": True},
        ),
        Feature(
            "shaft-d35", "Bearing seat Ø35 h6", 3, LATHE_OUTSIDE, 35.0, 0.0, -0.016, factor=-1,
            average_memory=5, warmth=0.008, more={"averaging_limit": 0.0053, "max_step": 0.5, "direction": "negative"},
        ),
        Feature(
            "shaft-l120", "Shoulder length 120", 7, LENGTH, 120.0, 0.025, -0.025, factor=-1,
            average_memory=6, weighting_factor=3, zero_range=0.003, scatter=0.0022, warmth=0.022,
            more={"axis": "Z", "direction": "negative"}, expansion={"coefficient": 11.5, "temperature_uncertainty": 0.5},
        ),
    ),
    first_chip=(12, 7),
)  # fmt: skip
LATHE_2 = Machine(
    key="lathe-2",
    name="Lathe 2",
    control="fanuc",
    type="lathe",
    part="flange-220",
    cycle=130.0,
    pipeline=(2, 4),
    tools=(
        Tool(5, "boring bar", wear=0.000_04, run_in=0.003, life=450),
        Tool(2, "finishing tool, outside", wear=0.000_07, run_in=0.004, life=560),
        Tool(9, "grooving tool", wear=0.000_05, run_in=0.004, life=700),
    ),
    features=(
        Feature(
            "flange-d62", "Bore Ø62 H7", 5, LATHE_INSIDE_RADIUS, 62.0, 0.030, 0.0, factor=-0.5,
            average_memory=1, zero_range=0.002, scatter=0.0014, warmth=-0.011,
            touches=(2, 2), shape=(0.0018, -0.0018),
            more={"variant": "indexed", "index": 180, "feature": "inside", "averaging_limit": 0.010},
        ),
        Feature(
            "flange-d80", "Spigot Ø80 h7", 2, LATHE_OUTSIDE, 80.0, 0.0, -0.030, factor=-1,
            average_memory=2, weighting_factor=3, zero_range=0.002, scatter=0.0015, warmth=0.010,
            more={"mode": "approval", "direction": "negative"},
        ),
        Feature(
            "flange-t18", "Flange thickness 18", 9, LENGTH, 18.0, 0.05, -0.05, factor=-1,
            average_memory=3, zero_range=0.005, scatter=0.004, warmth=0.012,
            more={"mode": "measure_only", "axis": "Z", "direction": "negative"},
            plan={"every": 5, "after_change": 3, "after_alarm": 10}, skipped=(25, 75),
        ),
    ),
    first_chip=(70, 2),
)  # fmt: skip
MILL_1 = Machine(
    key="mill-1",
    name="Milling machine 1",
    control="heidenhain",
    type="mill",
    part="plate-77",
    cycle=170.0,
    pipeline=(1, 2),
    tools=(
        Tool(11, "end mill Ø12, pocket", wear=0.000_035, run_in=0.003, life=430),
        Tool(12, "end mill Ø16, web", wear=0.000_03, run_in=0.002, life=480),
        Tool(14, "end mill Ø10, bore", wear=0.000_03, run_in=0.002, life=510),
        Tool(15, "face mill Ø50", wear=0.000_001, run_in=0.0005, life=2_500, chips=False),
    ),
    features=(
        Feature(
            "plate-p48", "Pocket 48 H8", 11, MILLING_INSIDE, 48.0, 0.039, 0.0, factor=0.5,
            average_memory=11, zero_range=0.003, scatter=0.002, warmth=-0.010, by_nest=(0.0, 0.003),
            more={"axis": "Y", "feature": "inside"},
        ),
        Feature(
            "plate-w20", "Web 20 h8", 12, MILLING_OUTSIDE, 20.0, 0.0, -0.033, factor=-0.5,
            average_memory=12, zero_range=0.003, scatter=0.002, warmth=0.008,
        ),
        Feature(
            "plate-d30", "Bore Ø30 H7", 14, MILLING_INSIDE, 30.0, 0.021, 0.0, factor=0.5,
            # Set too narrow on purpose: this loop runs after its own scatter, and Inband says so. It warms up little, so that the
            # map of what if shows what quieter settings would gain; with an average, k is one of them.
            average_memory=14, weighting_factor=1, zero_range=0.0003, scatter=0.0014, warmth=-0.0015,
            touches=(4, 1), shape=(0.0012, -0.0009, 0.0006, -0.0009),
            more={"variant": "round", "index": 90, "feature": "inside"},
        ),
        Feature(  # So stable and so capable that not every part has to be measured: sampling is proposed.
            "plate-h12", "Plate thickness 12", 15, LENGTH, 12.0, 0.08, -0.08, factor=-1,
            average_memory=15, zero_range=0.03, scatter=0.006, clean=True,
            more={"axis": "Z", "direction": "negative", "averaging_limit": 0.05},
        ),
    ),
    first_chip=(110, 11),
    nests=2,
)  # fmt: skip
# The lathe line without an operator (domain §6): a bore at three sections, accepted by two of three, corrected by their mean.
LATHE_3 = Machine(
    key="lathe-3",
    name="Lathe 3, unmanned",
    control="fanuc",
    type="lathe",
    part="bushing-25",
    cycle=75.0,
    pipeline=(1, 2),
    tools=(
        Tool(4, "boring bar", wear=0.000_06, run_in=0.003, life=480),
        Tool(6, "finishing tool, outside", wear=0.000_05, run_in=0.003, life=540),
    ),
    features=(
        Feature(
            "bushing-d25", "Bore Ø25 H7", 4, LATHE_INSIDE, 25.0, 0.021, 0.0, factor=-1,
            weighting_factor=1, zero_range=0.0, scatter=0.0018, warmth=-0.006,
            touches=(3, 1), shape=(-0.0012, 0.0, 0.0012),
            more={"variant": "along", "index": -8, "accept": {"n": 2, "m": 3}, "feature": "inside"},
        ),
        Feature(
            "bushing-d40", "Spigot Ø40 h7", 6, LATHE_OUTSIDE, 40.0, 0.0, -0.025, factor=-1,
            average_memory=4, zero_range=0.002, scatter=0.0014, warmth=0.008,
            touches=(4, 2), shape=(0.0016, -0.0010, 0.0004, -0.0010),
            more={"variant": "round", "index": 90, "direction": "negative"},
        ),
    ),
    first_chip=(90, 6),
    signal_path="plc",
)  # fmt: skip
MACHINES = (LATHE_1, LATHE_2, LATHE_3, MILL_1)
