"""The kit in a real browser: nothing foreign, nothing the policy forbids, both scales, both themes, live and not live."""

import json
import time

import pytest
from playwright.sync_api import Page, Route, expect

from tests.web.conftest import OpenPage, Show, until

pytestmark = pytest.mark.browser

DRAWN = "[...document.querySelectorAll('plotly-chart')].every((chart) => chart.drawn)"


def send(show: Show, kind: str, **data: object) -> None:
    """A live event to the page that is open."""
    show.stage.events.append(f"event: {kind}\ndata: {json.dumps(data)}\n\n")


def passing(page: Page, state: str, milliseconds: int) -> None:
    """Let so much time pass in the page, and again, until the connection is in this state."""
    deadline = time.monotonic() + 60
    while page.locator("live-status").get_attribute("state") != state:
        assert time.monotonic() < deadline, state
        page.clock.run_for(milliseconds)
        page.wait_for_timeout(200)


@pytest.mark.parametrize(
    ("width", "height", "theme"),
    [
        (1280, 800, "light"),
        (800, 1280, "dark"),
        pytest.param(1920, 1080, "light", marks=pytest.mark.long),
        pytest.param(800, 1280, "light", marks=pytest.mark.long),
        pytest.param(1280, 800, "dark", marks=pytest.mark.long),
        pytest.param(1920, 1080, "dark", marks=pytest.mark.long),
    ],
)
def test_every_part_shows_on_every_panel(open_page: OpenPage, width: int, height: int, theme: str) -> None:
    with open_page("/", width, height, theme) as page:
        until(page, DRAWN)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        ground = page.evaluate("document.querySelector('#zones .plot').layout.paper_bgcolor")
        assert ground == {"light": "#fbfbfa", "dark": "#1b2024"}[theme]


@pytest.mark.parametrize(
    ("figure", "scale", "width"),
    [
        ("zones", "zones", 800),
        ("thinned", "true", 800),
        pytest.param("zones", "zones", 1920, marks=pytest.mark.long),
        pytest.param("zones", "true", 1280, marks=pytest.mark.long),
        pytest.param("empty", "zones", 1280, marks=pytest.mark.long),
    ],
)
def test_all_words_beside_the_bands_are_whole(open_page: OpenPage, figure: str, scale: str, width: int) -> None:
    with open_page(f"/chart?figure={figure}&scale={scale}", width) as page:
        until(page, DRAWN)
        cut = page.evaluate(
            """() => {
              const box = document.querySelector("#zones").getBoundingClientRect();
              return [...document.querySelectorAll("#zones .annotation text")]
                .filter((text) => { const own = text.getBoundingClientRect(); return own.right > box.right || own.left < box.left; })
                .map((text) => text.textContent);
            }"""
        )
        assert cut == []
        words = page.locator("#zones").inner_text()
        assert "R35/2" in words
        assert "tolerance" in words


def test_the_chart_follows_the_readings(open_page: OpenPage, show: Show) -> None:
    with open_page("/chart?live=1") as page:
        until(page, DRAWN)
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        show.stage.readings = 121
        send(show, "reading", machine="lathe-1", characteristic="something-else")
        page.wait_for_timeout(300)
        assert (
            page.evaluate("document.querySelector('#zones .plot').data.find((t) => t.meta === 'readings').x.length")
            == 120
        )
        send(show, "reading", machine="lathe-1", characteristic="shaft-d40")
        until(page, "document.querySelector('#zones .plot').data.find((t) => t.meta === 'readings').x.length === 121")


@pytest.mark.long
def test_a_burst_of_events_is_few_requests(open_page: OpenPage, show: Show) -> None:
    with open_page("/chart?live=1") as page:
        until(page, DRAWN)
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url) if "/figures/" in request.url else None)
        begun = time.monotonic()
        with page.expect_request("**/figures/**"):
            for _ in range(20):
                send(show, "reading", characteristic="shaft-d40")
        page.wait_for_timeout(1500)
        assert len(asked) <= 2 + time.monotonic() - begun, "at once, and then once a second"


@pytest.mark.long
def test_the_theme_switch_repaints_charts_and_is_remembered(open_page: OpenPage) -> None:
    with open_page("/chart", color_scheme="light") as page:
        until(page, DRAWN)
        page.locator("theme-switch button").click()  # auto -> light
        page.locator("theme-switch button").click()  # light -> dark
        until(page, "document.querySelector('#zones .plot').layout.paper_bgcolor === '#1b2024'")
        page.reload()
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"


def test_a_part_keeps_what_the_reader_is_doing(open_page: OpenPage, show: Show) -> None:
    with open_page("/") as page:
        part = page.locator("#part")
        expect(part).to_contain_text("120 readings")
        part.locator("summary").click()
        part.locator("a").focus()
        show.stage.readings = 130
        send(show, "reading", characteristic="shaft-d40")
        expect(part).to_contain_text("130 readings")
        assert part.locator("details").evaluate("(details) => details.open")
        assert page.evaluate("document.activeElement.textContent") == "a link"
        part.locator("input").fill("chipped insert")
        show.stage.readings = 140
        send(show, "reading", characteristic="shaft-d40")
        page.wait_for_timeout(1500)
        assert part.locator("input").input_value() == "chipped insert"
        page.locator("h1").click()
        expect(part).to_contain_text("140 readings")


CLICKED = """document.addEventListener("click", (event) => {
    event.preventDefault();
    document.body.dataset.clicked = event.target.textContent;
})"""
STILL = "{ const now = performance.now(); performance.now = () => now; }"


def test_a_part_is_not_swapped_between_press_and_release(open_page: OpenPage, show: Show) -> None:
    with open_page("/") as page:
        part, held = page.locator("#part"), list[Route]()

        def hold(route: Route) -> None:
            if held:
                route.continue_()
            held.append(route)

        expect(part).to_contain_text("120 readings")
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        page.evaluate(CLICKED)
        page.route("**/part", hold)
        show.stage.readings = 130
        send(show, "reading", characteristic="shaft-d40")
        part.locator("a").hover()
        while not held:
            page.wait_for_timeout(20)
        page.evaluate(STILL)  # however long the press takes on this computer
        page.mouse.down()
        with page.expect_response("**/part"):
            held[0].continue_()
        page.wait_for_timeout(200)  # as much time as a swap takes
        page.mouse.up()
        expect(page.locator("body")).to_have_attribute("data-clicked", "a link")
        expect(part).to_contain_text("120 readings")
        page.evaluate("delete performance.now")
        expect(part).to_contain_text("130 readings")


def test_the_number_of_alarms_is_live(open_page: OpenPage, show: Show) -> None:
    show.stage.alarms = 3
    with open_page("/chart") as page:
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        send(show, "alarm", machine="lathe-1")
        expect(page.locator(".nav .count")).to_contain_text("3 wait for a person")


HEARTBEAT = """new Promise((heard) => {
    const source = new EventSource("/api/v1/events");
    source.addEventListener("heartbeat", () => { source.close(); heard(); });
})"""
"""The page, which listens for longer, has heard one when this one is heard."""


def test_without_connection_the_page_says_how_old_it_is(open_page: OpenPage, show: Show) -> None:
    with open_page("/chart") as page:
        page.clock.install()
        page.reload()
        status = page.locator("live-status")
        expect(status).to_have_attribute("state", "live")
        page.evaluate(HEARTBEAT)
        show.stage.silent = True
        passing(page, "lost", 20_000)
        expect(status).to_contain_text("what you see may be old")
        show.stage.silent = False
        passing(page, "live", 2_000)


def test_a_chart_that_cannot_be_fetched_says_so_in_words(open_page: OpenPage, show: Show) -> None:
    with open_page("/chart?live=1", forgive="503") as page:
        until(page, DRAWN)
        expect(page.locator("live-status")).to_have_attribute("state", "live")
        show.stage.broken = True
        send(show, "reading", characteristic="shaft-d40")
        trouble = page.locator("plotly-chart .trouble")
        expect(trouble).to_contain_text("cannot be brought up to date")
        expect(trouble).to_contain_text("old")
        show.stage.broken = False
        expect(trouble).to_have_count(0)


def test_the_keyboard_is_enough(open_page: OpenPage) -> None:
    with open_page("/chart") as page:
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.className") == "skip-link"
        page.keyboard.press("Enter")
        expect(page.locator("main")).to_be_focused()
    with open_page("/") as page:
        expect(page.locator("[aria-invalid=true]").first).to_be_focused()
        page.get_by_role("button", name="Acknowledge").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_role("dialog")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_be_hidden()
        expect(page.get_by_role("button", name="Acknowledge")).to_be_focused()


def test_what_operators_touch_is_large_enough(open_page: OpenPage) -> None:
    with open_page("/", 800, 1280) as page:
        small = page.evaluate(
            """() => [...document.querySelectorAll(".button, .choice a, .tabs a, .nav a, theme-switch button, .option, select, summary")]
              .filter((e) => e.offsetHeight && e.offsetHeight < 46).map((e) => e.textContent.trim())"""
        )
        assert small == []
