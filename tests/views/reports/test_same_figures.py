"""Figures of a report equal those of the pages and the API, number by number, in every format."""

import csv
import io
from typing import Any

import pytest
from openpyxl import load_workbook
from pypdf import PdfReader

from app.quality.proof import queries as proof
from app.quality.proof.cases import cases
from app.views.reports.request import SectionName
from tests.shop import Person, Shop
from tests.views.reports.story import PERIOD, SAID, facts, file, report, table

# The whole history, a run at its end, and a period by time, which begins and ends within it.
PERIODS = [PERIOD, "last=60", "from={half}&to={late}"]


@pytest.fixture(params=PERIODS)
def period(request: pytest.FixtureRequest, story: Shop) -> str:
    def at(sequence: int) -> str:
        reading = story.call("GET", f"/readings/{story.characteristic}/{sequence}")
        moment: str = reading["measured_at"]
        return moment.replace("+", "%2B")

    text: str = request.param
    return text.format(half=at(320), late=at(590))


def of(story: Shop, what: str, query: str) -> Any:
    query = "" if (what, query) == ("statistics", PERIOD) else query  # it is of all readings if nothing is said
    return story.call("GET", f"/characteristics/{story.characteristic}/{what}?{query}")


def um(value: float | None) -> Any:
    return None if value is None else pytest.approx(value * 1000, abs=2e-9)


def test_the_numbers_are_those_of_the_statistics(story: Shop, period: str) -> None:
    said, found = facts(report(story, period), "numbers"), of(story, "statistics", period)
    assert said["count"]["value"] == found["count"] > 20
    assert said["excluded"]["value"] == found["excluded"]
    assert said["probe_faults"]["value"] == found["probe_faults"]
    for name in ("mean", "standard_deviation", "minimum", "maximum"):
        assert said[name]["value"] == um(found[name])
    assert said["in_tolerance"]["value"] == found["in_tolerance"]
    assert said["corrections"]["value"] == found["corrections"]
    assert said["share_in_tolerance"]["value"] == pytest.approx(found["share_in_tolerance"] * 100)
    for zone, number in found["zones"].items():
        assert said[f"zone_{zone}"]["value"] == number


def test_capability_is_that_of_its_page(story: Shop, period: str) -> None:
    said, found = facts(report(story, period), "capability"), of(story, "capability", period)
    assert said["readings"]["value"] == found["readings"] > 20
    for name in ("cp", "cpk", "pp", "ppk", "cpm"):
        assert said[name]["value"] == pytest.approx(found[name]["value"], abs=1e-12)
        assert [said[name]["low"], said[name]["high"]] == pytest.approx([found[name]["low"], found[name]["high"]])
    assert (said["mean"]["value"], said["sigma_within"]["value"], said["sigma_overall"]["value"]) == (
        um(found["mean"]),
        um(found["sigma_within"]),
        um(found["sigma_overall"]),
    )
    assert said["outside"]["value"] == found["outside"]
    for name in ("ppm_observed", "ppm_within", "ppm_overall"):
        assert said[name]["value"] == pytest.approx(found[name]["total"])
    assert said["excluded"]["value"] == len(found["excluded"])
    assert said["faults"]["value"] == len(found["probe_faults"])
    # What the page strikes out is not quoted on paper either.
    quotable = {"cpk": ["cp", "cpk", "pp", "ppk"], "ppk": ["pp", "ppk"], "percentile": []}[found["quote"]]
    assert [name for name in ("cp", "cpk", "pp", "ppk") if not said[name]["note"]] == quotable


def test_probe_faults_and_exclusions_are_left_out_and_named(story: Shop) -> None:
    numbers = next(each for each in report(story)["sections"] if each["key"] == "numbers")
    assert numbers["warnings"][0].startswith("1 of these readings is a probe fault")
    counted = facts(report(story), "numbers")
    assert (counted["probe_faults"]["value"], counted["zone_probe_fault"]["value"]) == (1, 1)
    assert counted["outside"]["value"] == facts(report(story), "capability")["outside"]["value"]
    said = facts(report(story), "capability")
    assert (said["excluded"]["value"], said["excluded"]["note"]) == (2, "17, 560")
    assert (said["faults"]["value"], said["faults"]["note"]) == (1, "601")
    assert [row["reading"]["value"] for row in table(report(story), "excluded")] == [560, 17]


@pytest.mark.parametrize("kind", ["individuals", "moving_range"])
def test_control_limits_are_those_of_the_frozen_baseline(story: Shop, period: str, kind: str) -> None:
    found, whole = of(story, "control", f"{period}&chart={kind}"), report(story, period)
    said = facts(whole, "control")
    assert said["baseline"]["value"] == found["baseline"] == 1
    assert said[f"{kind}_points"]["value"] == found["count"] > 20
    for name in ("lower", "centre", "upper"):
        assert said[f"{kind}_{name}"]["value"] == um(found["points"][name])
    assert said[f"{kind}_signals"]["value"] == found["signal_count"]
    listed = [
        (row["first"]["value"], row["last"]["value"], row["points"]["value"])
        for row in table(whole, "control")
        if (row["chart"]["value"] == "Individuals") == (kind == "individuals")
    ]
    shown = [(each["first"], each["last"], each["points"]) for each in found["signals"]]
    assert [each for each in shown if each not in listed] == []
    # By the same baseline whatever the period: nothing is estimated anew.
    assert said["baseline_sigma"]["value"] == um(of(story, "baselines/1", "")["sigma"])


def test_signals_on_record_stand_in_it_with_what_was_said_of_them(story: Shop) -> None:
    kept = story.call("GET", f"/signals?characteristic={story.characteristic}&state=all")["items"]
    assert kept, "the story gives signals"
    whole = report(story)
    assert facts(whole, "control")["kept"]["value"] == len(kept)
    rows = {row["number"]["value"]: row for row in table(whole, "control") if row["number"]["value"] is not None}
    assert set(rows) == {each["id"] for each in kept}
    said = rows[kept[0]["id"]]
    assert (said["state"]["value"], said["comment"]["value"]) == ("explained", SAID["comment"])


def test_corrections_and_alarms_are_those_on_record(story: Shop, period: str) -> None:
    whole, window = report(story, period), of(story, "statistics", period)
    chart = of(story, "control", period)
    low, high = chart["first_sequence"], chart["last_sequence"]
    numbers: list[int] = []
    for row in table(whole, "corrections")[:20]:
        number = row["number"]["value"]
        found = story.call("GET", f"/corrections/{story.machine}/{number}")
        assert row["amount"]["value"] == um(found["amount"])
        assert row["status"]["value"] == found["status"]
        assert low <= row["reading"]["value"] <= high
        numbers.append(number)
    assert numbers == sorted(numbers, reverse=True)
    assert facts(whole, "corrections")["issued"]["value"] == window["corrections"]
    alarms = [
        each["id"]
        for each in story.alarms("all")
        if each.get("characteristic") == story.characteristic
        and each["sequence"] is not None
        and low <= each["sequence"] <= high
    ]
    listed = [row["number"]["value"] for row in table(whole, "alarms")]
    assert [each for each in alarms if each not in listed] == []


def said_in(whole: Any) -> list[str]:
    """Every value as it is read, of facts and of tables."""
    said = [fact["text"] for section in whole["sections"] for fact in section["facts"]]
    return said + [
        value["text"]
        for section in whole["sections"]
        if section["table"]
        for row in section["table"]["rows"]
        for value in row
    ]


def plain(text: str) -> str:
    """Without what only parts lines and words."""
    return "".join(text.split()).replace("\N{NO-BREAK SPACE}", "").replace("\N{NARROW NO-BREAK SPACE}", "")


@pytest.fixture(scope="module")
def whole(story: Shop) -> Any:
    return report(story)


def test_the_pdf_shows_every_value_in_the_same_words(story: Shop, whole: Any) -> None:
    pages = PdfReader(io.BytesIO(file(story, "pdf"))).pages
    text = plain("".join(page.extract_text() for page in pages))
    missing = [said for said in said_in(whole) if plain(said) not in text]
    assert missing == []
    for page in pages:
        assert f"({story.characteristic})" in page.extract_text(), "every page says what it is about"


def test_the_first_page_is_what_is_signed_and_the_rest_are_appendices(story: Shop, whole: Any) -> None:
    first, second = (page.extract_text() for page in PdfReader(io.BytesIO(file(story, "pdf"))).pages[:2])
    summary = next(each for each in whole["sections"] if each["key"] == "summary")
    assert (
        summary["facts"][1]["value"] == facts(whole, "capability")["ppk"]["value"]
        or summary["facts"][0]["value"] == "No number"
    )
    for said in (
        "Summary",
        "Verdict",
        "Made by, date",
        "Checked by, date",
        "Released by, date",
        "Logo",
        "by key a test",
    ):
        assert said in first
    assert "Decided in zone" not in first
    assert "Decided in zone" in second
    only = PdfReader(io.BytesIO(file(story, "pdf", "last=all&section=summary"))).pages
    assert len(only) == 1


def test_the_page_shows_every_value_in_the_same_words(story: Shop, whole: Any, viewer: Person) -> None:
    from html import unescape

    page = f"/characteristics/{story.characteristic}/report?{PERIOD}"
    chosen = "".join(f"&section={name}" for name in SectionName)
    text = plain(unescape(viewer.open(page + chosen)))
    assert [said for said in said_in(whole) if plain(said) not in text] == []
    usual = viewer.open(page)
    assert 'id="section-summary"' in usual
    assert 'id="section-decisions"' not in usual  # an appendix that one chooses


def test_the_xlsx_holds_the_numbers_as_numbers(story: Shop, whole: Any) -> None:
    book = load_workbook(io.BytesIO(file(story, "xlsx")))
    first = {(row[0].value, row[2].value) for row in book.worksheets[0].iter_rows(min_row=1, max_col=3)}
    for section in whole["sections"]:
        for fact in section["facts"]:
            if isinstance(fact["value"], int | float):
                assert any(
                    name == fact["name"] and isinstance(value, int | float) and value == pytest.approx(fact["value"])
                    for name, value in first
                ), fact
    # The points of the control chart stand beside the chart that the spreadsheet draws of them.
    points = {row[0]: row[1] for row in book["Individuals"].iter_rows(min_row=2, max_col=2, values_only=True)}
    found = of(story, "control", PERIOD)["points"]
    assert points == {last: um(value) for last, value in zip(found["last"], found["value"], strict=True)}


def test_the_csv_holds_every_value_once_by_its_names(story: Shop, whole: Any) -> None:
    rows = list(csv.DictReader(io.StringIO(file(story, "csv").decode("utf-8-sig"))))
    values = {(row["section"], row["row"], row["key"]): row["value"] for row in rows}
    assert len(values) == len(rows)
    for section in whole["sections"]:
        for fact in section["facts"]:
            if isinstance(fact["value"], int | float):
                assert float(values[section["key"], "", fact["key"]]) == pytest.approx(fact["value"])
        for number, row in enumerate(section["table"]["rows"] if section["table"] else (), start=1):
            for column, value in zip(section["table"]["columns"], row, strict=True):
                said = values[section["key"], str(number), column["key"]]
                if isinstance(value["value"], int | float):
                    assert float(said) == pytest.approx(value["value"])


def test_the_same_report_twice_says_the_same(story: Shop) -> None:
    one, two = report(story), report(story)
    one["made_at"] = two["made_at"] = None
    assert one == two


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> None:
    case = next(iter(cases()))
    monkeypatch.setattr(proof, "failing", lambda: (proof.Result(case, (), "ValueError: planted"),))


def test_a_failing_proof_stands_above_everything(story: Shop, failing: None) -> None:
    from datetime import UTC, datetime

    from app.files.documents.content import Format
    from app.files.documents.files import file_of
    from app.loop.characteristics.queries import characteristic_named
    from app.views.reports import queries
    from app.views.reports.request import ReportRequest, SectionName

    with story.server.database.begin() as session:
        current = characteristic_named(session, story.characteristic)
        made = queries.report_of(
            session, current, ReportRequest(sections=(SectionName.NUMBERS,)), datetime(2026, 11, 22, tzinfo=UTC)
        )
    warning = "1 published example does not come out as published"
    assert made.warnings[0].startswith(warning)
    first = PdfReader(io.BytesIO(file_of(made, Format.PDF))).pages[0].extract_text()
    assert plain(warning) in plain(first).partition("Numbers")[0]
    assert warning in file_of(made, Format.CSV).decode()
    book = load_workbook(io.BytesIO(file_of(made, Format.XLSX)))
    assert any(str(row[0]).startswith(warning) for row in book.worksheets[0].iter_rows(max_row=5, values_only=True))
