"""The ranking of the whole plant, over REST."""

import re
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.shop import Person, Shop

SPREAD = ((1 + 0.3**2 + 1.4**2 + 0.6**2) / 4 * 24 / 23) ** 0.5


@pytest.fixture(scope="module")
def ranking(common_shop: Shop) -> Shop:
    """Four that were measured; the first characteristic is left without readings."""
    shop = common_shop
    step = (1.0, -1.0, 0.3, -0.3, 1.4, -1.4, 0.6, -0.6)
    for key, scale, shift in (("wide", 5.0, 0.0), ("narrow", 1.5, 0.0), ("broken", 0.0, 0.0), ("equal", 0.0, 1.0)):
        shop.add(f"{shop.machine}-{key}", tool_memory=0, average_memory=0)
        shop.push([scale * step[at % 8] + shift for at in range(24)], f"{shop.machine}-{key}")
    shop.read(1500.0, f"{shop.machine}-narrow")  # a probe fault is not a size of a part
    narrow = f"{shop.machine}-narrow"
    alarm = shop.call("GET", f"/alarms?state=active&machine={shop.machine}")["items"][0]["id"]
    shop.call("POST", f"/alarms/{alarm}/acknowledge", action="false_reading", comment="dirt")
    shop.read(9.0, narrow)
    shop.call("POST", f"/readings/{narrow}/26/exclude", reason="chip under the stylus")
    shop.read(12.0, f"{shop.machine}-broken")
    return shop


def ranked(shop: Shop, **query: Any) -> list[dict[str, Any]]:
    query = {"machine": shop.machine} | query
    asked = "&".join(f"{name}={value}" for name, value in query.items())
    items: list[dict[str, Any]] = shop.call("GET", f"/overview?{asked}")["items"]
    return [item | {"key": item["characteristic"].removeprefix(f"{shop.machine}-")} for item in items]


def test_the_part_that_is_out_of_tolerance_comes_first_and_says_why(ranking: Shop) -> None:
    found = ranked(ranking)
    assert len(found) == 5
    assert [item["key"] for item in found] == ["broken", "narrow", "wide", "equal", ranking.characteristic]
    broken, narrow, wide, *calm = ([reason["code"] for reason in item["reasons"]] for item in found)
    assert broken == ["outside", "alarm"], "24 equal readings and one out of tolerance carry no Ppk"
    assert narrow == ["alarm", "loud"], "two alarms within one shift; what is excluded calls no part oversize"
    assert wide == ["not_capable"]
    assert calm == [[], []]
    assert found[0]["reasons"][0]["text"] == "Oversize"
    assert found[0]["alarms_per_shift"] == pytest.approx(1.0)


def test_the_alarm_load_is_that_of_the_days_in_which_the_parts_were_measured(shop: Shop) -> None:
    now = datetime.now(UTC)
    for days in (30, 20, 10, 2, 1):  # a machine hands in what it kept while it was offline
        shop.read(9.0, measured_at=(now - timedelta(days=days)).isoformat())
        alarm = shop.alarms()[0]["id"]
        shop.acknowledge(alarm, "keep_cutting")
    (item,) = ranked(shop)
    assert item["alarms_per_shift"] == pytest.approx(2 / 21, abs=1e-3)


def test_ppk_learns_what_counts(ranking: Shop) -> None:
    by_key = {item["key"]: item for item in ranked(ranking)}
    assert by_key["wide"]["ppk"] == pytest.approx(8 / 3 / (5.0 * SPREAD), rel=1e-4)
    assert by_key["wide"]["readings"] == 24
    assert "not_capable" in [reason["code"] for reason in by_key["wide"]["reasons"]]
    # The probe fault and the excluded reading are left out.
    assert by_key["narrow"]["readings"] == 24
    assert by_key["narrow"]["ppk"] == pytest.approx(8 / 3 / (1.5 * SPREAD), rel=1e-4)
    # Equal ones have no spread; nothing was measured here at all.
    assert (by_key["equal"]["readings"], by_key["equal"]["ppk"]) == (24, None)
    assert by_key[ranking.characteristic]["ppk"] is None


def test_it_can_be_ranked_by_one_number_and_read_page_by_page(ranking: Shop) -> None:
    by_ppk = ranked(ranking, by="ppk")
    known = [item["ppk"] for item in by_ppk if item["ppk"] is not None]
    assert known == sorted(known)
    assert [item["ppk"] for item in by_ppk[len(known) :]] == [None] * (5 - len(known))
    first = ranking.call("GET", f"/overview?machine={ranking.machine}&by=ppk&limit=3")
    rest = ranking.call("GET", f"/overview?machine={ranking.machine}&by=ppk&limit=3&after={first['next']}")
    assert rest["next"] is None
    assert [item["characteristic"] for item in first["items"] + rest["items"]] == [
        item["characteristic"] for item in by_ppk
    ]


def test_every_column_sorts_either_way_and_what_has_no_value_stays_at_the_end(ranking: Shop) -> None:
    best = [item["ppk"] for item in ranked(ranking, by="ppk", reverse="true")]
    known = [value for value in best if value is not None]
    assert known == sorted(known, reverse=True)
    assert best[len(known) :] == [None] * (5 - len(known))
    names = [item["name"].casefold() for item in ranked(ranking, by="name")]
    assert names == sorted(names)
    assert [item["key"] for item in ranked(ranking, by="last")][-1] == ranking.characteristic, "never measured"
    assert ranked(ranking, reverse="true")[-1]["key"] == "broken"
    assert ranked(ranking, by="alarms")[0]["key"] == "narrow"


def test_a_line_of_the_page_has_pictures_and_its_words_on_demand(ranking: Shop, viewer: Person) -> None:
    opened = viewer.open(f"/overview?machine={ranking.machine}")
    (line,) = re.findall(rf'<tr id="c-{ranking.machine}-wide".*?</tr>', opened, re.DOTALL)
    assert line.count('class="interval') == 1
    assert line.count('class="sparkline"') == 1
    assert "Not capable" in line
    assert line.index("24 readings, 1 to 24") > line.index(" popover "), (
        "the window of the index is in the words, not in the line"
    )
    order = re.findall(r'<tr id="c-([^"]+)"', viewer.open(f"/overview?machine={ranking.machine}&by=ppk&reverse=true"))
    assert order == [item["characteristic"] for item in ranked(ranking, by="ppk", reverse="true")]


def test_the_characteristics_of_a_part_show_the_tolerance_they_use(ranking: Shop, viewer: Person) -> None:
    ranking.call("PATCH", f"/characteristics/{ranking.machine}-wide", part=f"Ring {ranking.machine}")
    opened = viewer.open(f"/overview?part=Ring%20{ranking.machine}")
    assert re.findall(r'<tr id="c-([^"]+)"', opened) == [f"{ranking.machine}-wide"]
    assert (
        "The last 24 deviations lie between −7.0 µm and +7.0 µm; the tolerance is ±8 µm about the target"
        in opened.replace("\xa0", " ")
    )
    assert "No characteristic belongs to the part" in viewer.open("/overview?part=Ring%208")


@pytest.mark.browser
def test_thirty_lines_are_on_a_screen_and_words_open_by_touch(ranking: Shop, viewer: Person, page: Page) -> None:
    viewer.sign_in(page)
    page.set_viewport_size({"width": 1280, "height": 800})
    page.goto(f"/overview?machine={ranking.machine}")
    rows = page.locator(".ranking tbody tr")
    expect(rows).to_have_count(5)
    top, height = page.evaluate(
        "() => { const rows = [...document.querySelectorAll('.ranking tbody tr')].map(row => row.getBoundingClientRect());"
        " return [rows[0].top, Math.max(...rows.map(row => row.height))]; }"
    )
    assert top + 30 * height <= 800, (top, height)
    words = page.locator(f"#why-{ranking.machine}-wide")
    expect(words).to_be_hidden()
    page.locator(f"#c-{ranking.machine}-wide .why > button").click()
    expect(words).to_be_visible()
    expect(words).to_contain_text("24 readings, 1 to 24")
    page.keyboard.press("Escape")
    expect(words).to_be_hidden()


def test_a_machine_that_is_not_there_is_404(ranking: Shop) -> None:
    ranking.call("GET", "/overview?machine=nowhere", 404)
    ranking.call("GET", "/overview?by=beauty", 422)
