"""Machines as JSON."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.core.parameters import AVERAGE_LOCATIONS, LARGEST_LENGTH, MOST_LOCATIONS, TOOL_LOCATIONS
from app.core.uncertainty import DEFAULT_DELAY, DEFAULT_FEED
from app.web.fields import Body, Control, Slug, Text200

ExpireAfter = Annotated[
    float,
    Field(
        strict=True,
        gt=0,
        le=87_600,
        description="Hours after which a correction that was not applied is superseded; null: never.",
    ),
]
SignalWay = Annotated[
    Literal["direct", "plc"],
    Field(description="How the probe's signal comes to the control: directly, or through the PLC, which delays it."),
]
Delay = Annotated[
    float, Field(strict=True, ge=0, le=1000, description="Of the way through the PLC, ms; at most 0.25 as a rule.")
]
Jitter = Annotated[
    float,
    Field(
        strict=True,
        ge=0,
        le=1000,
        description="By how much the delay varies, ms; null if nobody has measured it: then the whole delay counts.",
    ),
]
Feed = Annotated[float, Field(strict=True, gt=0, le=100_000, description="Probing feed, mm/min.")]
Type = Annotated[
    Literal["lathe", "mill", "mill_turn", "grinder", "other"],
    Field(description="Kind of machine tool; variants that do not fit it are warned of."),
]
ToolLocations = Annotated[
    int, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="Locations of the tool memory: R10 goes so far.")
]
AverageLocations = Annotated[
    int, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="Locations of the average memory: R11 goes so far.")
]
PlausibleTurn = Annotated[
    float,
    Field(
        strict=True,
        gt=0,
        le=180,
        description="Degrees. An alignment or work zero that turns the part by more is warned of.",
    ),
]
PlausibleShift = Annotated[
    float,
    Field(
        strict=True,
        gt=0,
        le=LARGEST_LENGTH,
        description="mm. An alignment that shifts the part by more, and a work zero that lies further from that of its "
        "fixture, is warned of.",
    ),
]
PlausibleAxisTurn = Annotated[
    float, Field(strict=True, gt=0, le=180, description="Degrees. A rotary axis that leans by more is warned of.")
]
PlausibleAxisShift = Annotated[
    float,
    Field(
        strict=True,
        gt=0,
        le=LARGEST_LENGTH,
        description="mm. A rotary axis that lies further from where its kinematics has it is warned of.",
    ),
]


class MachineIn(Body):
    """A machine to set up."""

    key: Annotated[Slug, Field(description="Its name in addresses and keys; it cannot be changed later.")]
    name: Annotated[Text200, Field(description="What people call it.")]
    control: Control
    type: Type = "other"
    tool_locations: ToolLocations = TOOL_LOCATIONS
    average_locations: AverageLocations = AVERAGE_LOCATIONS
    corrections_expire_after: ExpireAfter | None = None
    signal_path: SignalWay = "direct"
    signal_delay: Delay = DEFAULT_DELAY
    signal_jitter: Jitter | None = None
    probing_feed: Feed = DEFAULT_FEED
    plausible_turn: PlausibleTurn = 5.0
    plausible_shift: PlausibleShift = 10.0
    plausible_axis_turn: PlausibleAxisTurn = 1.0
    plausible_axis_shift: PlausibleAxisShift = 1.0


class MachineChange(Body):
    """Change of a machine. Omitted fields stay. The key never changes, because programs call the machine by it."""

    key: Annotated[Slug | None, Field(description="May be sent along, unchanged.")] = None
    name: Text200 | None = None
    control: Control | None = None
    type: Type | None = None
    tool_locations: ToolLocations | None = None
    average_locations: AverageLocations | None = None
    corrections_expire_after: ExpireAfter | None = None
    signal_path: SignalWay | None = None
    signal_delay: Delay | None = None
    signal_jitter: Jitter | None = None
    probing_feed: Feed | None = None
    plausible_turn: PlausibleTurn | None = None
    plausible_shift: PlausibleShift | None = None
    plausible_axis_turn: PlausibleAxisTurn | None = None
    plausible_axis_shift: PlausibleAxisShift | None = None


class MachineOut(BaseModel):
    """A machine."""

    model_config = ConfigDict(from_attributes=True)

    key: Annotated[str, Field(description="Its name in addresses and keys.")]
    name: Annotated[str, Field(description="What people call it.")]
    control: Control
    type: Type
    tool_locations: Annotated[int, Field(description="Locations of the tool memory: R10 goes so far.")]
    average_locations: Annotated[int, Field(description="Locations of the average memory: R11 goes so far.")]
    corrections_expire_after: Annotated[
        float | None,
        Field(description="Hours after which a correction that was not applied is superseded; null: never."),
    ]
    signal_path: SignalWay
    signal_delay: Delay
    signal_jitter: Jitter | None
    probing_feed: Feed
    plausible_turn: PlausibleTurn
    plausible_shift: PlausibleShift
    plausible_axis_turn: PlausibleAxisTurn
    plausible_axis_shift: PlausibleAxisShift
    position_uncertainty: Annotated[
        float, Field(description="Probing feed x delay, mm: how far the axis moves on; 0 on the direct path.")
    ]
    zero_range_floor: Annotated[
        float, Field(description="What of it varies from point to point, mm; a smaller R33 is warned of.")
    ]
    simulated: Annotated[
        bool, Field(description="It is for trying and makes its readings up; it can be removed with all of them.")
    ]
    created_at: datetime
