"""The touch test by the command: proves sign, factor, diameter or radius, unit and register of one tool location.

At the page `app.bridge.proving_by_page` does the same with the answers of a person in the browser.
"""

import asyncio
from collections.abc import Callable

from app.bridge import offset_change
from app.bridge.configuration import Machine
from app.bridge.guards import location_of
from app.bridge.links import Link, LinkError, look_who_answers, silence
from app.bridge.offset_change import Back, Change
from app.bridge.program import link_of
from app.bridge.store import Store

Say = Callable[[str], None]
Ask = Callable[[str], bool]


async def run(machine: Machine, tool_memory: int, amount: float, store: Store, say: Say, ask: Ask) -> bool:
    """Change an offset by ``amount`` mm, let a person compare, take it back; whether the mapping is proved.

    The offset is taken back whatever the person answers and whatever fails in between; where the control does not let it, the
    next start of the bridge or of a test does. The proof is of the mapping as it is now: a change of it asks for a new test.
    """
    link = link_of(machine)
    if reason := offset_change.against(link, machine, tool_memory):
        say(reason)
        return False
    try:
        async with asyncio.timeout(machine.patience):
            identity = await link.connect()
        look_who_answers(identity, machine.identity)
        if not await _begun(link, machine, store, say):
            return False
        change = await offset_change.planned(link, machine, tool_memory, amount)
        proved = await _changed(link, change, machine, store, say, ask)
    except (LinkError, TimeoutError) as error:
        say(str(error) or silence(machine.patience))
        return False
    finally:
        await link.close()
    await store.prove(machine.key, tool_memory, change.mapping if proved else None)
    say(
        "Proved: corrections may reach this location." if proved else "Not proved: no correction reaches this location."
    )
    return proved


async def _begun(link: Link, machine: Machine, store: Store, say: Say) -> bool:
    """Take back what a test has left that was cut off; whether a new one may begin."""
    left = await offset_change.noted(store, machine.key)
    if left is None:
        return True
    if left.number is not None:
        say("A touch test by the page is open, or was cut off: end it at the page, with the bridge running.")
        return False
    back = await offset_change.take_back(link, machine, left)
    await offset_change.note(store, machine.key, None)
    say(f"A touch test was cut off. {back.words}")
    return back.kept


async def _changed(link: Link, change: Change, machine: Machine, store: Store, say: Say, ask: Ask) -> bool:
    say(
        f"The control holds {change.shown_before:.4f} {change.unit} in {change.place}: {change.before:.4f} mm for Inband, tool"
        f" memory {change.tool_memory}."
    )
    if not ask(f"Does the control's screen show {change.shown_before:.4f}? Is the program stopped?"):
        return False
    if reason := await offset_change.changed_since(link, machine, change):
        say(reason)
        return False
    back: Back | None = None
    await offset_change.note(store, machine.key, change)
    try:
        if reason := await offset_change.write(link, machine, change):
            say(reason)
            right = False
        else:
            right = _compared(change, machine, say, ask)
    finally:
        try:
            back = await offset_change.take_back(link, machine, change)
        except LinkError as error:
            say(f"NOT taken back: {error} {change.by_hand} Or start the bridge: it takes it back first.")
        else:
            await offset_change.note(store, machine.key, None)
            say(back.words)
    return right and back is not None and back.kept and back.untouched


def _compared(change: Change, machine: Machine, say: Say, ask: Ask) -> bool:
    amount = change.after - change.before
    location = location_of(machine, change.tool_memory)
    say(f"Inband’s offset is {amount * 1000:+.0f} µm larger now.")
    sense = "radius" if location is not None and location.holds == "radius" else "diameter or length"
    return ask(
        f"Does the screen show {change.shown_after:.4f} in that place now, and has nothing else changed?"
    ) and ask(
        f"Would a part cut now be {abs(amount):.3f} mm larger in size, as a larger {sense} of this offset should make it"
        " (or smaller, if the factor of the characteristic says so)?"
    )
