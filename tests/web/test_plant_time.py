"""Times on a page, on a chart, in a sentence and in a file are of one zone, the plant's, and it is named."""

import csv
import io
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any
from zoneinfo import ZoneInfo

import openpyxl
import pytest
from playwright.sync_api import Page, expect

from app.language.times import in_zone
from app.loop.readings import exporting
from app.loop.readings import queries as readings
from app.web.period import field, usual_periods
from tests.conftest import RunServer, Server
from tests.shop import Person, Shop

# 02:30 is there twice in Berlin that night.
NIGHT = ("2026-10-25T00:30:00Z", "2026-10-25T01:30:00Z", "2026-10-25T02:30:00Z")


@pytest.fixture(scope="module")
def server(run_server: RunServer) -> Iterator[Server]:
    """A plant in Berlin."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("INBAND_TIMEZONE", "Europe/Berlin")
        with run_server() as running:
            yield running


@pytest.fixture(scope="module")
def berlin(server: Server) -> Shop:
    """A characteristic with the readings of that night, to look at only."""
    made = Shop(server)
    for number, at in enumerate(NIGHT):
        made.read(0.1 + number, measured_at=at)
    return made


def path(berlin: Shop, more: str = "") -> str:
    return f"/api/v1/characteristics/{berlin.characteristic}{more}"


def test_pages_write_the_plants_time_and_name_its_zone(berlin: Shop, viewer: Person) -> None:
    page = viewer.open(f"/characteristics/{berlin.characteristic}")
    assert "Times of Europe/Berlin" in page
    for text in ("25 Oct 2026 02:30:00 UTC+02:00<", "25 Oct 2026 02:30:00 UTC+01:00<", "25 Oct 2026 03:30:00<"):
        assert text in page
    assert "UTC<" not in page


def test_charts_have_the_same_time_in_tooltip_and_on_the_axis(berlin: Shop) -> None:
    zones = berlin.admin.get(path(berlin, "/figures/zones")).json()
    texts = next(trace for trace in zones["data"] if trace.get("meta") == "readings")["text"]
    assert texts[2].endswith("2026-10-25 03:30:00 Europe/Berlin")
    assert texts[1].endswith("2026-10-25 02:30:00 UTC+01:00 Europe/Berlin")
    over_time = berlin.admin.get(path(berlin, "/figures/run")).json()
    (run,) = [trace for trace in over_time["data"] if trace.get("meta") == "run"]
    assert run["x"] == ["2026-10-25T02:30:00+02:00", "2026-10-25T02:30:00+01:00", "2026-10-25T03:30:00+01:00"]
    assert over_time["layout"]["xaxis"]["title"]["text"] == "Europe/Berlin"


def test_json_keeps_rfc_3339(berlin: Shop) -> None:
    assert berlin.call("GET", f"/readings/{berlin.characteristic}/3")["measured_at"] == "2026-10-25T02:30:00Z"


def test_reports_in_all_renderings(berlin: Shop, viewer: Person) -> None:
    page = viewer.open(f"/characteristics/{berlin.characteristic}/report?last=all")
    assert "times are those of Europe/Berlin" in page
    assert len(re.findall(r"report\.(?:pdf|xlsx|csv|json)\?[^\"]*timezone=Europe%2FBerlin", page)) >= 3
    rows = list(csv.DictReader(io.StringIO(berlin.admin.get(path(berlin, "/report.csv")).text.removeprefix("\ufeff"))))
    assert [row["text"] for row in rows if row["key"] == "timezone"] == ["Europe/Berlin"]
    measured = [row["value"] for row in rows if (row["section"], row["key"]) == ("decisions", "measured_at")]
    assert measured == ["2026-10-25T03:30:00+01:00", "2026-10-25T02:30:00+01:00", "2026-10-25T02:30:00+02:00"]
    book = openpyxl.load_workbook(io.BytesIO(berlin.admin.get(path(berlin, "/report.xlsx")).content))
    cells = [str(cell.value) for sheet in book for line in sheet.iter_rows() for cell in line]
    assert "Measured at, Europe/Berlin" in cells
    assert "2026-10-25 02:30:00 UTC+02:00" in cells
    assert "2026-10-25 03:30:00" in cells
    assert berlin.admin.get(path(berlin, "/report.json")).json()["timezone"] == "Europe/Berlin"


def test_exports_have_local_time_with_its_offset(berlin: Shop) -> None:
    with berlin.server.database.begin() as session, in_zone(ZoneInfo("Asia/Kathmandu")):
        entry = readings.entry_of(session, berlin.characteristic)
        assert entry is not None
        file = io.StringIO()
        exporting.write_csv(exporting.rows(session, entry), file)
    assert [row["measured_at"] for row in csv.DictReader(io.StringIO(file.getvalue()))] == [
        "2026-10-25T06:15:00+05:45",
        "2026-10-25T07:15:00+05:45",
        "2026-10-25T08:15:00+05:45",
    ]


@pytest.mark.parametrize(
    ("begin", "end", "count"),
    [
        ("2026-10-25 02:30", "2026-10-25 02:30", 2),  # an end that is there twice means the later one
        ("2026-10-25 03:00", "2026-10-25 04:00", 1),
        ("2026-10-25T00:30Z", "2026-10-25T00:30Z", 1),
    ],
)
def test_periods_are_typed_in_plant_time(berlin: Shop, viewer: Person, begin: str, end: str, count: int) -> None:
    query = f"from={begin}&to={end}".replace(" ", "+")
    report = viewer.open(f"/characteristics/{berlin.characteristic}/report?{query}&section=decisions")
    assert len(set(re.findall(r"2026-10-25 0\d:30:00(?: UTC\+0\d:00)?</td>", report))) == count
    assert "The period was not understood" not in viewer.open(
        f"/characteristics/{berlin.characteristic}/capability?{query}"
    )


def test_the_pages_of_charts_take_a_period_of_the_plants_clock(berlin: Shop, viewer: Person) -> None:
    about = f"/characteristics/{berlin.characteristic}"
    query = "?from=2026-10-25T03:00&to=2026-10-25T04:00"
    assert "from=2026-10-25T03%3A00%3A00%2B01%3A00" in viewer.open(about + query)
    assert "from=2026-10-25T03%3A00%3A00%2B01%3A00" in viewer.open(f"{about}/control{query}")


def test_usual_periods_begin_by_the_plants_clock() -> None:
    with in_zone(ZoneInfo("Europe/Berlin")):
        at = datetime(2026, 10, 26, 4, 30, tzinfo=UTC)  # Monday, 05:30; the clocks went back on Sunday
        periods = {period.name: (field(period.start), field(period.end)) for period in usual_periods(at, at)}
    assert periods == {
        "This shift": ("2026-10-25T22:00", ""),
        "Today": ("2026-10-26T00:00", ""),
        "Yesterday": ("2026-10-25T00:00", "2026-10-26T00:00"),
        "This tool": ("2026-10-26T05:30", ""),
        "This week": ("2026-10-26T00:00", ""),
        "Last week": ("2026-10-19T00:00", "2026-10-26T00:00"),
    }
    assert field("25.10.2026 06:00:01.0004", end=True) == "2026-10-25T06:00:01.001"
    assert field("soon") == ""


def test_a_period_is_picked_with_one_press(berlin: Shop, viewer: Person, page: Page) -> None:
    about = f"/characteristics/{berlin.characteristic}"
    viewer.sign_in(page)
    page.goto(f"{about}?scale=true")
    picker = page.locator(".period-picker")
    picker.locator("summary").click()
    picker.get_by_role("link", name="Yesterday").click()
    page.wait_for_url("**scale=true&from=*")
    picker.locator("summary").click()
    picker.get_by_label("From").fill("2026-10-25T03:00")
    picker.get_by_label("To").fill("2026-10-25T04:00")
    picker.get_by_role("button", name="Show").click()
    expect(picker.locator("summary")).to_have_text("25 Oct 2026 03:00 – 25 Oct 2026 04:00")
    assert "scale=true" in page.url
    page.goto(f"{about}/report?last=200")
    page.get_by_role("button", name="Last week").click()
    expect(page.locator("input[name=to]")).to_have_value(re.compile(r"T00:00$"))
    expect(page.get_by_label("Number of last readings")).to_have_value("")


@pytest.mark.parametrize("where", ["report", "capability", "what-if"])
def test_an_hour_that_is_missing_is_refused(berlin: Shop, engineer: Person, where: str) -> None:
    page = engineer.open(f"/characteristics/{berlin.characteristic}/{where}?from=2026-03-29+02:30", 422)
    assert 'value="2026-03-29T02:30"' in page


def test_who_was_first_is_told_in_plant_time(shop: Shop) -> None:
    shop.read(0.1)
    shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", reason="chip")
    problem: Any = shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", 409, reason="chip")
    assert re.search(r"on \d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+0[12]:00:", problem["detail"])


def test_a_browser_elsewhere_shows_the_plants_time_too(
    berlin: Shop, server: Server, viewer: Person, browser: Any
) -> None:
    context = browser.new_context(base_url=server.url, timezone_id="America/New_York", locale="en-GB")
    page: Page = context.new_page()
    viewer.sign_in(page)
    page.goto(f"/characteristics/{berlin.characteristic}?scale=time")
    page.wait_for_selector("plotly-chart.zones .xtick")
    expect(page.locator("main")).to_contain_text("25 Oct 2026 03:30:00")
    ticks = page.locator("plotly-chart.zones .xtick").all_text_contents()
    assert any(re.match(r"0[23]:", tick) for tick in ticks), ticks
    context.close()


def test_a_usual_period_is_chosen_without_script_too(berlin: Shop, viewer: Person) -> None:
    def yesterday() -> dict[str, str]:
        with in_zone(ZoneInfo("Europe/Berlin")):
            period = next(period for period in usual_periods() if period.key == "yesterday")
            return {"from": field(period.start), "to": field(period.end)}

    about, days = f"/characteristics/{berlin.characteristic}", [yesterday()]
    assert '<option value="yesterday">Yesterday</option>' in viewer.open(f"{about}/report")
    for text in (
        viewer.open(f"{about}/report?preset=yesterday&last=5&from=&to="),
        viewer.open(f"{about}/what-if?preset=yesterday&last=1000"),
        viewer.send("/reports", 422, characteristic=berlin.characteristic, preset="yesterday", format="clay"),
    ):
        days.append(yesterday())  # another one, if it was midnight in between
        shown = {name: re.findall(rf'name="{name}"[^>]*value="([^"]*)"', text) for name in ("from", "to")}
        assert any(all(day[name] in shown[name] for name in day) for day in days), shown
