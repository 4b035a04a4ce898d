"""The server's side of one machine, against a scripted server: readings that are sent, refused, and sent again."""

import asyncio
import json
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, cast

import pytest

from app.bridge import offering, server_side
from app.bridge.configuration import Server
from app.bridge.links import Decided, Order, Outcome, Position, Received
from app.bridge.store import Store
from app.bridge.unit import HeldBack, ended
from app.loop.connections.schemas import HeartbeatIn
from app.simulators.controls.model import Model
from inband_client import AsyncClient, Forbidden, Invalid, NotFound, Reason
from inband_client.calls import plain
from tests.bridge.plant import store_in, unit_of, until
from tests.bridge.scripted_server import M, Scripted, said, story
from tests.bridge.test_offering import ORDER, answered
from tests.loops import run


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
