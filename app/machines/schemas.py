"""Machines as JSON."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from app.core.uncertainty import DEFAULT_DELAY, DEFAULT_FEED
from app.web.fields import Body, Control, Slug, Text200

ExpireAfter = Annotated[
    float,
    Field(
        strict=True,
        gt=0,
        le=87_600,
        allow_inf_nan=False,
        description="Hours after which a correction that was not applied is superseded; null: never.",
    ),
]
SignalWay = Annotated[
    Literal["direct", "plc"],
    Field(description="How the probe's signal comes to the control: directly, or through the PLC, which delays it."),
]
Delay = Annotated[
    float,
    Field(
        strict=True,
        ge=0,
        le=1000,
        allow_inf_nan=False,
        description="Of the way through the PLC, ms; at most 0.25 as a rule.",
    ),
]
Jitter = Annotated[
    float,
    Field(
        strict=True,
        ge=0,
        le=1000,
        allow_inf_nan=False,
        description="By how much the delay varies, ms; null if nobody has measured it: then the whole delay counts.",
    ),
]
Feed = Annotated[float, Field(strict=True, gt=0, le=100_000, allow_inf_nan=False, description="Probing feed, mm/min.")]
MACHINE: dict[str, JsonValue] = {
    "key": "lathe-1",
    "name": "Lathe 1, hall B",
    "control": "sinumerik",
    "corrections_expire_after": 8.0,
    "signal_path": "plc",
    "signal_delay": 0.25,
    "signal_jitter": None,
    "probing_feed": 150.0,
}


class MachineIn(Body):
    """A machine to set up."""

    model_config = ConfigDict(json_schema_extra={"example": dict(MACHINE)})

    key: Annotated[Slug, Field(description="Its name in addresses and keys; it stays for good.")]
    name: Annotated[Text200, Field(description="What people call it.")]
    control: Control
    corrections_expire_after: ExpireAfter | None = None
    signal_path: SignalWay = "direct"
    signal_delay: Delay = DEFAULT_DELAY
    signal_jitter: Jitter | None = None
    probing_feed: Feed = DEFAULT_FEED


class MachineChange(Body):
    """What to change; what is left out stays. The key stays for good, because programs call the machine by it."""

    model_config = ConfigDict(json_schema_extra={"example": {"name": "Lathe 1, hall C"}})

    key: Annotated[Slug | None, Field(description="May be sent along, unchanged.")] = None
    name: Text200 | None = None
    control: Control | None = None
    corrections_expire_after: ExpireAfter | None = None
    signal_path: SignalWay | None = None
    signal_delay: Delay | None = None
    signal_jitter: Jitter | None = None
    probing_feed: Feed | None = None


class MachineOut(BaseModel):
    """A machine."""

    model_config = ConfigDict(
        from_attributes=True,
        json_schema_extra={
            "example": MACHINE
            | {"position_uncertainty": 0.000625, "zero_range_floor": 0.000625, "created_at": "2026-11-21T07:00:00Z"}
        },
    )

    key: str
    name: str
    control: Control
    corrections_expire_after: float | None
    signal_path: SignalWay
    signal_delay: Delay
    signal_jitter: Jitter | None
    probing_feed: Feed
    position_uncertainty: Annotated[
        float, Field(description="Probing feed x delay, mm: how far the axis moves on; 0 on the direct path.")
    ]
    zero_range_floor: Annotated[
        float, Field(description="What of it varies from touch to touch, mm; a smaller R33 is warned of.")
    ]
    created_at: datetime
