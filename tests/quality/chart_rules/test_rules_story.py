"""An engineer in Chromium: tries rules, switches them on, sees a signal come in, follows its alarm and says what it was."""

import re

from playwright.sync_api import Page, expect

from tests.pages.looks import live
from tests.quality.chart_signals.line import Line
from tests.shop import Person, Shop


def test_from_the_rules_to_the_cause(page: Page, shop: Shop, engineer: Person) -> None:
    line = Line(shop)
    line.push([0.5] * 12 + [-1.0, 1.0])
    engineer.sign_in(page)
    page.goto(f"/characteristics/{line.key}/control")
    page.get_by_role("link", name="Rules", exact=True).click()
    row = page.get_by_role("row").filter(has_text="9 points in a row")
    expect(row).to_contain_text("1 time")
    expect(row).to_contain_text("1 in 511 points")
    expect(page.locator(".together")).to_contain_text("chance alone gives")
    group = page.get_by_role("group", name="Nelson 2, Individuals")
    group.get_by_role("radio", name="alarm").check()
    page.get_by_role("button", name="Try selection").click()
    expect(page.get_by_text("tried, not switched on")).to_be_visible()
    expect(group.get_by_role("radio", name="alarm")).to_be_checked()
    page.get_by_label("Reason").fill("Shifts matter here")
    page.get_by_role("button", name="Switch on").click()
    expect(page.get_by_role("row").filter(has_text="Shifts matter here")).to_be_visible()
    expect(group.get_by_role("radio", name="alarm")).to_be_checked()

    page.goto(f"/characteristics/{line.key}/signals")
    expect(page.get_by_text("No signals")).to_be_visible()
    live(page)
    line.push([0.5] * 9)
    line.look()
    signal = page.get_by_role("link", name="Nelson 2, Individuals, readings 75 to 83")  # comes by itself
    expect(signal).to_be_visible()
    page.locator(".kept-signals").get_by_role("link", name="alarm").click()
    expect(page.get_by_role("heading", level=1)).to_contain_text("Signal")
    page.get_by_role("link", name="control chart").click()
    page.wait_for_url(re.compile("first=35.*through=123|through=123.*first=35"))
    expect(page.locator("plotly-chart .main-svg").first).to_be_attached()

    page.goto(f"/characteristics/{line.key}/signals?state=open")
    signal.click()
    expect(page.locator("plotly-chart .main-svg").first).to_be_attached()
    page.get_by_label("Cause").select_option("material")
    page.get_by_label("Comment").fill("New batch, harder by 20 HB")
    page.get_by_role("button", name="Save cause").click()
    expect(page.locator(".signal-head")).to_contain_text("explained")
    expect(page.get_by_text("Material or blank: New batch, harder by 20 HB")).to_be_visible()
    assert line.signals("open") == []
