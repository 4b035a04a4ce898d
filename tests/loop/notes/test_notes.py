"""Notes of people: written in words, seen on every chart of what they are about, withdrawn by those who may."""

from datetime import UTC, datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

import pytest
from playwright.sync_api import Page, expect

from app.errors import Invalid
from app.language.times import in_zone
from app.loop.notes.schemas import NoteIn
from app.web.forms import typed
from tests.pages.looks import live
from tests.servers import Server
from tests.shop import Person, Shop
from tests.views.reports.story import report, table


@pytest.fixture
def running(shop: Shop) -> Shop:
    """It has measured three parts."""
    for deviation in (0.2, 0.4, -0.3):
        shop.read(deviation)
    return shop


def write(running: Shop, **more: Any) -> Any:
    fields = {"characteristic": running.characteristic, "text": "New batch of bars"} | more
    return running.call("POST", "/notes", 201, **{name: value for name, value in fields.items() if value is not None})


def marks(running: Shop, path: str) -> dict[str, Any]:
    """The events of a chart; nothing where it has none."""
    found = [trace for trace in running.call("GET", path)["data"] if trace.get("meta") == "events"]
    return found[0] if found else {"x": [], "text": [], "customdata": []}


def zones(running: Shop) -> dict[str, Any]:
    return marks(running, f"/characteristics/{running.characteristic}/figures/zones?last=all")


class TestWriting:
    def test_it_stands_at_its_reading_on_the_chart(self, running: Shop) -> None:
        note = write(running, sequence=2, text="Chip <b>under</b> the stylus")
        found = zones(running)
        assert (found["x"], found["customdata"]) == ([2], [f"/notes/{note['id']}"])
        assert "Chip &lt;b&gt;under&lt;/b&gt; the stylus" in found["text"][0]
        assert note["at"] == running.call("GET", f"/readings/{running.characteristic}/2")["measured_at"]

    def test_one_of_the_machine_stands_on_every_chart_of_the_machine(self, running: Shop) -> None:
        note = write(running, characteristic=None, machine=running.machine)
        running.read(0.1)
        assert zones(running)["customdata"] == [f"/notes/{note['id']}"]
        in_time = marks(running, f"/characteristics/{running.characteristic}/figures/run?last=all")
        assert in_time["customdata"] == [f"/notes/{note['id']}"]

    def test_a_past_moment_is_where_it_stands(self, running: Shop) -> None:
        at = datetime.now(UTC) - timedelta(days=1)
        assert write(running, at=at.isoformat())["at"][:19] == at.isoformat()[:19]
        assert zones(running)["x"] == []  # before the first reading

    def test_sent_twice_it_is_one(self, running: Shop) -> None:
        first = write(running, key="k1")
        body: dict[str, Any] = {"characteristic": running.characteristic, "text": "New batch of bars", "key": "k1"}
        assert running.call("POST", "/notes", 200, **body) == first
        running.call("POST", "/notes", 409, **body | {"text": "Another"})

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
    def test_a_refusal_names_the_field(self, running: Shop, body: dict[str, Any], field: str) -> None:
        given = {"characteristic": running.characteristic, "text": "words"} | body
        answer = running.call("POST", "/notes", 422, **{name: each for name, each in given.items() if each is not None})
        assert [error["field"] for error in answer["errors"]] == [field]

    def test_a_reading_that_is_not_there_is_not_found(self, running: Shop) -> None:
        running.call("POST", "/notes", 404, characteristic=running.characteristic, sequence=99, text="words")


class TestLists:
    def test_of_a_characteristic_those_on_its_charts(self, running: Shop) -> None:
        running.add(f"{running.characteristic}-b")
        own, machine = write(running), write(running, characteristic=None, machine=running.machine)
        other = write(running, characteristic=f"{running.characteristic}-b")
        listed = running.call("GET", f"/notes?characteristic={running.characteristic}")["items"]
        assert [each["id"] for each in listed] == [machine["id"], own["id"]]
        listed = running.call("GET", f"/notes?machine={running.machine}")["items"]
        assert [each["id"] for each in listed] == [other["id"], machine["id"], own["id"]]

    def test_by_the_moment(self, running: Shop) -> None:
        write(running, at="2026-11-01T08:00:00Z")
        path = f"/notes?machine={running.machine}&from=2026-11-01T07:00:00Z&to=2026-11-01T0"
        assert len(running.call("GET", f"{path}9:00:00Z")["items"]) == 1
        assert running.call("GET", f"{path}7:30:00Z")["items"] == []

    def test_search_finds_its_words(self, running: Shop) -> None:
        note = write(running, text=f"Scale thicker than usual at {running.machine}!")
        hits = running.call("GET", f"/search?q=usual at {running.machine}!")["items"]
        assert [(hit["kind"], hit["path"]) for hit in hits] == [("note", f"/notes/{note['id']}")]

    def test_a_report_has_it(self, running: Shop) -> None:
        write(running, sequence=1)
        (row,) = table(report(running, "last=all"), "notes")
        assert (row["reading"]["value"], row["note"]["value"]) == (1, "New batch of bars")

    def test_a_machine_sees_its_own_only(self, running: Shop, server: Server) -> None:
        number, other = write(running)["id"], Shop(server)
        running.call("GET", f"/notes/{number}", client=running.machine_client)
        running.call("GET", f"/notes/{number}", 403, client=other.machine_client)
        assert running.call("GET", "/notes", client=other.machine_client)["items"] == []
        running.call("POST", "/notes", 403, client=running.machine_client, machine=running.machine, text="words")


class TestWithdrawing:
    def test_it_leaves_charts_and_lists_and_stays_on_record(self, running: Shop) -> None:
        number = write(running, sequence=2)["id"]
        running.call("POST", f"/notes/{number}/withdraw", reason="Wrong machine")
        assert zones(running)["x"] == []
        assert running.call("GET", f"/notes?machine={running.machine}")["items"] == []
        (kept,) = running.call("GET", f"/notes?machine={running.machine}&withdrawn=true")["items"]
        assert (kept["text"], kept["withdrawn"]["reason"]) == ("New batch of bars", "Wrong machine")
        actions = [entry["action"] for entry in running.call("GET", f"/audit?subject=note/{number}")["items"]]
        assert actions == ["note withdrawn", "note written"]
        running.call("POST", f"/notes/{number}/withdraw", 409, reason="Once more")

    def test_its_author_or_an_engineer_may(self, running: Shop, server: Server) -> None:
        author, another, engineer = (server.client(server.key(role)) for role in ("operator", "operator", "engineer"))
        first, second = (
            running.call("POST", "/notes", 201, client=author, machine=running.machine, text="words")["id"]
            for _ in range(2)
        )
        running.call("POST", f"/notes/{first}/withdraw", 403, client=another, reason="Not mine")
        running.call("POST", f"/notes/{first}/withdraw", client=author, reason="Mine")
        running.call("POST", f"/notes/{second}/withdraw", client=engineer, reason="I may")


class TestPages:
    def test_one_button_one_field_done(self, running: Shop, server: Server, page: Page) -> None:
        Person(server, "operator").sign_in(page)
        for path, where in (
            (f"/characteristics/{running.characteristic}", "Seat"),
            (f"/machines/{running.machine}", "Lathe"),
        ):
            page.goto(path)
            page.get_by_role("link", name="Write a note").first.click()
            page.get_by_label("Note", exact=True).fill(f"Heard a noise at {where}")
            page.get_by_role("button", name="Write the note").click()
            page.wait_for_url(f"**{path}#notes")
            expect(page.locator("#notes")).to_contain_text(f"Heard a noise at {where}")

    def test_a_selected_reading_offers_it(self, running: Shop, server: Server) -> None:
        operator, viewer = Person(server, "operator"), Person(server, "viewer")
        panel, link = f"/characteristics/{running.characteristic}/readings/2/panel", "Write a note"
        assert link in operator.open(panel)
        assert link not in viewer.open(panel)
        form = f"/notes/new?characteristic={running.characteristic}&sequence=2"
        assert "At reading 2 of" in operator.open(form)
        viewer.open(form, 403)

    def test_what_was_typed_stays_where_the_time_is_wrong(self, running: Shop, server: Server) -> None:
        operator = Person(server, "operator")
        fields = {"machine": running.machine, "text": "Words that were typed", "at": "2199-01-01T08:00"}
        assert "Words that were typed" in operator.send("/notes/new", 422, **fields)

    def test_what_no_field_shows_is_said_at_the_top(self, running: Shop, server: Server) -> None:
        operator = Person(server, "operator")
        fields: dict[str, Any] = {"characteristic": running.characteristic, "key": "used"}
        operator.send("/notes/new", text="First words", **fields)
        assert "was sent with the key" in operator.send("/notes/new", 409, text="Other words", **fields)

    def test_a_time_that_the_clock_skips_is_refused_in_words_for_people(self) -> None:
        form = {"machine": "lathe", "text": "Oil", "at": "2026-03-29T02:30"}
        with in_zone(ZoneInfo("Europe/Belgrade")), pytest.raises(Invalid) as refused:
            typed(NoteIn, form)
        assert refused.value.errors[0].message.endswith("the clocks go forward in that hour")

    def test_withdrawn_on_its_page(self, running: Shop, server: Server) -> None:
        number, engineer = write(running)["id"], Person(server, "engineer")
        assert "must not be empty" in engineer.send(f"/notes/{number}/withdraw", 422, reason=" ").lower()
        assert "Wrong shaft" in engineer.send(f"/notes/{number}/withdraw", reason="Wrong shaft")
        assert "Already withdrawn by another user" in engineer.send(f"/notes/{number}/withdraw", reason="Again")

    @pytest.mark.long
    def test_at_the_station(self, running: Shop, server: Server, page: Page) -> None:
        Person(server, "operator").sign_in(page)
        page.goto(f"/station/{running.machine}")
        page.get_by_role("link", name="Write a note").click()
        dialog = page.locator("#confirm-dialog")
        dialog.get_by_role("textbox", name="Note").fill("Jaw 2 is worn")
        dialog.get_by_role("button", name="Write the note").click()
        expect(page.get_by_role("status").filter(has_text="Note written: Jaw 2 is worn")).to_be_visible()
        (note,) = running.call("GET", f"/notes?machine={running.machine}")["items"]
        assert (note["text"], note["characteristic"]) == ("Jaw 2 is worn", None)


def test_an_open_chart_shows_what_is_written_meanwhile(running: Shop, server: Server, page: Page) -> None:
    Person(server, "viewer").sign_in(page)
    page.goto(f"/characteristics/{running.characteristic}")
    chart = page.locator("plotly-chart.zones")
    expect(chart.locator(".main-svg").first).to_be_attached()
    live(page)
    write(running, sequence=2, text="Probe cleaned")
    expect(chart.get_by_text("Probe cleaned").first).to_be_attached()
