"""The interface between the bridge and a kind of control, and the errors that a kind reports.

Lengths are mm in Inband's sense on this side: a kind, or `app.bridge.registers` for it, converts by the location's mapping.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Protocol

LIBRARIES: Final = (
    "pip install --require-hashes -r libraries-of-the-bridge.txt (beside the server: libraries-with-extras.txt)"
)
"""How to install what a kind needs beyond the usual: from the files beside the wheel. No name of Inband is registered at PyPI,
so by name pip would install what anybody puts there."""


class LinkError(Exception):
    """A control cannot be worked with now. The words say what is wrong and what to do; ``state`` is the heartbeat's."""

    state: ClassVar[str] = "control_away"


class ControlAway(LinkError):
    """No connection, or no answer; tried again by itself."""


class NotNow(ControlAway):
    """The control is there, but an offset must not be written at this moment: a program runs, or the tool is in use."""


class WrongMachine(LinkError):
    """Another machine answers at this address."""

    state = "wrong_machine"


class CountersLost(LinkError):
    """The control's counters went back or lost readings; a person has to look."""

    state = "counters_lost"


class Misconfigured(LinkError):
    """The control does not know what the configuration names, or works in another unit."""

    state = "configuration"


def look_who_answers(identity: str, wanted: str | None) -> None:
    """Raises `WrongMachine` where another machine answers than the one that the configuration names."""
    if wanted not in {None, identity}:
        raise WrongMachine(
            f"At this address machine {identity!r} answers, not {wanted!r}: look at address and network. If the control was"
            " exchanged, name the new one in identity. Nothing is fetched or written."
        )


def silence(seconds: float) -> str:
    """The sentence about a control that does not answer."""
    return (
        f"The control has not answered for {seconds:g} s: is it on, do address and port lead to it, and is there a firewall"
        " between?"
    )


@dataclass(frozen=True, slots=True)
class Position:
    """The part of a control's ring that is stored.

    epoch: None before the first contact. generation: counts how often a person has accepted counters that went back.
    """

    epoch: int | None = None
    sequence: int = 0
    generation: int = 0


@dataclass(frozen=True, slots=True)
class Received:
    """One reading as it came from a control.

    key: names it for ever. body: the reading as ``POST /readings`` takes it, without the key. position: in the ring, where
    the control has one. fault: a sentence why it is no reading for the server; it goes to the quarantine. mark: what the
    kind needs to acknowledge it.
    """

    key: str
    body: dict[str, Any]
    position: Position | None = None
    fault: str | None = None
    mark: Any = None


@dataclass(frozen=True, slots=True)
class Order:
    """All that the control is to take at one location: absolute offsets before and after, mm.

    number: of the last correction in it. merged: those of earlier ones of this location that it takes along, ascending. until: when
    it is too old, by the monotonic clock.
    """

    number: int
    tool_memory: int
    before: float
    after: float
    merged: tuple[int, ...] = ()
    until: float = field(default=math.inf, compare=False)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Every correction in it, in their order."""
        return (*self.merged, self.number)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of an order. offset: the one that the control holds now, mm, None where it does not say.

    differs: the offset was neither the one before the correction nor the one after it.
    """

    number: int
    applied: bool
    offset: float | None = None
    reason: str = ""
    differs: bool = False


STOPPING: frozenset[str] = frozenset({"hold", "stop"})
"""Actions that a control must hear of, however often the bridge is restarted."""


@dataclass(frozen=True, slots=True)
class Decided:
    """The server's decision on a reading. key, characteristic: of the reading; reason: a code, such as ``probe_fault``.

    measure_next: the part to measure next, counted from this one, where a control plan says so.
    """

    key: str
    characteristic: str
    action: str
    reason: str = ""
    measure_next: int | None = None


@dataclass(slots=True)
class Clock:
    """The control's clock minus the bridge's. offset: s, None until it is known. days: whole days of it, by the control's date."""

    offset: float | None = None
    days: int = 0


class Link(Protocol):
    """One control. Calls come one at a time; a call that fails raises `LinkError`, and the link is connected again."""

    clock: Clock

    async def connect(self) -> str:
        """Connect, and answer the control's identity: a serial number, or what is nearest to one."""

    async def close(self) -> None:
        """Disconnect; never raises."""

    async def fetch(self, stored: Position) -> Sequence[Received]:
        """New readings, oldest first; empty if there are none. They stay at the control until they are acknowledged."""

    async def acknowledge(self, received: Sequence[Received]) -> None:
        """Say that these are stored durably."""

    async def offer(self, orders: Sequence[Order]) -> None:
        """Make these known to the control, one for each location, the one that waits longest first; and no others.

        Offering the same again changes nothing.
        """

    async def outcomes(self) -> Sequence[Outcome]:
        """The answers that the control has given last. They may repeat themselves."""

    async def offsets(self) -> dict[int, float]:
        """The offsets that the control holds, by tool memory, mm; empty where they cannot be read."""


class OneWay:
    """The part of a link by which nothing goes back to the machine."""

    async def offer(self, orders: Sequence[Order]) -> None:
        """Nothing can be offered."""

    async def outcomes(self) -> Sequence[Outcome]:
        """Nothing is answered."""
        return []

    async def offsets(self) -> dict[int, float]:
        """Nothing can be read."""
        return {}


class DecisionCarrier(Protocol):
    """A link that carries decisions to the control; without one the machine cannot be stopped by Inband."""

    async def decide(self, decided: Sequence[Decided]) -> None:
        """Tell the control, oldest first. Telling the same again does no harm."""


def carries_decisions(link: object) -> bool:
    """Tell if `stop` and `hold` reach the control through this link."""
    return bool(getattr(link, "carries_decisions", hasattr(link, "decide")))


class OffsetAccess(Protocol):
    """A link that can write an offset directly: needed for the touch test, and for ``corrections = "direct"``."""

    async def read_offset(self, tool_memory: int) -> float:
        """The offset, mm."""

    async def write_offset(self, tool_memory: int, offset: float) -> None:
        """Set the offset, mm. Raises `NotNow` too."""
