"""The touch test: proves sign, factor, diameter or radius, unit and register of one tool location."""

import asyncio
from collections.abc import Callable

from app.bridge.configuration import Location, Machine
from app.bridge.guards import location_of
from app.bridge.links import LinkError
from app.bridge.program import link_of
from app.bridge.store import Store

Say = Callable[[str], None]
Ask = Callable[[str], bool]


async def run(machine: Machine, tool_memory: int, amount: float, store: Store, say: Say, ask: Ask) -> bool:
    """Change an offset by ``amount`` mm, let a person compare, take it back; whether the mapping is proved.

    The offset is taken back whatever the person answers and whatever fails in between. The proof is of the mapping as it is
    now: a change of it asks for a new test.
    """
    location = location_of(machine, tool_memory)
    if location is None:
        say(f"Tool memory {tool_memory} has no [[machine.{machine.key}.location]] in the configuration.")
        return False
    link = link_of(machine)
    if not hasattr(link, "write_offset"):
        say(
            f"A control of kind {machine.kind} lets no program write offsets: enter {amount:g} mm by hand, and compare."
        )
        return False
    try:
        async with asyncio.timeout(machine.patience):
            identity = await link.connect()
        if machine.identity not in {None, identity}:
            say(f"Machine {identity!r} answers, not {machine.identity!r}.")
            return False
        proved = await _changed(link, location, machine, amount, say, ask)
    except (LinkError, TimeoutError) as error:
        say(str(error) or f"The control has not answered for {machine.patience:g} s.")
        return False
    finally:
        await link.close()
    await store.prove(machine.key, tool_memory, machine.mapping_hash(location) if proved else None)
    say(
        "Proved: corrections may reach this location." if proved else "Not proved: no correction reaches this location."
    )
    return proved


async def _changed(link: object, location: Location, machine: Machine, amount: float, say: Say, ask: Ask) -> bool:
    read, write = link.read_offset, link.write_offset  # type: ignore[attr-defined]
    memory = location.tool_memory
    before = await read(memory)
    shown = location.to_control(before, machine.unit)
    there = location.to_control(before + amount, machine.unit)
    named = f"{location.register} of tool {location.tool}, edge {location.edge}"
    say(f"The control holds {shown:.4f} {machine.unit} in {named}: {before:.4f} mm for Inband, tool memory {memory}.")
    if not ask(f"Does the control's screen show {shown:.4f}? Is the program stopped?"):
        return False
    try:
        await write(memory, before + amount)
        await asyncio.sleep(max(machine.interval, 0.5))
        after = await read(memory)
        if abs(after - before - amount) > machine.tolerance:
            say(f"Read back are {after:.4f} mm in place of {before + amount:.4f} mm: the register was not set.")
            return False
        say(f"Inband’s offset is {amount * 1000:+.0f} µm larger now.")
        right = ask(f"Does the screen show {there:.4f} in that place now, and has nothing else changed?")
        sense = "diameter or length" if location.holds != "radius" else "radius"
        return right and ask(
            f"Would a part cut now be {abs(amount):.3f} mm larger in size, as a larger {sense} of this offset should make it"
            " (or smaller, if the factor of the characteristic says so)?"
        )
    finally:
        await write(memory, before)
        await asyncio.sleep(max(machine.interval, 0.5))
        back = await read(memory)
        kept = abs(back - before) <= machine.tolerance
        say(
            f"Taken back: {location.to_control(back, machine.unit):.4f} {machine.unit}."
            if kept
            else f"NOT taken back: the control holds {location.to_control(back, machine.unit):.4f}; set {shown:.4f} by hand."
        )
