"""The wear curve, the verdict on the loop and the forecast on the pages."""

from playwright.sync_api import Page, expect

from app.jobs.actions import run_jobs
from app.quality.wear.actions import JOB
from tests.conftest import Server
from tests.quality.wear.test_wear_api import nervous, shift
from tests.shop import Person, Shop


def go(shop: Shop) -> None:
    run_jobs(shop.server.database, [JOB])


def test_the_page_says_how_fast_and_how_long(server: Server, shop: Shop) -> None:
    shift(shop, 60, wear=0.6, scatter=0.3)
    text = Person(server, "viewer").open(f"/characteristics/{shop.characteristic}").replace("\xa0", " ")
    assert "Wear per part" in text
    assert "+0.6" in text
    assert "Worn by R37" in text
    assert "a part would be out of tolerance, if nothing were corrected from now on" in text
    assert "Quiet" in text


def test_before_there_is_enough_it_says_so(server: Server, shop: Shop) -> None:
    text = Person(server, "viewer").open(f"/characteristics/{shop.characteristic}")
    assert "Too few readings of this tool yet" in text


def test_a_loop_that_hunts_is_told_on_all_three_pages_and_noted(server: Server, shop: Shop) -> None:
    nervous(shop)
    shift(shop, 50, scatter=1.0, tool=4)
    go(shop)
    person = Person(server, "operator")
    # What is worked out for scatter alone leads to the map, where wear and warming up are in the parts.
    what_if = f'href="/characteristics/{shop.characteristic}/what-if"'
    curve = person.open(f"/characteristics/{shop.characteristic}").partition('id="wear-curve"')[2]
    assert "With R33 at" in curve
    assert what_if in curve
    board = person.open(f"/alarms?machine={shop.machine}")
    assert "Hunting" in board
    assert what_if in board
    (alarm,) = shop.alarms()
    shop.acknowledge(alarm["id"], "noted")
    assert "overcorrects" in person.open(f"/plant/{shop.machine}"), "noted, but not over"


def test_what_comes_soon_stands_out_on_the_plant_page(server: Server, shop: Shop) -> None:
    shop.add("limited-page", max_total=0.05, tool_memory=4, average_memory=6)
    shop.characteristic = "limited-page"
    shift(shop, 60, wear=0.6, scatter=0.3, tool=4)
    go(shop)
    text = Person(server, "viewer").open(f"/plant/{shop.machine}")
    assert "parts to limit" in text
    assert "data-near" in text


ABOVE_ITS_STRIP = """(chart) => chart.querySelector(".main-svg").getBoundingClientRect().bottom
  <= chart.querySelector(".chart-strip").getBoundingClientRect().top + 1"""


def test_in_the_browser_the_curve_is_drawn_and_goes_on(server: Server, shop: Shop, page: Page) -> None:
    shift(shop, 60, wear=0.6, scatter=0.3)
    Person(server, "viewer").sign_in(page)
    page.goto(f"/characteristics/{shop.characteristic}")
    curve = page.locator("plotly-chart.wear")
    curve.scroll_into_view_if_needed()
    expect(curve.locator(".main-svg").first).to_be_visible(timeout=30_000)
    expect(curve).to_contain_text("per part")
    expect(curve.locator(".chart-strip")).to_be_visible()  # the chart gives it room: it would lie over the axis
    page.wait_for_function(ABOVE_ITS_STRIP, arg=curve.element_handle())
    page.get_by_role("navigation", name="Readings of the wear curve").get_by_role("link", name="All").click()
    page.wait_for_url("**edge=all**")
    expect(page.locator("#wear")).to_contain_text("over the last 60 readings")
    shop.read(1.0)
    expect(page.locator("#wear")).to_contain_text("over the last 61 readings", timeout=30_000)
