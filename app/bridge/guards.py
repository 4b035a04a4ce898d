"""The bridge's own limits for a correction, whatever the server says: pure."""

from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import NamedTuple

from app.bridge.configuration import Location, Machine
from app.bridge.links import Order


class Verdict(NamedTuple):
    """A sentence against an order. final: it will not become right by waiting, and is rejected at the server."""

    reason: str
    final: bool


class Known(NamedTuple):
    """A location as the bridge knows it: the offset it has read or brought last (mm), and the hash that a touch test proved."""

    offset: float | None = None
    proved: str | None = None
    proved_at: float | None = None


def location_of(machine: Machine, tool_memory: int) -> Location | None:
    """The location of a tool memory."""
    return next((place for place in machine.location if place.tool_memory == tool_memory), None)


def against(
    order: Order, issued: datetime, now: datetime, machine: Machine, known: Mapping[int, Known], held: bool
) -> Verdict | None:
    """The first limit that stands against an order; None if it may go to the control."""
    named = f"Correction {order.number}"
    location = location_of(machine, order.tool_memory)
    if location is None:
        return Verdict(
            f"{named} is for tool memory {order.tool_memory}, which has no [[machine.{machine.key}.location]] in the"
            " configuration. Add one, or reject the correction.",
            final=False,
        )
    if held:
        return Verdict(f"{named} waits: all corrections are on hold. Release them with “inband bridge resume”.", False)
    here = known.get(order.tool_memory, Known())
    mapping = machine.mapping_hash(location)
    if machine.proof_needed and here.proved != mapping:
        by_page = ", or make it at the page of the connection" if machine.touch_tests_by_page else ""
        return Verdict(
            f"{named} waits: the mapping {mapping} of tool memory {order.tool_memory} has not been proved by a touch"
            f" test. End the bridge and run “inband bridge touch-test {machine.key} {order.tool_memory}”{by_page}.",
            final=False,
        )
    step = abs(order.after - order.before)
    largest_step = location.largest_step or machine.largest_step
    if step > largest_step + 1e-9:
        return Verdict(
            f"The bridge refuses correction {order.number}: a step of {step:.4f} mm is larger than {largest_step:g} mm"
            " (largest_step).",
            final=True,
        )
    if here.offset is not None and abs(order.after - here.offset) > machine.largest_distance + 1e-9:
        return Verdict(
            f"The bridge refuses correction {order.number}: it leads to {order.after:.4f} mm, more than"
            f" {machine.largest_distance:g} mm from the offset {here.offset:.4f} mm that the control held last"
            " (largest_distance).",
            final=True,
        )
    if now - issued > timedelta(seconds=machine.largest_age):
        hours = (now - issued).total_seconds() / 3600
        return Verdict(
            f"The bridge refuses correction {order.number}: it is {hours:.1f} h old, more than"
            f" {machine.largest_age / 3600:g} h (largest_age). If it was made just now, a clock is wrong: the bridge's says"
            f" {now:%Y-%m-%d %H:%M} UTC.",
            final=True,
        )
    return None
