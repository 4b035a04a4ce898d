"""The plant's page: empty, full, live, and never a stale green."""

import re
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect
from sqlalchemy import event, text

from app.core.state import CharacteristicState
from app.views.characteristic import state_queries as queries
from tests.pages.looks import boxes, live, resize
from tests.servers import RunServer, Server
from tests.shop import PARAMETERS, Person, Shop
from tests.waits import until

pytestmark = pytest.mark.own_server

XSS = """<b>"Кључ" d'Ø</b>"""


def line(page: Page, shop: Shop) -> Any:
    return page.locator(f"#c-{shop.characteristic}")


def touched(page: Page, selector: str) -> None:
    """A click on whatever lies uppermost there. In one step: the live part may bring a new line between two."""
    page.evaluate(
        """(selector) => {
            const cell = document.querySelector(selector);
            cell.scrollIntoView({ block: "center", behavior: "instant" });
            const box = cell.getBoundingClientRect();
            document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2).click();
        }""",
        selector,
    )


def newest_event(person: Person) -> int:
    """The number of the event that a page is made after."""
    found = re.search(r'<meta name="event" content="(\d+)">', person.open("/account"))
    assert found is not None
    return int(found[1])


class TestWithoutScripts:
    def test_what_one_characteristic_shows(self, shop: Shop, viewer: Person) -> None:
        shop.read(6.1)
        text = viewer.open(f"/plant/{shop.machine}")
        assert '+6.1<span class="unit">µm' in text
        assert "Correcting" in text
        assert 'class="band-picture' in text
        assert 'class="sparkline"' in text
        assert f"/characteristics/{shop.characteristic}" in text

    def test_a_reading_is_as_old_as_its_measurement_wherever_it_is_shown(self, shop: Shop, viewer: Person) -> None:
        """A bridge that was away for some hours delivers late: what it measured then is not from now."""
        measured = datetime.now(UTC) - timedelta(hours=3)
        shop.read(1.5, measured_at=measured.isoformat())
        for path in (f"/plant/{shop.machine}", f"/station/{shop.machine}", f"/characteristics/{shop.characteristic}"):
            assert f'<time-ago datetime="{measured:%Y-%m-%dT%H:%M}' in viewer.open(path), path
        row = viewer.open(f"/overview?machine={shop.machine}")
        assert f'<time-ago datetime="{measured:%Y-%m-%dT%H:%M}' in row

    @pytest.mark.parametrize(
        ("deviation", "words"),
        [(12.0, "Oversize"), (-12.0, "Undersize"), (350.0, "Tool worn"), (1200.0, "Probe fault"), (0.4, "In band")],
    )
    def test_the_state_in_words(self, shop: Shop, viewer: Person, deviation: float, words: str) -> None:
        shop.read(deviation)
        assert f"<span>{words}</span>" in viewer.open(f"/plant/{shop.machine}")

    @pytest.mark.parametrize(("action", "said"), [("false_reading", "excluded"), ("noted", "In band")])
    def test_a_reading_that_was_no_size_makes_no_part_oversize(
        self, shop: Shop, viewer: Person, action: str, said: str
    ) -> None:
        shop.read(0.4)
        shop.acknowledge(shop.read(1200.0)["alarms"][0]["id"], action)
        for path in (f"/plant/{shop.machine}", f"/characteristics/{shop.characteristic}"):
            text = viewer.open(path)
            assert "<span>In band</span>" in text
            assert "<span>Oversize</span>" not in text
            assert said in text

    def test_a_machine_without_characteristics_says_what_to_do(self, shop: Shop, viewer: Person) -> None:
        shop.call("POST", "/machines", 201, key=f"{shop.machine}-new", name="New", control="other")
        assert "Nothing is measured on this machine yet" in viewer.open(f"/plant/{shop.machine}-new")
        assert "There is no machine" in viewer.open("/plant/nowhere", 404)

    def test_of_very_many_those_that_run_by_themselves_are_folded(self, shop: Shop, viewer: Person) -> None:
        calm = f"{shop.characteristic}-calm"
        shop.add(calm, tool_memory=4)
        shop.read(0.1, calm)
        shop.read(12.0)
        text = viewer.open(f"/plant/{shop.machine}?show=short")
        assert f'id="c-{shop.characteristic}"' in text
        assert f'id="c-{calm}"' not in text
        assert f'<a href="/plant/{shop.machine}">' in text
        assert "1 characteristic is OK" in text
        assert f'id="c-{calm}"' in viewer.open(f"/plant/{shop.machine}")

    def test_only_those_that_need_someone(self, shop: Shop, viewer: Person) -> None:
        shop.add(f"{shop.characteristic}-calm", tool_memory=4)
        shop.read(0.1, f"{shop.characteristic}-calm")
        shop.read(12.0)
        text = viewer.open(f"/plant/{shop.machine}?show=attention")
        assert f'id="c-{shop.characteristic}"' in text
        assert f'id="c-{shop.characteristic}-calm"' not in text

    def test_names_are_text(self, shop: Shop, viewer: Person) -> None:
        body: dict[str, Any] = {"key": f"{shop.characteristic}-x", "machine": shop.machine, "name": XSS, "part": XSS}
        shop.call("POST", "/characteristics", 201, **body, parameters=PARAMETERS)
        text = viewer.open(f"/plant/{shop.machine}")
        assert XSS not in text
        assert "&lt;b&gt;&#34;Кључ&#34; d&#39;Ø&lt;/b&gt;" in text

    def test_nobody_sees_it_without_signing_in(self, server: Server) -> None:
        assert server.client().get("/").headers["location"].startswith("/sign-in")


def test_the_number_of_questions_does_not_grow_with_the_plant(shop: Shop, server: Server) -> None:
    def questions() -> int:
        asked: list[str] = []
        engine = server.database.engine

        def note(_connection: Any, _cursor: Any, statement: str, *_more: Any) -> None:
            asked.append(statement)

        event.listen(engine, "before_cursor_execute", note)
        with server.database.begin() as session:
            queries.plant(session)
        event.remove(engine, "before_cursor_execute", note)
        return len(asked)

    before = questions()
    for number in range(12):
        shop.add(f"{shop.characteristic}-{number}", tool_memory=number + 1, average_memory=number + 1)
        shop.read(3.0, f"{shop.characteristic}-{number}")
    assert questions() == before <= 6


class TestLive:
    def test_a_reading_changes_the_line_and_the_counts(self, shop: Shop, viewer: Person, page: Page) -> None:
        viewer.sign_in(page)
        page.goto("/")
        expect(line(page, shop)).to_contain_text("No readings yet")
        live(page)
        needed = int(page.locator(".plant-count strong").first.inner_text())
        page.evaluate("window.untouched = true")
        shop.read(12.0)
        expect(line(page, shop)).to_contain_text("Oversize")
        expect(line(page, shop)).to_contain_text("+12.0")
        expect(line(page, shop)).to_contain_text("1 alarm")
        expect(page.locator(".plant-count strong").first).to_have_text(str(needed + 1))
        assert page.evaluate("window.untouched")

    def test_what_happens_before_the_page_hears_anything_is_shown(self, shop: Shop, viewer: Person, page: Page) -> None:
        held: list[Route] = []

        def hold(route: Route) -> None:
            held.append(route)

        viewer.sign_in(page)
        page.route("**/api/v1/events*", hold)
        page.goto("/")
        expect(line(page, shop)).to_contain_text("No readings yet")
        before = newest_event(viewer)
        shop.read(12.0)
        until(lambda: newest_event(viewer) > before)  # everybody who listens has heard of it
        while not held:
            page.wait_for_timeout(20)
        held[0].continue_()
        expect(line(page, shop)).to_contain_text("Oversize")

    @pytest.mark.parametrize("size", ["desk", "phone"])
    def test_a_row_keeps_its_height_when_corrections_and_alarms_come(
        self, shop: Shop, viewer: Person, page: Page, size: str
    ) -> None:
        shop.read(0.2)
        viewer.sign_in(page)
        resize(page, size)
        page.goto(f"/plant/{shop.machine}")
        live(page)
        row = f"#c-{shop.characteristic}"
        before = boxes(page, row)[0]["height"]
        for deviation, shown in ((6.1, "pending"), (-6.3, "and 1 more"), (12.0, "1 alarm")):
            shop.read(deviation)
            expect(line(page, shop)).to_contain_text(shown)
            assert boxes(page, row)[0]["height"] == before, shown

    @pytest.mark.parametrize("size", ["desk", "phone"])
    def test_a_row_keeps_its_height_when_a_part_is_rejected(
        self, shop: Shop, viewer: Person, page: Page, size: str
    ) -> None:
        accepted = {"points": 3, "accept": {"n": 2, "m": 3}, "zero_range": 0, "weighting_factor": 1}
        name = shop.another("n-of-m", average_memory=0, **accepted)

        def read(*sizes: float) -> None:
            shop.call("POST", "/readings", 201, characteristic=name, touches=[[size] for size in sizes])

        read(40.0, 40.0, 40.0)
        viewer.sign_in(page)
        resize(page, size)
        page.goto(f"/plant/{shop.machine}")
        live(page)
        expect(page.locator(f"#c-{name}")).to_contain_text("0 rejected by this tool")
        before = boxes(page, f"#c-{name}")[0]["height"]
        read(40.02, 40.02, 40.0)
        expect(page.locator(f"#c-{name}")).to_contain_text("1 rejected by this tool")
        assert boxes(page, f"#c-{name}")[0]["height"] == before

    def test_a_new_characteristic_appears(self, shop: Shop, viewer: Person, page: Page) -> None:
        viewer.sign_in(page)
        page.goto("/")
        expect(line(page, shop)).to_be_visible()
        live(page)
        shop.add(f"{shop.characteristic}-late", tool_memory=9)
        expect(page.locator(f"#c-{shop.characteristic}-late")).to_be_visible()

    @pytest.mark.long
    def test_by_keyboard_to_the_characteristic(self, shop: Shop, viewer: Person, page: Page) -> None:
        viewer.sign_in(page)
        page.goto(f"/plant/{shop.machine}")
        link = line(page, shop).get_by_role("link").first
        link.focus()
        page.keyboard.press("Enter")
        page.wait_for_url(f"**/characteristics/{shop.characteristic}")

    @pytest.mark.long
    def test_a_calm_state_grows_old_while_the_page_is_open(self, shop: Shop, viewer: Person, page: Page) -> None:
        shop.read(0.2)
        viewer.sign_in(page)
        page.clock.install()
        page.goto(f"/plant/{shop.machine}")
        expect(line(page, shop)).to_contain_text("In band")
        page.clock.fast_forward("16:00")
        expect(line(page, shop).get_by_text("Old data")).to_be_visible()
        expect(line(page, shop).get_by_text("In band")).to_be_hidden()


def of_machines(server: Server) -> dict[str, int]:
    """Number of rows that belong to a machine, by table."""
    with server.database.begin() as session:
        tables = session.scalars(
            text(
                "SELECT table_name FROM information_schema.columns WHERE column_name = 'machine_id' AND table_schema = 'public'"
            )
        ).all()
        counted = "SELECT count(*) FROM {} WHERE machine_id IS NOT NULL"
        counts = {name: session.scalar(text(counted.format(name))) for name in tables}
    return {name: count for name, count in counts.items() if count}


def test_an_empty_plant_leads_to_set_up_or_to_a_simulated_machine_that_leaves_nothing_behind(
    run_server: RunServer,
) -> None:
    with run_server() as empty:
        engineer, viewer = Person(empty, "engineer"), Person(empty, "viewer")
        page = engineer.open("/")
        assert "No machine is set up yet" in page
        assert "/setup/machines/new" in page
        assert "Start a simulated lathe" in page
        assert "Start a simulated lathe" not in viewer.open("/")
        viewer.post("/simulated", 403)

        engineer.post("/simulated")
        assert "is simulated: none of its values were really measured" in viewer.open("/")
        client = empty.client(empty.key())
        [machine] = client.get("/api/v1/machines").json()["items"]
        assert machine["simulated"]
        until(lambda: client.get(f"/api/v1/machines/{machine['key']}/corrections").json()["items"], 120)
        renamed = client.patch(f"/api/v1/machines/{machine['key']}", json={"name": "Lathe 1"})
        assert "simulated" in renamed.json()["detail"]
        measured = client.get("/api/v1/characteristics").json()["items"][0]["key"]

        viewer.post("/simulated/remove", 403)
        engineer.post("/simulated/remove")
        assert of_machines(empty) == {}
        assert "No machine is set up yet" in engineer.open("/?done=removed")
        late = {"characteristic": measured, "measured": 40}
        assert client.post("/api/v1/readings", json=late).status_code == 404
        assert client.post("/api/v1/readings/batch", json=[late]).status_code == 404
        entry = client.get("/api/v1/audit", params={"subject": f"machine/{machine['key']}"}).json()["items"][0]
        assert entry["before"]["reading"] > 0

        Shop(empty)  # a real machine, which nothing removes
        engineer.post("/simulated", 409)
        engineer.post("/simulated/remove", 404)


class TestWithoutConnection:
    def test_no_state_is_shown_as_if_it_were_true(
        self, shop: Shop, server: Server, viewer: Person, page: Page, complaints: list[str]
    ) -> None:
        shop.read(0.2)
        viewer.sign_in(page)
        page.goto(f"/plant/{shop.machine}")
        expect(line(page, shop).get_by_text("In band")).to_be_visible()
        server.kill()
        expect(page.locator("live-status")).to_contain_text("No connection")
        expect(line(page, shop).get_by_text("In band")).to_be_hidden()
        expect(line(page, shop).get_by_text("Old data")).to_be_visible()
        server.restart()
        expect(page.locator("live-status")).to_have_text("live", timeout=60_000)
        expect(line(page, shop).get_by_text("In band")).to_be_visible()
        page.goto("about:blank")  # it asks no more
        complaints.clear()  # the browser notes every attempt that failed


def test_every_state_has_words() -> None:
    from app.views.characteristic.wording import state_word

    assert all(state_word(state) for state in CharacteristicState)


class TestRows:
    def test_a_row_opens_wherever_it_is_touched(self, page: Page, shop: Shop, viewer: Person) -> None:
        shop.read(12.0)
        viewer.sign_in(page)
        for size in ((1280, 800), (390, 844)):
            page.set_viewport_size({"width": size[0], "height": size[1]})
            page.goto(f"/plant/{shop.machine}")
            touched(page, f"#c-{shop.characteristic} .deviation")  # the link of the row lies over it
            page.wait_for_url(f"**/characteristics/{shop.characteristic}")
            page.goto(f"/plant/{shop.machine}")
            line(page, shop).locator(".alarm-link").click()
            page.wait_for_url(f"**/alarms?machine={shop.machine}")
