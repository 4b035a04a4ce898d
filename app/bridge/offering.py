"""Corrections of one machine: what the control may have now, and what it has answered.

All pending corrections of a tool location go out as one order, which is absolute, the location that waits longest first. The order
of corrections counts within a location alone: one that cannot go holds back its own tool and no other.
"""

import logging
import math
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

from app.bridge import proving_by_page
from app.bridge.guards import Known, against
from app.bridge.links import Order
from app.bridge.store_tables import REPORTED, Intent
from app.bridge.unit import HeldBack, Unit
from inband_client import AsyncClient, Conflict, Correction, Invalid, NotFound, ProblemError, TooLarge

log = logging.getLogger(__name__)
REFUSED = (Conflict, Invalid, NotFound, TooLarge)
MOST_REASON, MOST_NAME = 500, 200  # characters
NOTICED = 0.0005  # mm: what an offset may differ by without being reported


async def tell(unit: Unit, client: AsyncClient) -> None:
    """The control's answers, and offsets that a person has changed at the control. One that is refused holds up no other."""
    key = unit.machine.key
    refused: ProblemError | None = None
    for intent in await unit.store.intents(key, "answered"):
        try:
            await _tell_one(unit, client, intent)
        except REFUSED as error:
            refused = refused or error
        else:
            await unit.store.set_intent(key, intent.order.number, REPORTED)
    for tool_memory, offset in (await unit.store.unreported(key, NOTICED)).items():
        try:
            await client.report_offset(key, tool_memory, round(offset, 6), none_applied=True)
        except REFUSED as error:
            refused = refused or error
        else:
            await unit.store.reported(key, tool_memory, offset)
    if refused is not None:
        raise refused


async def _tell_one(unit: Unit, client: AsyncClient, intent: Intent) -> None:
    """Confirm or reject every correction of an order, the last one with the offset that the control holds."""
    key, order, outcome = unit.machine.key, intent.order, intent.outcome
    assert outcome is not None  # it is answered
    held = None if outcome.offset is None else round(outcome.offset, 6)
    conflict: ProblemError | None = None
    for number in order.numbers:
        try:
            if outcome.applied:
                after = held if number == order.number else None
                await client.confirm(key, number, offset_after=after, mapping=intent.mapping)
            elif not outcome.differs:
                reason = line(outcome.reason, MOST_REASON) or "The control has refused it."
                await client.reject(key, number, reason)
        except (
            Conflict,
            NotFound,
        ) as error:  # superseded while the control took it, reported before, or forgotten by a restored server
            if not_from_inband(error):
                raise
            said = "is in the offset" if outcome.applied else "was refused by the control"
            log.warning("%s: correction %d %s, but %s", key, number, said, error)
            conflict = error
    if held is None and outcome.applied:
        held = round(order.after, 6)  # not said, but an order is absolute
    if held is not None and (conflict is not None or outcome.differs):
        await client.report_offset(key, order.tool_memory, held, none_applied=True)


def not_from_inband(error: ProblemError) -> bool:
    """Tell if it is not Inband's: a proxy without a server behind it may answer 404, which says nothing of what was sent."""
    return not error.kind


async def ask(unit: Unit, client: AsyncClient) -> None:
    """The pending corrections, through the guards; what the control may have, and why others wait."""
    machine, store = unit.machine, unit.store
    if machine.corrections == "none":
        return
    if unit.test is not None and unit.test.holds:
        _note(unit, [HeldBack(unit.test.tool_memory, None, proving_by_page.holds(unit.test))])
        await _intend(unit, [])
        return
    unit.taken.clear()
    unheard = {intent.order.tool_memory for intent in await store.intents(machine.key, "answered")}
    pending: dict[int, list[Correction]] = {}  # the location that waits longest first
    for correction in await client.pending(machine.key):
        pending.setdefault(correction.tool_memory, []).append(correction)
        if correction.tool_memory in unit.newest:
            unit.newest[correction.tool_memory] = max(unit.newest[correction.tool_memory], correction.number)
        if unit.tool_memories.get(str(correction.characteristic)) != correction.tool_memory:
            unit.locations_at = (
                -math.inf
            )  # it has another location now: no reading may name a correction of the one before
    reported = await store.intents(machine.key, REPORTED) if pending else []
    known = await store.known(machine.key)
    await unit.look_if_held()
    orders: list[Order] = []
    waiting: list[HeldBack] = []
    for tool_memory, corrections in pending.items():
        if tool_memory in unheard:  # what these lead to is not known before the server has heard the answer
            continue
        found = await _of_location(unit, client, corrections, reported, known)
        if isinstance(found, Order):
            orders.append(found)
        elif found is not None:
            waiting.append(found)
        elif len(corrections) > 1:  # those that are left lead to another offset now: asked again at once
            unit.to_tell = True
            unit.news.set()
    _note(unit, waiting)
    await _intend(unit, orders)


async def _of_location(
    unit: Unit,
    client: AsyncClient,
    corrections: Sequence[Correction],
    reported: Sequence[Intent],
    known: Mapping[int, Known],
) -> Order | HeldBack | None:
    """The order that takes as many of these along as the guards let through, or why the first waits.

    None where the server has just heard something of one of them.
    """
    machine, first, now = unit.machine, corrections[0], datetime.now(UTC)
    for correction in corrections:
        if earlier := _answered_before(reported, correction):
            await _tell_again(unit, client, correction, earlier)
            return None
    if first.offset_expected is None:
        reason = f"Correction {first.number} waits: the server does not say which offset it leads to."
        return HeldBack(first.tool_memory, first.number, reason)
    issued = first.created_at or now
    until = time.monotonic() + machine.largest_age - (now - issued).total_seconds()
    alone = _merged(corrections[:1], until)
    verdict = against(alone, issued, now, machine, known, unit.held)
    if verdict is not None and verdict.final:
        await _reject(unit, client, first.number, verdict.reason)
        return None
    if verdict is not None:
        return HeldBack(first.tool_memory, first.number, verdict.reason)
    for count in range(len(corrections), 1, -1):
        together = corrections[:count]
        if together[-1].offset_expected is not None:
            order = _merged(together, until)
            if against(order, issued, now, machine, known, unit.held) is None:
                return order
    return alone


def _merged(corrections: Sequence[Correction], until: float) -> Order:
    first, last = corrections[0], corrections[-1]
    assert first.offset_expected is not None  # looked at by the caller
    assert last.offset_expected is not None
    before = round(first.offset_expected - first.amount, 6)
    earlier = tuple(correction.number for correction in corrections[:-1])
    return Order(last.number, first.tool_memory, before, round(last.offset_expected, 6), earlier, until)


async def _intend(unit: Unit, orders: Sequence[Order]) -> None:
    """Note what is offered before the control hears of it, and what is taken back."""
    key = unit.machine.key
    wanted = {order.number for order in orders}
    for intent in await unit.store.intents(key, "open"):
        if intent.order.number not in wanted:
            await unit.store.set_intent(key, intent.order.number, "withdrawn")
    offered: list[Order] = []
    for order in orders:
        location = next(place for place in unit.machine.location if place.tool_memory == order.tool_memory)
        if await unit.store.intend(key, order, unit.machine.mapping_hash(location)):
            offered.append(order)
    # the control may have answered an order for a location since the server was asked: these begin at the offset before it
    unit.orders = tuple(order for order in offered if order.tool_memory not in unit.taken)


def _note(unit: Unit, waiting: Sequence[HeldBack]) -> None:
    """Keep why corrections wait; what is new is logged."""
    for each in waiting:
        if each not in unit.held_back:
            log.warning("%s: %s", unit.machine.key, each.reason)
    unit.held_back = tuple(waiting)


def _answered_before(reported: Sequence[Intent], correction: Correction) -> Intent | None:
    """The order with this correction whose answer the server has heard."""
    for intent in reported:
        order = intent.order
        if correction.number == order.number or (
            correction.number in order.merged and correction.tool_memory == order.tool_memory
        ):
            return intent
    return None


async def _tell_again(unit: Unit, client: AsyncClient, correction: Correction, earlier: Intent) -> None:
    """A correction waits whose answer the server has heard: the answer was lost when the server went back in time, or the
    control has refused it, or the number was given again to another correction.
    """
    order, after = earlier.order, correction.offset_expected
    same = correction.tool_memory == order.tool_memory
    if correction.number == order.number:
        same = same and after is not None and abs(after - order.after) <= NOTICED
    if same and earlier.outcome is not None and earlier.outcome.applied:
        await _tell_one(unit, client, earlier)
        return
    reason = "The control has refused this correction; its offset was reported."
    if not same:
        reason = "The control has had another correction with this number, before the server went back in time."
    await _reject(unit, client, correction.number, reason)


async def _reject(unit: Unit, client: AsyncClient, number: int, reason: str) -> None:
    try:
        await client.reject(unit.machine.key, number, reason)
    except Conflict as error:  # someone else was quicker; what was offered before must not stay on offer for that
        log.info("%s: correction %d: %s", unit.machine.key, number, error)


def line(text: object, most: int = MOST_NAME) -> str | None:
    """Words as the server takes them, whatever a control or a file has sent: one line of signs that can be read, or None."""
    seen = "".join(sign if sign.isprintable() else " " for sign in str("" if text is None else text))
    return " ".join(seen.split())[:most].strip() or None
