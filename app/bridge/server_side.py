"""The tasks that talk to the server for one machine: readings up, corrections down, the heartbeat."""

import asyncio
import contextlib
import json
import logging
import math
import time
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime
from typing import Any

from app import __version__
from app.bridge import guided_test
from app.bridge.configuration import Server
from app.bridge.guards import against
from app.bridge.links import Order
from app.bridge.offset_change import writes_offsets
from app.bridge.store import StoreError
from app.bridge.store_tables import Intent, Waiting
from app.bridge.unit import Unit
from inband_client import (
    AsyncClient,
    Conflict,
    Correction,
    Decision,
    Forbidden,
    Invalid,
    NotFound,
    ProblemError,
    TooLarge,
    Unauthorized,
    Unavailable,
    Untrusted,
)

log = logging.getLogger(__name__)
REFUSED = (Conflict, Invalid, NotFound, TooLarge)
SHORTEST_PAUSE, LONGEST_PAUSE = 1.0, 30.0  # s
AWAY = (Unauthorized, Forbidden, Unavailable, Untrusted)
TRUST = "Look at server.url; if it is right, name the authority that signed the certificate in server.ca."
TOGETHER = 100  # readings of a backlog in one request
MOST_DETAIL, MOST_REASON, MOST_NAME = 1000, 500, 200  # characters
MOST_CLOCK = 1e9  # s: a control whose battery is empty may say 1980; the server takes no more
MOST_OFFSET = 100_000.0  # mm: as much as the server takes; more is what a wrong register holds
NOTICED = 0.0005  # mm: what an offset may differ by without being told


async def run(unit: Unit, client: AsyncClient, server: Server) -> None:
    """Send what waits, bring corrections, until cancelled; whatever fails is said, and tried again.

    Corrections are asked for when a decision makes some, when the control has answered one, and every `Server.ask` seconds.
    """
    ask_at = 0.0
    while True:
        unit.news.clear()
        pause, trouble, away = server.ask, None, False
        in_full = due = unit.to_tell or time.monotonic() >= ask_at
        unit.to_tell = False
        for step in STEPS:
            if step is not _forward and not in_full:
                continue
            try:
                in_full = bool(await step(unit, client)) or in_full
            except Exception as error:  # noqa: BLE001 - said below; one step that fails holds up no other
                waits, trouble = _sentence(unit, error)
                pause, ask_at = max(pause, waits), 0.0
                if away := isinstance(error, AWAY):
                    break
        if due and trouble is None:  # corrections that readings ask for do not put off what else has to be told
            ask_at = time.monotonic() + server.ask
        unit.complain(trouble)
        if away:
            await asyncio.sleep(pause)
            continue
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(pause):
                await unit.news.wait()


def _sentence(unit: Unit, error: Exception) -> tuple[float, str]:
    """Seconds to wait, and what is wrong in words."""
    match error:
        case Unauthorized() | Forbidden():
            return LONGEST_PAUSE, (
                f"The server refuses the key of {unit.machine.key}: {error.detail} Make a new key in Set-up, Machines."
            )
        case Untrusted():
            return LONGEST_PAUSE, f"{error.detail} {TRUST}"
        case Unavailable():
            waits = min(max(error.retry_after or SHORTEST_PAUSE, SHORTEST_PAUSE), LONGEST_PAUSE)
            return waits, f"The server does not answer ({error.detail}) Does it run, and is server.url right?"
        case ProblemError() | StoreError():
            return LONGEST_PAUSE, str(error)
    log.error("%s", unit.machine.key, exc_info=error)
    return LONGEST_PAUSE, f"{type(error).__name__}: {error}"


# --- readings


async def _forward(unit: Unit, client: AsyncClient) -> bool:
    """Everything that waits, oldest first; whether corrections have to be asked for."""
    concerned = False
    while rows := await unit.store.waiting(unit.machine.key, TOGETHER):
        decisions = await _push_all(unit, client, rows)
        # while one is offered, any reading may supersede it
        concerned = concerned or bool(unit.orders) or any(_concerns(decision) for decision in decisions)
        if len(rows) < TOGETHER:
            break  # `Unit.news` tells of later ones
    return concerned


def _concerns(decision: Decision) -> bool:
    return decision.correction is not None or decision.action != "none" or bool(decision.alarms)


async def _push_all(unit: Unit, client: AsyncClient, rows: Sequence[Waiting]) -> Sequence[Decision]:
    if len(rows) > 1:
        try:
            batch = await client.push_many([row.body | {"key": row.key} for row in rows])
        except (*REFUSED, Forbidden):
            pass  # one of them: each by itself, below
        else:
            await unit.store.sent(unit.machine.key, [row.id for row in rows])
            return batch.decisions
    return [decision for row in rows if (decision := await _push(unit, client, row))]


async def _push(unit: Unit, client: AsyncClient, row: Waiting) -> Decision | None:
    try:
        decision = await client.push(row.body | {"key": row.key})
    except REFUSED as error:
        if _not_from_inband(error):
            raise
        reason = str(error)
    except Forbidden:
        if not await _key_is_right(unit, client):
            raise
        named = f"machine.{unit.machine.key}.characteristics"
        reason = f"Characteristic {row.body.get('characteristic')!r} is another machine's: correct it in {named}."
    else:
        await unit.store.sent(unit.machine.key, [row.id])
        return decision
    await unit.store.refuse(unit.machine.key, row.id, reason)
    log.warning("%s: reading %s is in the quarantine: %s", unit.machine.key, row.key, reason)
    return None


def _not_from_inband(error: ProblemError) -> bool:
    """Tell if it is not Inband's: a proxy without a server behind it may answer 404, which says nothing of what was sent."""
    return not error.kind


async def _key_is_right(unit: Unit, client: AsyncClient) -> bool:
    """Tell if the server takes the key for this machine, so that what it has forbidden is about something else."""
    try:
        await client.get(f"/machines/{unit.machine.key}")
    except (Unauthorized, Forbidden):
        return False
    return True


# --- corrections


async def _tell(unit: Unit, client: AsyncClient) -> None:
    """The control's answers, and offsets that somebody has changed at the control. One that is refused holds up no other."""
    key = unit.machine.key
    refused: ProblemError | None = None
    for intent in await unit.store.intents(key, "answered"):
        try:
            await _tell_one(unit, client, intent)
        except REFUSED as error:
            refused = refused or error
        else:
            await unit.store.set_intent(key, intent.order.number, "told")
    for tool_memory, offset in (await unit.store.untold(key, NOTICED)).items():
        try:
            await client.report_offset(key, tool_memory, round(offset, 6), none_applied=True)
        except REFUSED as error:
            refused = refused or error
        else:
            await unit.store.told(key, tool_memory, offset)
    if refused is not None:
        raise refused


async def _tell_one(unit: Unit, client: AsyncClient, intent: Intent) -> None:
    key, order, outcome = unit.machine.key, intent.order, intent.outcome
    assert outcome is not None  # it is answered
    held = None if outcome.offset is None else round(outcome.offset, 6)
    try:
        if outcome.applied:
            await client.confirm(key, order.number, offset_after=held, mapping=intent.mapping)
            return
        if not outcome.differs:
            await client.reject(key, order.number, _line(outcome.reason, MOST_REASON) or "The control has refused it.")
            return
    except (
        Conflict,
        NotFound,
    ) as error:  # superseded while the control took it, told before, or forgotten by a restored server
        if _not_from_inband(error):
            raise
        said = "is in the offset" if outcome.applied else "was refused by the control"
        log.warning("%s: correction %d %s, but %s", key, order.number, said, error)
    if held is not None:
        await client.report_offset(key, order.tool_memory, held, none_applied=True)


async def _ask(unit: Unit, client: AsyncClient) -> None:
    """The pending corrections, through the guards; what the control may have, and why others wait."""
    machine, store = unit.machine, unit.store
    if machine.corrections == "none":
        return
    if unit.test is not None and unit.test.holds:
        unit.held_back = (guided_test.holds(unit.test),)
        await _intend(unit, [])
        return
    pending = await client.pending(machine.key)
    told = {intent.order.number: intent for intent in await store.intents(machine.key, "told")} if pending else {}
    known = await store.known(machine.key)
    await unit.look_if_held()
    orders: list[Order] = []
    waiting: list[str] = []
    until = math.inf
    now = datetime.now(UTC)
    answered: set[int] = set()  # tool memories whose later corrections lead to another offset now
    for correction in pending:
        if correction.tool_memory in answered:
            unit.to_tell = True  # asked again at once
            unit.news.set()
            break
        if correction.offset_expected is None:
            waiting.append(f"Correction {correction.number} waits: the server does not say which offset it leads to.")
            break
        order = _order(correction, correction.offset_expected)
        if earlier := told.get(correction.number):
            await _tell_again(unit, client, order, earlier)
            answered.add(order.tool_memory)
            continue
        issued = correction.created_at or now
        verdict = against(order, issued, now, machine, known, unit.held)
        if verdict is None:
            if not orders:
                until = time.monotonic() + machine.largest_age - (now - issued).total_seconds()
            orders.append(order)
        elif verdict.final:
            answered.add(order.tool_memory)
            await _reject(unit, client, order.number, verdict.reason)
        else:
            waiting.append(verdict.reason)
            break  # the order of corrections is theirs: what stands behind waits too
    unit.held_back = tuple(waiting)
    await _intend(unit, orders, until)


async def _intend(unit: Unit, orders: Sequence[Order], until: float = math.inf) -> None:
    """Note what is offered before the control hears of it, and what is taken back."""
    key = unit.machine.key
    wanted = {order.number for order in orders}
    for intent in await unit.store.intents(key, "open"):
        if intent.order.number not in wanted:
            await unit.store.set_intent(key, intent.order.number, "withdrawn")
    offered: list[Order] = []
    for order in orders[:1]:
        location = next(place for place in unit.machine.location if place.tool_memory == order.tool_memory)
        if await unit.store.intend(key, order, unit.machine.mapping_hash(location)):
            offered.append(order)
    unit.orders, unit.orders_until = tuple(offered), until


async def _tell_again(unit: Unit, client: AsyncClient, order: Order, earlier: Intent) -> None:
    """A correction waits whose answer the server has heard: the answer was lost when the server went back in time, or the
    control has refused it, or the number was given anew to another correction.
    """
    same = abs(order.after - earlier.order.after) <= NOTICED and order.tool_memory == earlier.order.tool_memory
    if same and earlier.outcome is not None and earlier.outcome.applied:
        await _tell_one(unit, client, earlier)
        return
    reason = "The control has refused this correction; its offset was reported."
    if not same:
        reason = "The control has had another correction with this number, before the server went back in time."
    await _reject(unit, client, order.number, reason)


async def _reject(unit: Unit, client: AsyncClient, number: int, reason: str) -> None:
    try:
        await client.reject(unit.machine.key, number, reason)
    except Conflict as error:  # somebody was quicker; what was offered before must not stay on offer for that
        log.info("%s: correction %d: %s", unit.machine.key, number, error)


def _order(correction: Correction, after: float) -> Order:
    return Order(correction.number, correction.tool_memory, round(after - correction.amount, 6), round(after, 6))


STEPS: tuple[Callable[[Unit, AsyncClient], Awaitable[bool | None]], ...] = (_tell, _forward, _ask)


# --- heartbeat


async def beat(unit: Unit, client: AsyncClient, server: Server) -> None:
    """Tell the server how the machine is doing, until cancelled; and send again what it may have lost."""
    while True:
        try:
            answer = await client.heartbeat(unit.machine.key, **await heartbeat(unit))
            await _look_back(unit, answer.get("server") or {})
            await guided_test.hear(unit, answer.get("touch_test"))
        except Invalid as error:  # nobody else says it, and the server takes this bridge for silent
            log.warning("%s: %s", unit.machine.key, error)
        except (ProblemError, StoreError) as error:  # the control's and the server's side say it
            log.debug("%s: heartbeat: %s", unit.machine.key, error)
        except Exception:
            log.exception("%s: heartbeat", unit.machine.key)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(server.heartbeat):
                await unit.beat_now.wait()
        unit.beat_now.clear()


async def heartbeat(unit: Unit) -> dict[str, Any]:
    """The fields of a heartbeat."""
    machine, store = unit.machine, unit.store
    counts = await store.counts(machine.key)
    known = await store.known(machine.key)
    quarantine = await store.quarantine(machine.key) if counts.quarantined else []
    locations = []
    for location in machine.location:
        here = known.get(location.tool_memory)
        mapping = machine.mapping_hash(location)
        proved = here is not None and here.proved == mapping
        locations.append(
            {
                "tool_memory": location.tool_memory,
                "mapping": mapping,
                "proved_at": _moment(here.proved_at) if here is not None and proved else None,
                "offset": None if here is None else _sensible(here.offset),
                "touch_test_by_page": machine.touch_tests_by_page and writes_offsets(unit.link),
            }
        )
    return {
        "version": __version__,
        "kind": machine.kind,
        "state": unit.state,
        "detail": _line(unit.detail or unit.trouble or (unit.context.summary() if unit.context else ""), MOST_DETAIL),
        "sent_at": datetime.now(UTC),
        "waiting": counts.waiting,
        "oldest_waiting_at": _moment(counts.oldest),
        "quarantined": counts.quarantined,
        "quarantine": [
            {
                "key": _line(each.key) or "?",
                "characteristic": _line(each.body.get("characteristic")),
                "reason": _line(each.reason, MOST_REASON) or "",
                "at": _moment(each.at),
            }
            for each in quarantine
        ],
        "clock_offset": None if (ahead := unit.link.clock.offset) is None else max(-MOST_CLOCK, min(MOST_CLOCK, ahead)),
        "started_at": unit.started_at,
        "mapping": machine.mapping_hash(),
        "hold_all": unit.held,
        "identity": _line(unit.identity),
        "locations": locations,
    }


def _line(text: object, most: int = MOST_NAME) -> str | None:
    """Words as the server takes them, whatever a control or a file has sent: one line of signs that can be read, or None."""
    seen = "".join(sign if sign.isprintable() else " " for sign in str("" if text is None else text))
    return " ".join(seen.split())[:most].strip() or None


def _sensible(offset: float | None) -> float | None:
    return offset if offset is not None and abs(offset) <= MOST_OFFSET else None


def _moment(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


async def _look_back(unit: Unit, server: dict[str, Any]) -> None:
    """Let readings wait again that a server has had which is not that one any more: restored, or failed over.

    Keys make it harmless: what the server still has is answered as before.
    """
    if not server:
        return
    key = unit.machine.key
    seen = json.loads(await unit.store.fact(key, "server") or "null")
    if seen is not None:
        changed = [seen.get(name) for name in ("system", "timeline")] != [
            server.get(name) for name in ("system", "timeline")
        ]
        if changed or (server.get("last_event") or 0) < (seen.get("last_event") or 0):
            again = await unit.store.send_again(key)
            log.warning(
                "%s: the server went back in time (restored or failed over): %d readings are sent again", key, again
            )
            unit.news.set()
    await unit.store.note(key, "server", json.dumps(server))
