"""The measuring sheet: sizes that a person types, with the decision of any reading, marked by hand, stored once."""

import html
import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.shop import Person, Shop

NUMBER = "00112233445566aa"


class Sheet:
    """Somebody at the sheet of a machine."""

    def __init__(self, shop: Shop, person: Person) -> None:
        self.shop, self.person, self.here = shop, person, f"/station/{shop.machine}/sizes"

    def send(
        self, status: int = 200, key: str = NUMBER, sizes: dict[str, str] | None = None, sure: str = "", **fields: str
    ) -> str:
        """Send sizes by characteristic; sure: what was typed and is confirmed."""
        named = {f"size:{name}": text for name, text in (sizes or {}).items()}
        confirmed = {f"sure:{name}": sure for name in named if sure}
        return html.unescape(self.person.send(self.here, status, **{"key": key, **named, **confirmed, **fields}))

    def readings(self, characteristic: str | None = None) -> list[Any]:
        found: list[Any] = self.shop.call(
            "GET", f"/readings?characteristic={characteristic or self.shop.characteristic}"
        )["items"]
        return found


@pytest.fixture
def sheet(shop: Shop, operator: Person) -> Sheet:
    return Sheet(shop, operator)


def test_a_size_is_decided_as_a_reading_and_marked_by_hand(sheet: Sheet, operator: Person) -> None:
    shop, name = sheet.shop, sheet.shop.characteristic
    shop.call("PUT", f"/characteristics/{name}/control-plan", every=5, reason="Agreed")
    said = sheet.send(sizes={name: "40,006"}, part="SN-7", order="A-77", gauge="Micrometer 4")
    assert "Measure next: part 5 from here." in said
    assert "Stored, measured by hand" in said
    assert "Mark applied" in said
    stored = shop.call("GET", f"/readings/{name}/1")
    assert (stored["measured"], stored["zone"], stored["part"]) == (40.006, "full", "SN-7")
    assert stored["correction"]["amount"] == -0.006
    said_of_it = {field: value for field, value in stored["context"].items() if value is not None}
    assert said_of_it == {"order": "A-77", "operator": operator.name, "gauge": "Micrometer 4", "by_hand": True}
    assert "by hand" in operator.open(f"/characteristics/{name}/readings/1")
    entry = next(e for e in shop.call("GET", "/audit?limit=20")["items"] if e["action"] == "sizes entered by hand")
    assert (entry["actor"], entry["after"]) == (operator.name, {name: 40.006})


def test_what_the_probe_reads_too_much_is_not_taken_off_a_gauges_size(sheet: Sheet) -> None:
    """The probe reads 12 µm too much. A part of 40.000 by the micrometer is right and must not be cut 12 µm larger."""
    shop, name = sheet.shop, sheet.shop.characteristic
    shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.012, reason="compared")
    assert shop.read(12.0)["deviation"] == 0.0
    assert shop.read(0.0, context={"by_hand": True})["deviation"] == 0.0
    sheet.send(sizes={name: "40.0000"})
    by_hand = sheet.readings()[-1]
    assert (by_hand["deviation"], by_hand["action"], by_hand["correction"]) == (0.0, "none", None)


def test_several_sizes_of_a_part_are_stored_together_or_not_at_all(sheet: Sheet) -> None:
    shop, name = sheet.shop, sheet.shop.characteristic
    other = shop.another("bore", tool_memory=4, average_memory=6)
    assert "not a size" in sheet.send(422, sizes={name: "40.001", other: "SN-12"})
    assert "This sheet has no number" in sheet.send(422, key="mine", sizes={name: "40.001"})
    assert "Type a size first" in sheet.send(422)
    assert sheet.readings() == sheet.readings(other) == []
    sheet.send(sizes={name: "40.001", other: "−0"} | {other: "39.9995"})
    assert [sheet.readings(each)[0]["measured"] for each in (name, other)] == [40.001, 39.9995]


def test_a_slip_of_the_finger_is_asked_about_before_a_machine_gets_it(sheet: Sheet) -> None:
    name = sheet.shop.characteristic
    asked = sheet.send(422, sizes={name: "42.05"})
    assert "42.05 mm is 2.05\xa0mm above the target 40 mm. Really?" in asked
    assert "looks like inches" in sheet.send(422, sizes={name: "1.5748"})
    assert "20\xa0µm below" in sheet.send(422, sizes={name: "39.98"}, sure="42.05")
    assert sheet.readings() == []
    sheet.send(sizes={name: "39,98"}, sure="39,98")
    assert [each["zone"] for each in sheet.readings()] == ["undersize"]


def test_sent_twice_it_is_stored_once(sheet: Sheet) -> None:
    name = sheet.shop.characteristic
    for _time in range(2):
        assert "Stored, measured by hand" in sheet.send(sizes={name: "40.006"})
    assert len(sheet.readings()) == 1
    assert "stored before, with another size" in sheet.send(409, sizes={name: "40.007"})
    assert len(sheet.readings()) == 1
    assert len(sheet.shop.call("GET", f"/machines/{sheet.shop.machine}/corrections")["items"]) == 1


def test_corrections_since_the_part_was_cut_are_not_made_twice(sheet: Sheet) -> None:
    """The part on the bench is one of those before the correction: it shows +6 µm that are gone already."""
    shop, name = sheet.shop, sheet.shop.characteristic
    number = shop.read(6.0)["correction"]["number"]
    shop.correction(number, "applied")
    assert "choose when the part was cut" in sheet.send(422, sizes={name: "40.006"}).lower()
    sheet.send(sizes={name: "40.006"}, cut=str(number))
    before = sheet.readings()[-1]
    assert (before["decided_deviation"], before["outstanding"], before["correction"]) == (0.0, [number], None)
    sheet.send(sizes={name: "40.006"}, cut="now", key="ff" * 8)
    assert sheet.readings()[-1]["correction"]["amount"] == -0.006


def test_a_correction_is_entered_at_the_control_and_confirmed_at_the_station(sheet: Sheet, operator: Person) -> None:
    sheet.send(sizes={sheet.shop.characteristic: "40.006"})
    where = f"/station/{sheet.shop.machine}/corrections/1"
    assert "Is correction 1 in the control?" in operator.open(f"{where}?do=applied")
    assert "Correction 1 is applied" in operator.send(where, do="applied")
    assert sheet.shop.tool()["offset"] == -0.006


def test_sections_are_typed_each_and_judged_together(sheet: Sheet) -> None:
    name = sheet.shop.another("bore", tool_memory=4, average_memory=0, points=3, accept={"n": 2, "m": 3})
    sizes = {f"{name}:{n}": size for n, size in enumerate(("40.001", "40.002", "40.003"), 1)}
    assert "all 3 sections are needed" in sheet.send(422, sizes={f"{name}:1": "40.001"}).lower()
    sheet.send(sizes=sizes)
    assert sheet.readings(name)[0]["measured"] == 40.002


def test_a_viewer_types_nothing(sheet: Sheet, viewer: Person) -> None:
    viewer.open(sheet.here, 403)
    viewer.send(sheet.here, 403, **{"key": NUMBER, f"size:{sheet.shop.characteristic}": "40.001"})
    assert sheet.readings() == []


def test_one_drawing_at_a_time_in_its_order(sheet: Sheet, operator: Person) -> None:
    shop = sheet.shop
    for key, part in (("z", "flange"), ("a", "flange"), ("b", "cover")):
        body: dict[str, Any] = {
            "key": f"{shop.characteristic}-{key}",
            "name": f"Size {key}",
            "machine": shop.machine,
            "part": part,
        }
        parameters = shop.call("GET", f"/characteristics/{shop.characteristic}")["parameters"]
        shop.call("POST", "/characteristics", 201, **body, parameters=parameters)
    text = operator.open(f"{sheet.here}?of=flange")
    assert re.findall(rf'name="size:{shop.characteristic}-(\w)"', text) == ["z", "a"]
    text = operator.open(f"{sheet.here}?characteristic={shop.characteristic}-b")
    assert re.findall(rf'name="size:{shop.characteristic}-(\w)"', text) == ["b"]


class TestByTouch:
    @pytest.fixture
    def screen(self) -> dict[str, Any]:
        return {"viewport": {"width": 800, "height": 1280}, "has_touch": True, "is_mobile": True}

    def test_scanner_gauge_and_big_keys(self, page: Page, shop: Shop, operator: Person) -> None:
        """Scanner and gauge type and end with Enter; the last size is touched digit by digit, and sent from there."""
        other = shop.another("bore", tool_memory=4, average_memory=6)
        operator.sign_in(page)
        page.goto(f"/station/{shop.machine}/sizes")
        expect(page.get_by_label("Part")).to_be_focused()
        for typed in ("SN-812", "A-77", "Micrometer 4", "+040.0012"):
            page.keyboard.type(typed)
            page.keyboard.press("Enter")
        last = page.locator(f'[id="size:{other}"]')
        expect(last).to_be_focused()
        page.keyboard.type("SN-813")  # a scan that came too late is not a size
        page.keyboard.press("Enter")
        expect(last).to_have_attribute("aria-invalid", "true")
        last.fill("")
        for digit in "39.9985":
            page.locator(".number-keys").get_by_role("button", name="Decimal point" if digit == "." else digit).tap()
        expect(page.locator(f'output[for="size:{other}"]')).to_have_text("−1.5 µm")
        page.get_by_role("button", name="Next").tap()
        expect(page.get_by_role("status").filter(has_text="Stored, measured by hand")).to_contain_text("39.9985")
        stored = shop.call("GET", f"/readings/{shop.characteristic}/1")
        assert (stored["measured"], stored["part"], stored["context"]["gauge"]) == (40.0012, "SN-812", "Micrometer 4")
        assert shop.call("GET", f"/readings/{other}/1")["measured"] == 39.9985
        expect(page.get_by_label("Gauge")).to_have_value("Micrometer 4")
        expect(page.get_by_label("Part")).to_have_value("")


def test_what_the_control_plan_requires_is_scanned_before_a_size_is_stored(sheet: Sheet, operator: Person) -> None:
    shop, name = sheet.shop, sheet.shop.characteristic
    shop.call("PUT", f"/characteristics/{name}/control-plan", required_context=["order", "nest"], reason="Agreed")
    assert "control plan requires it" in sheet.send(422, sizes={name: "40.001"}, order="A-1")
    assert "whole number" in sheet.send(422, sizes={name: "40.001"}, order="A-1", nest="two")
    assert shop.call("GET", f"/readings?characteristic={name}")["items"] == []
    stored = sheet.send(sizes={name: "40.001"}, order="A-1", nest="2", batch="C 7")
    assert 'name="batch" type="text"\n  value="C 7"' in stored, "the next part is most likely of the same"
    said = {"order": "A-1", "nest": 2, "batch": "C 7", "operator": operator.name, "by_hand": True}
    context = shop.call("GET", f"/readings/{name}/1")["context"]
    assert {field: value for field, value in context.items() if value is not None} == said
