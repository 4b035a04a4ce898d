"""Import in a real browser: send, look, change what a column means, import; and what may not be done."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from sqlalchemy import text

from tests.conftest import RunServer, Server
from tests.loop.readings.importing.test_history import set_up

pytestmark = pytest.mark.browser
PASSWORD = "correct horse battery"


@pytest.fixture(scope="module")
def server(run_server: RunServer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """It keeps what is sent in a folder of this test."""
    with run_server(data_dir=tmp_path_factory.mktemp("plant") / "data") as running:
        yield running


@pytest.fixture(scope="module")
def shop(server: Server) -> Server:
    set_up(server.database)
    server.person("Eva", "engineer", PASSWORD)
    server.person("Otto", "operator", PASSWORD)
    return server


def sign_in(page: Page, name: str) -> Page:
    page.goto("/sign-in?next=/import?characteristic=shaft-d40")
    page.fill("[name=name]", name)
    page.fill("[name=password]", PASSWORD)
    page.keyboard.press("Enter")
    return page


@pytest.fixture
def engineer(page: Page, shop: Server) -> Page:
    sign_in(page, "Eva")
    page.wait_for_url(re.compile(r"^http://[^/]+/import"))
    return page


def send(page: Page, path: Path) -> None:
    page.goto("/import?characteristic=shaft-d40")
    page.set_input_files("[name=file]", path)
    page.get_by_role("button", name="Preview").click()
    page.wait_for_url(re.compile(r"/import/[\w-]{22}"))


def count(server: Server) -> Any:
    with server.database.begin() as session:
        return session.execute(text("SELECT count(*) FROM reading")).scalar_one()


def test_a_file_is_seen_before_it_is_imported_and_then_is_on_the_record(
    engineer: Page, shop: Server, tmp_path: Path
) -> None:
    file = tmp_path / "Žižek & <b>.csv"
    file.write_text("Messwert [µm];Zeit;Teil\n39992,5;2026-03-02 06:00;<i>a</i>\n39998,1;2026-03-02 06:01;b\n")
    send(engineer, file)
    expect(engineer.locator("h1")).to_have_text("Žižek & <b>.csv")
    expect(engineer.locator(".readout").first).to_contain_text("2")
    expect(engineer.locator(".sheet td.read").first).to_contain_text("39.9925")
    expect(engineer.locator(".sheet")).to_contain_text("<i>a</i>")
    before = count(shop)
    engineer.get_by_role("button", name="Import all").click()
    expect(engineer.locator("h2").first).to_have_text("2 readings imported")
    assert count(shop) == before + 2
    engineer.reload()
    assert count(shop) == before + 2
    send(engineer, file)
    expect(engineer.locator(".readouts")).to_contain_text("Stored before")


def test_bad_lines_are_named_and_cannot_be_imported(engineer: Page, shop: Server, tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(
        "measured,measured_at\nabout 40,2026-03-02T06:00Z\n1e999,2026-03-02T06:00Z\n39.99,2026-03-02T06:00Z\n"
    )
    send(engineer, file)
    rows = engineer.locator(".flaws tbody tr")
    expect(rows).to_have_count(2)
    expect(rows.first).to_contain_text("about 40")
    expect(rows.first).to_contain_text("is not a number")
    expect(engineer.get_by_role("button", name="Import all")).to_be_disabled()


def test_what_a_column_means_can_be_changed(engineer: Page, shop: Server, tmp_path: Path) -> None:
    file = tmp_path / "odd.csv"
    file.write_text("a;b;c\n1;39,991;02.03.2026 07:00:00\n2;39,992;02.03.2026 07:01:00\n")
    send(engineer, file)
    expect(engineer.locator(".note")).to_contain_text("No column is recognised")
    engineer.select_option("select[name=column_measured]", label="b")
    expect(engineer.locator(".sheet th small")).to_have_text(["Measured value"])
    engineer.select_option("#f-column_measured_at", label="c")
    expect(engineer.locator(".sheet th small")).to_have_count(2)
    before = count(shop)
    engineer.get_by_role("button", name="Import all").click()
    expect(engineer.locator("h2").first).to_have_text("2 readings imported")
    assert count(shop) == before + 2


def test_a_file_in_another_encoding_can_still_be_read(engineer: Page, tmp_path: Path) -> None:
    file = tmp_path / "windows.csv"
    file.write_bytes("measured;part\n39,9911;Žižek\n".encode("cp1250"))
    send(engineer, file)
    expect(engineer.locator(".sheet")).to_contain_text("Žižek")  # guessed
    engineer.select_option("select[name=encoding]", "utf-8")
    expect(engineer.locator(".note").first).to_contain_text("cp1250 for Serbian")
    expect(engineer.locator("table").first).to_contain_text("Žižek")  # so it would look in cp1250
    engineer.select_option("select[name=encoding]", "cp1250")
    expect(engineer.locator(".sheet")).to_contain_text("Žižek")


def test_an_operator_may_not_import(page: Page, shop: Server, complaints: list[str]) -> None:
    sign_in(page, "Otto")
    expect(page.locator("main")).to_contain_text("engineer")
    assert page.locator("[name=file]").count() == 0
    complaints.clear()


def test_nobody_sees_the_file_of_another_and_no_path_leads_out(shop: Server, engineer: Page, tmp_path: Path) -> None:
    file = tmp_path / "mine.csv"
    file.write_text("measured\n39.99\n")
    send(engineer, file)
    token = re.search(r"/import/([\w-]{22})", engineer.url)
    assert token
    with shop.client(shop.key("engineer")) as other:
        for path in (token[1], "..%2F..%2Fdemo.json", "a" * 22):
            assert other.get(f"/import/{path}", params={"characteristic": "shaft-d40"}).status_code == 404


def test_a_foreign_page_cannot_send_a_file(engineer: Page, shop: Server) -> None:
    cookies = {c["name"]: c["value"] for c in engineer.context.cookies() if "name" in c and "value" in c}
    with shop.client() as client:
        client.cookies.update(cookies)
        answer = client.post(
            "/import", data={"characteristic": "shaft-d40"}, files={"file": ("a.csv", b"measured\n1\n", "text/csv")}
        )
    assert answer.status_code == 403
