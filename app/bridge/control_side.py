"""The task that talks to one control: readings into the store, corrections offered, answers noted."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar, cast

from app.bridge import log_lines, proving_by_page
from app.bridge.links import (
    STOPPING,
    DecisionCarrier,
    LinkError,
    Misconfigured,
    Order,
    carries_decisions,
    look_who_answers,
    silence,
)
from app.bridge.moments import wrong_date
from app.bridge.store_lock import StoreError
from app.bridge.unit import Unit

log = logging.getLogger(__name__)
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 15.0  # s between attempts to connect
FULL_EVERY = 5.0  # s
AGAIN = 15.0  # s between attempts at what is beside the readings, at most
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Failed:
    """Something beside the readings that has failed. of: what was to be done. until: when it is tried again. pause: s."""

    error: Exception
    of: object
    until: float
    pause: float


class Beside:
    """Work beside the readings, an offer or a look at the offsets: it may fail, and readings go on."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self.failed: dict[str, Failed] = {}
        self.offered: Sequence[Order] = ()

    async def do(self, name: str, of: object, work: Callable[[], Awaitable[T]]) -> T | None:
        """Do it, unless it has just failed. Raises what may have left the connection behind in disorder."""
        before = self.failed.get(name)
        if before is not None and before.of == of and time.monotonic() < before.until:
            return None
        try:
            async with asyncio.timeout(self.unit.machine.patience):
                found = await work()
        except Exception as error:
            pause = 0.0 if before is None else min(max(2 * before.pause, FIRST_PAUSE), AGAIN)
            self.failed[name] = Failed(error, of, time.monotonic() + pause, pause)
            if not isinstance(error, Misconfigured):
                self.unit.polls += 1  # readings have come: the next attempt to connect need not wait
                raise
            return None
        self.failed.pop(name, None)
        return found

    def note_offered(self, orders: Sequence[Order]) -> None:
        """Log what the control can take now and could not before."""
        if "offer" in self.failed:
            return
        for order in orders:
            if order not in self.offered:
                log_lines.offered(self.unit.machine.key, order)
        self.offered = orders

    def words(self) -> tuple[str, str]:
        """The state and the sentences of what fails time and again; empty if nothing does."""
        said = [each.error for each in self.failed.values() if each.pause or isinstance(each.error, Misconfigured)]
        words = [str(error) or silence(self.unit.machine.patience) for error in said]
        return ("configuration" if said else ""), " ".join(f"{each} Readings go on." for each in words)


async def run(unit: Unit) -> None:
    """Work with the control until cancelled; whatever fails is said, and tried again."""
    pause, beside = FIRST_PAUSE, Beside(unit)
    while True:
        began = unit.polls
        try:
            await _connected(unit, beside)
        except (LinkError, StoreError) as error:
            unit.say(error.state if isinstance(error, LinkError) else "full", str(error))
        except TimeoutError:
            unit.say("control_away", silence(unit.machine.patience))
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            if (unit.state, unit.detail) != ("control_away", said):  # once: it comes again with each attempt
                log.exception("%s", unit.machine.key)
            unit.say("control_away", said)
        finally:
            await _closed(unit)
        pause = FIRST_PAUSE if unit.polls > began else min(2 * pause, LONGEST_PAUSE)
        await asyncio.sleep(pause)


def _until_next(interval: float) -> float:
    """Seconds until the next poll. All machines with the same interval are polled together, which shares wake-ups and commits."""
    return interval - time.monotonic() % interval


async def _closed(unit: Unit) -> None:
    try:
        async with asyncio.timeout(unit.machine.patience):
            await unit.link.close()
    except Exception:
        log.exception("%s: closing the connection", unit.machine.key)


async def _decide(unit: Unit, beside: Beside) -> None:
    """Tell the control what was decided; whatever fails is reported again."""
    decided = tuple(unit.decisions)
    if not decided:
        return
    carrier = cast("DecisionCarrier", unit.link)  # decisions are kept for such links alone
    await beside.do("decide", decided, partial(carrier.decide, decided))
    if "decide" in beside.failed:
        return
    if stopping := [each.key for each in decided if each.action in STOPPING]:
        await unit.store.carried(unit.machine.key, stopping)
    del unit.decisions[: len(decided)]


async def _connected(unit: Unit, beside: Beside) -> None:
    machine, link, store = unit.machine, unit.link, unit.store
    await proving_by_page.resume(unit)
    async with asyncio.timeout(machine.patience):
        unit.identity = await link.connect()
    look_who_answers(unit.identity, machine.identity)
    position = await store.position(machine.key)
    if carries_decisions(link):
        known = {each.key for each in unit.decisions}
        unit.decisions[:0] = [each for each in await store.decisions(machine.key) if each.key not in known]
    answered: set[int] = set()
    offsets_at = full_at = 0.0
    full = False
    while True:
        if unit.test is not None:
            await proving_by_page.advance(unit)
        if time.monotonic() >= full_at:
            full, full_at = await store.is_full(), time.monotonic() + FULL_EVERY
            await unit.look_if_held()  # the server's side does not come to it while the server is unreachable
        if full:
            if machine.corrections != "none" and not unit.offered:  # a hold and an age count all the same
                async with asyncio.timeout(machine.patience):
                    await link.fetch(position)
                    await link.offer(())
            raise StoreError(
                f"The store holds {store.largest / 1e6:g} MB, its largest size: nothing is fetched until the server has"
                " taken readings. They wait at the control."
            )
        async with asyncio.timeout(machine.patience):
            received = await link.fetch(position)
        if received:
            if unit.context is not None:
                received = unit.context.with_parts(received)
            added = await store.add(machine.key, received)
            received = [
                replace(each, fault=added.refused.get(place, each.fault)) for place, each in enumerate(received)
            ]
            log_lines.readings(machine.key, received, added.new)
            position = received[-1].position or position
            unit.news.set()
            async with asyncio.timeout(machine.patience):
                await link.acknowledge(received)
        if unit.refused:
            await beside.do("refusals", None, partial(_tell_refused, unit))
        async with asyncio.timeout(machine.patience):
            for outcome in await link.outcomes():
                order = next((each for each in unit.orders if each.number == outcome.number), None)
                memory = order and order.tool_memory
                if order is not None or outcome.number not in answered:
                    if noted := await store.answered(machine.key, outcome):
                        memory = noted
                        log_lines.answered(machine.key, outcome)
                        unit.to_tell = True
                        unit.news.set()
                    answered.add(outcome.number)
                # nor another order for this location, however long the server is unreachable: it begins at the offset of before
                unit.taken.add(memory or 0)
                unit.orders = tuple(each for each in unit.orders if each.tool_memory != memory)
        offered = tuple(unit.offered)
        await beside.do("offer", offered, partial(link.offer, offered))
        beside.note_offered(offered)
        await _decide(unit, beside)
        if time.monotonic() >= offsets_at:
            offsets = await beside.do("offsets", None, link.offsets) or {}
            if unit.test is not None and unit.test.changed:
                offsets.pop(unit.test.tool_memory, None)  # nobody's edit
            if offsets:
                await store.held(machine.key, offsets)
            offsets_at = time.monotonic() + machine.offsets_every
        unit.polls += 1
        remark = getattr(link, "remark", "")  # of kinds that see gaps in what a control prints
        waits = unit.test.waits if unit.test is not None else ""
        state, failed = beside.words()
        unit.say(
            state or ("held" if unit.held else "online"),
            " ".join(filter(None, (failed, waits, remark, wrong_date(link.clock)))),
        )
        await asyncio.sleep(_until_next(machine.interval))


async def _tell_refused(unit: Unit) -> None:
    """Tell a machine that listens which of its readings the server has refused."""
    tell = getattr(unit.link, "tell_refused", None)
    while unit.refused:
        if tell is not None:
            await tell(*unit.refused[0])
        del unit.refused[0]
