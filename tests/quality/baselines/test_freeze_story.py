"""An engineer in Chromium: drags a period on the chart, leaves points out with their reason, and freezes what the preview says."""

import re

import pytest
from playwright.sync_api import Page, expect

from app.core.spc.quantity import Quantity
from app.errors import Invalid
from app.quality.baselines.draft_queries import _check
from app.quality.baselines.form_reader import at_fields
from app.quality.baselines.schemas import ExcludedIn, PeriodIn
from tests.pages.looks import drawn, live
from tests.quality.chart_signals.line import Line
from tests.shop import Person, Shop


@pytest.fixture
def line(shop: Shop) -> Line:
    """60 quiet readings, a chip, 60 more; no baseline yet."""
    line = Line(shop, baseline=False)
    line.push([25.0, *[1.128, -1.128] * 30])
    return line


def dragged(page: Page, first: float, last: float) -> None:
    """Drag over the chart from one reading to another."""
    page.wait_for_load_state()
    drawn(page)
    where = page.evaluate(
        """([first, last]) => {
            const plot = document.querySelector("plotly-chart .js-plotly-plot");
            const { _fullLayout: { xaxis: x, yaxis: y } } = plot, box = plot.getBoundingClientRect();
            return [first, last].map((n) => [box.left + x._offset + x.d2p(n), box.top + y._offset + y._length / 3]);
        }""",
        [first, last],
    )
    (x, y), (to, _y) = where
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move((x + to) / 2, y + 40, steps=4)
    page.mouse.move(to, y + 60, steps=4)
    page.mouse.up()


def test_from_the_chart_to_a_frozen_baseline(page: Page, line: Line, engineer: Person, complaints: list[str]) -> None:
    engineer.sign_in(page)
    page.goto(f"/characteristics/{line.key}/control")
    expect(page.get_by_text("No baseline is in force")).to_be_visible()
    page.get_by_role("link", name="Freeze a baseline").click()
    page.get_by_role("navigation", name="How many readings").get_by_role("link", name="All").click()
    page.wait_for_url("**last=all**")

    dragged(page, 10.6, 110.4)
    first, last = page.get_by_label("From reading"), page.get_by_label("To reading")
    expect(first).to_have_value("11")
    expect(last).to_have_value("110")
    # Dragging inside the period that was just chosen leaves out; it does not move the period.
    left_out = page.get_by_label("Left out of it")
    page.get_by_role("button", name="Drag: leave out").click()
    dragged(page, 60.1, 61.9)
    expect(left_out).to_have_value("61 ")
    expect(last).to_have_value("110")
    left_out.fill("")
    page.get_by_role("button", name="Preview").click()
    preview = page.locator("#preview")
    expect(preview).to_contain_text("1 point of the period itself lies beyond its limits")
    expect(preview).to_contain_text("100 readings")

    page.wait_for_load_state()
    page.get_by_role("button", name="Drag: leave out").click()
    dragged(page, 60.1, 61.9)
    expect(left_out).to_have_value("61 ")
    page.get_by_role("button", name="Preview").click()
    expect(page.get_by_role("alert").or_(page.locator(".error")).first).to_contain_text("has no reason")
    expect(left_out).to_have_value("61 ")
    assert all("422" in each for each in complaints)
    complaints.clear()  # the browser's own words for it
    left_out.fill("61 chip on the stylus")
    page.get_by_role("button", name="Preview").click()
    expect(preview).to_contain_text("left out by the baseline: 61")
    expect(preview).to_contain_text("99 readings")
    expect(preview.locator('[data-code="signals"]')).to_have_count(0)

    preview.get_by_label("Reason").fill("New toolholder, quiet since Monday")
    preview.get_by_role("button", name="Freeze", exact=True).click()
    page.wait_for_url(f"**/characteristics/{line.key}/control")
    expect(page.get_by_role("heading", name="Baseline 1")).to_be_visible()
    expect(page.get_by_text("Left out: reading 61, chip on the stylus")).to_be_visible()
    (made,) = line.shop.call("GET", f"/characteristics/{line.key}/baselines")["items"]
    assert (made["first_sequence"], made["last_sequence"], made["actor"]) == (11, 110, engineer.name)
    assert made["excluded"] == [{"first": 61, "last": 61, "reason": "chip on the stylus"}]

    live(page)
    line.push([9.0])
    line.look()
    found = page.get_by_role("region", name="Open signals").get_by_text("reading 122")
    expect(found).to_be_visible()  # comes by itself


@pytest.mark.long
def test_of_two_who_freeze_at_once_the_second_is_informed_and_loses_nothing(
    page: Page, line: Line, engineer: Person, complaints: list[str]
) -> None:
    engineer.sign_in(page)
    page.goto(f"/characteristics/{line.key}/control/freeze?first_sequence=1&last_sequence=60&last=all")
    reason = page.locator("#preview").get_by_label("Reason")
    reason.fill("Mine")
    line.freeze(5, 100)
    page.get_by_role("button", name="Freeze", exact=True).click()
    expect(page.get_by_text("Another person has frozen baseline 1 meanwhile")).to_be_visible()
    expect(reason).to_have_value("Mine")
    assert all("409" in each for each in complaints)
    complaints.clear()
    page.get_by_role("button", name="Freeze", exact=True).click()
    expect(page.get_by_role("heading", name="Baseline 2")).to_be_visible()


def test_too_little_says_how_much_is_missing_and_keeps_what_was_typed(line: Line, engineer: Person) -> None:
    path = f"/characteristics/{line.key}/control/freeze"
    text = engineer.open(f"{path}?first_sequence=1&last_sequence=12&excluded=3%20chip", 422)
    assert "9 are missing" in text
    assert re.search(r'name="last_sequence"[^>]*value="12"', text)
    assert re.search(r'name="excluded"[^>]*>\s*3 chip', text)
    assert "here are 121 readings so far" in engineer.open(f"{path}?first_sequence=500&last_sequence=900", 422)


def test_of_several_runs_outside_of_the_period_each_is_named() -> None:
    """All of them stand in one field."""
    runs = [ExcludedIn(first=first, last=last, reason="Chip") for first, last in ((3, 5), (31, 32), (40, 41))]
    period = PeriodIn(quantity=Quantity.DEVIATION, first_sequence=1, last_sequence=30, excluded=runs)
    with pytest.raises(Invalid) as refused:
        _check(period, 100)
    wrong = "lies outside of the period: there is nothing of it to leave out"
    assert at_fields(refused.value) == {"excluded": f"31 to 32 {wrong}. 40 to 41 {wrong}"}
