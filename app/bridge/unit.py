"""State that the tasks of one machine share: its link, what is offered to the control, and how it is doing."""

import asyncio
import logging
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import NamedTuple

from app.bridge.configuration import Machine
from app.bridge.kinds.mtconnect import Context
from app.bridge.links import Decided, Link, Order
from app.bridge.offset_change import Change
from app.bridge.store import Store

log = logging.getLogger(__name__)


class HeldBack(NamedTuple):
    """A sentence why the corrections of a location wait. number: of the first of them, None where nobody needs to hear of it."""

    tool_memory: int
    number: int | None
    reason: str


@dataclass(slots=True)
class Guided:
    """A touch test that a person guides at the page.

    number: at the server, None for one of the command that was cut off. heard: its state at the server; since: when it began at
    the latest, by the bridge's own clock, for a server may be unreachable and its clock may be set.
    refused: the question that was answered with no. reached: the state that the bridge has brought it to; reported: the one of these
    that the server knows. change: once it is read. changed: the control may hold its offset. waits: why that is not
    taken back yet, where the control itself answers. ending: the state and the words
    that it ends with as soon as the offset is taken back; end: these, when it is. until: when the bridge waits no longer for a
    person, by its own clock.
    """

    number: int | None
    tool_memory: int
    amount: float
    until: float
    heard: str = "asked"
    since: float = 0.0
    refused: str | None = None
    reached: str = "asked"
    reported: str = "asked"
    change: Change | None = None
    changed: bool = False
    waits: str = ""
    ending: tuple[str, str] | None = None
    end: tuple[str, str] | None = None

    @property
    def holds(self) -> bool:
        """Tell if corrections wait for it."""
        return self.end is None


@dataclass(slots=True)
class Unit:
    """One machine.

    hold_all: by the configuration; held: by that or by command. orders: those that passed the guards, one for each location; the
    control side offers them until they are too old. taken: tool memories that the control has answered an order for since the
    server was asked last. decisions: what the control has to hear of. news: something waits for the server; to_tell: an answer of the control is among it. state and
    detail: the control's side, as the heartbeat tells it. held_back: why corrections wait. tool_memories: by characteristic, as
    the server said at locations_at (of the monotonic clock). newest: number of the newest correction of a location, once asked.
    trouble: the server's side, None while it answers. context: what an MTConnect agent tells of the machine. test: the touch test that is open; no correction is offered meanwhile; test_open: there
    is one. beat_now: the heartbeat waits no longer.
    refused: keys of readings that the server has refused, and the reasons: the machine has not heard of it yet.
    """

    machine: Machine
    link: Link
    store: Store
    hold_all: bool = False
    held: bool = False
    identity: str | None = None
    orders: Sequence[Order] = ()
    taken: set[int] = field(default_factory=set)
    decisions: list[Decided] = field(default_factory=list)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    to_tell: bool = False
    state: str = "starting"
    detail: str = ""
    held_back: tuple[HeldBack, ...] = ()
    tool_memories: dict[str, int | None] = field(default_factory=dict)
    locations_at: float = -math.inf
    newest: dict[int, int] = field(default_factory=dict)
    trouble: str | None = None
    started_at: datetime = field(default_factory=lambda: datetime.now(UTC))
    polls: int = 0
    context: Context | None = None
    test: Guided | None = None
    test_open: asyncio.Event = field(default_factory=asyncio.Event)
    beat_now: asyncio.Event = field(default_factory=asyncio.Event)
    refused: list[tuple[str, str]] = field(default_factory=list)

    @property
    def offered(self) -> Sequence[Order]:
        """The corrections that the control may have now; without a server too a hold and an age count."""
        if self.held or (self.test is not None and self.test.holds):
            return ()
        now = time.monotonic()
        return tuple(order for order in self.orders if now <= order.until)

    async def look_if_held(self) -> None:
        """Look whether corrections are on hold, by the configuration or by command. Raises `StoreError`."""
        facts = [await self.store.fact("", "hold_all"), await self.store.fact(self.machine.key, "hold")]
        self.held = self.hold_all or any(fact is not None for fact in facts)

    def say(self, state: str, detail: str = "") -> None:
        """Note how the control's side is doing; a change is logged."""
        if (state, detail) != (self.state, self.detail):
            level = logging.INFO if state in {"online", "starting"} else logging.WARNING
            log.log(level, "%s: %s%s", self.machine.key, state, f": {detail}" if detail else "")
        self.state, self.detail = state, detail

    def complain(self, trouble: str | None) -> None:
        """Note how the server's side is doing; a change is logged."""
        if trouble != self.trouble:
            if trouble is None:
                log.info("%s: the server answers", self.machine.key)
            else:
                log.warning("%s: %s", self.machine.key, trouble)
        self.trouble = trouble


async def ended(tasks: Sequence["asyncio.Task[None]"]) -> None:
    """Cancel tasks until they have ended: a library may swallow a cancellation (``asyncio.wait_for`` of Python 3.11 can)."""
    while waiting := [task for task in tasks if not task.done()]:
        for task in waiting:
            task.cancel()
        await asyncio.wait(waiting, timeout=1.0)
    await asyncio.gather(*tasks, return_exceptions=True)
