"""The station of a machine: what it says, how large it says it, what is done there, and how it calls."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from app.language.formatting import um
from tests.pages.looks import boxes
from tests.shop import PARAMETERS, Person, Shop, unique

UPRIGHT: Any = {"width": 800, "height": 1280}
ACROSS: Any = {"width": 1280, "height": 800}
LETTERS = "([part, least]) => parseFloat(getComputedStyle(document.querySelector(part)).fontSize) >= least"
TONES = """document.addEventListener("alarmsound", () => {
  const page = document.documentElement.dataset;
  page.tones = Number(page.tones ?? 0) + 1;
})"""


class TestWithoutScripts:
    def test_who_needs_someone_first_is_in_giant_digits(self, shop: Shop, viewer: Person) -> None:
        other = f"{shop.characteristic}-calm"
        shop.add(other, tool_memory=4)
        shop.read(12.5)
        shop.read(0.4, other)
        text = viewer.open(f"/station/{shop.machine}")
        giant, rest = text.split('class="station-next"')
        assert '+12.5<span class="unit">µm' in giant
        assert "Oversize" in giant
        assert '+0.4<span class="unit">µm' in rest
        assert "Set the part aside" in rest

    @pytest.mark.parametrize(
        ("deviation", "action"),
        [(0.4, "Nothing to do"), (350.0, "Check tool 3"), (1200.0, "Check the probe and the part")],
    )
    def test_next_action(self, shop: Shop, viewer: Person, deviation: float, action: str) -> None:
        shop.read(deviation)
        assert f'<p class="station-action">{action}</p>' in viewer.open(f"/station/{shop.machine}")

    def test_without_readings_the_first_part_is_next(self, shop: Shop, viewer: Person) -> None:
        assert "Measure the first part" in viewer.open(f"/station/{shop.machine}")

    def test_a_correction_awaits_approval(self, shop: Shop, viewer: Person) -> None:
        key = f"{shop.characteristic}-approval"
        shop.add(key, mode="approval", tool_memory=4, average_memory=6)
        shop.read(6.0, key)
        assert "Approve the correction of −6.0" in viewer.open(f"/station/{shop.machine}")

    def test_where_no_program_takes_a_correction_a_person_enters_it(self, shop: Shop, operator: Person) -> None:
        machine, key = unique("bench"), unique("ring")  # neither a key nor a bridge
        shop.call("POST", "/machines", 201, key=machine, name="Bench", control="other")
        shop.call("POST", "/characteristics", 201, key=key, name="Ring", machine=machine, parameters=PARAMETERS)
        assert shop.read(6.0)["correction"]["status"] == shop.read(6.0, key)["correction"]["status"] == "pending"
        assert "to the offset" not in operator.open(f"/station/{shop.machine}")
        here = f"/station/{machine}"
        text = operator.open(here)
        assert '<p class="station-action">Add −6.0\xa0µm to the offset of tool 3</p>' in text
        assert "then mark it applied" in text
        assert f"{here}/corrections/1?do=applied" in text
        assert "Correction pending" in operator.open(f"/characteristics/{key}")
        operator.send(f"{here}/corrections/1", do="applied")
        assert '<p class="station-action">Nothing to do</p>' in operator.open(here)
        assert [shop.read(each, key)["correction"]["number"] for each in (6.0, 12.0, 18.0)] == [2, 3, 4]
        text = operator.open(here)
        assert f"{here}/corrections/3?do=applied" in text
        assert f"{here}/corrections/4?" not in text
        assert "1 more correction waits" in text

    def test_a_correction_is_approved_or_rejected(self, shop: Shop, operator: Person, viewer: Person) -> None:
        key = f"{shop.characteristic}-approval"
        shop.add(key, mode="approval", tool_memory=4, average_memory=6)
        first = shop.read(6.0, key)["correction"]["number"]
        here = f"/station/{shop.machine}"
        for verb in ("approve", "rejected"):
            assert f"{here}/corrections/{first}?do={verb}" in operator.open(here)
        assert f"{here}/corrections/" not in viewer.open(here)
        assert f"Approve correction {first}?" in operator.open(f"{here}/corrections/{first}?do=approve")
        asked_again = operator.send(f"{here}/corrections/{first}", 422, do="approve")
        assert "Pick a reason" in asked_again
        text = operator.send(f"{here}/corrections/{first}", do="approve", reason="As expected")
        assert f"Correction {first} is approved" in text
        assert shop.correction(first)["decided_by"] == operator.name
        assert shop.correction(first)["status"] == "pending"
        second = shop.read(-6.0, key, correction_in_effect=0)["correction"]["number"]
        operator.send(f"{here}/corrections/{second}", do="rejected", reason="False reading")
        assert shop.correction(second)["status"] == "rejected"
        assert "someone else had already decided" in operator.send(
            f"{here}/corrections/{second}", do="approve", reason="As expected"
        )

    def test_corrections_stand_oldest_first_and_are_approved_together(self, shop: Shop, operator: Person) -> None:
        key = f"{shop.characteristic}-approval"
        shop.add(key, mode="approval", tool_memory=4, average_memory=6)
        first, second, third = (shop.read(each, key)["correction"]["number"] for each in (6.0, 3.7, 12.0))
        here = f"/station/{shop.machine}"
        text = operator.open(here)
        assert text.index(f"{here}/corrections/{first}?") < text.index(f"{here}/corrections/{second}?")
        assert f"{here}/corrections/{third}?" not in text
        assert "1 more correction waits" in text
        total = sum(shop.correction(number)["amount"] for number in (first, second, third))
        assert f"Approve all 3, {um(total)}" in text
        asked = operator.open(f"{here}/tools/4/corrections")
        assert 'value="As expected" checked' in asked
        later = shop.read(-6.0, key)["correction"]["number"]
        said = operator.send(
            f"{here}/tools/4/corrections", numbers=f"{first} {second} {third}", reason="As expected", do="approve-all"
        )
        assert "All that awaited approval for tool 4 is approved" in said
        states = [shop.correction(number)["status"] for number in (first, second, third, later)]
        assert states == ["pending", "pending", "pending", "awaiting_approval"], "only those that were shown"

    def test_alarms_stand_by_urgency_then_by_age(self, shop: Shop, operator: Person) -> None:
        for kind, (deviation, tool) in {"large": (12.5, 4), "worn": (350.0, 6), "fault": (1200.0, 8)}.items():
            shop.add(f"{shop.characteristic}-{kind}", tool_memory=tool, average_memory=tool)
            shop.read(deviation, f"{shop.characteristic}-{kind}")
        for path in (f"/alarms?machine={shop.machine}", f"/todo?machine={shop.machine}"):
            text = operator.open(path)
            places = [text.index(f"Seat {shop.characteristic}-{kind}") for kind in ("fault", "worn", "large")]
            assert places == sorted(places), path
        text = operator.open(f"/station/{shop.machine}")
        assert text.index("Probe fault</h2>") < text.index("Tool worn</h2>")
        assert "1 more alarm<" in text

    def test_an_alarm_is_acknowledged_in_the_name_of_who_is_signed_in(self, shop: Shop, operator: Person) -> None:
        shop.read(12.0)
        alarm = shop.alarms()[0]["id"]
        here = f"/station/{shop.machine}"
        assert f"{here}/alarms/{alarm}?action=noted" in operator.open(here)
        assert "Nothing else changes." in operator.open(f"{here}/alarms/{alarm}?action=noted")
        text = operator.send(f"{here}/alarms/{alarm}", action="noted", comment="Seen")
        assert f"Oversize: Noted, {operator.name}." in text
        assert shop.alarms() == []

    def test_who_comes_second_learns_who_was_first(self, shop: Shop, operator: Person) -> None:
        shop.read(12.0)
        alarm = shop.alarms()[0]["id"]
        shop.acknowledge(alarm, "noted")
        here = f"/station/{shop.machine}/alarms/{alarm}"
        assert "Already acknowledged by another user" in operator.send(here, action="tool_replaced", comment="New")
        assert "Already acknowledged by another user" in operator.open(f"{here}?action=noted")

    def test_what_is_missing_is_asked_again(self, shop: Shop, operator: Person) -> None:
        shop.read(12.0)
        alarm = shop.alarms()[0]["id"]
        here = f"/station/{shop.machine}/alarms/{alarm}"
        text = operator.send(here, 422, action="measured_by_hand", comment="Micrometer")
        assert "say the size in mm" in text
        assert f'action="{here}"' in text
        assert len(shop.alarms()) == 1

    def test_a_tool_is_changed(self, shop: Shop, operator: Person) -> None:
        shop.read(6.0)
        here = f"/station/{shop.machine}/tools/3/change"
        assert "Was tool 3 changed?" in operator.open(here)
        assert "Offset" in operator.send(here, 422, offset="wide", reason="New insert")
        assert "Tool 3 starts a new life" in operator.send(here, offset="0,01", reason="New insert")
        assert shop.tool()["offset"] == 0.01

    def test_a_viewer_looks_and_no_more(self, shop: Shop, viewer: Person) -> None:
        shop.read(12.0)
        alarm = shop.alarms()[0]["id"]
        here = f"/station/{shop.machine}"
        text = viewer.open(here)
        assert "Acknowledging an alarm requires the Operator role" in text
        assert "data-confirm" not in text
        viewer.open(f"{here}/alarms/{alarm}?action=noted", 403)
        viewer.send(f"{here}/alarms/{alarm}", 403, action="noted", comment="Seen")
        viewer.send(f"{here}/tools/3/change", 403, offset="0", reason="New")

    def test_what_is_not_of_this_machine_is_not_there(self, shop: Shop, operator: Person) -> None:
        other = Shop(shop.server)
        shop.read(12.0)
        alarm = shop.alarms()[0]["id"]
        operator.open(f"/station/{other.machine}/alarms/{alarm}?action=noted", 404)
        operator.send(f"/station/{other.machine}/alarms/{alarm}", 404, action="noted", comment="Seen")
        operator.open(f"/station/{shop.machine}/alarms/{alarm}?action=dance", 404)
        operator.open("/station/nowhere", 404)
        assert len(shop.alarms()) == 1


@pytest.mark.parametrize(
    ("size", "deviation"),
    [
        pytest.param(UPRIGHT, 1234.5, id="upright, long"),
        pytest.param(ACROSS, -12.5, id="across, short"),
        pytest.param(UPRIGHT, -12.5, id="upright, short", marks=pytest.mark.long),
        pytest.param(ACROSS, 1234.5, id="across, long", marks=pytest.mark.long),
    ],
)
def test_it_is_read_from_two_metres(page: Page, shop: Shop, operator: Person, size: Any, deviation: float) -> None:
    """On ten inches 60 px are letters of 7 mm."""
    page.set_viewport_size(size)
    shop.add(f"{shop.characteristic}-calm", tool_memory=4)
    shop.read(deviation)
    operator.sign_in(page)
    page.goto(f"/station/{shop.machine}")
    for part, least in (
        (".station-deviation .value", 120),
        (".station-now .badge", 59),
        (".station-action", 59),
        (".station-alarm h2", 59),
    ):
        page.wait_for_function(LETTERS, arg=[part, least])
    assert boxes(page, ".station-deviation .value")[0]["right"] <= size["width"]
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    assert boxes(page, ".station-alarm")[0]["top"] < size["height"] * 0.75  # seen without scrolling
    assert min(box["height"] for box in boxes(page, ".actions .button")) >= 64


@pytest.mark.parametrize("size", [ACROSS, pytest.param(UPRIGHT, marks=pytest.mark.long)], ids=["across", "upright"])
def test_alarms_and_corrections_that_wait_stand_one_below_the_other(
    page: Page, shop: Shop, operator: Person, size: Any
) -> None:
    page.set_viewport_size(size)
    shop.add(f"{shop.characteristic}-asked", tool_memory=4, mode="approval")
    shop.read(6.0, f"{shop.characteristic}-asked")
    shop.read(12.5)
    operator.sign_in(page)
    page.goto(f"/station/{shop.machine}")
    alarm, correction = boxes(page, ".station-alarm")
    assert alarm["bottom"] <= correction["top"]


def test_by_touch_live_with_two_touches(page: Page, shop: Shop, operator: Person) -> None:
    page.set_viewport_size(UPRIGHT)
    operator.sign_in(page)
    page.goto(f"/station/{shop.machine}")
    expect(page.locator("live-status")).to_have_attribute("state", "live")
    shop.read(12.5)
    expect(page.locator(".station-deviation")).to_contain_text("+12.5")
    expect(page.locator(".station-alarm h2")).to_contain_text("Oversize")
    page.get_by_role("link", name="Noted").click()
    page.get_by_role("dialog").get_by_role("button", name="Noted").click()
    expect(page.get_by_role("status").filter(has_text="Oversize: Noted")).to_be_visible()
    assert shop.alarms("acknowledged")[0]["acknowledged_by"] == operator.name


def test_nothing_moves_under_a_finger_and_news_is_announced(page: Page, shop: Shop, operator: Person) -> None:
    """A more urgent alarm comes while a hand is at the list: it is announced, and shown at a touch."""
    page.set_viewport_size(UPRIGHT)
    shop.read(12.5)
    operator.sign_in(page)
    page.goto(f"/station/{shop.machine}")
    expect(page.locator("live-status")).to_have_attribute("state", "live")
    page.evaluate(
        """() => {
          const part = document.getElementById("station");
          window.hand = setInterval(() => part.dispatchEvent(new PointerEvent("pointermove", { bubbles: true })), 100);
        }"""
    )
    other = shop.another("worn", tool_memory=4, average_memory=6)
    shop.read(350.0, other)
    news = page.get_by_role("status").filter(has_text="1 new")
    expect(news).to_be_visible()
    expect(page.locator(".station-alarm h2")).to_have_text(["Oversize"])
    news.get_by_role("button").click()
    expect(page.locator(".station-alarm h2")).to_have_text(["Tool worn", "Oversize"])
    page.evaluate("clearInterval(window.hand)")


def test_it_says_plainly_that_live_data_is_lost(
    page: Page, shop: Shop, operator: Person, complaints: list[str]
) -> None:
    page.set_viewport_size(UPRIGHT)
    shop.read(0.4)
    operator.sign_in(page)
    page.route("**/station/*/events*", lambda route: route.abort())
    page.goto(f"/station/{shop.machine}")
    status = page.locator("live-status")
    expect(status).to_contain_text("No connection")
    page.wait_for_function(LETTERS, arg=["live-status", 24])
    expect(page.locator(".station-now").get_by_text("Old data")).to_be_visible()
    expect(page.locator(".station-now").get_by_text("In band")).to_be_hidden()
    page.unroute("**/station/*/events*")
    expect(status).to_have_attribute("state", "live")
    complaints.clear()  # the browser notes every attempt that failed


@pytest.mark.long
def test_sound_and_title_when_an_alarm_comes(page: Page, shop: Shop, operator: Person) -> None:
    operator.sign_in(page)
    page.add_init_script(TONES)
    page.goto(f"/station/{shop.machine}")
    expect(page.locator("live-status")).to_have_attribute("state", "live")
    expect(page).to_have_title(re.compile(r"^Lathe"))
    switch = page.get_by_role("button", name="Sound at an alarm")
    expect(switch).to_have_attribute("aria-pressed", "false")
    switch.click()
    expect(switch).to_have_text("Sound on")
    expect(page.locator("html")).to_have_attribute("data-tones", "1")  # so that the person knows it
    page.evaluate("localStorage.removeItem('inband_alarm_sounded')")
    shop.read(12.0)
    expect(page.locator("html")).to_have_attribute("data-tones", "2")
    expect(page).to_have_title(re.compile(r"^\(1\) Lathe"))
    page.goto("/alarms")
    expect(page).to_have_title(re.compile(r"^\([1-9]\d*\) Alarms"))
    expect(page.get_by_role("button", name="Sound at an alarm")).to_have_attribute("aria-pressed", "true")
