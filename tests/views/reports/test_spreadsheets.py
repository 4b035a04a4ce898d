"""Nothing that comes from outside becomes a formula: in reports, in their summaries, and in the export of readings."""

import csv
import io
import re
import zipfile

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from openpyxl import load_workbook
from xlsxwriter import Workbook

from app.files.documents.files.sheets import _Writing
from app.files.formats.delimited import defused
from app.views.reports.bundle import BundleFormat
from app.views.reports.request import ReportRequest
from tests.forked import inband
from tests.shop import Shop
from tests.views.reports.made_here import made_here
from tests.views.reports.story import file, scatter

NASTY = [
    "=1+1",
    "+1+1",
    "-2+3",
    "@SUM(1+1)",
    "\t=1+1",
    "\r=1+1",
    "\n=1+1",
    " =1+1",
    "=cmd|' /C calc'!A0",
    '=HYPERLINK("http://example.org","x")',
    "\N{FULLWIDTH EQUALS SIGN}1+1",
    "chip;=1+1;x",
    "chip\t@SUM(1)",
    "a,-1+1",
]
SIGNS = tuple(
    "=+-@\N{FULLWIDTH EQUALS SIGN}\N{FULLWIDTH PLUS SIGN}\N{FULLWIDTH HYPHEN-MINUS}\N{FULLWIDTH COMMERCIAL AT}"
)
STARTS = (*SIGNS, "\t", "\r", "\n")


def parts_of(cell: str) -> list[str]:
    """The cells that a spreadsheet may make of one, by whichever delimiter it parts lines."""
    found = [cell]
    for sign in ";,\t|\n\r":
        found = [piece for each in found for piece in each.split(sign)] + found
    return found


def harmless(cell: str) -> bool:
    """Tell if no spreadsheet takes it, or a piece of it, for a formula; a number may begin with its sign."""
    if cell.startswith(STARTS) and not _number(cell):
        return False
    return not any(piece.startswith(SIGNS) and not _number(piece) for piece in parts_of(cell))


def _number(text: str) -> bool:
    """Tell if it is a plain number as far as the next delimiter; no spreadsheet computes that, whatever delimiter it knows."""
    try:
        float(re.split(r"[];,\t|\n\r]", text)[0])
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("text", NASTY)
def test_defused(text: str) -> None:
    made = defused(text)
    assert not made.lstrip(" ").startswith(STARTS)
    assert harmless(made)
    assert made.replace("'", "") == text.replace("'", ""), "nothing else is changed"


@example(",-1;")
@given(st.text(alphabet="=+-@;,|\t\r\n '\"a1\N{FULLWIDTH EQUALS SIGN}", max_size=12))
def test_whatever_is_written_is_no_formula(text: str) -> None:
    once = defused(text)
    assert harmless(once)
    assert once.replace("'", "") == text.replace("'", "")


@pytest.mark.parametrize(
    "text", ["SN-812", "Bearing seat Ø40 h6", "−6.1 µm", "3 µm, -2", "a - b", "Đorđe", "[[0.01,-0.02],[-1e-05,+3]]", ""]
)
def test_what_is_harmless_stays_as_it_is(text: str) -> None:
    assert defused(text) == text


@pytest.fixture(scope="module")
def nasty(common_shop: Shop) -> Shop:
    """Names, parts, reasons and comments that are formulas in spreadsheets."""
    made = common_shop
    key = made.characteristic
    made.call("PATCH", f"/characteristics/{key}", name="=1+1", part="@SUM(1+1)")
    made.call("PATCH", f"/machines/{made.machine}", name="+1+1")
    for number, text in enumerate(each for each in NASTY if each.isprintable()):
        made.push([0.5], part=[text])
        made.call("POST", f"/readings/{key}/{number + 1}/exclude", reason=text)
    made.push(scatter(40), part=["=2+2"] * 40)
    made.read(9.5, part="=3+3")
    alarm = made.alarms()[0]
    made.acknowledge(alarm["id"], "noted", comment="-2+3+cmd|' /C calc'!A0")
    made.call("PATCH", f"/characteristics/{key}", parameters={"weighting_factor": 3}, reason="=HYPERLINK(1)")
    made.call("POST", f"/machines/{made.machine}/tools/3/change", offset=0.0, reason="+chip;=1+1;x")
    return made


def no_formula(content: bytes) -> int:
    """Count the texts of the workbook that begin like a formula and are none."""
    book = load_workbook(io.BytesIO(content))
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row if isinstance(cell.value, str)]
    assert [cell.value for cell in cells if cell.data_type == "f" or cell.hyperlink] == []
    with zipfile.ZipFile(io.BytesIO(content)) as whole:
        sheets = [whole.read(name) for name in whole.namelist() if name.startswith("xl/worksheets/sheet")]
        assert not any(b"<f>" in sheet or b"<hyperlink" in sheet for sheet in sheets)
    return sum(str(cell.value).startswith(STARTS) for cell in cells)


def test_xlsx_holds_them_as_texts(nasty: Shop) -> None:
    assert no_formula(file(nasty, "xlsx")) > 20


def cells_of(content: bytes) -> list[str]:
    return [cell for row in csv.reader(io.StringIO(content.decode("utf-8-sig"))) for cell in row]


def test_names_of_sheets_are_those_that_spreadsheets_take() -> None:
    with Workbook(io.BytesIO()) as book:
        writing = _Writing(book)
        titles = ("D40", "d40", "History", "'a'", "x" * 40, "x" * 41, "a/b:c", "", "'" * 3)
        found = [writing.sheet(title).name for title in titles]
    long = "x" * 31, "x" * 29 + "~2"
    assert found == ["D40", "d40~2", "History~2", "a", *long, "a-b-c", "-", "-~2"]


def test_csv_of_a_report_is_defused(nasty: Shop) -> None:
    cells = cells_of(file(nasty, "csv"))
    assert [cell for cell in cells if not harmless(cell)] == []
    assert "'=1+1" in cells
    assert any("cmd|" in cell for cell in cells), "it is in there, as a text"


def test_many_at_once_are_defused(nasty: Shop) -> None:
    forms: tuple[BundleFormat, ...] = ("workbook", "csv")
    for form in forms:
        number = made_here(nasty.server.database, ReportRequest(), form, nasty.characteristic)
        content = nasty.admin.get(f"/api/v1/reports/{number}/file").content
        if form == "workbook":
            assert no_formula(content) > 10
        else:
            whole = zipfile.ZipFile(io.BytesIO(content))
            for name in whole.namelist():
                assert [cell for cell in cells_of(whole.read(name)) if not harmless(cell)] == []


def test_the_export_of_readings_is_defused(nasty: Shop) -> None:
    database = nasty.server.database
    exported = inband("export", "--characteristic", nasty.characteristic, INBAND_DATABASE_URL=database.dsn)
    assert exported.returncode == 0, exported.stderr
    cells = cells_of(exported.stdout.encode())
    assert [cell for cell in cells if not harmless(cell)] == []
    assert "'=2+2" in cells


@pytest.mark.parametrize("what", ["control.csv?last=all", "report.csv?last=all&section=capability"])
def test_the_tables_of_the_pages_are_defused(nasty: Shop, what: str) -> None:
    content = nasty.admin.get(f"/api/v1/characteristics/{nasty.characteristic}/{what}")
    assert content.status_code == 200, content.text
    assert [cell for cell in cells_of(content.content) if not harmless(cell)] == []
