"""Import in a real browser: send, look, change what a column means, import; and what may not be done."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.loop.readings.record import history
from tests.shop import Person, Shop

pytestmark = pytest.mark.browser


def send(page: Page, shop: Shop, path: Path) -> None:
    page.goto(f"/import?characteristic={shop.characteristic}")
    page.set_input_files("[name=file]", path)
    page.get_by_role("button", name="Preview").click()
    page.wait_for_url(re.compile(r"/import/[\w-]{22}"))


def count(shop: Shop) -> int:
    return len(history(shop.server.database.dsn, shop.characteristic))


@pytest.fixture
def at_desk(page: Page, engineer: Person) -> Page:
    """The page of an engineer who is signed in."""
    engineer.sign_in(page)
    return page


def test_a_file_is_seen_before_it_is_imported_and_then_is_on_the_record(
    at_desk: Page, shop: Shop, tmp_path: Path
) -> None:
    file = tmp_path / "Žižek & <b>.csv"
    file.write_text("Messwert [µm];Zeit;Teil\n39992,5;2026-03-02 06:00;<i>a</i>\n39998,1;2026-03-02 06:01;b\n")
    send(at_desk, shop, file)
    expect(at_desk.locator("h1")).to_have_text("Žižek & <b>.csv")
    expect(at_desk.locator(".readout").first).to_contain_text("2")
    expect(at_desk.locator(".sheet td.read").first).to_contain_text("39.9925")
    expect(at_desk.locator(".sheet")).to_contain_text("<i>a</i>")
    at_desk.get_by_role("button", name="Import all").click()
    expect(at_desk.locator("h2").first).to_have_text("2 readings imported")
    assert count(shop) == 2
    at_desk.reload()
    assert count(shop) == 2
    send(at_desk, shop, file)
    expect(at_desk.locator(".readouts")).to_contain_text("Stored before")


def test_bad_lines_are_named_and_cannot_be_imported(at_desk: Page, shop: Shop, tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(
        "measured,measured_at\nabout 40,2026-03-02T06:00Z\n1e999,2026-03-02T06:00Z\n39.99,2026-03-02T06:00Z\n"
    )
    send(at_desk, shop, file)
    rows = at_desk.locator(".flaws tbody tr")
    expect(rows).to_have_count(2)
    expect(rows.first).to_contain_text("about 40")
    expect(rows.first).to_contain_text("is not a number")
    expect(at_desk.get_by_role("button", name="Import all")).to_be_disabled()


def test_what_a_column_means_can_be_changed(at_desk: Page, shop: Shop, tmp_path: Path) -> None:
    file = tmp_path / "odd.csv"
    file.write_text("a;b;c\n1;39,991;02.03.2026 07:00:00\n2;39,992;02.03.2026 07:01:00\n")
    send(at_desk, shop, file)
    expect(at_desk.locator(".note")).to_contain_text("No column is recognised")
    at_desk.select_option("select[name=column_measured]", label="b")
    expect(at_desk.locator(".sheet th small")).to_have_text(["Measured value", "Time of measuring"])
    expect(at_desk.locator(".note")).to_contain_text("c is taken for it")
    at_desk.wait_for_load_state()  # the script that sends what is changed
    at_desk.select_option("#f-column_measured_at", label="–")
    expect(at_desk.locator(".sheet th small")).to_have_text(["Measured value"])
    at_desk.wait_for_load_state()
    at_desk.select_option("#f-column_measured_at", label="c")
    expect(at_desk.locator(".sheet th small")).to_have_count(2)
    at_desk.get_by_role("button", name="Import all").click()
    expect(at_desk.locator("h2").first).to_have_text("2 readings imported")
    assert count(shop) == 2


def test_a_file_in_another_encoding_can_still_be_read(at_desk: Page, shop: Shop, tmp_path: Path) -> None:
    file = tmp_path / "windows.csv"
    file.write_bytes("measured;part\n39,9911;Žižek\n".encode("cp1250"))
    send(at_desk, shop, file)
    expect(at_desk.locator(".sheet")).to_contain_text("Žižek")  # guessed
    at_desk.select_option("select[name=encoding]", "utf-8")
    expect(at_desk.locator(".note").first).to_contain_text("cp1250 for Serbian")
    expect(at_desk.locator("table").first).to_contain_text("Žižek")  # so it would look in cp1250
    at_desk.wait_for_load_state()  # the script that sends what is changed
    at_desk.select_option("select[name=encoding]", "cp1250")
    expect(at_desk.locator(".sheet")).to_contain_text("Žižek")


def test_an_operator_may_not_import(operator: Person) -> None:
    text = operator.open("/import", 403)
    assert "engineer" in text
    assert 'name="file"' not in text


def test_nobody_sees_the_file_of_another_and_no_path_leads_out(shop: Shop, at_desk: Page, tmp_path: Path) -> None:
    file = tmp_path / "mine.csv"
    file.write_text("measured\n39.99\n")
    send(at_desk, shop, file)
    token = re.search(r"/import/([\w-]{22})", at_desk.url)
    assert token
    with shop.server.client(shop.server.key("engineer")) as other:
        for path in (token[1], "..%2F..%2Fdemo.json", "a" * 22):
            assert other.get(f"/import/{path}", params={"characteristic": shop.characteristic}).status_code == 404


def test_a_foreign_page_cannot_send_a_file(engineer: Person, shop: Shop) -> None:
    answer = engineer.browser.post(
        "/import",
        data={"characteristic": shop.characteristic},
        files={"file": ("a.csv", b"measured\n1\n", "text/csv")},
    )
    assert answer.status_code == 403
