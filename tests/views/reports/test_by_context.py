"""The report of one order: its readings alone, whatever was cut between them."""

from io import BytesIO
from statistics import mean
from urllib.parse import quote

import pytest
from pypdf import PdfReader

from tests.conftest import Server
from tests.shop import Person, Shop
from tests.views.reports.story import facts, file, report, scatter, table

ORDER = "A-47 „Đ“ & <b>"
HERE = f"context.order={quote(ORDER)}"


@pytest.fixture(scope="module")
def orders(common_server: Server) -> Shop:
    """Twelve parts of an order, among sixty of another that lie 3 µm higher."""
    shop = Shop(common_server)
    names = [ORDER if at % 6 == 0 else "B" for at in range(72)]
    values = [value + 3 * (name == "B") for value, name in zip(scatter(72), names, strict=True)]
    contexts = [{"order": name, "nest": at // 6 % 2} for at, name in enumerate(names)]
    shop.push(values, part=[f"{name[0]}{at}" for at, name in enumerate(names)], context=contexts)
    return shop


def test_its_numbers_are_of_its_readings_alone(orders: Shop) -> None:
    said = report(orders, HERE)
    numbers = facts(said, "numbers")
    assert numbers["count"]["value"] == 12
    assert numbers["mean"]["value"] == pytest.approx(mean(scatter(72)[::6]), abs=1e-6)
    assert facts(said, "summary")["readings"]["value"] == 12
    assert [row["part"]["value"][0] for row in table(said, "decisions")] == ["A"] * 12
    corrected = {
        answer["correction"]["number"]
        for answer in orders.call("GET", f"/readings?characteristic={orders.characteristic}&limit=100&{HERE}")["items"]
        if answer["correction"]
    }
    assert facts(said, "corrections")["issued"]["value"] == len(corrected)


def test_every_page_names_it(orders: Shop) -> None:
    said = report(orders, HERE)
    assert said["period"].startswith(f"Order {ORDER}, ")
    (named,) = [fact for fact in said["head"] if fact["key"] == "context.order"]
    assert (named["name"], named["value"]) == ("Order", ORDER)
    text = "".join(page.extract_text() for page in PdfReader(BytesIO(file(orders, "pdf", HERE))).pages)
    assert "A-47 „Đ“ & <b>" in text


def test_last_and_nest_narrow_it_further(orders: Shop) -> None:
    assert facts(report(orders, f"{HERE}&last=5"), "numbers")["count"]["value"] == 5
    assert facts(report(orders, "context.order=B&context.nest=1"), "numbers")["count"]["value"] == 30


def test_an_order_that_nothing_was_cut_for_has_an_empty_report(orders: Shop) -> None:
    said = report(orders, "context.order=C")
    assert said["period"] == "Order C, no readings"
    assert facts(said, "numbers")["count"]["value"] == 0


def test_the_page_asks_for_it_and_its_files_hold_it(orders: Shop, viewer: Person) -> None:
    page = viewer.open(f"/characteristics/{orders.characteristic}/report?{HERE}")
    assert 'name="context.order" value="A-47 „Đ“ &amp; &lt;b&gt;"' in page
    assert f"report.pdf?context.order={quote(ORDER).replace('%20', '+')}" in page
    assert "Order A-47 „Đ“ &amp; &lt;b&gt;, " in page
