"""Times on a page, on a chart, in a sentence and in a file are of one zone, the plant's, and it is named."""

import csv
import io
import re
from collections.abc import Iterator
from datetime import UTC, date, datetime, time, timedelta
from statistics import fmean
from typing import Any
from urllib.parse import urlencode
from zoneinfo import ZoneInfo

import openpyxl
import pytest
from playwright.sync_api import Page, expect

from app.language.times import in_zone
from app.loop.readings import exporting
from app.loop.readings import queries as readings
from app.views.reports.jobs_schemas import ReportsIn
from app.web.usual_periods import field, usual_periods
from tests.forked import inband
from tests.servers import RunServer, Server
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
    assert texts[2].endswith("25 Oct 2026 03:30:00 Europe/Berlin")
    assert texts[1].endswith("25 Oct 2026 02:30:00 UTC+01:00 Europe/Berlin")
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
    assert "25 Oct 2026 02:30:00 UTC+02:00" in cells
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
        (
            "2026-10-25 02:30",
            "2026-10-25 02:30",
            1,
        ),  # an end that is there twice means the later one, and is not included
        ("2026-10-25 03:00", "2026-10-25 04:00", 1),
        ("2026-10-25T00:30Z", "2026-10-25T00:31Z", 1),
    ],
)
def test_periods_are_typed_in_plant_time(berlin: Shop, viewer: Person, begin: str, end: str, count: int) -> None:
    query = f"from={begin}&to={end}".replace(" ", "+")
    report = viewer.open(f"/characteristics/{berlin.characteristic}/report?{query}&section=decisions")
    assert len(set(re.findall(r"25 Oct 2026 0\d:30:00(?: UTC\+0\d:00)?</td>", report))) == count
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


def test_who_was_first_is_reported_in_plant_time(shop: Shop) -> None:
    shop.read(0.1)
    shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", reason="chip")
    problem: Any = shop.call("POST", f"/readings/{shop.characteristic}/1/exclude", 409, reason="chip")
    assert re.search(r"on \d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+0[12]:00:", problem["detail"])


@pytest.mark.long
def test_a_browser_elsewhere_shows_the_plants_time_too(
    berlin: Shop, server: Server, viewer: Person, browser: Any
) -> None:
    context = browser.new_context(base_url=server.url, timezone_id="America/New_York", locale="en-GB")
    context.set_default_timeout(60_000)
    page: Page = context.new_page()
    viewer.sign_in(page)
    page.goto(f"/characteristics/{berlin.characteristic}?scale=time")
    page.wait_for_selector("plotly-chart.zones .xtick")
    expect(page.locator("main")).to_contain_text("25 Oct 2026 03:30:00")
    expect(page.locator("plotly-chart.zones .xtick").filter(has_text=re.compile(r"^0[23]:")).first).to_be_attached()
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


# --- one meaning of a period at every door

DAYS = ("2026-03-29", "2026-10-25")  # of 23 and of 25 hours


def midnight(day: str, days: int = 0, zone: str = "Europe/Berlin") -> datetime:
    return datetime.combine(date.fromisoformat(day) + timedelta(days), time(), ZoneInfo(zone))


@pytest.fixture(scope="module")
def bordered(server: Server) -> Shop:
    """Readings exactly at both borders of each day, three of one part at its end, and beside them."""
    made, instant = Shop(server), timedelta(microseconds=1)
    moments: list[datetime] = []
    for day in DAYS:
        begin, end = midnight(day).astimezone(UTC), midnight(day, 1).astimezone(UTC)
        hours = [begin + timedelta(hours=hour) for hour in range(int((end - begin) / timedelta(hours=1)))]
        moments += [begin - instant, *hours, end - instant, end, end, end]
    made.push([at % 7 / 10 for at in range(len(moments))], measured_at=[at.isoformat() for at in moments])
    made.call(
        "POST",
        path_of(made, "/baselines"),
        201,
        quantity="deviation",
        first_sequence=1,
        last_sequence=30,
        reason="calm",
    )
    for number in range(1, len(moments) + 1):
        note: dict[str, Any] = {
            "machine": made.machine,
            "characteristic": made.characteristic,
            "sequence": number,
            "text": str(number),
        }
        made.call("POST", "/notes", 201, **note)
    return made


def path_of(made: Shop, more: str) -> str:
    return f"/characteristics/{made.characteristic}{more}"


Found = tuple[int, int, int, float | None]  # count, first, last, mean in µm


def by_number(numbers: list[int], mean: float | None = None) -> Found:
    return len(numbers), min(numbers), max(numbers), mean


def doors(made: Shop, start: str, end: str) -> dict[str, Found]:
    """The answer of each door for one period."""
    key, query = made.characteristic, urlencode({"from": start, "to": end})

    def get(path: str) -> Any:
        return made.call("GET", f"{path}{'&' if '?' in path else '?'}{query}")

    found: dict[str, Found] = {}
    numbers = get(path_of(made, "/statistics"))
    found["statistics"] = (
        numbers["count"],
        numbers["first_sequence"],
        numbers["last_sequence"],
        numbers["mean"] * 1000,
    )
    study = get(path_of(made, "/capability"))
    found["capability"] = (study["readings"], study["first_sequence"], study["last_sequence"], study["mean"] * 1000)
    listed = get(f"/readings?limit=1000&characteristic={key}")["items"]
    found["list"] = by_number([row["sequence"] for row in listed], fmean(row["deviation"] for row in listed) * 1000)
    listed = get(f"/readings?limit=1000&machine={made.machine}")["items"]
    found["list of a machine"] = by_number([row["sequence"] for row in listed])
    chart = get(path_of(made, "/control"))
    found["control"] = by_number(chart["points"]["last"], fmean(chart["points"]["value"]) * 1000)
    assert (chart["first_sequence"], chart["last_sequence"]) == found["control"][1:3]
    found["notes"] = by_number([row["sequence"] for row in get(f"/notes?limit=1000&characteristic={key}")["items"]])
    run = next(trace for trace in get(path_of(made, "/figures/run"))["data"] if trace.get("meta") == "run")
    found["figure"] = len(run["x"]), numbers["first_sequence"], numbers["last_sequence"], (fmean(run["y"]) - 40) * 1000
    lines = list(csv.DictReader(io.StringIO(made.admin.get(f"/api/v1{path_of(made, '/control.csv')}?{query}").text)))
    found["control.csv"] = by_number([int(line["last_reading"]) for line in lines])
    report = get(path_of(made, "/report.json"))
    facts = {fact["key"]: fact for section in report["sections"][:2] for fact in section["facts"]}
    first, last = re.findall(r"readings (\d+) to (\d+)", report["period"])[0]
    found["report"] = facts["count"]["value"], int(first), int(last), facts["mean"]["value"]
    asked: dict[str, Any] = {"from": start, "to": end, "weighting_factor": 3}
    what_if = made.call("POST", path_of(made, "/what-if"), **asked)
    found["what-if"] = what_if["readings"], what_if["first_sequence"], what_if["last_sequence"], None
    file = made.admin.get(f"/api/v1/readings.dfq?characteristic={key}&{query}").text
    values = [float(re.split("[\x0f\x14]", line)[0]) for line in file.split("\r\n") if line[:1].isdigit()]
    found["AQDEF"] = len(values), *found["statistics"][1:3], (fmean(values) - 40) * 1000
    return found


def commands(made: Shop, start: str, end: str) -> dict[str, Found]:
    about = {"INBAND_DATABASE_URL": made.server.database.dsn, "INBAND_TIMEZONE": "Europe/Berlin"}
    period = ("--from", start, "--to", end)
    done = inband("export", "--characteristic", made.characteristic, *period, **about)
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    found = {
        "export": by_number([int(row["sequence"]) for row in rows], fmean(float(r["deviation"]) for r in rows) * 1000)
    }
    first, last = re.findall(r"numbers (\d+) to (\d+)", done.stderr)[0]
    assert (int(first), int(last)) == found["export"][1:3]
    done = inband("report", made.characteristic, *period, "--format", "csv", **about)
    said = {row["key"]: row for row in reversed(list(csv.DictReader(io.StringIO(done.stdout.removeprefix("\ufeff")))))}
    first, last = re.findall(r"readings (\d+) to (\d+)", said["period"]["text"])[0]
    return found | {"report": (int(said["count"]["value"]), int(first), int(last), float(said["mean"]["value"]))}


@pytest.mark.parametrize("day", DAYS)
def test_every_door_means_the_same_period(bordered: Shop, viewer: Person, day: str) -> None:
    """From midnight on, and before the next one: as a day, as moments with an offset; and the next day has the rest."""
    hours = round((midnight(day, 1).astimezone(UTC) - midnight(day).astimezone(UTC)) / timedelta(hours=1))
    first = 2 + DAYS.index(day) * (23 + 5)
    count = hours + 1  # one for each hour, and the last instant; none of the three of midnight
    mean = fmean((number - 1) % 7 / 10 for number in range(first, first + count))
    as_moments = midnight(day).isoformat(), midnight(day, 1).isoformat()
    for start, end in ((day, day), as_moments):
        for door, found in doors(bordered, start, end).items():
            assert found[:3] == (count, first, first + count - 1), (door, start)
            assert found[3] is None or found[3] == pytest.approx(mean, abs=1e-3), (door, start)
    for start, end in ((day, day), (f"{day} 00:00", as_moments[1])):
        page = viewer.open(path_of(bordered, f"?{urlencode({'from': start, 'to': end})}"))
        assert re.search(rf"<span[^>]*>{count}</span>", page), start
    after = bordered.call("GET", path_of(bordered, f"/statistics?{urlencode({'from': as_moments[1], 'last': 60})}"))
    assert after["first_sequence"] == first + count


def test_commands_mean_it_too(bordered: Shop) -> None:
    asked = DAYS[1], DAYS[1]
    there = doors(bordered, *asked)["statistics"]
    for door, found in commands(bordered, *asked).items():
        assert found[:3] == there[:3], door
        assert found[3] == pytest.approx(there[3], abs=1e-6), door


def test_a_period_that_ends_where_it_begins_is_empty_and_a_wrong_one_is_refused(bordered: Shop) -> None:
    def asked(start: str, end: str, status: int = 200) -> Any:
        return bordered.call("GET", path_of(bordered, f"/statistics?{urlencode({'from': start, 'to': end})}"), status)

    at = midnight(DAYS[0]).isoformat()
    assert asked(at, at)["count"] == 0
    for start, end in ((DAYS[1], DAYS[0]), ("2026-03-05T06:00:00", "2026-03-06"), ("2026-02-30", "2026-03-06")):
        assert {each["field"] for each in asked(start, end, 422)["errors"]} == {"from"}
    assert {each["field"] for each in asked(DAYS[0], "9999-12-31", 422)["errors"]} == {"to"}


def test_a_day_of_a_report_is_one_of_the_zone_that_it_names(bordered: Shop) -> None:
    def made(**more: str) -> str:
        query = urlencode({"from": DAYS[0], "to": DAYS[0], "section": "numbers", **more})
        period: str = bordered.call("GET", path_of(bordered, f"/report.json?{query}"))["period"]
        return period.partition(",")[0]

    assert made() == "29 Mar 2026 00:00:00 – 30 Mar 2026 00:00:00"
    assert made(timezone="Asia/Tokyo") == "29 Mar 2026 00:00:00 – 30 Mar 2026 00:00:00"
    body = ReportsIn.model_validate({"from": DAYS[0], "to": DAYS[0], "timezone": "Asia/Tokyo"})
    assert body.bundle().request.period == (midnight(DAYS[0], zone="Asia/Tokyo"), midnight(DAYS[0], 1, "Asia/Tokyo"))
