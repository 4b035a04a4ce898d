"""What people come for most often, done as they do it, and the number of touches, clicks and keys that it takes.

Everybody begins at the plant page, signed in. Who stands at a machine has fingers, who sits at a desk a mouse and keys.
"""

from datetime import UTC, datetime, timedelta
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.pages.looks import live, until_shown
from tests.servers import Server
from tests.shop import Person, Shop

pytestmark = pytest.mark.own_server  # everybody begins at the plant page, which shows a plant and no crowd

PART = "SN-2041"  # the part of the last reading
PLACE_OF_LAST = """(chart) => {
  const plot = chart.querySelector(".plot"), box = plot.getBoundingClientRect(), { xaxis, yaxis } = plot._fullLayout;
  const { x, y } = plot.data.find((trace) => trace.meta === "readings");
  return [box.x + xaxis._offset + xaxis.d2p(x.at(-1)), box.y + yaxis._offset + yaxis.d2p(y.at(-1))];
}"""  # in pixels of the screen


class Hands:
    """The hands of somebody at a page. Each touch, each click, each key and each text typed into a field counts one."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.count = 0

    def tap(self, what: Locator) -> None:
        self.count += 1
        what.tap()

    def click(self, what: Locator) -> None:
        self.count += 1
        what.click()

    def press(self, key: str) -> None:
        self.count += 1
        self.page.keyboard.press(key)

    def type(self, text: str, field: Locator | None = None) -> None:
        """Into a field in place of what it holds; without one, where the cursor is."""
        self.count += 1
        if field is not None:
            field.fill(text)
        else:
            self.page.keyboard.type(text)


@pytest.fixture(scope="module")
def floor(server: Server) -> Shop:
    """A characteristic with readings of last week, of yesterday and of now, the last one corrected; two corrections that
    wait for approval, and one alarm, each on a tool of its own."""
    made = Shop(server)
    noon = datetime.now(UTC).replace(hour=12)
    readings = [
        {
            "characteristic": made.characteristic,
            "measured": 40 + (n % 5 - 2) / 5000,
            "measured_at": (noon - timedelta(days=before) + timedelta(seconds=n)).isoformat(),
        }
        for before in (8, 7, 1)
        for n in range(40)
    ]
    assert made.admin.post("/api/v1/readings/batch", json=readings).status_code == 201
    made.read(6.1, part=PART)
    made.add(f"{made.characteristic}-approval", tool_memory=4, average_memory=6, mode="approval")
    made.read(6.0, f"{made.characteristic}-approval")
    made.add(f"{made.characteristic}-to-do", tool_memory=9, average_memory=10, mode="approval")
    made.read(6.0, f"{made.characteristic}-to-do")
    made.add(f"{made.characteristic}-oversize", tool_memory=7, average_memory=8)
    made.read(12.5, f"{made.characteristic}-oversize")
    return made


def at_the_plant(page: Page, person: Person) -> Hands:
    person.sign_in(page)
    page.goto("/")
    live(page)
    return Hands(page)


def line(page: Page, floor: Shop, more: str = "") -> Locator:
    """The line of a characteristic on the plant page."""
    return page.locator(f"[id='c-{floor.characteristic}{more}']")


def name(page: Page, floor: Shop) -> Locator:
    return line(page, floor).get_by_role("link", name=f"Seat {floor.characteristic}", exact=True)


class TestByTouch:
    """An operator with a tablet of ten inches, held upright."""

    @pytest.fixture
    def screen(self) -> dict[str, Any]:
        return {"viewport": {"width": 800, "height": 1280}, "has_touch": True}

    def test_acknowledge_an_alarm(self, page: Page, floor: Shop, operator: Person) -> None:
        hands = at_the_plant(page, operator)
        hands.tap(line(page, floor, "-oversize").get_by_role("link", name="1 alarm"))
        hands.tap(page.get_by_role("link", name="Noted"))
        hands.tap(page.get_by_role("dialog").get_by_role("button", name="Noted"))
        expect(page.get_by_role("status").filter(has_text="Oversize")).to_contain_text("Noted")
        assert floor.alarms() == []
        assert hands.count == 3

    def test_approve_a_correction(self, page: Page, floor: Shop, operator: Person) -> None:
        hands = at_the_plant(page, operator)
        hands.tap(line(page, floor, "-approval").get_by_role("link", name="−6.0 µm awaiting approval"))
        hands.tap(page.get_by_role("link", name="Approve"))
        hands.tap(page.get_by_role("dialog").get_by_role("button", name="Approve"))
        expect(page.get_by_role("status").filter(has_text="approved")).to_be_visible()
        assert hands.count == 3

    def test_approve_a_correction_from_the_list_of_what_waits(self, page: Page, floor: Shop, operator: Person) -> None:
        operator.sign_in(page)
        page.goto("/todo")
        hands, about = Hands(page), f"Seat {floor.characteristic}-to-do"
        hands.tap(page.get_by_role("row").filter(has_text=about).get_by_role("link", name="Approve"))
        hands.tap(page.get_by_role("dialog").get_by_role("button", name="Approve"))
        expect(page.get_by_role("status").filter(has_text="approved")).to_be_visible()
        expect(page.get_by_role("row").filter(has_text=about)).to_have_count(0)
        assert hands.count == 2

    def test_reject_a_correction_after_a_touch_too_many(self, page: Page, floor: Shop, operator: Person) -> None:
        """Without a reason nothing is sent: the question stays where it is and says what it lacks."""
        key = f"{floor.characteristic}-rejected"
        floor.add(key, tool_memory=13, average_memory=14, mode="approval")
        number = floor.read(6.0, key)["correction"]["number"]
        operator.sign_in(page)
        page.goto("/todo")
        row = page.get_by_role("row").filter(has_text=f"Seat {key}")
        row.get_by_role("link", name="Reject", exact=True).tap()
        dialog = page.get_by_role("dialog")
        dialog.get_by_role("button", name="Reject").tap()
        expect(dialog.get_by_text("Pick a reason, or write one.")).to_be_visible()
        assert floor.correction(number)["status"] == "awaiting_approval"
        dialog.locator(".chip").filter(has_text="False reading").tap()
        expect(dialog.get_by_text("Pick a reason, or write one.")).to_be_hidden()
        dialog.get_by_role("button", name="Reject").tap()
        expect(page.get_by_role("status").filter(has_text="rejected")).to_be_visible()
        assert floor.correction(number)["status"] == "rejected"

    @pytest.mark.long
    def test_type_in_a_size(self, page: Page, floor: Shop, operator: Person) -> None:
        hands, key = at_the_plant(page, operator), f"{floor.characteristic}-typed"
        floor.add(key, tool_memory=11, average_memory=12)
        hands.tap(page.get_by_role("link", name="Station").first)
        hands.tap(page.get_by_role("link", name="Enter sizes"))
        hands.tap(page.get_by_role("textbox", name=f"Seat {key}"))
        hands.type("40.0004")
        hands.tap(page.get_by_role("button", name="Store"))
        expect(page.get_by_role("status").filter(has_text="Stored, measured by hand")).to_contain_text("+0.4")
        assert floor.call("GET", f"/readings/{key}/1")["context"]["operator"] == operator.name
        assert hands.count == 5

    @pytest.mark.long
    def test_report_a_tool_change(self, page: Page, floor: Shop, operator: Person) -> None:
        hands = at_the_plant(page, operator)
        hands.tap(line(page, floor).get_by_role("link", name="T3"))
        hands.tap(page.get_by_role("link", name="Tool changed"))
        dialog = page.get_by_role("dialog")
        hands.tap(dialog.locator(".chip").first)
        hands.tap(dialog.get_by_role("button", name="Tool changed"))
        expect(page.locator("main")).to_contain_text("starts a new life")
        assert hands.count == 4

    def test_why_was_it_corrected_last(self, page: Page, floor: Shop, operator: Person) -> None:
        hands = at_the_plant(page, operator)
        hands.tap(name(page, floor))
        chart = page.locator("plotly-chart.zones")
        expect(chart).to_have_attribute("tabindex", "0")
        chart.scroll_into_view_if_needed()
        hands.count += 1
        until_shown(chart.locator(".chart-panel"), lambda: page.touchscreen.tap(*chart.evaluate(PLACE_OF_LAST)))
        expect(chart.locator(".chart-panel")).to_contain_text("beyond the averaging limit 5.0 µm: corrected in full.")
        assert hands.count == 2


class TestAtTheDesk:
    """An engineer with a mouse and a keyboard."""

    def test_find_a_part(self, page: Page, floor: Shop, engineer: Person) -> None:
        hands = at_the_plant(page, engineer)
        hands.press("/")
        hands.type(PART)
        expect(page.get_by_role("option").filter(has_text=PART)).to_be_visible()
        hands.press("ArrowDown")
        hands.press("Enter")
        expect(page.get_by_role("heading", level=1)).to_have_text(f"Part {PART}")
        expect(page.locator("#of-part")).to_contain_text("corrected in full")
        assert hands.count == 4

    @pytest.mark.long
    def test_look_at_yesterday(self, page: Page, floor: Shop, engineer: Person) -> None:
        hands = at_the_plant(page, engineer)
        hands.click(name(page, floor))
        hands.click(page.locator(".period-picker summary").first)
        hands.click(page.get_by_role("link", name="Yesterday"))
        page.wait_for_url(lambda url: "from=" in url)
        counted = f"/characteristics/{floor.characteristic}/statistics?{urlsplit(page.url).query}"
        expect(page.locator("#numbers dd").first).to_have_text(str(floor.call("GET", counted)["count"]))
        assert hands.count == 3

    @pytest.mark.long
    def test_see_the_capability(self, page: Page, floor: Shop, engineer: Person) -> None:
        hands = at_the_plant(page, engineer)
        hands.click(name(page, floor))
        hands.click(page.get_by_role("link", name="Capability", exact=True))
        expect(page.locator("#indices")).to_contain_text("Ppk")
        assert hands.count == 2

    def test_change_r33_with_a_reason(self, page: Page, floor: Shop, engineer: Person) -> None:
        hands = at_the_plant(page, engineer)
        hands.click(name(page, floor))
        hands.click(page.get_by_role("link", name="Parameters in Set-up"))
        hands.type("0.0015", page.locator("#f-zero_range"))
        hands.type("Half as many corrections", page.get_by_label("Reason for the change"))
        hands.click(page.get_by_role("button", name="Save"))
        expect(page.locator("#versions")).to_contain_text("Half as many corrections")
        assert floor.call("GET", f"/characteristics/{floor.characteristic}")["parameters"]["zero_range"] == 0.0015
        assert hands.count == 5

    @pytest.mark.long
    def test_report_last_week_on_paper(self, page: Page, floor: Shop, engineer: Person) -> None:
        hands = at_the_plant(page, engineer)
        hands.click(name(page, floor))
        hands.click(page.get_by_role("link", name="Report", exact=True))
        hands.click(page.get_by_role("button", name="Last week"))
        hands.click(page.get_by_role("button", name="Show"))
        with page.expect_download() as got:
            hands.click(page.get_by_role("link", name="PDF"))
        assert got.value.path().read_bytes().startswith(b"%PDF-")
        assert hands.count == 5

    def test_add_a_characteristic_like_another(self, page: Page, floor: Shop, engineer: Person) -> None:
        hands = at_the_plant(page, engineer)
        hands.click(name(page, floor))
        hands.click(page.get_by_role("link", name="Parameters in Set-up"))
        hands.click(page.get_by_role("link", name="Add one like it"))
        hands.type("Seat of the other end", page.get_by_label("Name"))
        hands.type("other-end", page.get_by_label("Key"))
        hands.click(page.get_by_role("button", name="Add characteristic"))
        expect(page.get_by_role("heading", level=1)).to_have_text("Seat of the other end")
        made = floor.call("GET", "/characteristics/other-end")
        assert made["parameters"]["averaging_limit"] == 0.005
        assert hands.count == 6
