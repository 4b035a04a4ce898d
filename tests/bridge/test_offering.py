"""Corrections that the server offers for one machine: which are passed to the control, and how its answers are reported."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from app.bridge import offering, server_side
from app.bridge.links import Order, Outcome
from app.bridge.store import Store
from app.bridge.store_tables import REPORTED
from app.bridge.unit import Unit
from app.loop.tools.schemas import RejectionIn
from app.simulators.controls.model import Model
from inband_client import AsyncClient, Conflict, Correction, NotFound
from tests.bridge.plant import machine, store_in, unit_of
from tests.bridge.scripted_server import PLACES, M, Scripted, correction, said, story
from tests.loops import run


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
