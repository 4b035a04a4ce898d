"""Notes of people: written in words, seen on every chart of what they are about, withdrawn by those who may."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.conftest import Server
from tests.shop import Person, Shop
from tests.views.reports.story import report, table


@pytest.fixture
def shop(server: Server) -> Shop:
    made = Shop(server)
    for deviation in (0.2, 0.4, -0.3):
        made.read(deviation)
    return made


def write(shop: Shop, **more: Any) -> Any:
    fields = {"characteristic": shop.characteristic, "text": "New batch of bars"} | more
    return shop.call("POST", "/notes", 201, **{name: value for name, value in fields.items() if value is not None})


def marks(shop: Shop, path: str) -> dict[str, Any]:
    """The events of a chart; nothing where it has none."""
    found = [trace for trace in shop.call("GET", path)["data"] if trace.get("meta") == "events"]
    return found[0] if found else {"x": [], "text": [], "customdata": []}


def zones(shop: Shop) -> dict[str, Any]:
    return marks(shop, f"/characteristics/{shop.characteristic}/figures/zones?last=all")


class TestWriting:
    def test_it_stands_at_its_reading_on_the_chart(self, shop: Shop) -> None:
        note = write(shop, sequence=2, text="Chip <b>under</b> the stylus")
        found = zones(shop)
        assert (found["x"], found["customdata"]) == ([2], [f"/notes/{note['id']}"])
        assert "Chip &lt;b&gt;under&lt;/b&gt; the stylus" in found["text"][0]
        assert note["at"] == shop.call("GET", f"/readings/{shop.characteristic}/2")["measured_at"]

    def test_one_of_the_machine_stands_on_every_chart_of_the_machine(self, shop: Shop) -> None:
        note = write(shop, characteristic=None, machine=shop.machine)
        shop.read(0.1)
        assert zones(shop)["customdata"] == [f"/notes/{note['id']}"]
        in_time = marks(shop, f"/characteristics/{shop.characteristic}/figures/run?last=all")
        assert in_time["customdata"] == [f"/notes/{note['id']}"]

    def test_a_past_moment_is_where_it_stands(self, shop: Shop) -> None:
        at = datetime.now(UTC) - timedelta(days=1)
        assert write(shop, at=at.isoformat())["at"][:19] == at.isoformat()[:19]
        assert zones(shop)["x"] == []  # before the first reading

    def test_sent_twice_it_is_one(self, shop: Shop) -> None:
        first = write(shop, key="k1")
        body: dict[str, Any] = {"characteristic": shop.characteristic, "text": "New batch of bars", "key": "k1"}
        assert shop.call("POST", "/notes", 200, **body) == first
        shop.call("POST", "/notes", 409, **body | {"text": "Another"})

    @pytest.mark.parametrize(
        ("body", "field"),
        [
            ({"text": ""}, "text"),
            ({"text": "x" * 1001}, "text"),
            ({"at": "2199-01-01T00:00:00Z"}, "at"),
            ({"machine": "another"}, "machine"),
            ({"characteristic": None}, "machine"),
            ({"characteristic": None, "machine": "any", "sequence": 1}, "sequence"),
        ],
    )
    def test_a_refusal_names_the_field(self, shop: Shop, body: dict[str, Any], field: str) -> None:
        given = {"characteristic": shop.characteristic, "text": "words"} | body
        answer = shop.call("POST", "/notes", 422, **{name: each for name, each in given.items() if each is not None})
        assert [error["field"] for error in answer["errors"]] == [field]

    def test_a_reading_that_is_not_there_is_not_found(self, shop: Shop) -> None:
        shop.call("POST", "/notes", 404, characteristic=shop.characteristic, sequence=99, text="words")


class TestLists:
    def test_of_a_characteristic_those_on_its_charts(self, shop: Shop) -> None:
        shop.add(f"{shop.characteristic}-b")
        own, machine = write(shop), write(shop, characteristic=None, machine=shop.machine)
        other = write(shop, characteristic=f"{shop.characteristic}-b")
        listed = shop.call("GET", f"/notes?characteristic={shop.characteristic}")["items"]
        assert [each["id"] for each in listed] == [machine["id"], own["id"]]
        listed = shop.call("GET", f"/notes?machine={shop.machine}")["items"]
        assert [each["id"] for each in listed] == [other["id"], machine["id"], own["id"]]

    def test_by_the_moment(self, shop: Shop) -> None:
        write(shop, at="2026-11-01T08:00:00Z")
        path = f"/notes?machine={shop.machine}&from=2026-11-01T07:00:00Z&to=2026-11-01T0"
        assert len(shop.call("GET", f"{path}9:00:00Z")["items"]) == 1
        assert shop.call("GET", f"{path}7:30:00Z")["items"] == []

    def test_search_finds_its_words(self, shop: Shop) -> None:
        note = write(shop, text=f"Scale thicker than usual at {shop.machine}!")
        hits = shop.call("GET", f"/search?q=usual at {shop.machine}!")["items"]
        assert [(hit["kind"], hit["path"]) for hit in hits] == [("note", f"/notes/{note['id']}")]

    def test_a_report_has_it(self, shop: Shop) -> None:
        write(shop, sequence=1)
        (row,) = table(report(shop, "last=all"), "notes")
        assert (row["reading"]["value"], row["note"]["value"]) == (1, "New batch of bars")

    def test_a_machine_sees_its_own_only(self, shop: Shop, server: Server) -> None:
        number, other = write(shop)["id"], Shop(server)
        shop.call("GET", f"/notes/{number}", client=shop.machine_client)
        shop.call("GET", f"/notes/{number}", 403, client=other.machine_client)
        assert shop.call("GET", "/notes", client=other.machine_client)["items"] == []
        shop.call("POST", "/notes", 403, client=shop.machine_client, machine=shop.machine, text="words")


class TestWithdrawing:
    def test_it_leaves_charts_and_lists_and_stays_on_record(self, shop: Shop) -> None:
        number = write(shop, sequence=2)["id"]
        shop.call("POST", f"/notes/{number}/withdraw", reason="Wrong machine")
        assert zones(shop)["x"] == []
        assert shop.call("GET", f"/notes?machine={shop.machine}")["items"] == []
        (kept,) = shop.call("GET", f"/notes?machine={shop.machine}&withdrawn=true")["items"]
        assert (kept["text"], kept["withdrawn"]["reason"]) == ("New batch of bars", "Wrong machine")
        actions = [entry["action"] for entry in shop.call("GET", f"/audit?subject=note/{number}")["items"]]
        assert actions == ["note withdrawn", "note written"]
        shop.call("POST", f"/notes/{number}/withdraw", 409, reason="Once more")

    def test_its_author_or_an_engineer_may(self, shop: Shop, server: Server) -> None:
        author, another, engineer = (server.client(server.key(role)) for role in ("operator", "operator", "engineer"))
        first, second = (
            shop.call("POST", "/notes", 201, client=author, machine=shop.machine, text="words")["id"] for _ in range(2)
        )
        shop.call("POST", f"/notes/{first}/withdraw", 403, client=another, reason="Not mine")
        shop.call("POST", f"/notes/{first}/withdraw", client=author, reason="Mine")
        shop.call("POST", f"/notes/{second}/withdraw", client=engineer, reason="I may")


class TestPages:
    def test_one_button_one_field_done(self, shop: Shop, server: Server, page: Page) -> None:
        Person(server, "operator").sign_in(page)
        for path, where in (
            (f"/characteristics/{shop.characteristic}", "Seat"),
            (f"/machines/{shop.machine}", "Lathe"),
        ):
            page.goto(path)
            page.get_by_role("link", name="Write a note").first.click()
            page.get_by_label("Note", exact=True).fill(f"Heard a noise at {where}")
            page.get_by_role("button", name="Write the note").click()
            page.wait_for_url(f"**{path}#notes")
            expect(page.locator("#notes")).to_contain_text(f"Heard a noise at {where}")

    def test_a_selected_reading_offers_it(self, shop: Shop, server: Server) -> None:
        operator, viewer = Person(server, "operator"), Person(server, "viewer")
        panel, link = f"/characteristics/{shop.characteristic}/readings/2/panel", "Write a note"
        assert link in operator.open(panel)
        assert link not in viewer.open(panel)
        form = f"/notes/new?characteristic={shop.characteristic}&sequence=2"
        assert "At reading 2 of" in operator.open(form)
        viewer.open(form, 403)

    def test_what_was_typed_stays_where_the_time_is_wrong(self, shop: Shop, server: Server) -> None:
        operator = Person(server, "operator")
        fields = {"machine": shop.machine, "text": "Words that were typed", "at": "2199-01-01T08:00"}
        assert "Words that were typed" in operator.send("/notes/new", 422, **fields)

    def test_withdrawn_on_its_page(self, shop: Shop, server: Server) -> None:
        number, engineer = write(shop)["id"], Person(server, "engineer")
        assert "must not be empty" in engineer.send(f"/notes/{number}/withdraw", 422, reason=" ").lower()
        assert "Wrong shaft" in engineer.send(f"/notes/{number}/withdraw", reason="Wrong shaft")
        assert "Already withdrawn by somebody else" in engineer.send(f"/notes/{number}/withdraw", reason="Again")

    def test_at_the_station(self, shop: Shop, server: Server, page: Page) -> None:
        Person(server, "operator").sign_in(page)
        page.goto(f"/station/{shop.machine}")
        page.get_by_role("link", name="Write a note").click()
        dialog = page.locator("#confirm-dialog")
        dialog.get_by_role("textbox", name="Note").fill("Jaw 2 is worn")
        dialog.get_by_role("button", name="Write the note").click()
        expect(page.get_by_role("status").filter(has_text="Note written: Jaw 2 is worn")).to_be_visible()
        (note,) = shop.call("GET", f"/notes?machine={shop.machine}")["items"]
        assert (note["text"], note["characteristic"]) == ("Jaw 2 is worn", None)


def test_an_open_chart_shows_what_is_written_meanwhile(shop: Shop, server: Server, page: Page) -> None:
    Person(server, "viewer").sign_in(page)
    page.goto(f"/characteristics/{shop.characteristic}")
    chart = page.locator("plotly-chart.zones")
    expect(chart.locator(".main-svg").first).to_be_attached()
    expect(page.locator("live-status")).to_contain_text("live")
    write(shop, sequence=2, text="Probe cleaned")
    expect(chart.get_by_text("Probe cleaned").first).to_be_attached()
