"""The touch test that a person guides at the page: server, bridge, control, and a browser."""

import asyncio
import math
import threading
import time
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import psycopg
import pytest
from playwright.sync_api import Page, expect

from app.bridge import offset_change, proving_by_page
from app.bridge.configuration import Location, Machine
from app.bridge.kinds import opcua
from app.bridge.offset_change import noted
from app.bridge.store import Store
from app.bridge.unit import Guided, Unit
from app.loop.connections.touch_tests.pages import TOO_SOON
from app.simulators.controls.model import Feature, Model
from app.simulators.controls.opcua import serve
from tests.bridge.kinds.test_opcua import machine as opcua_machine
from tests.bridge.plant import ModelRegisters, bridge, controlled, parts, store_in, unit_of, until
from tests.loops import run
from tests.shop import Person, Shop

PLACE = (3, 1, "wear_length_1")
BEFORE, AFTER = 0.0, 0.01


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proving_by_page, "EVERY", 0.05)
    monkeypatch.setattr(offset_change, "LEAST_PAUSE", 0.02)


@pytest.fixture
def model() -> Model:
    made = Model((Feature(bias=0.0, wear=0.0, noise=0.0),))
    for _ in made.part():  # the NC program has set the block up
        pass
    made.offsets[PLACE] = BEFORE
    return made


def unit(shop: Shop, model: Model, store: Store, registers: ModelRegisters | None = None, **fields: Any) -> Unit:
    fields = {"characteristics": {"1": shop.characteristic}, "touch_tests_by_page": True, "proof_needed": True} | fields
    return unit_of(model, store, registers, key=shop.machine, **fields)


class Guide:
    """A person at the page, and what the tests look at."""

    def __init__(self, shop: Shop) -> None:
        self.shop = shop
        self.number = 0

    async def call(self, method: str, path: str, status: int = 200, **body: Any) -> Any:
        return await asyncio.to_thread(
            self.shop.call, method, f"/machines/{self.shop.machine}/touch-tests{path}", status, **body
        )

    async def bridge_is_online(self) -> None:
        async def heard() -> bool:
            answer = await asyncio.to_thread(self.shop.admin.get, f"/api/v1/machines/{self.shop.machine}/connection")
            return answer.status_code == 200 and answer.json()["state"] == "online"

        await until(heard, "a heartbeat")

    async def ask(self, status: int = 201, **body: Any) -> Any:
        await self.bridge_is_online()
        made = await self.call("POST", "", status, **{"tool_memory": 3} | body)
        self.number = made.get("id", 0)
        return made

    async def look(self) -> Any:
        return await self.call("GET", f"/{self.number}")

    async def reaches(self, state: str) -> Any:
        async def there() -> bool:
            seen = await self.look()
            assert seen["ended_at"] is None or seen["state"] == state, seen
            return bool(seen["state"] == state)

        await until(there, f"the test {state}")
        return await self.look()

    async def says(self, question: str, yes: bool = True) -> Any:
        return await self.call("POST", f"/{self.number}/answer", question=question, yes=yes)

    async def comes_to(self, state: str) -> Any:
        """Answer yes until the test is in this state."""
        steps = (("before", "read"), ("after", "written"), ("size", "compared"))
        for question, open_in in steps[: [each for _, each in steps].index(state)]:
            await self.reaches(open_in)
            await self.says(question)
        return await self.reaches(state)


def asked_before(shop: Shop, seconds: float) -> None:
    """Let the last touch test of this machine be in its state for so long. 0: no longer, however slow the test is."""
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute(
            "UPDATE touch_test SET state_at = now() - make_interval(secs => %s)"
            " WHERE id = (SELECT max(t.id) FROM touch_test t JOIN machine m ON m.id = t.machine_id WHERE m.key = %s)",
            [seconds or -60, shop.machine],
        )


@asynccontextmanager
async def running(shop: Shop, one: Unit) -> Any:
    async with bridge(shop, one, heartbeat=True):
        yield Guide(shop)


async def proof(one: Unit) -> str | None:
    known = (await one.store.known(one.machine.key)).get(3)
    return known.proved if known else None


def test_a_location_is_proved_at_the_page(
    shop: Shop, operator: Person, model: Model, page: Page, tmp_path: Path
) -> None:
    """The page in a browser, the bridge, and a simulated SINUMERIK; the browser has this thread, the bridge another."""
    enough = asyncio.Event()
    loop: dict[str, asyncio.AbstractEventLoop] = {}
    facts: dict[str, Any] = {}

    async def plant() -> None:
        loop["of"] = asyncio.get_running_loop()
        simulator = await serve(model, 0, secure=False)
        store = store_in(tmp_path)
        chosen: Machine = opcua_machine(simulator, touch_tests_by_page=True, proof_needed=True)
        chosen = type(chosen)(
            **{name: getattr(chosen, name) for name in chosen.__struct_fields__} | {"key": shop.machine}
        )
        one = Unit(chosen, opcua.link(chosen), store)
        async with bridge(shop, one, heartbeat=True):
            facts["unit"] = one
            await enough.wait()
        facts["proof"], facts["hash"] = await proof(one), chosen.mapping_hash(chosen.location[0])
        store.close()
        await simulator.stop()

    thread = threading.Thread(target=lambda: asyncio.run(plant()))
    thread.start()
    try:
        run(Guide(shop).bridge_is_online())
        operator.sign_in(page)
        page.goto(f"/machines/{shop.machine}/connection")
        page.get_by_role("button", name="Touch test of tool 3").click()
        part = page.locator("#touch-test")
        expect(part.locator(".readout.big")).to_contain_text("0.0000mm")
        expect(part).to_contain_text("wear_length_1 of tool 3, edge 1")
        assert model.offsets[PLACE] == BEFORE
        asked_before(shop, TOO_SOON)
        part.get_by_role("button", name="Yes, change it").click()
        expect(part.locator(".readout.big")).to_contain_text("0.0100mm")
        assert model.offsets[PLACE] == pytest.approx(AFTER)
        asked_before(shop, TOO_SOON)
        part.get_by_role("button", name="Yes").click()
        expect(part).to_contain_text("10 µm larger in size")
        asked_before(shop, 0)
        part.get_by_role("button", name="Yes").click()  # a second click
        expect(page.get_by_text("this did not count")).to_be_visible()
        expect(part).to_contain_text("Step 3 of 3")
        asked_before(shop, TOO_SOON)
        part.get_by_role("button", name="Yes").click()
        expect(part).to_contain_text("Proved")
        expect(part).to_contain_text("Taken back: 0.0000 mm")
        page.goto(f"/machines/{shop.machine}/connection")
        expect(page.locator("#locations .proved")).to_be_visible()
        expect(page.locator("#touch-tests tbody tr")).to_contain_text("Proved")
    finally:
        loop["of"].call_soon_threadsafe(enough.set)
        thread.join()
    assert model.offsets[PLACE] == pytest.approx(BEFORE)
    assert facts["proof"] == facts["hash"]
    assert shop.alarms() == []
    said = [
        entry["action"] for entry in shop.call("GET", "/audit?limit=50")["items"] if shop.machine in entry["subject"]
    ]
    assert [each for each in reversed(said) if "touch test" in each] == [
        "touch test asked for", "touch test answered", "touch test answered", "touch test answered", "touch test proved",
    ]  # fmt: skip


@pytest.mark.parametrize("question", ["before", "after", "size"])
def test_a_no_proves_nothing_and_takes_back(shop: Shop, model: Model, tmp_path: Path, question: str) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path))
        await one.store.prove(one.machine.key, 3, one.machine.mapping_hash(one.machine.location[0]))
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to({"before": "read", "after": "written", "size": "compared"}[question])
            await guide.says(question, yes=False)
            over = await guide.reaches("not_proved")
            assert over["refused"] == question
            assert model.offsets[PLACE] == pytest.approx(BEFORE)
            assert await proof(one) is None
        one.store.close()

    run(work())


def test_a_person_stops_it_and_it_is_taken_back(shop: Shop, model: Model, tmp_path: Path) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path))
        proved = one.machine.mapping_hash(one.machine.location[0])
        await one.store.prove(one.machine.key, 3, proved)
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
            await guide.call("POST", f"/{guide.number}/stop")
            over = await guide.reaches("cancelled")
            assert "Taken back" in over["detail"]
            assert model.offsets[PLACE] == pytest.approx(BEFORE)
            assert await proof(one) == proved, "what was proved before stays proved"
            await until(lambda: one.test is None, "the end")
            await guide.ask()  # the next one may begin
        one.store.close()

    run(work())


def test_after_a_crash_the_next_start_takes_back(shop: Shop, model: Model, tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path)
        one = unit(shop, model, store)
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
        store.close()  # the tasks were cut off: nothing was taken back
        assert model.offsets[PLACE] == pytest.approx(AFTER)
        store = store_in(tmp_path)
        other = unit(shop, model, store)
        async with bridge(shop, other, heartbeat=True):
            over = await guide.reaches("cancelled")
            assert "was ended during the touch test" in over["detail"]
            assert model.offsets[PLACE] == pytest.approx(BEFORE)
            await until(lambda: other.test is None, "the end")
        assert await noted(store, shop.machine) is None
        store.close()

    run(work())


def test_an_offset_that_somebody_else_has_set_is_left_alone_after_a_crash(
    shop: Shop, model: Model, tmp_path: Path
) -> None:
    async def work() -> None:
        store = store_in(tmp_path)
        async with running(shop, unit(shop, model, store)) as guide:
            await guide.ask()
            await guide.comes_to("written")
        model.edit(PLACE, 0.5)
        async with bridge(shop, unit(shop, model, store), heartbeat=True):
            over = await guide.reaches("failed")
        assert "Set 0.0000 mm in wear_length_1 of tool 3, edge 1 by hand." in over["detail"]
        assert model.offsets[PLACE] == 0.5
        store.close()

    run(work())


def test_while_the_server_is_away_the_time_limit_takes_back(
    shop: Shop, model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path))
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
            test = one.test
            assert test is not None
        # all tasks are cut off; that of the control goes on without those that speak with the server
        test.until = 0.0
        async with controlled(one):
            await until(lambda: test.end is not None, "the end")
        assert model.offsets[PLACE] == pytest.approx(BEFORE)
        async with bridge(shop, one, heartbeat=True):  # the server is there again
            over = await guide.reaches("cancelled")
            assert "No answer came" in over["detail"]
        one.store.close()

    run(work())


def test_a_control_that_lets_nothing_be_written_ends_the_test(shop: Shop, model: Model, tmp_path: Path) -> None:
    async def work() -> None:
        registers = ModelRegisters(model)
        registers.may_write = "Tool 3 is in use by a program that has not ended."
        one = unit(shop, model, store_in(tmp_path), registers)
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.reaches("read")
            await guide.says("before")
            over = await guide.reaches("failed")
            assert "in use" in over["detail"]
            assert model.offsets[PLACE] == BEFORE
        one.store.close()

    run(work())


def test_taking_back_waits_for_a_control_that_is_away(shop: Shop, model: Model, tmp_path: Path) -> None:
    async def work() -> None:
        registers = ModelRegisters(model)
        one = unit(shop, model, store_in(tmp_path), registers)
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
            registers.away = True
            await until(lambda: one.state == "control_away", "the cable out")
            await guide.call("POST", f"/{guide.number}/stop")
            await guide.reaches("stopping")
            assert model.offsets[PLACE] == pytest.approx(AFTER)
            registers.away = False
            await guide.reaches("cancelled")
            assert model.offsets[PLACE] == pytest.approx(BEFORE)
        one.store.close()

    run(work())


def test_no_correction_is_offered_and_no_edit_reported_meanwhile(shop: Shop, model: Model, tmp_path: Path) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path), proof_needed=False, offsets_every=0.02)
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
            await asyncio.to_thread(shop.read, 6.0)

            async def waits() -> bool:
                pending = await asyncio.to_thread(shop.call, "GET", f"/machines/{shop.machine}/corrections")
                return bool(pending["items"]) and "touch test" in " ".join(each.reason for each in one.held_back)

            await until(waits, "a correction that waits")
            assert await one.store.intents(one.machine.key, "open") == []
            assert (await one.store.known(one.machine.key))[3].offset == pytest.approx(BEFORE)
            await guide.call("POST", f"/{guide.number}/stop")
            await guide.reaches("cancelled")

            async def offered() -> bool:
                return bool(await one.store.intents(one.machine.key, "open"))

            await until(offered, "the correction")
        one.store.close()
        assert shop.alarms() == []

    run(work())


def test_what_is_refused(shop: Shop, model: Model, tmp_path: Path) -> None:
    async def work() -> None:
        guide = Guide(shop)
        await guide.call("POST", "", 404, tool_memory=3)  # no bridge
        one = unit(shop, model, store_in(tmp_path))
        async with running(shop, one) as guide:
            await guide.ask(404, tool_memory=4)
            await guide.ask(422, amount=0.2)
            await guide.ask()
            refused = await guide.call("POST", "", 409, tool_memory=3)
            assert "is open" in refused["title"] + refused["detail"]
            first = guide.shop.call("GET", f"/machines/{shop.machine}/touch-tests")["items"][0]["id"]
            guide.number = first
            await guide.reaches("read")
            await guide.call("POST", f"/{first}/answer", 409, question="size", yes=True)
            await guide.call("POST", f"/{first + 1000}/stop", 404)
            await guide.call("POST", f"/{first}/stop")
            await until(lambda: one.test is None, "the end")
        one.store.close()

    run(work())


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"touch_tests_by_page": False}, "touch_tests_by_page = true in [machine."),
        ({"location": ()}, "has no [[machine."),
    ],
)
def test_the_bridge_refuses_by_itself(
    shop: Shop, model: Model, tmp_path: Path, fields: dict[str, Any], said: str
) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path), **fields)
        one.state = "online"
        await proving_by_page.hear(one, {"id": 1, "tool_memory": 3, "amount": 0.01, "state": "asked"})
        assert one.test is not None
        assert one.test.end is not None
        assert one.test.end[0] == "failed"
        assert said in one.test.end[1]
        one.store.close()

    run(work())


@pytest.mark.parametrize(
    ("state", "ends", "said"),
    [
        ("read", "cancelled", "Nothing was written"),
        ("go", "failed", "knows nothing"),
        ("written", "failed", "knows nothing"),
    ],
)
def test_a_test_that_the_store_knows_nothing_of_says_nothing_that_may_be_false(
    shop: Shop, model: Model, tmp_path: Path, state: str, ends: str, said: str
) -> None:
    """The computer of the bridge was exchanged, and its store with it: the offset may be at the control."""

    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path))
        one.state = "online"
        await proving_by_page.hear(one, {"id": 1, "tool_memory": 3, "amount": 0.01, "state": state})
        assert one.test is not None
        assert one.test.end is not None
        assert one.test.end[0] == ends
        assert said in one.test.end[1]
        one.store.close()

    run(work())


def test_a_go_that_is_old_writes_nothing(shop: Shop, model: Model, tmp_path: Path) -> None:
    """Control and server were away together after the yes; and the server's clock was set back meanwhile."""

    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path))
        test = one.test = Guided(1, 3, 0.01, math.inf)
        await one.link.connect()
        await proving_by_page.advance(one)
        assert test.reached == "read"
        said = {"state": "go", "refused": None, "ended_at": None}
        now = time.monotonic()
        proving_by_page._heard(test, said | {"state_age": 2.0}, now - 29.0)
        proving_by_page._heard(test, said | {"state_age": 0.0}, now)
        for _ in range(2):
            await proving_by_page.advance(one)
        assert test.end == ("cancelled", "The answer came too late to the bridge. Nothing was written.")
        assert model.offsets[PLACE] == BEFORE
        one.store.close()

    run(work())


class Unreadable(ModelRegisters):
    async def read_offset(self, location: Location) -> float | None:
        return None


def test_an_offset_that_cannot_be_read_ends_the_test_and_holds_up_no_reading(
    shop: Shop, model: Model, tmp_path: Path
) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path), Unreadable(model))
        async with running(shop, one) as guide:
            await guide.ask()
            over = await guide.reaches("failed")
            assert "cannot be read" in over["detail"]
            assert one.state == "online"
        one.store.close()

    run(work())


def test_a_program_that_runs_again_is_named_while_the_offset_is_not_taken_back(
    shop: Shop, model: Model, tmp_path: Path
) -> None:
    async def work() -> None:
        registers = ModelRegisters(model)
        one = unit(shop, model, store_in(tmp_path), registers)
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
            registers.may_write = "Tool 3 is in use by a program that has not ended."
            await guide.call("POST", f"/{guide.number}/stop")
            await until(lambda: "is not taken back yet: Tool 3 is in use" in one.detail, "the sentence")
            assert "Set 0.0000 mm in wear_length_1 of tool 3, edge 1 by hand." in one.detail
            await parts(model, 10)  # the program waits for its readings to be fetched, or would never end
            assert one.state == "online"
            registers.may_write = None
            await guide.reaches("cancelled")
            assert model.offsets[PLACE] == pytest.approx(BEFORE)
        one.store.close()

    run(work())


def test_the_page_says_what_to_set_by_hand_while_the_bridge_is_waited_for(
    shop: Shop, operator: Person, model: Model, tmp_path: Path
) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path))
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
        # the computer of the bridge is off
        await guide.says("after")
        await guide.says("size")
        path = f"/machines/{shop.machine}/touch-tests/{guide.number}"
        assert "set that by hand" not in await asyncio.to_thread(operator.open, path)
        await asyncio.to_thread(asked_before, shop, 60)
        page = await asyncio.to_thread(operator.open, path)
        assert "the screen showed 0.0000 mm in wear_length_1 of tool 3, edge 1" in page
        assert "set that by hand" in page
        one.store.close()

    run(work())


def test_the_end_of_the_program_takes_back(shop: Shop, model: Model, tmp_path: Path) -> None:
    async def work() -> None:
        one = unit(shop, model, store_in(tmp_path))
        async with running(shop, one) as guide:
            await guide.ask()
            await guide.comes_to("written")
            await proving_by_page.end_all([one])
            assert model.offsets[PLACE] == pytest.approx(BEFORE)
        one.store.close()

    run(work())


def test_the_end_of_the_bridge_takes_back_what_is_just_being_written(
    tmp_path: Path, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proving_by_page, "LAST", 2.0)
    monkeypatch.setattr(offset_change, "LEAST_PAUSE", 0.3)

    async def work() -> None:
        one = unit_of(model, store_in(tmp_path))
        change = await offset_change.planned(one.link, one.machine, 3, 0.01, 1)
        now = time.monotonic()
        one.test = Guided(1, 3, 0.01, math.inf, heard="go", since=now, reached="read", change=change)
        async with controlled(one):
            await until(lambda: model.offsets[PLACE] == pytest.approx(AFTER), "the write")
            await proving_by_page.end_all([one])
        assert model.offsets[PLACE] == pytest.approx(BEFORE)
        one.store.close()

    run(work())
