"""The report of one order: its readings alone, whatever was cut between them."""

from csv import DictReader
from io import BytesIO, StringIO
from statistics import mean
from typing import Any
from urllib.parse import quote
from zipfile import ZipFile

import pytest
from pypdf import PdfReader

from tests.forked import inband
from tests.servers import Server
from tests.shop import Person, Shop
from tests.views.reports.story import facts, file, report, scatter, table
from tests.waits import until

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


def test_many_at_once_are_of_it_alone(orders: Shop) -> None:
    body: dict[str, Any] = {"characteristics": [orders.characteristic], "sections": ["numbers"], "format": "csv"}
    job = orders.call("POST", "/reports", 201, **body, context={"order": ORDER, "nest": 0})
    until(lambda: orders.call("GET", f"/reports/{job['id']}")["state"] == "done", 120)
    whole = ZipFile(BytesIO(orders.admin.get(f"/api/v1/reports/{job['id']}/file").content))
    text = whole.read(f"report-{orders.characteristic}.csv").decode("utf-8-sig")
    values = {(row["section"], row["key"]): row["value"] for row in DictReader(StringIO(text))}
    assert values["numbers", "count"] == "6"
    assert ORDER in values.values()


@pytest.mark.parametrize(
    ("context", "field"),
    [({"nest": "second"}, "context.nest"), ({"order": "A\nB"}, "context.order"), ({"pallet": "3"}, "context.pallet")],
)
def test_many_at_once_of_a_context_that_there_is_not_are_refused(orders: Shop, context: object, field: str) -> None:
    body: dict[str, Any] = {"characteristics": [orders.characteristic]}
    refusal = orders.call("POST", "/reports", 422, **body, context=context)
    assert field in str(refusal["errors"])


def test_the_page_of_many_asks_for_it_and_says_it(orders: Shop, viewer: Person) -> None:
    fields = {"characteristic": orders.characteristic, "section": "numbers", "format": "csv"}
    viewer.post("/reports", **fields, **{"context.order": ORDER})
    assert "Order A-47 „Đ“ &amp; &lt;b&gt;" in viewer.open("/reports")


def test_a_command_asks_for_it(orders: Shop) -> None:
    asked = ("report", orders.characteristic, "--format", "csv", "--section", "numbers")
    database = {"INBAND_DATABASE_URL": orders.server.database.dsn}
    done = inband(*asked, "--context", f"order={ORDER}", "--context", "nest=0", **database)
    assert done.returncode == 0, done.stderr
    values = {
        (row["section"], row["key"]): row["value"] for row in DictReader(StringIO(done.stdout.removeprefix("\ufeff")))
    }
    assert values["numbers", "count"] == "6"
    for wrong, reason in (("order", "order=A-4711"), ("pallet=3", "pallet"), ("nest=b", "nest")):
        refused = inband(*asked, "--context", wrong, **database)
        assert refused.returncode
        assert reason in refused.stderr
