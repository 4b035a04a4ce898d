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
from app.bridge import log_lines, offering, proving_by_page
from app.bridge.configuration import Server
from app.bridge.links import STOPPING, Decided, carries_decisions
from app.bridge.offering import MOST_REASON, REFUSED, line, not_from_inband
from app.bridge.offset_change import writes_offsets
from app.bridge.store_lock import StoreError
from app.bridge.store_tables import Waiting
from app.bridge.unit import Unit
from inband_client import (
    AsyncClient,
    Decision,
    Forbidden,
    Invalid,
    ProblemError,
    Unauthorized,
    Unavailable,
    Untrusted,
)

log = logging.getLogger(__name__)
SHORTEST_PAUSE, LONGEST_PAUSE = 1.0, 30.0  # s
AWAY = (Unauthorized, Forbidden, Unavailable, Untrusted)
TRUST = "Look at server.url; if it is right, name the authority that signed the certificate in server.ca."
TOGETHER = 100  # readings of a backlog in one request
MOST_DETAIL, MOST_HELD_BACK = 1000, 100  # characters; tools
MOST_CLOCK = 1e9  # s: a control whose battery is empty may say 1980; the server takes no more
MOST_OFFSET = 100_000.0  # mm: as much as the server takes; more is what a wrong register holds
LOCATIONS_EVERY = 30.0  # s: as long as a characteristic may go on counting for the location that it had


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
        if due and trouble is None:  # corrections that readings ask for do not put off what else has to be reported
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
        bodies = [await _as_sent(unit, client, row) for row in rows]
        try:
            batch = await client.push_many(bodies)
        except (*REFUSED, Forbidden):
            pass  # one of them: each by itself, below
        else:
            await _decided(unit, list(zip(rows, batch.decisions, strict=True)))
            await unit.store.sent(unit.machine.key, [row.id for row in rows])
            _newest(unit, batch.decisions)
            for row, decided in zip(rows, batch.decisions, strict=False):
                log_lines.decision(unit.machine.key, row.key, decided)
            return batch.decisions
    return [decision for row in rows if (decision := await _push(unit, client, row))]


async def _push(unit: Unit, client: AsyncClient, row: Waiting) -> Decision | None:
    body = await _as_sent(unit, client, row)
    try:
        decision = await client.push(body)
    except REFUSED as error:
        if not_from_inband(error):
            raise
        reason = str(error)
        if error.document.get("action") in STOPPING and not row.again:
            stop = Decided(row.key, str(row.body.get("characteristic")), error.document["action"], error.kind)
            await _for_control(unit, [stop])
    except Forbidden:
        if not await _key_is_right(unit, client):
            raise
        named = f"machine.{unit.machine.key}.characteristics"
        reason = f"Characteristic {row.body.get('characteristic')!r} is another machine's: correct it in {named}."
    else:
        await _decided(unit, [(row, decision)])
        await unit.store.sent(unit.machine.key, [row.id])
        _newest(unit, [decision])
        log_lines.decision(unit.machine.key, row.key, decision)
        return decision
    await unit.store.refuse(unit.machine.key, row.id, reason)
    unit.refused.append((row.key, reason))
    log.warning("%s: reading %s is in the quarantine: %s", unit.machine.key, row.key, reason)
    return None


async def _decided(unit: Unit, pairs: Sequence[tuple[Waiting, Decision]]) -> None:
    """Note for the control what the server has decided; a stop outlives the bridge. What is sent again was decided before."""
    decided = [
        Decided(row.key, decision.characteristic, decision.action, decision.reason.code, decision.measure_next)
        for row, decision in pairs
        if not row.again
    ]
    await _for_control(unit, decided)


async def _for_control(unit: Unit, decided: list[Decided]) -> None:
    """Keep decisions for a control that takes any."""
    if not carries_decisions(unit.link):
        return
    if stopping := [each for each in decided if each.action in STOPPING]:
        await unit.store.keep_decisions(unit.machine.key, stopping)
    unit.decisions += decided


async def _as_sent(unit: Unit, client: AsyncClient, row: Waiting) -> dict[str, Any]:
    """A reading as the server takes it: with the correction in effect of its own tool location.

    A control keeps one number for all locations, which do not get their corrections in the order of the numbers. Of what a
    person has set by hand it knows nothing: then its number is no answer.
    """
    body = row.body | {"key": row.key}
    number = body.get("correction_in_effect")
    if number is None:
        return body
    memory = await _tool_memory(unit, client, str(body.get("characteristic")))
    known = number and (await unit.store.in_effect(unit.machine.key, memory, int(number)) if memory else None)
    if known is None or (memory and await _set_by_hand(unit, client, memory, known, row.at)):
        del body["correction_in_effect"]
    else:
        body["correction_in_effect"] = known
    return body


async def _set_by_hand(unit: Unit, client: AsyncClient, memory: int, known: int, at: float) -> bool:
    """Tell if a correction beyond the known one was in the offset when a reading came, and not by this control."""
    if unit.machine.corrections == "none" or known >= unit.newest.get(memory, math.inf):
        return False  # without a mailbox the number is that of a text, or typed
    query: dict[str, Any] = {"status": "applied", "tool_memory": memory, "after": known}
    applied = [each async for each in client.items(f"/machines/{unit.machine.key}/corrections", **query)]
    unit.newest.setdefault(memory, max((each["number"] for each in applied), default=known))
    if not applied:
        return False
    own = await unit.store.applied(unit.machine.key, memory)
    return any(
        each["number"] not in own and datetime.fromisoformat(each["applied_at"]).timestamp() < at for each in applied
    )


def _newest(unit: Unit, decisions: Sequence[Decision]) -> None:
    """Note the newest correction of each location."""
    for decision in decisions:
        if (issued := decision.correction) is not None and issued.tool_memory in unit.newest:
            unit.newest[issued.tool_memory] = max(unit.newest[issued.tool_memory], issued.number)


async def _tool_memory(unit: Unit, client: AsyncClient, characteristic: str) -> int | None:
    """The location of a characteristic; None where the server knows none."""
    if time.monotonic() > unit.locations_at + LOCATIONS_EVERY:
        unit.tool_memories = {
            each["key"]: each["parameters"].get("tool_memory")
            async for each in client.items("/characteristics", machine=unit.machine.key, limit=1000)
        }
        unit.locations_at = time.monotonic()
    return unit.tool_memories.get(characteristic)


async def _key_is_right(unit: Unit, client: AsyncClient) -> bool:
    """Tell if the server takes the key for this machine, so that what it has forbidden is about something else."""
    try:
        await client.get(f"/machines/{unit.machine.key}")
    except (Unauthorized, Forbidden):
        return False
    return True


STEPS: tuple[Callable[[Unit, AsyncClient], Awaitable[bool | None]], ...] = (offering.tell, _forward, offering.ask)


# --- heartbeat


async def beat(unit: Unit, client: AsyncClient, server: Server) -> None:
    """Tell the server how the machine is doing, until cancelled; and send again what it may have lost."""
    while True:
        try:
            answer = await client.heartbeat(unit.machine.key, **await heartbeat(unit))
            await _look_back(unit, answer.get("server") or {})
            await proving_by_page.hear(unit, answer.get("touch_test"))
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
                "corrected": machine.corrections != "none",
                "proof_needed": machine.proof_needed,
            }
        )
    return {
        "version": __version__,
        "kind": machine.kind,
        "state": unit.state,
        "detail": line(_detail(unit), MOST_DETAIL),
        "sent_at": datetime.now(UTC),
        "waiting": counts.waiting,
        "oldest_waiting_at": _moment(counts.oldest),
        "quarantined": counts.quarantined,
        "quarantine": [
            {
                "key": line(each.key) or "?",
                "characteristic": line(each.body.get("characteristic")),
                "reason": line(each.reason, MOST_REASON) or "",
                "at": _moment(each.at),
            }
            for each in quarantine
        ],
        "clock_offset": None if (ahead := unit.link.clock.offset) is None else max(-MOST_CLOCK, min(MOST_CLOCK, ahead)),
        "started_at": unit.started_at,
        "mapping": machine.mapping_hash(),
        "hold_all": unit.held,
        "carries_decisions": carries_decisions(unit.link),
        "running": unit.context.running() if unit.context else None,
        "held_back": [
            {"tool_memory": each.tool_memory, "number": each.number, "reason": line(each.reason, MOST_REASON)}
            for each in unit.held_back[:MOST_HELD_BACK]
            if each.number is not None
        ],
        "identity": line(unit.identity),
        "locations": locations,
    }


def _detail(unit: Unit) -> str:
    """The control's side, then the server's, each sentence once; where all is well, what the agent says."""
    sentences = (unit.detail, unit.trouble, *(each.reason for each in unit.held_back))
    return " ".join(dict.fromkeys(filter(None, sentences))) or (unit.context.summary() if unit.context else "")


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
