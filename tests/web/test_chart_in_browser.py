"""Moving in a chart and selecting its points, in a real browser: by mouse, finger and keyboard."""

import json
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Page, expect

from tests.web.conftest import OpenPage, Show, until

pytestmark = pytest.mark.browser

DRAWN = "document.querySelector('#zones').drawn === true"
SHOWN = "document.querySelector('#zones .plot')._fullLayout.xaxis.range"
DRAWN_POINTS = "document.querySelector('#zones .plot').data.find((trace) => trace.meta === 'readings').x.length"


def told(show: Show, readings: int) -> None:
    """One more reading, and the live event of it."""
    show.stage.readings = readings
    event = json.dumps({"machine": "lathe-1", "characteristic": "shaft-d40"})
    show.stage.events.append(f"event: reading\ndata: {event}\n\n")


def place(page: Page, sequence: int) -> tuple[float, float]:
    """The place of a reading on the screen."""
    x, y = page.evaluate(
        """(sequence) => {
          const plot = document.querySelector("#zones .plot"), box = plot.getBoundingClientRect();
          const { xaxis, yaxis } = plot._fullLayout, readings = plot.data.find((trace) => trace.meta === "readings");
          return [box.x + xaxis._offset + xaxis.d2p(sequence), box.y + yaxis._offset + yaxis.d2p(readings.y[sequence - 1])];
        }""",
        sequence,
    )
    return x, y


def dragged(page: Page, first: int, last: int) -> None:
    (x, y), (end, _y) = place(page, first), place(page, last)
    page.mouse.move(x, y + 60)
    page.mouse.down()
    page.mouse.move(end, y + 64, steps=6)
    page.mouse.up()


def test_a_part_of_the_chart_stays_while_readings_arrive_and_goes_by_back(open_page: OpenPage, show: Show) -> None:
    with open_page("/chart?live=1") as page:
        until(page, DRAWN)
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        dragged(page, 40, 60)
        until(page, f"{SHOWN}[1] - {SHOWN}[0] < 25")
        shown = page.evaluate(SHOWN)
        assert shown == pytest.approx([40, 60], abs=1)
        told(show, 121)
        until(page, f"{DRAWN_POINTS} === 121")
        assert page.evaluate(SHOWN) == shown
        page.go_back()
        until(page, f"{SHOWN}[1] - {SHOWN}[0] > 120")
        assert "zoom" not in page.url


@pytest.mark.long
def test_the_address_shows_the_same_part_and_one_button_the_whole(open_page: OpenPage, show: Show) -> None:
    with open_page("/chart?zoom=40..60") as page:
        until(page, DRAWN)
        assert page.evaluate(SHOWN) == [40, 60]
        page.locator("#zones").focus()
        page.keyboard.press("+")
        until(page, f"{SHOWN}[1] - {SHOWN}[0] < 15")
        page.keyboard.press("Shift+ArrowRight")
        until(page, f"{SHOWN}[0] > 46")
        page.get_by_role("button", name="Whole chart").click()
        until(page, f"{SHOWN}[1] > 200")
        assert "zoom" not in page.url


@pytest.mark.long
def test_with_pan_switched_on_dragging_moves(open_page: OpenPage) -> None:
    with open_page("/chart?zoom=40..60") as page:
        until(page, DRAWN)
        pan = page.get_by_role("button", name="Pan")
        pan.click()
        expect(pan).to_have_attribute("aria-pressed", "true")
        dragged(page, 50, 45)
        until(page, f"Math.abs({SHOWN}[0] - 45) < 1")
        assert page.evaluate(SHOWN) == pytest.approx([45, 65], abs=1)
        pan.click()
        dragged(page, 50, 60)
        until(page, f"{SHOWN}[1] - {SHOWN}[0] < 12")


def test_who_follows_sees_the_new_readings(open_page: OpenPage, show: Show) -> None:
    with open_page("/chart?live=1&zoom=40..60") as page:
        until(page, DRAWN)
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        follow = page.get_by_role("button", name="Follow")
        expect(follow).to_have_attribute("aria-pressed", "false")
        follow.click()
        until(page, f"{SHOWN}[1] > 120")
        before = page.evaluate(SHOWN)
        told(show, 130)
        until(page, f"{DRAWN_POINTS} === 130")
        until(page, f"{SHOWN}[1] > 130")
        after = page.evaluate(SHOWN)
        assert after[1] - after[0] == pytest.approx(before[1] - before[0])
        assert parse_qs(urlsplit(page.url).query)["zoom"] == ["last..20"]


def test_two_fingers_zoom(open_page: OpenPage) -> None:
    with open_page("/chart", has_touch=True) as page:
        until(page, DRAWN)
        box = page.locator("#zones .plot").bounding_box()
        assert box is not None
        y = box["y"] + 200
        middle = box["x"] + box["width"] / 3
        device = page.context.new_cdp_session(page)

        def touch(kind: str, *xs: float) -> None:
            points = [{"x": x, "y": y, "id": number} for number, x in enumerate(xs)]
            device.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        low, high = page.evaluate(SHOWN)
        touch("touchStart", middle - 40)
        touch("touchStart", middle - 40, middle + 40)
        for apart in (60, 90, 120):
            touch("touchMove", middle - apart, middle + apart)
        touch("touchEnd")
        until(page, f"{SHOWN}[1] - {SHOWN}[0] < {(high - low) / 2}")
        assert page.evaluate(f"{SHOWN}[1] - {SHOWN}[0]") == pytest.approx((high - low) / 3, rel=0.05)
        until(page, "location.search.includes('zoom=')")


def test_a_click_selects_and_the_link_opens(open_page: OpenPage) -> None:
    with open_page("/chart") as page:
        until(page, DRAWN)
        page.route("**/readings/61", lambda route: route.fulfill(body="reading 61"))
        panel = page.get_by_role("complementary", name="Selected point")
        expect(panel).to_be_hidden()
        page.mouse.click(*place(page, 60))
        expect(panel).to_contain_text("Reading 60")
        assert page.url.endswith("/chart")
        page.locator("#zones").focus()
        page.keyboard.press("ArrowRight")
        expect(panel).to_contain_text("Reading 61")
        page.keyboard.press("Escape")
        expect(panel).to_be_hidden()
        page.mouse.click(*place(page, 61))
        panel.get_by_role("link", name="Open").click()
        page.wait_for_url("**/readings/61")
