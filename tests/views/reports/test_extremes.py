"""Reports of nothing, of one reading, of equal ones, of very many; with letters from everywhere and names without end."""

import io
from datetime import UTC, datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from openpyxl import load_workbook
from pypdf import PdfReader

from app.core.parameters import Parameters
from app.files.documents.content import (
    Column,
    Fact,
    Format,
    Paper,
    Picture,
    Report,
    Section,
    Table,
    count,
    deviation,
    moment,
    words,
)
from app.files.documents.files import file_of
from app.files.documents.files.fonts import MISSING
from app.views.characteristic.figures import histogram_counts, histogram_figure
from tests.chance import examples
from tests.shop import Person, Shop
from tests.views.reports.story import facts, file, report, scatter

SERBIAN = "Ležište Ø40 – čađavo ŠĐČĆŽ, Лежиште Њ Џ Ђ"


def pdf(content: bytes) -> tuple[int, str]:
    reader = PdfReader(io.BytesIO(content))
    return len(reader.pages), "".join(page.extract_text() for page in reader.pages)


def warned(found: Any, section: str) -> str:
    return " ".join(next(each for each in found["sections"] if each["key"] == section)["warnings"])


def test_nothing_measured_yet(shop: Shop) -> None:
    key = shop.another("nothing")
    found = report(shop, characteristic=key)
    assert found["period"] == "no readings"
    assert facts(found, "numbers")["count"]["value"] == 0
    assert facts(found, "numbers")["mean"]["text"] == "–"
    assert "No readings" in warned(found, "numbers")
    assert "missing" in warned(found, "capability")
    for form in ("pdf", "xlsx", "csv"):
        assert len(file(shop, form, characteristic=key)) > 1000


def test_a_period_in_which_nothing_was_measured(shop: Shop) -> None:
    key = shop.another("long-ago")
    shop.push(scatter(30), key)
    found = report(shop, "from=2001-01-01T00:00:00Z&to=2001-12-31T00:00:00Z", key)
    assert found["period"].endswith("no readings")
    assert facts(found, "numbers")["count"]["value"] == 0
    pages, text = pdf(file(shop, "pdf", "from=2001-01-01T00:00:00Z&to=2001-12-31T00:00:00Z", key))
    assert "No readings were measured" in text
    assert pages <= 3


def test_only_a_spreadsheet_asks_for_the_numbers_of_the_charts() -> None:
    """Of a million readings they are tens of thousands of values, and everybody waits while garbage is looked for among them."""
    asked: list[str] = []

    def table() -> Table:
        asked.append("table")
        return Table((Column("reading", "Reading"), Column("value", "Value")), ((count(1), deviation(0.001)),))

    limits = Parameters(
        target=40, tolerance_width=0.016, zero_range=0.001, averaging_limit=0.005, wear_limit=0.3, confidence_limit=1.0,
        weighting_factor=2, factor=-1, tool_memory=1, average_memory=1,
    )  # fmt: skip
    figure = histogram_figure(histogram_counts([0.001, 0.003], limits), limits)
    picture = Picture("histogram", "Histogram", "says", figure, 400, 300, table)
    at = moment(datetime(2026, 11, 22, tzinfo=UTC))
    sections = (Section("numbers", "Numbers", pictures=(picture,)),)
    head = (Fact("x", "X", words("y")),)
    made = Report("key", "name", "machine", "part", "period", "UTC", at, head, sections)
    for form in (Format.PDF, Format.CSV):
        file_of(made, form)
    assert asked == []
    file_of(made, Format.XLSX)
    assert asked


def test_one_reading(shop: Shop) -> None:
    key = shop.another("one")
    shop.push([1.5], key)
    found = report(shop, characteristic=key)
    said = facts(found, "numbers")
    assert (said["count"]["value"], said["standard_deviation"]["value"]) == (1, None)
    assert said["mean"]["value"] == pytest.approx(1.5)
    assert "A standard deviation needs at least two readings" in warned(found, "numbers")
    assert "19 are missing" in warned(found, "capability")
    for form in ("pdf", "xlsx", "csv"):
        file(shop, form, characteristic=key)


def test_all_equal(shop: Shop) -> None:
    key = shop.another("equal", mode="measure_only", tool_memory=0, average_memory=0)
    shop.push([0.5] * 150, key)
    shop.call(
        "POST",
        f"/characteristics/{key}/baselines",
        422,
        quantity="deviation",
        first_sequence=1,
        last_sequence=150,
        reason="all the same",
    )
    found = report(shop, characteristic=key)
    assert facts(found, "numbers")["standard_deviation"]["value"] == 0
    assert warned(found, "capability").startswith("No capability")
    assert "No baseline is in force" in warned(found, "control")
    for form in ("pdf", "xlsx", "csv"):
        file(shop, form, characteristic=key)


def test_only_probe_faults_and_excluded_ones(shop: Shop) -> None:
    key = shop.another("faulty")
    shop.read(1500, key)
    shop.push([1.0], key)
    shop.call("POST", f"/readings/{key}/2/exclude", reason="Chip")
    found = report(shop, characteristic=key)
    assert "missing" in warned(found, "capability")
    file(shop, "pdf", characteristic=key)


def test_letters_of_the_shop_floors(shop: Shop, viewer: Person) -> None:
    key = shop.another("letters")
    names = f"{SERBIAN} 轴承座 Ärmel"
    shop.call("PATCH", f"/characteristics/{key}", name=names, part="Дугме № 5")
    shop.push([1.0, 2.0, 9.5], key, part=["ЊЏ-ŠĐ"] * 3)
    pages, text = pdf(file(shop, "pdf", characteristic=key))
    for piece in (*SERBIAN.split(), "轴承座", "Ärmel", "ЊЏ-ŠĐ"):
        assert piece in text.replace("\n", " "), piece
    assert MISSING not in text
    assert pages < 10
    book = load_workbook(io.BytesIO(file(shop, "xlsx", characteristic=key)))
    assert book.worksheets[0]["A1"].value == names
    assert names in file(shop, "csv", characteristic=key).decode("utf-8-sig")
    assert SERBIAN in viewer.open(f"/characteristics/{key}/report")


def test_names_without_end_break_no_page(shop: Shop) -> None:
    key = shop.another("endless")
    shop.call("PATCH", f"/characteristics/{key}", name="W" * 200, part="Ü" * 100)
    shop.push([1.0, 9.5, -9.5], key, part=["P" * 120] * 3)
    for alarm in shop.alarms():
        shop.acknowledge(alarm["id"], "noted", comment="nothing but a very long word " + "x" * 400)
    pages, _text = pdf(file(shop, "pdf", characteristic=key))
    assert pages < 12


@pytest.mark.long
def test_a_long_history_is_no_book(shop: Shop) -> None:
    """Six hundred readings, each of which corrects: what is listed is bounded, and says how much is left out."""
    key = shop.another("many", zero_range=0.0, weighting_factor=1, averaging_limit=0.001)
    shop.push(scatter(600), key)
    found = report(shop, "last=100000", key)
    assert facts(found, "numbers")["count"]["value"] == 600
    tables = {each["key"]: each["table"] for each in found["sections"] if each["table"]}
    assert len(tables["corrections"]["rows"]) == 100
    assert tables["corrections"]["more"] > 400
    assert tables["decisions"]["more"] == 600 - len(tables["decisions"]["rows"])
    content = file(shop, "pdf", "last=100000", key)
    assert pdf(content)[0] < 20
    assert len(content) < 3_000_000


def of(text: str, rows: int = 3) -> Report:
    """A report that says the same everywhere."""
    columns = (Column("a", text), Column("b", "B", aligned="right"))
    table = Table(columns, tuple((words(text), deviation(0.001 * at)) for at in range(rows)))
    section = Section(
        "numbers", text, sentences=(text,), warnings=(text,), facts=(Fact("f", text, count(3), note=text),)
    )
    more = Section("alarms", "Alarms", table=table)
    at = moment(datetime(2026, 11, 22, 6, 0, tzinfo=UTC))
    return Report("key", text, text, text, text, "UTC", at, (Fact("x", text, words(text)),), (section, more), (text,))


@examples(30)
@given(st.text(max_size=80))
def test_whatever_is_written_can_be_printed(text: str) -> None:
    for form in Format:
        assert file_of(of(text), form)


def test_markup_in_names_is_only_text() -> None:
    text = '<b>&amp; <para> <img src="x"/> </font> ]]> &#0;'
    assert "<para>" in pdf(file_of(of(text), Format.PDF))[1]


@pytest.mark.parametrize("form", list(Format))
def test_the_same_report_gives_the_same_bytes(form: Format) -> None:
    assert file_of(of("Ø40"), form) == file_of(of("Ø40"), form)


def test_paper() -> None:
    for paper, width in ((Paper.A4, 595), (Paper.LETTER, 612)):
        page = PdfReader(io.BytesIO(file_of(of("Ø40"), Format.PDF, paper))).pages[0]
        assert round(float(page.mediabox.width)) == width


def test_a_table_has_its_heading_on_every_page() -> None:
    reader = PdfReader(io.BytesIO(file_of(of("Heading", rows=300), Format.PDF)))
    assert len(reader.pages) > 3
    for number, page in enumerate(reader.pages, start=1):
        text = page.extract_text()
        assert f"{number} of {len(reader.pages)}" in text
        assert text.count("Heading") > 1
