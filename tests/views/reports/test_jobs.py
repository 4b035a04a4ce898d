"""Many reports at once: made in the background, watched, cancelled, taken up again where a process was killed, thrown away."""

import csv
import io
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import psycopg
import pytest
from openpyxl import load_workbook
from playwright.sync_api import Page, expect
from pypdf import PdfReader

from app.access import actions as people
from app.views.reports import actions
from app.views.reports.bundle import Bundle
from app.views.reports.request import ReportRequest, SectionName
from app.views.reports.tables import ReportJob
from tests.conftest import RunServer, Server
from tests.shop import Person, Shop
from tests.views.reports.story import pushed, scatter

MANY = 12


@pytest.fixture(scope="module")
def shop(server: Server) -> Shop:
    """Twelve characteristics with readings, one with none."""
    made = Shop(server)
    for number in range(MANY):
        made.add(f"bore-{number}", mode="measure_only", tool_memory=0, average_memory=0)
        pushed(made, scatter(60, seed=number), f"bore-{number}")
    return made


def keys(number: int = MANY) -> list[str]:
    return [f"bore-{each}" for each in range(number)]


def ask(shop: Shop, status: int = 201, client: Any = None, **body: Any) -> Any:
    return shop.call("POST", "/reports", status, client, **body)


def state(shop: Shop, number: int) -> Any:
    return shop.call("GET", f"/reports/{number}")


def until(shop: Shop, number: int, wanted: Callable[[Any], bool], seconds: float = 120) -> Any:
    """The job once it is as wanted."""
    deadline = time.monotonic() + seconds
    while not wanted(found := state(shop, number)):
        assert time.monotonic() < deadline, found
        time.sleep(0.03)
    return found


def done(shop: Shop, number: int) -> Any:
    return until(shop, number, lambda job: job["state"] not in {"queued", "running"})


def fetched(shop: Shop, number: int) -> zipfile.ZipFile:
    answer = shop.admin.get(f"/api/v1/reports/{number}/file")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/zip"
    assert f'filename="reports-{number}.zip"' in answer.headers["content-disposition"]
    return zipfile.ZipFile(io.BytesIO(answer.content))


@contextmanager
def held_up(shop: Shop, key: str) -> Iterator[None]:
    """While this lasts nobody gets past that characteristic: what a report of it reads is locked."""
    with psycopg.connect(shop.server.database.dsn) as connection:
        connection.execute("LOCK TABLE stream IN ACCESS EXCLUSIVE MODE")
        yield


def caller(shop: Shop, name: str, role: str) -> httpx.Client:
    """Somebody with a key of that name."""
    with shop.server.database.begin() as session:
        secret = people.add_key(session, role=role, machine=None, name=name, actor="tests").secret
    made: httpx.Client = shop.server.client(secret)
    return made


def test_a_zip_of_pdfs_with_what_became_of_each(shop: Shop) -> None:
    asked = ask(shop, characteristics=keys(3), sections=["numbers", "capability"])
    assert (asked["state"], asked["total"], asked["file"]) == ("queued", 3, None)
    job = done(shop, asked["id"])
    assert (job["state"], job["done"], job["problems"], job["without_report"]) == ("done", 3, 0, [])
    assert job["file"] == f"/api/v1/reports/{job['id']}/file"
    whole = fetched(shop, job["id"])
    assert whole.testzip() is None
    assert sorted(whole.namelist()) == [*(f"report-bore-{n}.pdf" for n in range(3)), "summary.csv"]
    for n in range(3):
        first = PdfReader(io.BytesIO(whole.read(f"report-bore-{n}.pdf"))).pages[0].extract_text()
        assert f"(bore-{n})" in first
    summary = list(csv.DictReader(io.StringIO(whole.read("summary.csv").decode("utf-8-sig"))))
    assert [row["file"] for row in summary] == [f"report-bore-{n}.pdf" for n in range(3)]


@pytest.mark.parametrize("form", ["csv", "xlsx"])
def test_files_of_every_form_are_those_of_one_at_a_time(shop: Shop, form: str) -> None:
    job = done(shop, ask(shop, characteristics=["bore-1"], format=form, last=10**9)["id"])
    inside = fetched(shop, job["id"]).read(f"report-bore-1.{form}")
    alone = shop.admin.get(f"/api/v1/characteristics/bore-1/report.{form}?last=all").content
    if form == "csv":
        made = [line for line in inside.splitlines() if b"made_at" not in line]
        assert made == [line for line in alone.splitlines() if b"made_at" not in line]
    else:
        one, two = (load_workbook(io.BytesIO(each)) for each in (inside, alone))
        assert one.sheetnames == two.sheetnames
        cells = [list(book["Report"].iter_rows(min_row=4, values_only=True)) for book in (one, two)]
        assert cells[0] == cells[1]


def test_a_workbook_with_a_sheet_for_each_of_a_machine(shop: Shop) -> None:
    job = done(shop, ask(shop, machines=[shop.machine], format="workbook", last=10**9, sections=["numbers"])["id"])
    answer = shop.admin.get(f"/api/v1/reports/{job['id']}/file")
    book = load_workbook(io.BytesIO(answer.content))
    assert book.sheetnames == ["Summary", *sorted([*keys(), shop.characteristic])]
    rows = {row[0]: row for row in book["Summary"].iter_rows(min_row=4, values_only=True) if row[0]}
    found = shop.call("GET", "/characteristics/bore-5/statistics")
    assert rows["bore-5"][4] == found["count"] == 60
    assert rows["bore-5"][5] == pytest.approx(found["mean"] * 1000)


def test_progress_can_be_watched_and_counts_up(shop: Shop) -> None:
    number = ask(shop, characteristics=keys(6), sections=["numbers"])["id"]
    seen: list[int] = []

    def wanted(job: Any) -> bool:
        seen.append(job["done"])
        return bool(job["state"] == "done")

    until(shop, number, wanted)
    assert seen == sorted(seen)
    assert seen[-1] == 6
    assert len(set(seen)) > 2, "it was watched on the way"


def test_cancelled_while_it_runs(shop: Shop) -> None:
    number = ask(shop, characteristics=keys(), sections=["numbers", "chart", "decisions"])["id"]
    until(shop, number, lambda job: job["state"] == "running" and job["done"] >= 1)
    job = shop.call("POST", f"/reports/{number}/cancel")
    assert job["state"] == "cancelled"
    assert job["done"] < MANY
    time.sleep(1.5)  # whoever worked on it has noticed
    later = state(shop, number)
    assert (later["state"], later["done"], later["file"], later["current"]) == ("cancelled", job["done"], None, None)
    with shop.server.database.begin() as session:
        from app.views.reports.queries import parts

        assert list(parts(session, number)) == [], "what was ready is thrown away"
    refused = shop.call("POST", f"/reports/{number}/cancel", 409)
    assert "cancelled" in refused["detail"]
    assert shop.call("GET", f"/reports/{number}/file", 409)["status"] == 409
    # The thread goes on with the next one.
    assert done(shop, ask(shop, characteristics=["bore-0"], sections=["numbers"])["id"])["state"] == "done"


def test_cancelled_in_the_middle_of_one_characteristic(shop: Shop) -> None:
    with held_up(shop, "bore-0"):
        number = ask(shop, characteristics=keys(2), sections=["numbers"])["id"]
        until(shop, number, lambda job: job["current"] == "bore-0")
        shop.call("POST", f"/reports/{number}/cancel")
    time.sleep(1)
    assert (state(shop, number)["state"], state(shop, number)["done"]) == ("cancelled", 0)


def test_two_jobs_at_once_are_both_made_and_not_mixed(shop: Shop) -> None:
    one = ask(shop, characteristics=keys(4), sections=["numbers"], format="csv")["id"]
    two = ask(shop, characteristics=keys(8)[4:], sections=["numbers"], format="csv")["id"]
    assert {done(shop, one)["state"], done(shop, two)["state"]} == {"done"}
    assert sorted(fetched(shop, one).namelist()) == [*(f"report-bore-{n}.csv" for n in range(4)), "summary.csv"]
    assert sorted(fetched(shop, two).namelist()) == [*(f"report-bore-{n}.csv" for n in range(4, 8)), "summary.csv"]


def test_only_who_asked_or_an_engineer_may_cancel(shop: Shop) -> None:
    ana, boris, engineer = (caller(shop, *who) for who in (("ana", "viewer"), ("boris", "viewer"), ("eva", "engineer")))
    with held_up(shop, "bore-0"):
        number = ask(shop, client=shop.admin, characteristics=keys(1))["id"]
        refused = shop.call("POST", f"/reports/{number}/cancel", 403, boris)
        assert "engineer" in refused["what_to_do"]
        own = shop.call("POST", "/reports", 201, ana, characteristics=keys(1))["id"]
        namesake = caller(shop, "ana", "viewer")
        shop.call("POST", f"/reports/{own}/cancel", 403, namesake)  # a name may be had twice: the number counts
        assert shop.call("POST", f"/reports/{own}/cancel", 200, ana)["state"] == "cancelled"
        shop.call("POST", f"/reports/{number}/cancel", 200, engineer)


@pytest.mark.parametrize(
    ("body", "field", "said"),
    [
        ({"characteristics": ["nobody"]}, "characteristics", "no characteristic 'nobody'"),
        ({"machines": ["nobody"]}, "machines", "no machine 'nobody'"),
        ({"characteristics": []}, "characteristics", "names no characteristic"),
        (
            {"characteristics": ["bore-0"], "from": "2026-11-22T00:00:00Z", "to": "2026-11-21T00:00:00Z"},
            "from",
            "later than",
        ),
        ({"characteristics": ["bore-0"], "timezone": "Europe/Atlantis"}, "timezone", "Atlantis"),
        ({"characteristics": ["bore-0"], "last": 0}, "last", "1"),
        ({"characteristics": ["bore-0"], "sections": ["poetry"]}, "sections.0", "numbers"),
        ({"characteristics": ["bore-0"] * 501}, "characteristics", "500"),
    ],
)
def test_what_cannot_be_made_is_refused_by_name(shop: Shop, body: dict[str, Any], field: str, said: str) -> None:
    before = len(shop.call("GET", "/reports")["items"])
    refused = ask(shop, 422, **body)
    assert any(error["field"].startswith(field.split(".", maxsplit=1)[0]) for error in refused["errors"]), refused
    assert said in str(refused)
    assert len(shop.call("GET", "/reports")["items"]) == before


def test_no_more_wait_than_can_be_made(shop: Shop) -> None:
    with held_up(shop, "bore-0"):
        waiting = [ask(shop, characteristics=["bore-0"])["id"] for _each in range(actions.MOST_WAITING)]
        refused = shop.admin.post("/api/v1/reports", json={"characteristics": ["bore-0"]})
        assert refused.status_code == 429
        assert int(refused.headers["retry-after"]) > 0
        for number in waiting:
            shop.call("POST", f"/reports/{number}/cancel")


class TestKilled:
    """SIGKILL in the middle of it; nobody was told anything."""

    def test_it_goes_on_behind_what_was_ready(self, run_server: RunServer) -> None:
        with run_server() as server:
            shop = Shop(server)
            for number in range(6):
                shop.add(f"bore-{number}", mode="measure_only", tool_memory=0, average_memory=0)
                pushed(shop, scatter(40, seed=number), f"bore-{number}")
            number = ask(shop, characteristics=keys(6))["id"]
            until(shop, number, lambda job: job["done"] >= 2)
            server.kill()
            left = _ready(server, number)
            assert 2 <= len(left) < 6
            server.restart()
            job = done(shop, number)
            assert (job["state"], job["done"], job["problems"]) == ("done", 6, 0)
            whole = fetched(shop, number)
            assert len(whole.namelist()) == 7
            for place, content in left.items():
                assert whole.read(f"report-bore-{place}.pdf") == content, "what was ready was not made again"

    def test_another_process_takes_it_up(self, run_server: RunServer) -> None:
        """Two servers on one database: one is killed while it works, the other one finishes."""
        with run_server() as first, run_server(first.database.dsn) as second:
            shop = Shop(first)
            for number in range(6):
                shop.add(f"bore-{number}", mode="measure_only", tool_memory=0, average_memory=0)
                pushed(shop, scatter(40, seed=number), f"bore-{number}")
            other = second.client(second.key())
            begun = ask(shop, characteristics=keys(6))["id"]
            until(shop, begun, lambda job: job["done"] >= 1)
            threading.Thread(target=first.kill).start()
            deadline = time.monotonic() + 120
            while (found := other.get(f"/api/v1/reports/{begun}").json())["state"] != "done":
                assert time.monotonic() < deadline, found
                time.sleep(0.05)
            assert (found["done"], found["problems"]) == (6, 0)
            whole = zipfile.ZipFile(io.BytesIO(other.get(f"/api/v1/reports/{begun}/file").content))
            assert len(whole.namelist()) == 7


def _ready(server: Server, number: int) -> dict[int, bytes]:
    with server.database.begin() as session:
        from app.views.reports.queries import parts

        return {part.place: part.content for part in parts(session, number) if part.content is not None}


def test_a_process_that_was_only_slow_writes_no_more(shop: Shop) -> None:
    """Its token is another one's by now: what it brings is not kept."""
    with held_up(shop, "bore-0"):
        number = ask(shop, characteristics=keys(1), sections=["numbers"])["id"]
        until(shop, number, lambda job: job["state"] == "running")
        with shop.server.database.begin() as session:
            assert actions.take(session, number, "another process") is not None
            assert actions.keep(session, number, "the first process", 0, "bore-0", b"late", None) is False
            assert actions.finish(session, number, "the first process", "late.zip", b"late") is False
        shop.call("POST", f"/reports/{number}/cancel")


def test_finished_ones_are_thrown_away_after_a_week(shop: Shop) -> None:
    old, young = (done(shop, ask(shop, characteristics=["bore-0"], sections=["numbers"])["id"])["id"] for _n in "12")
    with psycopg.connect(shop.server.database.dsn, autocommit=True) as connection:
        connection.execute(
            "UPDATE report_job SET finished_at = now() - make_interval(days => %s, mins => 1) WHERE id = %s",
            [actions.KEPT_DAYS, old],
        )
    with shop.server.database.begin() as session:
        actions.drop_old(session)
    assert shop.call("GET", f"/reports/{old}", 404)["status"] == 404
    assert shop.call("GET", f"/reports/{old}/file", 404)["status"] == 404
    assert len(fetched(shop, young).namelist()) == 2


def test_the_oldest_files_go_first_when_they_are_too_much(shop: Shop, monkeypatch: pytest.MonkeyPatch) -> None:
    old, young = (done(shop, ask(shop, characteristics=["bore-0"], sections=["numbers"])["id"]) for _n in "12")
    monkeypatch.setattr(actions, "KEPT_BYTES", young["size"] + 1)
    with shop.server.database.begin() as session:
        actions.drop_old(session)
    assert shop.call("GET", f"/reports/{old['id']}", 404)["status"] == 404
    assert state(shop, young["id"])["state"] == "done"


def test_thrown_away_at_once_by_who_asked_for_them(shop: Shop) -> None:
    number = done(shop, ask(shop, characteristics=["bore-0"], sections=["numbers"])["id"])["id"]
    stranger = caller(shop, "carl", "viewer")
    assert stranger.delete(f"/api/v1/reports/{number}").status_code == 403
    assert shop.admin.delete(f"/api/v1/reports/{number}").status_code == 204
    assert shop.call("GET", f"/reports/{number}", 404)["status"] == 404
    with held_up(shop, "bore-0"):
        running = ask(shop, characteristics=["bore-0"])["id"]
        refused = shop.call("DELETE", f"/reports/{running}", 409)
        assert "cancel" in refused["what_to_do"].lower()
        shop.call("POST", f"/reports/{running}/cancel")


def test_one_that_cannot_be_made_spoils_no_other(shop: Shop) -> None:
    """A characteristic that is not there any more."""
    bundle = Bundle(ReportRequest(sections=(SectionName.NUMBERS,)), "csv")
    with shop.server.database.begin() as session:
        job = ReportJob(asked_by="tests", request=bundle.stored(["=gone", "bore-1"]), total=2)
        session.add(job)
        session.flush()
        number = job.id
    found = done(shop, number)
    assert (found["state"], found["done"], found["problems"]) == ("done", 2, 1)
    assert found["without_report"][0]["characteristic"] == "=gone"
    whole = fetched(shop, number)
    assert "report-bore-1.csv" in whole.namelist()
    assert "\r\n'=gone,," in whole.read("summary.csv").decode()
    assert "1 without a report" in Person(shop.server, "viewer").open("/reports")


class TestPage:
    """The same on the page."""

    def test_ask_watch_and_fetch(self, shop: Shop) -> None:
        ana = Person(shop.server, "viewer")
        text = ana.send(
            "/reports", characteristic="bore-2", format="csv", timezone="Europe/Belgrade", section="numbers"
        )
        assert ana.name in text
        number = shop.call("GET", "/reports")["items"][0]["id"]
        done(shop, number)
        text = ana.open("/reports")
        assert f'href="/api/v1/reports/{number}/file"' in text
        assert ana.browser.get(f"/api/v1/reports/{number}/file").status_code == 200

    def test_the_bar_moves_and_ends_in_a_file_without_a_reload(self, shop: Shop, page: Page) -> None:
        ana = Person(shop.server, "viewer")
        ana.sign_in(page)
        page.goto("/reports?characteristic=bore-3")
        for key in keys(3):
            page.locator(f"input[value={key}]").check()
        page.get_by_role("button", name="Create reports").click()
        number = shop.call("GET", "/reports")["items"][0]["id"]
        row = page.locator(f"#job-{number}")
        expect(row).to_contain_text("4 characteristics")
        expect(row).to_contain_text(ana.name)
        page.evaluate("window.stayed = true")
        with page.expect_download(timeout=120_000) as got:
            row.get_by_role("link", name="Fetch").click(timeout=120_000)
        assert got.value.suggested_filename == f"reports-{number}.zip"
        assert page.evaluate("window.stayed"), "the page was not loaded again"
        expect(row.locator("progress")).to_have_count(0)
        row.get_by_role("button", name="Throw away").click()
        expect(page.locator(f"#job-{number}")).to_have_count(0)

    def test_what_was_typed_wrong_is_kept_and_named(self, shop: Shop) -> None:
        ana = Person(shop.server, "viewer")
        text = ana.send("/reports", 422, characteristic="bore-2", **{"from": "yesterday", "timezone": "Mars"})
        assert 'id="f-from-error"' in text
        assert 'value="bore-2" checked' in text
        assert "Mars" in text

    def test_cancelling_what_is_finished_says_so(self, shop: Shop) -> None:
        number = done(shop, ask(shop, characteristics=["bore-0"], sections=["numbers"])["id"])["id"]
        engineer = Person(shop.server, "engineer")
        assert "finished already" in engineer.send(f"/reports/{number}/cancel", 409)
        assert f'id="job-{number}"' not in engineer.send(f"/reports/{number}/throw-away")
