"""The touch test that a person guides at the page, beside the running program.

The heartbeat's answer tells of one that is open (`hear`). The control's task owns the link and does each step between two polls
(`advance`): it reads, writes when a person has said that the screen shows the same and the program is stopped, and takes back.
Another task tells the server and hears the answers (`run`). Whatever happens the offset is taken back: after the answers, when
a person stops it, when nobody answers, when the server is unreachable, when the program ends, and after a crash at the next start.
"""

import asyncio
import contextlib
import logging
import time
from collections.abc import Sequence
from typing import Any, Final

import msgspec

from app.bridge import offset_change
from app.bridge.links import LinkError, Misconfigured, NotNow
from app.bridge.offset_change import FACT, Change
from app.bridge.store_lock import StoreError
from app.bridge.unit import Guided, Unit
from inband_client import AsyncClient, Conflict, Invalid, NotFound, ProblemError

log = logging.getLogger(__name__)
LIMIT = 300.0  # s that a person has for each step
GO_LIMIT: Final = 30.0  # s: who said then that the program is stopped does not say it of now
EVERY: Final = 1.0  # s between two questions to the server
LAST: Final = 10.0  # s for taking back when the program ends
WORKING: Final = frozenset({"online", "held"})


def holds(test: Guided) -> str:
    """The sentence about corrections that wait for a touch test."""
    return f"Corrections wait for the touch test of tool memory {test.tool_memory}."


# --- what the server says


async def hear(unit: Unit, asked: dict[str, Any] | None) -> None:
    """Take up the test that the server tells of, or say why not."""
    if asked is None or unit.test is not None or await offset_change.noted(unit.store, unit.machine.key) is not None:
        return
    test = Guided(asked["id"], asked["tool_memory"], asked["amount"], time.monotonic() + LIMIT)
    test.ending = await _against(unit, asked)
    if test.ending is not None:
        test.end, test.reached = test.ending, test.ending[0]
    _open(unit, test)


async def _against(unit: Unit, asked: dict[str, Any]) -> tuple[str, str] | None:
    machine, memory = unit.machine, asked["tool_memory"]
    if asked["state"] == "read":
        return "cancelled", "The bridge was restarted during the touch test. Nothing was written."
    if asked["state"] != "asked":  # a note of it would be in the store from which it was written
        return "failed", (
            "The bridge was restarted, and its store knows nothing of this touch test. Look whether the control shows the"
            " number of before; if not, set that by hand."
        )
    if not machine.touch_tests_by_page:
        return "failed", (
            "This bridge makes no touch tests by the page. Set touch_tests_by_page = true in"
            f" [machine.{machine.key}] of its configuration and restart it, or use the command."
        )
    if reason := offset_change.against(unit.link, machine, memory):
        return "failed", reason
    if unit.state not in WORKING:
        return "failed", unit.detail or "The bridge has no connection to the control yet."
    for state in ("open", "answered"):
        if unit.orders or await unit.store.intents(machine.key, state):
            return "failed", "A correction is on its way to the control. Ask again when it is applied or refused."
    return None


async def resume(unit: Unit) -> None:
    """Take up what was cut off: an offset that may be at the control, or an end that the server has not heard."""
    if unit.test is not None:
        return
    change = await offset_change.noted(unit.store, unit.machine.key)
    if change is None:
        return
    test = Guided(change.number, change.tool_memory, change.after - change.before, time.monotonic(), change=change)
    if change.end is None:
        test.changed = True
        test.ending = ("cancelled", "The bridge was ended during the touch test.")
    else:
        test.end, test.reached = change.end, change.end[0]
    _open(unit, test)


def _open(unit: Unit, test: Guided) -> None:
    unit.test = test
    unit.test_open.set()


# --- at the control


async def advance(unit: Unit) -> None:
    """The next step at the control, if there is one. Raises `LinkError`, `TimeoutError`; it is tried again then."""
    test = unit.test
    if test is None or test.end is not None:
        return
    _decide(test)
    test.waits = ""
    async with asyncio.timeout(unit.machine.patience + 2 * offset_change.pause(unit.machine)):
        if test.ending is not None:
            await _take_back(unit, test, test.ending)
        elif test.reached == "asked":
            await _read(unit, test)
        elif test.reached == "read" and test.heard == "go":
            await _write(unit, test)


def _decide(test: Guided) -> None:
    """Note that the test has to end, and how."""
    if test.ending is not None:
        return
    if test.heard == "answered" and test.refused is not None:
        said = {"before": "The screen showed something else before.", "after": "The screen showed something else."}
        test.ending = ("not_proved", said.get(test.refused, "A part would not have become larger by that."))
    elif test.heard == "answered" and test.reached == "written":
        test.ending = ("proved", "")
    elif time.monotonic() > test.until:
        test.ending = ("cancelled", f"No answer came for {LIMIT / 60:g} minutes, from a person or from the server.")


async def _read(unit: Unit, test: Guided) -> None:
    try:
        change = await offset_change.planned(unit.link, unit.machine, test.tool_memory, test.amount, test.number)
    except Misconfigured as error:  # it comes again, and would hold up the readings
        test.ending = ("failed", str(error))
        return
    if test.end is None:  # the other task may have ended it meanwhile
        _reached(test, "read", change)


async def _write(unit: Unit, test: Guided) -> None:
    change = test.change
    assert change is not None  # it is read
    if time.monotonic() - test.since > GO_LIMIT:
        test.ending = ("cancelled", "The answer came too late to the bridge. Nothing was written.")
    elif reason := await offset_change.changed_since(unit.link, unit.machine, change):
        test.ending = ("failed", reason)
    if test.ending is not None:
        return
    test.changed = True
    test.ending = ("failed", "The control did not answer when the offset was written.")  # until it has
    try:
        await offset_change.note(unit.store, unit.machine.key, change)
        reason = await offset_change.write(unit.link, unit.machine, change)
    except (LinkError, StoreError) as error:
        test.ending = ("failed", str(error))
        return
    test.ending = ("not_proved", reason) if reason else None
    if not reason:
        _reached(test, "written", change)


def _reached(test: Guided, state: str, change: Change) -> None:
    test.change, test.reached, test.until = change, state, time.monotonic() + LIMIT


async def _take_back(unit: Unit, test: Guided, ending: tuple[str, str]) -> None:
    state, words = ending
    if test.changed:
        assert test.change is not None  # it was noted
        try:
            back = await offset_change.take_back(unit.link, unit.machine, test.change)
        except LinkError as error:
            words = f"The touch test of tool memory {test.tool_memory} is not taken back yet: {error}"
            words = f"{words} {test.change.by_hand} Or wait: it is tried again."
            if isinstance(error, NotNow):  # readings go on: a program that waits for them would never end
                test.waits = words
                return
            raise type(error)(words) from error
        words = f"{words} {back.words}".strip()
        if not back.kept:
            state = "failed"
        elif state == "proved" and not back.untouched:
            why = "The offset was back before: set by hand, or by an attempt whose answer was lost."
            state, words = "failed", f"{why} It proves nothing; make the test again. {words}"
    await _conclude(unit, test, state, words)


async def _conclude(unit: Unit, test: Guided, state: str, words: str) -> None:
    """Note the end durably, and the proof with it."""
    key, change = unit.machine.key, test.change
    if change is not None:
        ended = msgspec.structs.replace(change, end=(state, words))
        if state in {"proved", "not_proved"}:
            mapping = change.mapping if state == "proved" else None
            fact = (FACT, offset_change.text_of(ended))
            await unit.store.prove(key, change.tool_memory, mapping, fact)
        else:
            await offset_change.note(unit.store, key, ended)
    test.end, test.reached, test.changed = (state, words), state, False
    level = logging.ERROR if state == "failed" else logging.INFO
    log.log(level, "%s: touch test of tool memory %d: %s. %s", key, test.tool_memory, state, words)


# --- at the server


async def run(unit: Unit, client: AsyncClient) -> None:
    """Tell the server of the test that is open, and hear the answers, until cancelled."""
    while True:
        await unit.test_open.wait()
        try:
            await _talk(unit, client)
        except (ProblemError, StoreError) as error:  # the control's and the server's side say it
            log.debug("%s: touch test: %s", unit.machine.key, error)
        except Exception:
            log.exception("%s: touch test", unit.machine.key)
        if unit.test_open.is_set():
            await asyncio.sleep(EVERY)


async def _talk(unit: Unit, client: AsyncClient) -> None:
    test = unit.test
    if test is None:
        unit.test_open.clear()
        return
    if unit.state not in WORKING and test.end is None and not test.changed:  # the control's task does not come to it
        _decide(test)
        if test.ending is not None:
            await _conclude(unit, test, *test.ending)
    end, reached = test.end, test.reached
    if test.number is not None:
        path = f"/machines/{unit.machine.key}/touch-tests/{test.number}"
        asked_at = time.monotonic()
        try:
            if reached != test.reported:
                answer = await client.post(f"{path}/report", _report(test, reached), repeat=True)
                test.reported = reached
            else:
                answer = await client.get(path)
        except (NotFound, Conflict, Invalid) as error:
            log.warning("%s: touch test %d: %s", unit.machine.key, test.number, error)
            test.ending = test.ending or ("cancelled", "The server knows of this touch test no longer.")
        else:
            _heard(test, answer, asked_at)
    if end is not None:
        await _forget(unit)


def _heard(test: Guided, answer: dict[str, Any], asked_at: float) -> None:
    state, since, test.refused = answer["state"], asked_at - answer["state_age"], answer["refused"]
    if state != test.heard:
        test.until = time.monotonic() + LIMIT
        test.since = since
    test.heard, test.since = state, min(test.since, since)
    if test.ending is None and (state == "stopping" or answer["ended_at"] is not None):
        test.ending = ("cancelled", "Stopped by a person.")


async def _forget(unit: Unit) -> None:
    await offset_change.note(unit.store, unit.machine.key, None)
    unit.test = None
    unit.test_open.clear()
    unit.held_back = ()
    unit.to_tell = True  # corrections are asked for again
    unit.news.set()
    unit.beat_now.set()


def _report(test: Guided, state: str) -> dict[str, Any]:
    change = test.change
    report: dict[str, Any] = {"state": state, "detail": test.end[1][:1000] if test.end else None}
    if change is not None:
        report |= {
            "mapping": change.mapping,
            "place": change.place,
            "unit": change.unit,
            "before": round(change.before, 6),
            "shown_before": round(change.shown_before, 6),
            "shown_after": round(change.shown_after, 6),
        }
    return report


# --- the end of the program


async def end_all(units: Sequence[Unit]) -> None:
    """Take back what is at the controls, as long as that takes some seconds; the next start does what is left."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(LAST):
            while changed := [unit.test for unit in units if unit.test is not None and unit.test.changed]:
                for test in changed:  # each time: one whose offset is just being written has no end then
                    test.ending = test.ending or ("cancelled", "The bridge was ended during the touch test.")
                await asyncio.sleep(0.05)
