"""The change of an offset by a touch test: noted in the store before the control hears of it, and taken back whatever happens.

One rule for the command and for the page: an offset is written only where the control holds the one that was read, and taken
back only where it holds the one that was written. Anything else was set by someone else: it is left alone and reported.
"""

import asyncio
from typing import NamedTuple, cast

import msgspec
from msgspec import Struct

from app.bridge.configuration import Location, Machine
from app.bridge.guards import location_of
from app.bridge.links import ControlAway, Link, OffsetAccess
from app.bridge.store import Store

FACT = "touch_test"
LEAST_PAUSE = 0.5  # s: a control shows a new value only after its next sampling tick


class Change(Struct, frozen=True):
    """An offset that a touch test changes.

    before, after: Inband's offsets, mm. shown_before, shown_after: the same as the control's screen shows them. place: the
    register in words. mapping: the hash by which they were converted. number: of the test at the server, None for that of the
    command. end: state and words of a test that is over, until the server has heard them; the offset is taken back then.
    """

    tool_memory: int
    before: float
    after: float
    mapping: str
    place: str
    unit: str
    shown_before: float
    shown_after: float
    number: int | None = None
    end: tuple[str, str] | None = None

    @property
    def by_hand(self) -> str:
        """The sentence of what a person has to set."""
        return f"Set {self.shown_before:.4f} {self.unit} in {self.place} by hand."


class Back(NamedTuple):
    """The outcome of taking back. kept: the control holds the offset of before. untouched: it held what the test had written."""

    kept: bool
    untouched: bool
    words: str


def against(link: Link, machine: Machine, tool_memory: int) -> str | None:
    """The reason why no touch test of this location is possible."""
    if location_of(machine, tool_memory) is None:
        return f"Tool memory {tool_memory} has no [[machine.{machine.key}.location]] in the configuration."
    if not writes_offsets(link):
        return (
            f"A control of kind {machine.kind} lets no program write offsets: change the offset by hand, and compare."
        )
    return None


def writes_offsets(link: Link) -> bool:
    """Tell if a kind can write offsets at all."""
    return hasattr(link, "write_offset")


async def planned(link: Link, machine: Machine, tool_memory: int, amount: float, number: int | None = None) -> Change:
    """The change of an offset by ``amount`` mm, from what the control holds now. Nothing is written. Raises `LinkError`."""
    location = cast("Location", location_of(machine, tool_memory))
    before = await _access(link).read_offset(tool_memory)
    after = before + amount
    return Change(
        tool_memory,
        before,
        after,
        machine.mapping_hash(location),
        f"{location.register} of tool {location.tool}, edge {location.edge}",
        machine.unit,
        location.to_control(before, machine.unit),
        location.to_control(after, machine.unit),
        number,
    )


async def noted(store: Store, machine: str) -> Change | None:
    """The change that is noted in the store: its offset may be at the control."""
    found = await store.fact(machine, FACT)
    return None if found is None else change_of(found)


async def note(store: Store, machine: str, change: Change | None) -> None:
    """Note a change durably; None forgets it."""
    await store.note(machine, FACT, None if change is None else text_of(change))


def text_of(change: Change) -> str:
    """A change as the store keeps it."""
    return msgspec.json.encode(change).decode()


def change_of(text: str) -> Change:
    """A change from the store."""
    return msgspec.json.decode(text, type=Change)


async def changed_since(link: Link, machine: Machine, change: Change) -> str | None:
    """The reason why it must not be written: the control holds no longer what was read. Raises `LinkError`."""
    held = await _access(link).read_offset(change.tool_memory)
    if _near(held, change.before, machine, change):
        return None
    return (
        f"The control holds {_shown(held, machine, change):.4f} {change.unit} now, no longer {change.shown_before:.4f}: somebody"
        " has changed it. Nothing was written."
    )


async def write(link: Link, machine: Machine, change: Change) -> str | None:
    """Set the offset of after; None, or the reason why the register does not hold it.

    `changed_since` and `note` come first, `take_back` after, whatever this says. Raises `LinkError`.
    """
    access = _access(link)
    await access.write_offset(change.tool_memory, change.after)
    await asyncio.sleep(pause(machine))
    held = await access.read_offset(change.tool_memory)
    if _near(held, change.after, machine, change):
        return None
    return (
        f"Read back are {_shown(held, machine, change):.4f} {change.unit} in place of {change.shown_after:.4f}: the register was"
        " not set."
    )


async def take_back(link: Link, machine: Machine, change: Change) -> Back:
    """Set the offset of before again, if the control holds the one of the test; anything else is left alone.

    Raises `LinkError` where it has to be tried again.
    """
    location = location_of(machine, change.tool_memory)
    if location is None or machine.mapping_hash(location) != change.mapping:
        words = (
            f"The mapping of tool memory {change.tool_memory} was changed during the touch test: nothing is written."
        )
        return Back(False, False, f"{words} {change.by_hand}")
    access = _access(link)
    held = await access.read_offset(change.tool_memory)
    untouched = _near(held, change.after, machine, change)
    if untouched:
        await access.write_offset(change.tool_memory, change.before)
    if untouched or _near(held, change.before, machine, change):
        await asyncio.sleep(pause(machine))  # where it was back already, a write may still have been on its way
        held = await access.read_offset(change.tool_memory)
    if _near(held, change.before, machine, change):
        return Back(True, untouched, f"Taken back: {change.shown_before:.4f} {change.unit} in {change.place}.")
    if _near(held, change.after, machine, change):
        raise ControlAway("The control still holds the offset of the test after the one of before was written.")
    found = _shown(held, machine, change)
    return Back(
        False,
        untouched,
        f"NOT taken back: the control holds {found:.4f} {change.unit}, which the touch test has not written. {change.by_hand}",
    )


def _near(held: float, wanted: float, machine: Machine, change: Change) -> bool:
    """Before and after are distinguished whatever the tolerance is."""
    return abs(held - wanted) <= min(machine.tolerance, abs(change.after - change.before) / 4)


def _shown(held: float, machine: Machine, change: Change) -> float:
    return cast("Location", location_of(machine, change.tool_memory)).to_control(held, machine.unit)


def pause(machine: Machine) -> float:
    """Seconds after which a control shows what was written."""
    return max(machine.interval, LEAST_PAUSE)


def _access(link: Link) -> OffsetAccess:
    return cast("OffsetAccess", link)
