"""Wide sheets, workbooks and encodings: through the command, and on the page in a real browser."""

import re
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

import httpx
import pytest
from openpyxl import Workbook
from playwright.sync_api import Page, expect
from sqlalchemy import text

from app.files.formats.delimited import encoding_of, samples
from tests.servers import Server
from tests.shop import Person, Shop


def workbook(path: Path, header: list[str], rows: list[list[Any]]) -> Path:
    book = Workbook()
    notes = book.active
    assert notes is not None
    notes.title = "Notes"
    sheet = book.create_sheet("Measurements")
    for row in [header, *rows]:
        sheet.append(row)
    sheet["XFD1"].number_format = "0.000"  # a format, no value: the file says that it is 16,384 columns wide
    book.save(path)
    return path


def readings(shop: Shop, key: str) -> list[tuple[float, str, str]]:
    found = shop.call("GET", f"/readings?characteristic={key}")["items"]
    return [(each["measured"], each["part"], each["measured_at"][:16]) for each in found]


def send(client: httpx.Client, path: Path, characteristic: str = "") -> str:
    """Send the file as the page does; the address of its preview."""
    csrf = re.search(r'name="csrf" value="([^"]+)"', client.get("/account").text)
    assert csrf
    form = {"csrf": csrf[1], "characteristic": characteristic}
    answer = client.post("/import", data=form, files={"file": (path.name, path.read_bytes())})
    assert answer.status_code == 303, answer.text[-3000:]
    return answer.headers["location"]


@pytest.fixture
def client(server: Server, engineer: Person) -> httpx.Client:
    """The engineer's, which shows where it is sent on to."""
    client = server.client()
    client.cookies.update(engineer.browser.cookies)
    return client


@pytest.mark.browser
@pytest.mark.long
def test_a_wide_workbook_on_the_page(shop: Shop, engineer: Person, page: Page, tmp_path: Path) -> None:
    one, two = shop.characteristic, f"{shop.characteristic}-b"
    shop.add(two)
    when = [datetime(2026, 11, 20, 8, minute) for minute in range(3)]  # noqa: DTZ001 - as cells have them
    rows = [["A1", when[0], 40.001, 39.999], ["A2", when[1], None, 40.002], ["A3", when[2], 40.003, 40.001]]
    path = workbook(tmp_path / "shift.xlsx", ["Serial", "Time", one, f"Seat {two}"], rows)
    engineer.sign_in(page)
    page.goto("/import")
    page.select_option("[name=characteristic]", "")
    page.set_input_files("[name=file]", path)
    page.get_by_role("button", name="Preview").click()
    page.wait_for_url(re.compile(r"/import/[\w-]{22}"))
    # Both columns are known: one by its key, one by its name.
    results = page.locator("table").first
    expect(results.locator("tbody tr")).to_have_count(2)
    expect(results).to_contain_text(two)
    page.get_by_role("button", name="Import all").click()
    expect(page.get_by_role("heading", name="5 readings imported")).to_be_visible()
    assert readings(shop, one) == [(40.001, "A1", "2026-11-20T08:00"), (40.003, "A3", "2026-11-20T08:02")]
    assert [part for _value, part, _at in readings(shop, two)] == ["A1", "A2", "A3"]


def test_a_workbook_with_merged_heads_dates_and_formulas(shop: Shop, client: httpx.Client, tmp_path: Path) -> None:
    one, two = shop.characteristic, f"{shop.characteristic}-b"
    shop.add(two)
    rows: list[list[Any]] = [
        ["Shift report"],
        [],
        ["Date", "Time", "Part", "Sizes", None],
        [None, None, None, one, f"Seat {two}", "", "no name"],
        [date(2026, 11, 20), time(8, 15), 17, 40.001, "=D5-0.002"],
        [date(2026, 11, 20), time(8, 16), 18, 40.002, 39.999],
    ]
    path = workbook(tmp_path / "report.xlsx", [], rows)
    address = send(client, path)
    shown = client.get(address).text
    assert "line 6, Seat" in shown.replace("&#39;", "'")  # the first line of this workbook is empty
    assert "is a formula without a result in the file" in shown
    assert "Shift report" in shown
    csrf = re.search(r'name="csrf" value="([^"]+)"', shown)
    assert csrf
    form = {"csrf": csrf[1], "to_4": one, "to_5": two}
    assert client.post(address, data=form).status_code == 422
    assert readings(shop, one) == readings(shop, two) == []
    assert client.post(address, data=form | {"first_line": "7"}).status_code == 303
    assert readings(shop, one) == [(40.002, "18", "2026-11-20T08:16")]
    assert readings(shop, two) == [(39.999, "18", "2026-11-20T08:16")]


def test_one_wrong_column_stores_nothing_of_the_others(shop: Shop, client: httpx.Client, tmp_path: Path) -> None:
    path = tmp_path / "wide.csv"
    path.write_text(f"part;{shop.characteristic};D40\nA1;40,001;40,002\nA2;40,002;broken\n")
    two = f"{shop.characteristic}-b"
    shop.add(two)
    address = send(client, path)
    shown = client.get(f"{address}?to_2={shop.characteristic}&to_3={two}").text
    assert "broken" in shown
    assert "disabled" in shown[shown.index("Import all") - 200 : shown.index("Import all")]
    csrf = re.search(r'name="csrf" value="([^"]+)"', shown)
    assert csrf
    form = {"csrf": csrf[1], "to_2": shop.characteristic, "to_3": two}
    assert client.post(address, data=form).status_code == 422
    assert readings(shop, shop.characteristic) == readings(shop, two) == []
    twice = client.post(address, data=form | {"to_3": shop.characteristic})
    assert twice.status_code == 422
    assert "named for two columns" in twice.text
    # The column that is wrong is left out: the other one goes in, and a second time stores nothing.
    assert client.post(address, data=form | {"to_3": ""}).status_code == 303
    assert len(readings(shop, shop.characteristic)) == 2
    again = client.post(send(client, path), data=form | {"to_3": ""})
    assert "stored=0" in again.headers["location"]


def test_what_is_no_workbook_is_refused_where_it_is_chosen(client: httpx.Client, tmp_path: Path) -> None:
    path = tmp_path / "old.xlsx"
    path.write_bytes(b"\xd0\xcf\x11\xe0 an older format")
    csrf = re.search(r'name="csrf" value="([^"]+)"', client.get("/account").text)
    assert csrf
    answer = client.post("/import", data={"csrf": csrf[1]}, files={"file": (path.name, path.read_bytes())})
    assert answer.status_code == 422
    assert "not an XLSX workbook" in answer.text


@pytest.mark.parametrize(
    ("encoding", "words"),
    [
        ("utf-8", "Prüfer;Ø40"),
        ("cp1252", "Prüfer;Größe;Ø40"),
        ("cp1250", "Merač;Šifra;Živković"),
        ("iso-8859-2", "vreme obrade;Živković"),
        ("cp1251", "Измерено;време;Ђорђе"),
    ],
)
def test_an_encoding_is_guessed_by_its_letters(tmp_path: Path, encoding: str, words: str) -> None:
    path = tmp_path / "file.csv"
    path.write_bytes(f"{words}\n39,998;1\n".encode(encoding))
    assert encoding_of(path) == encoding
    assert words in dict(samples(path))[encoding]


def test_a_wrong_encoding_is_shown_with_the_lines_in_each(shop: Shop, client: httpx.Client, tmp_path: Path) -> None:
    path = tmp_path / "umlaut.csv"
    path.write_bytes("Messwert;Prüfer\n40,001;Müller\n".encode("cp1252"))
    address = send(client, path, shop.characteristic)
    assert "Guessed: cp1252" in client.get(address).text
    refused = client.get(f"{address}&encoding=utf-8").text
    assert "Messwert;Prüfer" in refused
    with shop.server.database.begin() as session:
        assert session.execute(text("SELECT count(*) FROM reading WHERE part = 'Müller'")).scalar_one() == 0
