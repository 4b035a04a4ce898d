"""A scripted server, and one round of the bridge's side that talks to it."""

from collections.abc import AsyncIterator, Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

from app.bridge import offering, server_side
from app.bridge.store import Store
from app.bridge.unit import Unit
from app.simulators.controls.model import Feature, Model
from inband_client import AsyncClient, Batch, Correction, Decision, Forbidden, Reason
from tests.bridge.plant import location, store_in, unit_of
from tests.loops import run

M = "lathe-1"
PLACES = (location(Feature()), location(Feature(tool=4), 4))


def correction(number: int, after: float | None = -0.01, amount: float = -0.01, tool: int = 3) -> Correction:
    return Correction(
        number=number,
        tool_memory=tool,
        amount=amount,
        status="pending",
        offset_expected=after,
        created_at=datetime.now(UTC),
    )


def said(kind: str) -> dict[str, Any]:
    """What makes an error one of Inband's."""
    return {"document": {"type": f"urn:inband:problem:{kind}"}}


class Scripted:
    """A server: what waits, what it refuses, and what it has heard."""

    def __init__(self, *pending: Correction) -> None:
        self.waiting = list(pending)
        self.own = True
        self.characteristics: dict[str, int] = {}
        self.applied: dict[int, float] = {}
        self.pushed: list[dict[str, Any]] = []
        self.heard: list[tuple[Any, ...]] = []
        self.refuses: Callable[[dict[str, Any]], Exception | None] = lambda _reading: None
        self.confirming: Exception | None = None
        self.rejecting: Exception | None = None
        self.decision = Decision(
            characteristic="shaft-1",
            sequence=1,
            measured=40.0,
            deviation=0.0,
            zone="zero",
            action="none",
            reason=Reason(code="in_zero_range"),
        )

    async def pending(self, machine: str) -> list[Correction]:
        return self.waiting

    async def get(self, path: str) -> None:
        if not self.own:
            raise Forbidden(f"GET {path}", "another machine's key", status=403)

    async def items(self, path: str, **query: Any) -> AsyncIterator[dict[str, Any]]:
        if path.endswith("/corrections"):
            for number, at in self.applied.items():
                if number > query["after"]:
                    yield {"number": number, "applied_at": datetime.fromtimestamp(at, UTC).isoformat()}
            return
        for key, memory in self.characteristics.items():
            yield {"key": key, "parameters": {"tool_memory": memory}}

    async def push(self, reading: dict[str, Any]) -> Decision:
        if error := self.refuses(reading):
            raise error
        self.heard.append(("push", reading["key"]))
        self.pushed.append(reading)
        return self.decision

    async def push_many(self, readings: list[dict[str, Any]]) -> Batch:
        for reading in readings:
            if error := self.refuses(reading):
                raise error
        self.heard += [("push", reading["key"]) for reading in readings]
        self.pushed += readings
        return Batch(stored=len(readings), repeated=0, items=(self.decision,) * len(readings))

    async def confirm(self, machine: str, number: int, **said: Any) -> None:
        if self.confirming is not None:
            raise self.confirming
        self.heard.append(("confirm", number, said["offset_after"]))

    async def reject(self, machine: str, number: int, reason: str) -> None:
        if self.rejecting is not None:
            raise self.rejecting
        self.heard.append(("reject", number, reason))
        self.waiting = [each for each in self.waiting if each.number != number]

    async def report_offset(self, machine: str, tool: int, offset: float, *, none_applied: bool) -> None:
        self.heard.append(("report", tool, offset))


def story(
    tmp_path: Path, server: Scripted, before: Callable[[Store], Any] | None = None, fields: dict[str, Any] | None = None
) -> Unit:
    """One round of the server's side, after something has happened."""

    async def work() -> Unit:
        store = store_in(tmp_path)
        unit = unit_of(Model(), store, **fields or {})
        if before is not None:
            await before(store)
        for step in (offering.tell, server_side._forward, offering.ask):
            await step(unit, cast("AsyncClient", server))
        return unit

    return run(work())
