"""The wear curve, the verdict on the loop and the forecast on the pages."""

from playwright.sync_api import Page, expect

from tests.pages.looks import live
from tests.quality.closed_loop import cut, scatter
from tests.quality.wear.test_wear_api import go, nervous
from tests.shop import Person, Shop
from tests.waits import until


def test_the_page_says_how_fast_and_how_long(viewer: Person, shop: Shop) -> None:
    cut(shop, scatter(60, sigma=0.3, wear=0.6), delay=0)
    text = viewer.open(f"/characteristics/{shop.characteristic}").replace("\xa0", " ")
    assert "Wear per part" in text
    assert "+0.6" in text
    assert "Worn by R37" in text
    assert "a part would be out of tolerance, if nothing were corrected from now on" in text
    assert "Quiet" in text


def test_before_there_is_enough_it_says_so(viewer: Person, shop: Shop) -> None:
    text = viewer.open(f"/characteristics/{shop.characteristic}")
    assert "Too few readings of this tool yet" in text


def test_a_loop_that_hunts_is_reported_on_all_three_pages_and_noted(operator: Person, shop: Shop) -> None:
    nervous(shop)
    cut(shop, scatter(50, sigma=1.0, wear=0.0), delay=0, tool=4)
    go(shop)
    # What is worked out for scatter alone leads to the map, where wear and warming up are in the parts.
    what_if = f'href="/characteristics/{shop.characteristic}/what-if"'
    curve = operator.open(f"/characteristics/{shop.characteristic}").partition('id="wear-curve"')[2]
    assert "With R33 at" in curve
    assert what_if in curve
    board = operator.open(f"/alarms?machine={shop.machine}")
    assert "Hunting" in board
    assert what_if in board
    (alarm,) = shop.alarms()
    shop.acknowledge(alarm["id"], "noted")
    assert "overcorrects" in operator.open(f"/plant/{shop.machine}"), "noted, but not over"


def test_what_comes_soon_stands_out_on_the_plant_page(viewer: Person, shop: Shop) -> None:
    shop.characteristic = shop.another("limited", max_total=0.05, tool_memory=4, average_memory=6)
    cut(shop, scatter(60, sigma=0.3, wear=0.6), delay=0, tool=4)
    go(shop)
    text = viewer.open(f"/plant/{shop.machine}")
    assert "parts to limit" in text
    assert "data-near" in text


ABOVE_ITS_STRIP = """document.querySelector("plotly-chart.wear .main-svg").getBoundingClientRect().bottom
  <= document.querySelector("plotly-chart.wear .chart-strip").getBoundingClientRect().top + 1"""


def test_in_the_browser_the_curve_is_drawn_and_goes_on(viewer: Person, shop: Shop, page: Page) -> None:
    cut(shop, scatter(60, sigma=0.3, wear=0.6), delay=0)
    viewer.sign_in(page)
    page.goto(f"/characteristics/{shop.characteristic}")
    curve = page.locator("plotly-chart.wear")
    curve.scroll_into_view_if_needed()
    expect(curve.locator(".main-svg").first).to_be_visible()
    expect(curve).to_contain_text("per part")
    expect(curve.locator(".chart-strip")).to_be_visible()  # the chart gives it room: it would lie over the axis
    until(lambda: page.evaluate(ABOVE_ITS_STRIP))
    page.get_by_role("navigation", name="Readings of the wear curve").get_by_role("link", name="All").click()
    page.wait_for_url("**edge=all**")
    expect(page.locator("#wear")).to_contain_text("over the last 60 readings")
    live(page)
    shop.read(1.0)
    expect(page.locator("#wear")).to_contain_text("over the last 61 readings")
