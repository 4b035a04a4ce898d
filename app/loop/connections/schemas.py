"""Heartbeats and connections as JSON."""

from datetime import UTC, datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

from app.core.parameters import MOST_LOCATIONS
from app.language.i18n import _
from app.loop.connections.touch_tests.schemas import Sentence, TouchTestOut
from app.web.fields import LARGEST_SERIAL, Body, Length, MappingHash, Moment, Text200

ConnectionState = Literal[
    "starting", "online", "control_away", "wrong_machine", "counters_lost", "full", "held", "configuration"
]
STATE_MEANS = (
    "`starting`: nothing is known of the control yet; `online`: it answers; `control_away`: it does not; `wrong_machine`: "
    "another machine answers; `counters_lost`: the counters of its ring began again; `full`: the bridge's store is full and "
    "nothing is fetched; `held`: it is on hold and writes nothing; `configuration`: the bridge cannot work as it is set up."
)
MOST_QUARANTINED = 20
MOST_PLACES = 500
_FIRST, _LAST = datetime(1970, 1, 2, tzinfo=UTC), datetime(2200, 1, 1, tzinfo=UTC)


def _storable(moment: datetime) -> datetime:
    if not _FIRST <= moment <= _LAST:
        raise PydanticCustomError(
            "moment", _("lies before 1970 or after 2200; check the clock of the bridge's computer")
        )
    return moment


AnyMoment = Annotated[Moment, AfterValidator(_storable)]
"""A time by a clock that may be wrong: a bridge is heard all the same."""


Count = Annotated[int, Field(strict=True, ge=0, le=LARGEST_SERIAL)]


class LocationIn(BaseModel):
    """One location of the tool memory in the bridge's mapping, and its touch test."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    tool_memory: Annotated[int, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="R10")]
    mapping: MappingHash | None = None
    proved_at: Annotated[
        AnyMoment | None, Field(description="When the touch test proved this mapping; null: not yet.")
    ] = None
    offset: Annotated[Length | None, Field(description="The offset that the control held last, mm.")] = None
    touch_test_by_page: Annotated[
        bool, Field(strict=True, description="true: the bridge makes touch tests of it that are asked for here.")
    ] = False
    corrected: Annotated[bool, Field(strict=True, description="false: the bridge carries no corrections to it.")] = True
    proof_needed: Annotated[
        bool, Field(strict=True, description="true: corrections wait until a touch test has proved this mapping.")
    ] = True


class QuarantinedIn(BaseModel):
    """A reading that the server has refused, and that the bridge keeps in its quarantine."""

    model_config = ConfigDict(extra="ignore")

    key: Annotated[Text200, Field(description="Key of the reading.")]
    characteristic: Annotated[Text200 | None, Field(description="Characteristic that it was sent for.")] = None
    reason: Annotated[Sentence, Field(description="Why it was refused, in words.")]
    at: Annotated[AnyMoment, Field(description="When.")]


class HeldBackIn(BaseModel):
    """Corrections of one tool memory that the bridge holds back."""

    model_config = ConfigDict(extra="ignore")

    tool_memory: Annotated[int, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="R10")]
    number: Annotated[int, Field(strict=True, ge=1, le=LARGEST_SERIAL, description="The first of them.")]
    reason: Annotated[Sentence, Field(description="Why, in words.")]


class HeartbeatIn(Body):
    """Heartbeat of a bridge, every ten seconds. Fields that this server does not know are passed over."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    version: Annotated[Text200, Field(description="Of the bridge.")]
    state: Annotated[ConnectionState, Field(description=STATE_MEANS)]
    detail: Annotated[Sentence | None, Field(description="One sentence of the bridge about this state.")] = None
    waiting: Annotated[Count, Field(description="Readings that wait in the bridge.")]
    oldest_waiting_at: Annotated[
        AnyMoment | None, Field(description="When the oldest of them came in, by the bridge's clock.")
    ] = None
    sent_at: Annotated[
        AnyMoment | None,
        Field(
            description="Now, by the bridge's clock: the age of the oldest counts from it. If left out, the server's."
        ),
    ] = None
    quarantined: Annotated[Count, Field(description="Readings that the server has refused.")] = 0
    quarantine: Annotated[
        list[QuarantinedIn],
        Field(default_factory=list, max_length=MOST_QUARANTINED, description="The newest of them, at most 20."),
    ]
    clock_offset: Annotated[
        float | None,
        Field(strict=True, ge=-1e9, le=1e9, description="The control's clock less the bridge's, s; null: unknown."),
    ] = None
    kind: Annotated[
        Text200 | None, Field(max_length=32, description="How it reaches the control: opcua, haas, dprnt, ...")
    ] = None
    started_at: Annotated[AnyMoment | None, Field(description="When the bridge started, by its clock.")] = None
    mapping: MappingHash | None = None
    hold_all: Annotated[bool, Field(strict=True, description="true: it gives no correction to the control.")] = False
    identity: Annotated[Text200 | None, Field(description="The serial number that the control has answered.")] = None
    locations: Annotated[
        list[LocationIn],
        Field(default_factory=list, max_length=MOST_PLACES, description="What it may write to."),
    ]
    held_back: Annotated[
        list[HeldBackIn],
        Field(
            default_factory=list,
            max_length=MOST_PLACES,
            description="Corrections that cannot go, one entry for each tool memory; an alarm says so.",
        ),
    ]
    carries_decisions: Annotated[
        bool | None,
        Field(
            strict=True,
            description="true: `stop` and `hold` reach the control; false: this machine cannot be stopped by Inband; null: the bridge does not say.",
        ),
    ] = None
    running: Annotated[
        bool | None,
        Field(
            strict=True,
            description="true: the control says that it cuts (a program runs in automatic). Its minutes count for control plans by "
            "minutes. false: it does not run; null: the bridge does not know.",
        ),
    ] = None


class ServerOut(BaseModel):
    """Mark of the server's database. After a restore or a failover one of the first two is another, or the last is
    smaller than it was: then readings of the last minutes may be lost here, and the bridge sends them again by their keys.
    """

    system: Annotated[str, Field(description="PostgreSQL's system identifier.")]
    timeline: Annotated[int, Field(description="Its timeline; each failover begins another.")]
    last_event: Annotated[int, Field(description="Number of the last event.")]


class HeartbeatOut(BaseModel):
    """Answer to a heartbeat."""

    received_at: datetime
    server: ServerOut
    touch_test: Annotated[TouchTestOut | None, Field(description="The touch test of this machine that is open.")]


class LocationOut(BaseModel):
    """One location of the tool memory in the bridge's mapping, and its touch test."""

    tool_memory: Annotated[int, Field(description="R10.")]
    mapping: Annotated[str | None, Field(description="Hash of the mapping by which the bridge converts it.")]
    proved_at: Annotated[datetime | None, Field(description="When the touch test proved this mapping; null: not yet.")]
    offset: Annotated[float | None, Field(description="The offset that the control held last, mm; null: unknown.")]
    touch_test_by_page: Annotated[
        bool, Field(description="true: the bridge makes touch tests of it that are asked for here.")
    ] = False
    corrected: Annotated[bool, Field(description="false: the bridge carries no corrections to it.")] = True
    proof_needed: Annotated[
        bool, Field(description="true: corrections wait until a touch test has proved this mapping.")
    ] = True


class QuarantinedOut(BaseModel):
    """A reading that the server has refused."""

    key: Annotated[str, Field(description="Key of the reading.")]
    characteristic: str | None
    reason: Annotated[str, Field(description="Why it was refused, in words.")]
    at: datetime


class HeldBackOut(BaseModel):
    """Corrections of one tool memory that the bridge holds back: the first of them, and why."""

    tool_memory: Annotated[int, Field(description="R10.")]
    number: Annotated[int, Field(description="The first of them.")]
    reason: Annotated[str, Field(description="Why they cannot go, in words.")]


class ConnectionOut(BaseModel):
    """The connection of one machine, as its bridge reported it last."""

    machine: str
    name: Annotated[str, Field(description="What people call the machine.")]
    silent: Annotated[bool, Field(description="No heartbeat for longer than INBAND_BRIDGE_SILENT_AFTER.")]
    age: Annotated[float, Field(description="Seconds since the last heartbeat.")]
    received_at: datetime
    state: Annotated[ConnectionState, Field(description=STATE_MEANS)]
    since: Annotated[datetime, Field(description="Since when it is in this state.")]
    detail: Annotated[str | None, Field(description="What the bridge said of it.")]
    error: Annotated[str | None, Field(description="The last error, in the bridge's words; it may be over.")]
    error_at: Annotated[datetime | None, Field(description="When that was, by the server's clock.")]
    version: Annotated[str, Field(description="Version of the bridge.")]
    kind: Annotated[str | None, Field(description="How it reaches the control: opcua, haas, dprnt, …")]
    started_at: Annotated[datetime | None, Field(description="When the bridge started, by its clock.")]
    waiting: Annotated[int, Field(description="Readings that wait in the bridge.")]
    oldest_waiting_at: Annotated[
        datetime | None, Field(description="When the oldest reading that waits came in, by the bridge's clock.")
    ]
    oldest_waiting: Annotated[float | None, Field(description="Age of the oldest reading that waits, s.")]
    backing_up: Annotated[bool, Field(description="It waits longer than INBAND_BRIDGE_BACKLOG_AFTER, or is full.")]
    quarantined: Annotated[int, Field(description="Readings of it that the server has refused.")]
    quarantine: Annotated[list[QuarantinedOut], Field(description="The newest of them, at most 20.")]
    clock_offset: Annotated[float | None, Field(description="The control's clock less the bridge's, s; null: unknown.")]
    mapping: Annotated[str | None, Field(description="Hash of the mapping by which the bridge converts.")]
    hold_all: Annotated[bool, Field(description="true: it gives no correction to the control.")]
    identity: Annotated[str | None, Field(description="The serial number that the control has answered.")]
    locations: Annotated[list[LocationOut], Field(description="Locations of the tool memory that it may write to.")]
    held_back: Annotated[
        list[HeldBackOut], Field(description="Corrections that the bridge cannot give to the control.")
    ]
    carries_decisions: Annotated[
        bool | None,
        Field(description="Whether `stop` and `hold` reach the control; null: the bridge does not say."),
    ]
