"""The server's side of one machine, against a server that is scripted: what is told, what is refused, what is told again."""

import asyncio
import json
import math
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any, cast

import pytest

from app.bridge import offering, server_side
from app.bridge.configuration import Server
from app.bridge.links import Decided, Order, Outcome, Position, Received
from app.bridge.store import Store
from app.bridge.store_tables import REPORTED
from app.bridge.unit import HeldBack, Unit, ended
from app.loop.connections.schemas import HeartbeatIn
from app.loop.tools.schemas import RejectionIn
from app.simulators.controls.model import Feature, Model
from inband_client import AsyncClient, Batch, Conflict, Correction, Decision, Forbidden, Invalid, NotFound, Reason
from inband_client.calls import plain
from tests.bridge.plant import location, machine, store_in, unit_of, until
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


def answered(outcome: Outcome, order: Order, *, reported: bool) -> Callable[[Store], Any]:
    async def before(store: Store) -> None:
        await store.intend(M, order, "hash")
        await store.answered(M, outcome)
        if reported:
            await store.set_intent(M, order.number, REPORTED)

    return before


ORDER = Order(18, 3, 0.0, -0.01)


def test_a_correction_is_offered_and_noted_first(tmp_path: Path) -> None:
    unit = story(tmp_path, Scripted(correction(18)))
    assert unit.orders == (ORDER,)
    assert [intent.order for intent in run(unit.store.intents(M, "open"))] == [ORDER]


def test_what_is_no_longer_pending_is_withdrawn(tmp_path: Path) -> None:
    unit = story(tmp_path, Scripted(), lambda store: store.intend(M, ORDER, "hash"))
    assert unit.orders == ()
    assert [intent.order.number for intent in run(unit.store.intents(M, "withdrawn"))] == [18]


@pytest.mark.parametrize(
    ("outcome", "heard"),
    [
        (Outcome(18, applied=True, offset=-0.01), [("confirm", 18, -0.01)]),
        (Outcome(18, applied=False, offset=0.004, differs=True), [("report", 3, 0.004)]),
        (Outcome(18, applied=False, offset=0.0, reason="no tool"), [("reject", 18, "no tool")]),
    ],
)
def test_each_answer_is_reported_once(tmp_path: Path, outcome: Outcome, heard: list[tuple[Any, ...]]) -> None:
    server = Scripted()
    unit = story(tmp_path, server, answered(outcome, ORDER, reported=False))
    assert server.heard == heard
    run(offering.tell(unit, cast("AsyncClient", server)))
    assert server.heard == heard


@pytest.mark.parametrize("offset", [-0.01, None])
def test_a_correction_that_was_superseded_while_the_control_took_it_is_reported(
    tmp_path: Path, offset: float | None
) -> None:
    """The answer may say no offset, or one of an order that is withdrawn: what was applied is absolute."""
    server = Scripted()
    server.confirming = Conflict("POST applied", "superseded", status=409, **said("conflict"))
    story(tmp_path, server, answered(Outcome(18, applied=True, offset=offset), ORDER, reported=False))
    assert server.heard == [("report", 3, -0.01)]


@pytest.mark.parametrize(
    "error",
    [
        Conflict("POST rejected", "rejected already", status=409, **said("conflict")),
        NotFound("POST rejected", "no such", status=404, **said("not-found")),
    ],
)
def test_a_refusal_that_the_server_has_heard_or_forgotten_holds_up_no_later_answer(
    tmp_path: Path, error: Exception
) -> None:
    """The line was cut after the first rejection, or the server was restored from a backup of before."""
    server = Scripted()
    server.rejecting = error

    async def before(store: Store) -> None:
        for number, outcome in (
            (18, Outcome(18, applied=False, offset=0.0, reason="no tool")),
            (19, Outcome(19, applied=True, offset=-0.01)),
        ):
            await store.intend(M, Order(number, 3, 0.0, -0.01), "hash")
            await store.answered(M, outcome)

    unit = story(tmp_path, server, before)
    assert server.heard == [("report", 3, 0.0), ("confirm", 19, -0.01)]
    assert run(unit.store.intents(M, "answered")) == []


def test_a_report_that_is_refused_holds_up_no_other(tmp_path: Path) -> None:
    """The configuration names a tool memory that the server does not have; a machine refuses without a reason."""

    class Strict(Scripted):
        async def report_offset(self, machine: str, tool: int, offset: float, *, none_applied: bool) -> None:
            if tool == 2:
                raise NotFound("POST reported", "no such tool memory", status=404, **said("not-found"))
            await super().report_offset(machine, tool, offset, none_applied=none_applied)

        async def reject(self, machine: str, number: int, reason: str) -> None:
            RejectionIn(reason=reason, although_fetched=False)
            await super().reject(machine, number, reason)

    server = Strict()

    async def story() -> None:
        unit = unit_of(Model(), store_in(tmp_path))
        await unit.store.held(M, {2: 0.001, 3: 0.002})
        await answered(Outcome(18, applied=False, reason="\x07"), ORDER, reported=False)(unit.store)
        with pytest.raises(NotFound, match="no such tool memory"):
            await offering.tell(unit, cast("AsyncClient", server))

    run(story())
    assert server.heard == [("reject", 18, "The control has refused it."), ("report", 3, 0.002)]


def test_what_a_server_has_forgotten_is_confirmed_again(tmp_path: Path) -> None:
    """It went back in time: the correction waits again that the control has applied."""
    server = Scripted(correction(18))
    unit = story(tmp_path, server, answered(Outcome(18, applied=True, offset=-0.01), ORDER, reported=True))
    assert server.heard == [("confirm", 18, -0.01)]
    assert unit.orders == ()


@pytest.mark.parametrize(
    ("outcome", "after", "words"),
    [
        (Outcome(18, applied=True, offset=-0.01), -0.07, "another correction with this number"),
        (Outcome(18, applied=False, offset=0.004, differs=True), -0.01, "has refused this correction"),
    ],
)
def test_a_number_that_the_control_has_answered_is_not_offered_again(
    tmp_path: Path, outcome: Outcome, after: float, words: str
) -> None:
    server = Scripted(correction(18, after))
    unit = story(tmp_path, server, answered(outcome, ORDER, reported=True))
    [(what, number, reason)] = server.heard
    assert (what, number) == ("reject", 18)
    assert words in reason
    assert unit.orders == ()


def held_back(unit: Unit) -> list[tuple[int, int | None]]:
    return [(each.tool_memory, each.number) for each in unit.held_back]


def test_one_correction_that_cannot_go_holds_back_its_own_tool_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A tool memory without a location, one that no touch test has proved: the others go on, and a person hears of it once."""
    server = Scripted(
        correction(18, tool=9),
        correction(19),
        correction(20, tool=9),
        correction(21, None, tool=4),
        correction(22, -0.02),
    )
    unit = story(tmp_path, server, fields={"location": PLACES})
    assert unit.orders == (Order(22, 3, 0.0, -0.02, (19,)),)
    assert held_back(unit) == [(9, 18), (4, 21)]
    assert "tool memory 9, which has no" in unit.held_back[0].reason
    assert "does not say which offset" in unit.held_back[1].reason
    assert [record.levelname for record in caplog.records] == ["WARNING", "WARNING"]
    run(offering.ask(unit, cast("AsyncClient", server)))
    assert len(caplog.records) == 2
    said = run(server_side.heartbeat(unit))
    assert [(each["tool_memory"], each["number"]) for each in said["held_back"]] == [(9, 18), (4, 21)]
    assert "tool memory 9" in said["detail"]
    proved = story(tmp_path / "proof", server, prove(4), {"location": PLACES, "proof_needed": True})
    assert held_back(proved) == [(9, 18), (3, 19), (4, 21)]


def prove(memory: int) -> Callable[[Store], Any]:
    chosen = machine(Model(), location=PLACES)
    mapping = chosen.mapping_hash(next(place for place in PLACES if place.tool_memory == memory))
    return lambda store: store.prove(M, memory, mapping)


def test_what_waits_for_a_location_is_one_order_the_longest_wait_first(tmp_path: Path) -> None:
    rows = [correction(18 + n, -0.01 * (1 + n // 2), tool=4 - n % 2) for n in range(6)]
    unit = story(tmp_path, Scripted(*rows), fields={"location": PLACES})
    assert unit.orders == (Order(22, 4, 0.0, -0.03, (18, 20)), Order(23, 3, 0.0, -0.03, (19, 21)))
    assert [intent.order for intent in run(unit.store.intents(M, "open"))] == list(unit.orders)


def test_no_order_is_larger_than_the_limits(tmp_path: Path) -> None:
    """Three steps of 0.04 mm: two of them are within 0.1 mm; the limit of the sum rejects none of them."""
    server = Scripted(*(correction(18 + n, 0.04 * (1 + n), 0.04) for n in range(3)))
    unit = story(tmp_path, server)
    assert unit.orders == (Order(19, 3, 0.0, 0.08, (18,)),)
    assert server.heard == []


def test_an_order_is_confirmed_for_each_correction_in_it(tmp_path: Path) -> None:
    server = Scripted()
    order = Order(22, 3, 0.0, -0.03, (18, 20))
    unit = story(tmp_path, server, answered(Outcome(22, applied=True, offset=-0.03), order, reported=False))
    assert server.heard == [("confirm", 18, None), ("confirm", 20, None), ("confirm", 22, -0.03)]
    server = Scripted(correction(18), correction(20, -0.02), correction(22, -0.03))  # went back in time
    run(offering.ask(unit, cast("AsyncClient", server)))
    assert server.heard == [("confirm", 18, None), ("confirm", 20, None), ("confirm", 22, -0.03)]
    assert unit.orders == ()
    refused = Scripted()
    story(tmp_path / "refused", refused, answered(Outcome(22, applied=False, reason="no"), order, reported=False))
    assert refused.heard == [("reject", 18, "no"), ("reject", 20, "no"), ("reject", 22, "no")]


def test_an_answer_that_comes_while_the_server_is_asked_takes_the_location_off(tmp_path: Path) -> None:
    """What was pending then begins at the offset before that answer: the control would call it an edit by hand."""

    class Slow(Scripted):
        async def pending(self, machine: str) -> list[Correction]:
            unit.taken.add(3)
            return await super().pending(machine)

    unit = unit_of(Model(), store_in(tmp_path), location=PLACES)
    server = Slow(correction(18), correction(19, -0.02), correction(20, tool=4))
    run(offering.ask(unit, cast("AsyncClient", server)))
    assert [order.number for order in unit.orders] == [20]
    unreported = answered(Outcome(18, applied=True, offset=-0.01), ORDER, reported=False)
    unit = unit_of(Model(), store_in(tmp_path / "unreported"), location=PLACES)
    run(unreported(unit.store))
    run(offering.ask(unit, cast("AsyncClient", Scripted(*server.waiting))))
    assert [order.number for order in unit.orders] == [20], "the server has not heard of 18"


def test_a_reading_names_the_correction_in_effect_of_its_own_location(tmp_path: Path) -> None:
    """A control keeps one number for all tools. 7 of tool 3 was taken before 5 of tool 4, which waited for a touch test."""
    server = Scripted()
    server.characteristics = {"shaft-1": 3, "bore-1": 4, "face-1": 5}

    async def before(store: Store) -> None:
        for order in (Order(7, 3, 0.0, 0.01, (2, 3)), Order(5, 4, 0.0, 0.01, (4,)), Order(9, 4, 0.01, 0.02)):
            await store.intend(M, order, "hash")
            if order.number != 9:  # in the mailbox still
                await store.answered(M, Outcome(order.number, applied=True, offset=order.after))
        rows = [
            ("shaft-1", 7),
            ("bore-1", 7),
            ("face-1", 7),
            ("bore-1", 5),
            ("shaft-1", 5),
            ("bore-1", 9),
            ("bore-1", 1),
        ]
        await store.add(
            M,
            [
                Received(f"k{n}", {"characteristic": key, "measured": 1.0, "correction_in_effect": number})
                for n, (key, number) in enumerate(rows)
            ],
        )

    story(tmp_path, server, before)
    assert [reading.get("correction_in_effect") for reading in server.pushed] == [7, 3, None, 5, 7, 9, None]


@pytest.mark.parametrize(
    ("hand", "number", "sent"),
    [
        ({9: 0.0}, 0, None),  # set at the control by hand, marked applied: the control goes on reporting 0
        ({9: 0.0}, 7, None),
        ({9: 4e9}, 7, 7),  # the reading came before that
        ({7: 0.0}, 0, 0),  # its own: the part was cut before
        ({3: 0.0}, 0, 0),  # taken along by its own
        ({5: 0.0}, 7, 7),
        ({}, 0, 0),
    ],
)
@pytest.mark.parametrize("corrections", ["control", "none"])
def test_of_what_a_person_has_set_by_hand_the_number_of_the_control_says_nothing(
    tmp_path: Path, hand: dict[int, float], number: int, sent: int | None, corrections: str
) -> None:
    """Else a part that was cut with it is taken for one without, and what it corrected is taken back."""
    server = Scripted()
    server.characteristics, server.applied = {"shaft-1": 3}, hand

    async def before(store: Store) -> None:
        await store.intend(M, Order(7, 3, 0.0, 0.01, (2, 3)), "hash")
        await store.answered(M, Outcome(7, applied=True, offset=0.01))
        body = {"characteristic": "shaft-1", "measured": 1.0, "correction_in_effect": number}
        await store.add(M, [Received("k", body)])

    story(tmp_path, server, before, {"corrections": corrections})
    assert server.pushed[0].get("correction_in_effect") == (number if corrections == "none" else sent)


@pytest.mark.parametrize(("tool", "asks"), [(3, False), (4, True)])
def test_where_a_characteristic_is_corrected_is_asked_again_when_a_correction_shows_it(
    tmp_path: Path, tool: int, asks: bool
) -> None:
    """Its sister goes on: readings that named a correction of the tool before would be corrected again and again, for half a minute."""
    unit = unit_of(Model(), store_in(tmp_path))
    unit.tool_memories, unit.locations_at = {"shaft-1": 3}, time.monotonic()
    server = Scripted(replace(correction(18, tool=tool), characteristic="shaft-1"))
    run(offering.ask(unit, cast("AsyncClient", server)))
    assert (unit.locations_at == -math.inf) is asks


def test_a_step_beyond_the_limit_is_rejected_with_its_reason(tmp_path: Path) -> None:
    server = Scripted(correction(18, after=-0.2, amount=-0.2, tool=4), correction(19))
    unit = story(tmp_path, server, fields={"location": PLACES})
    [(what, number, reason)] = server.heard
    assert (what, number) == ("reject", 18)
    assert "larger than 0.1 mm" in reason
    assert [order.number for order in unit.orders] == [19]


def test_a_rejection_that_somebody_was_quicker_with_leaves_nothing_on_offer(tmp_path: Path) -> None:
    server = Scripted(correction(18, after=-0.2, amount=-0.2))
    server.rejecting = Conflict("POST rejected", "superseded", status=409, **said("conflict"))
    unit = unit_of(Model(), store_in(tmp_path))
    unit.orders = (Order(17, 3, 0.0, -0.01),)  # superseded as well
    run(offering.ask(unit, cast("AsyncClient", server)))
    assert not unit.orders


def test_what_stands_behind_a_rejected_correction_of_its_tool_is_asked_for_again(tmp_path: Path) -> None:
    """It was to follow the one that is rejected: the control will hold another offset before it, and lead to another."""
    server = Scripted(correction(18, after=-0.2, amount=-0.2), correction(19, after=-0.21))
    unit = story(tmp_path, server)
    assert [(what, number) for what, number, _ in server.heard] == [("reject", 18)]
    assert not unit.orders
    assert unit.to_tell
    assert unit.news.is_set()
    server.waiting = [correction(19, after=-0.01)]
    run(offering.ask(unit, cast("AsyncClient", server)))
    assert unit.orders == (Order(19, 3, 0.0, -0.01),)


def test_a_hold_by_command_is_seen_and_released(tmp_path: Path) -> None:
    unit = story(tmp_path, Scripted(correction(18)), lambda store: store.note("", "hold_all", "x"))
    assert (unit.held, unit.orders) == (True, ())
    run(unit.store.note("", "hold_all", None))
    run(offering.ask(unit, cast("AsyncClient", Scripted(correction(18)))))
    assert (unit.held, unit.orders) == (False, (ORDER,))


def test_a_reading_that_is_refused_holds_up_no_other(tmp_path: Path) -> None:
    server = Scripted()
    server.refuses = lambda reading: (
        Invalid("POST /readings", "not a size", status=422, **said("invalid")) if reading["measured"] > 90 else None
    )

    async def before(store: Store) -> None:
        sizes = (40.0, 99.0, 41.0)
        rows = [Received(f"k{n}", {"measured": size}, Position(7, n)) for n, size in enumerate(sizes, 1)]
        await store.add(M, rows)

    unit = story(tmp_path, server, before)
    assert server.heard == [("push", "k1"), ("push", "k3")]
    [refused] = run(unit.store.quarantine(M))
    assert refused.key == "k2"
    assert "not a size" in refused.reason


@pytest.mark.parametrize("together", [1, 2])
def test_a_refusal_that_asks_for_a_stop_reaches_the_control(tmp_path: Path, together: int) -> None:
    """More touches than the characteristic has: nothing is stored, and the machine must not cut on."""
    server = Scripted()
    document = said("invalid")["document"] | {"action": "stop"}
    server.refuses = lambda reading: (
        Invalid("POST /readings", "too many", status=422, document=document) if reading["measured"] > 90 else None
    )

    async def before(store: Store) -> None:
        body = {"measured": 99.0, "characteristic": "shaft-1"}
        await store.add(M, [Received(f"k{n}", body, Position(7, n)) for n in range(1, together + 1)])

    unit = story(tmp_path, server, before)
    stops = [Decided(f"k{n}", "shaft-1", "stop", "invalid") for n in range(1, together + 1)]
    assert (unit.decisions, run(unit.store.decisions(M))) == (stops, stops)
    assert [each.key for each in run(unit.store.quarantine(M))] == [each.key for each in reversed(stops)]


@pytest.mark.parametrize("together", [1, 2])
def test_what_a_proxy_answers_puts_no_reading_into_the_quarantine(tmp_path: Path, together: int) -> None:
    """While the server is started anew, some answer "404 page not found" in its place."""
    server = Scripted()
    server.refuses = lambda _reading: NotFound("POST /readings", "404 page not found", status=404)
    server.confirming = NotFound("POST applied", "404 page not found", status=404)

    async def before(store: Store) -> None:
        await answered(Outcome(18, applied=True, offset=-0.01), ORDER, reported=False)(store)
        await store.add(M, [Received(f"k{n}", {"measured": 40.0}, Position(7, n)) for n in range(together)])

    unit = unit_of(Model(), store_in(tmp_path))
    run(before(unit.store))
    for step in (offering.tell, server_side._forward):
        with pytest.raises(NotFound):
            run(step(unit, cast("AsyncClient", server)))
    assert run(unit.store.quarantine(M)) == []
    assert len(run(unit.store.waiting(M))) == together
    assert server.heard == [], "nor is the offset reported as that of an edit"


@pytest.mark.parametrize("together", [1, 2])
def test_a_characteristic_of_another_machine_holds_up_no_other(tmp_path: Path, together: int) -> None:
    """The server answers as to a wrong key: 403."""
    server = Scripted()
    server.refuses = lambda reading: (
        Forbidden("POST /readings", "not yours", status=403) if reading["characteristic"] == "foreign" else None
    )
    names = ("foreign", "shaft-1")[:together]

    async def before(store: Store) -> None:
        rows = [Received(f"k{n}", {"characteristic": name}, Position(7, n)) for n, name in enumerate(names, 1)]
        await store.add(M, rows)

    unit = story(tmp_path, server, before)
    assert server.heard == [("push", f"k{n}") for n in range(2, together + 1)]
    [refused] = run(unit.store.quarantine(M))
    assert (
        refused.reason
        == "Characteristic 'foreign' is another machine's: correct it in machine.lathe-1.characteristics."
    )
    server.own = False
    run(unit.store.release(M, None, drop=False))
    with pytest.raises(Forbidden):  # the key itself is another machine's: nothing is at fault but that
        run(server_side._forward(unit, cast("AsyncClient", server)))
    assert run(unit.store.quarantine(M)) == []


@pytest.mark.parametrize(
    ("change", "again"),
    [({}, 0), ({"last_event": 9}, 1), ({"timeline": 2}, 1), ({"system": "other"}, 1), ({"last_event": 99}, 0)],
)
def test_readings_are_sent_again_to_a_server_that_went_back_in_time(
    tmp_path: Path, change: dict[str, Any], again: int
) -> None:
    seen = {"system": "one", "timeline": 1, "last_event": 10}

    async def before(store: Store) -> None:
        await store.add(M, [Received("k1", {"measured": 40.0}, Position(7, 1))])

    unit = story(tmp_path, Scripted(), before)

    async def look() -> int:
        await server_side._look_back(unit, seen)
        await server_side._look_back(unit, seen | change)
        return (await unit.store.counts(M)).waiting

    assert run(look()) == again


@pytest.mark.parametrize(
    ("action", "order", "asks"), [("none", None, False), ("correct", None, True), ("none", ORDER, True)]
)
def test_corrections_are_asked_for_when_a_decision_concerns_them(
    tmp_path: Path, action: str, order: Order | None, *, asks: bool
) -> None:
    """A reading that calls for nothing costs one request; while a correction is offered, any reading may supersede it."""

    async def story() -> None:
        server = Scripted()
        server.decision = replace(server.decision, action=action)
        unit = unit_of(Model(), store_in(tmp_path))
        unit.orders = () if order is None else (order,)
        await unit.store.add(M, [Received("k1", {"measured": 40.0}, Position(7, 1))])
        assert await server_side._forward(unit, cast("AsyncClient", server)) is asks
        assert server.heard == [("push", "k1")]

    run(story())


def test_a_remark_on_the_control_hides_no_trouble_with_the_server(tmp_path: Path) -> None:
    async def detail(said: str, trouble: str) -> Any:
        unit = unit_of(Model(), store_in(tmp_path))
        unit.detail, unit.trouble = said, trouble
        unit.held_back = (HeldBack(3, 18, "Correction 18 waits."),)
        return (await server_side.heartbeat(unit))["detail"]

    assert run(detail("A gap.", "It refuses.")) == "A gap. It refuses. Correction 18 waits."
    assert run(detail("The store is full.", "The store is full.")) == "The store is full. Correction 18 waits."


def test_a_heartbeat_is_taken_whatever_a_control_has_sent(tmp_path: Path) -> None:
    """One field that the server does not take would make the whole bridge silent."""

    async def story() -> None:
        unit = unit_of(Model(), store_in(tmp_path))
        unit.identity = "  "
        unit.detail = "The line has\x07 rung\u202e."
        unit.link.clock.offset = -1.48e9  # the battery is empty: 1980
        await unit.store.held(M, {3: 1e9})
        names = ("x" * 300, "shaft\n1", "\x00", "", 5)
        rows = [Received(f"k{n}\x01", {"characteristic": name}, fault="\x07") for n, name in enumerate(names)]
        await unit.store.add(M, rows)
        told = HeartbeatIn.model_validate_json(json.dumps(plain(await server_side.heartbeat(unit))))
        assert (told.identity, told.detail, told.clock_offset) == (None, "The line has rung .", -1e9)
        assert told.locations[0].offset is None
        assert [each.characteristic for each in told.quarantine] == ["5", None, None, "shaft 1", "x" * 200]

    run(story())


def test_an_edit_is_reported_though_each_reading_asks_for_corrections(tmp_path: Path) -> None:
    """A tool whose corrections are held: every reading concerns them, one comes after the other."""

    async def story() -> None:
        server = Scripted()
        server.decision = replace(server.decision, action="correct")
        unit = unit_of(Model(), store_in(tmp_path))

        async def readings() -> None:
            for number in count():
                await unit.store.add(M, [Received(f"k{number}", {"measured": 40.0}, Position(7, number))])
                unit.news.set()
                await asyncio.sleep(0.02)

        client = cast("AsyncClient", server)
        tasks = [
            asyncio.create_task(server_side.run(unit, client, Server(url="", ask=0.2))),
            asyncio.create_task(readings()),
        ]
        try:
            await until(lambda: ("push", "k9") in server.heard, "some readings")
            await unit.store.held(M, {3: -0.004})
            await until(lambda: ("report", 3, -0.004) in server.heard, "the edit is told")
        finally:
            await ended(tasks)

    run(story())


def test_a_stop_is_kept_for_the_control_and_what_is_sent_again_stops_nothing(tmp_path: Path) -> None:
    server = Scripted()
    server.decision = replace(server.decision, action="stop", reason=Reason(code="probe_fault"), measure_next=1)

    async def before(store: Store) -> None:
        await store.add(M, [Received("lathe-1:7:1", {"measured": 30.0}, Position(7, 1))])

    unit = story(tmp_path, server, before)
    stop = Decided("lathe-1:7:1", "shaft-1", "stop", "probe_fault", 1)
    assert unit.decisions == [stop]
    assert run(unit.store.decisions(M)) == [stop], "a bridge that is started anew tells it, too"
    assert run(server_side.heartbeat(unit))["carries_decisions"] is True
    run(unit.store.carried(M, [stop.key]))
    unit.decisions.clear()
    run(unit.store.send_again(M))
    run(server_side._forward(unit, cast("AsyncClient", server)))
    assert server.heard.count(("push", "lathe-1:7:1")) == 2
    assert (unit.decisions, run(unit.store.decisions(M))) == ([], [])
