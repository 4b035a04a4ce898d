"""Many reports at once: made in the background, watched, cancelled, taken up again where a process was killed, thrown away."""

import csv
import io
import os
import signal
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest
from openpyxl import load_workbook
from playwright.sync_api import Page, expect
from psycopg.rows import dict_row
from pypdf import PdfReader

from app.access import actions as people
from app.views.reports import actions
from app.views.reports.bundle import Bundle
from app.views.reports.request import ReportRequest, SectionName
from app.views.reports.tables import ReportJob
from tests.servers import RunServer, Server
from tests.shop import Person, Shop
from tests.views.reports.story import scatter
from tests.waits import until

pytestmark = pytest.mark.own_server

MANY = 6


@pytest.fixture(scope="module")
def bores(common_shop: Shop) -> Shop:
    """Six characteristics with readings, one with none."""
    for number in range(MANY):
        common_shop.add(f"bore-{number}", mode="measure_only", tool_memory=0, average_memory=0)
        common_shop.push(scatter(60, seed=number), f"bore-{number}")
    return common_shop


def keys(number: int = MANY) -> list[str]:
    return [f"bore-{each}" for each in range(number)]


def ask(shop: Shop, status: int = 201, client: Any = None, **body: Any) -> Any:
    return shop.call("POST", "/reports", status, client, **body)


def state(shop: Shop, number: int) -> Any:
    return shop.call("GET", f"/reports/{number}")


def done(shop: Shop, number: int) -> Any:
    until(lambda: state(shop, number)["state"] not in {"queued", "running"}, 120)
    return state(shop, number)


def fetched(shop: Shop, number: int) -> zipfile.ZipFile:
    answer = shop.admin.get(f"/api/v1/reports/{number}/file")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/zip"
    assert f'filename="reports-{number}.zip"' in answer.headers["content-disposition"]
    return zipfile.ZipFile(io.BytesIO(answer.content))


@contextmanager
def held_up(shop: Shop) -> Iterator[Callable[[int], None]]:
    """While this lasts no characteristic gets its report: what is read for it is locked. What it gives lets a job make one."""
    with ExitStack() as holding, psycopg.connect(shop.server.database.dsn, autocommit=True) as looking:

        def locked() -> psycopg.Connection:
            connection = psycopg.connect(shop.server.database.dsn)
            connection.execute("SET LOCAL lock_timeout = '60s'")
            connection.execute("LOCK TABLE stream IN ACCESS EXCLUSIVE MODE")
            return connection

        def waits(mode: str) -> bool:
            found = looking.execute(
                "SELECT 1 FROM pg_locks WHERE relation = 'stream'::regclass AND NOT granted AND mode = %s", [mode]
            )
            return found.fetchone() is not None

        def let_one_pass(number: int) -> None:
            before = state(shop, number)["done"]
            while state(shop, number)["done"] == before:
                until(lambda: waits("AccessShareLock"))
                with ThreadPoolExecutor(1) as pool:
                    following = pool.submit(locked)  # who makes the report is first in the queue
                    until(lambda: waits("AccessExclusiveLock"))
                    holding.close()
                    holding.callback(following.result().close)
                until(lambda: state(shop, number)["done"] > before or waits("AccessShareLock"))

        holding.callback(locked().close)
        yield let_one_pass


def working_on(shop: Shop, number: int, key: str) -> None:
    """Wait until the report of that characteristic is being made."""
    until(lambda: state(shop, number)["current"] == key)


def caller(shop: Shop, name: str, role: str) -> httpx.Client:
    """Somebody with a key of that name."""
    with shop.server.database.begin() as session:
        secret = people.add_key(session, role=role, machine=None, name=name, actor="tests").secret
    made: httpx.Client = shop.server.client(secret)
    return made


def test_a_zip_of_pdfs_with_what_became_of_each(bores: Shop) -> None:
    asked = ask(bores, characteristics=keys(3), sections=["numbers", "capability"])
    assert (asked["state"], asked["total"], asked["file"]) == ("queued", 3, None)
    job = done(bores, asked["id"])
    assert (job["state"], job["done"], job["problems"], job["without_report"]) == ("done", 3, 0, [])
    assert job["file"] == f"/api/v1/reports/{job['id']}/file"
    whole = fetched(bores, job["id"])
    assert whole.testzip() is None
    assert sorted(whole.namelist()) == [*(f"report-bore-{n}.pdf" for n in range(3)), "summary.csv"]
    for n in range(3):
        first = PdfReader(io.BytesIO(whole.read(f"report-bore-{n}.pdf"))).pages[0].extract_text()
        assert f"(bore-{n})" in first
    summary = list(csv.DictReader(io.StringIO(whole.read("summary.csv").decode("utf-8-sig"))))
    assert [row["file"] for row in summary] == [f"report-bore-{n}.pdf" for n in range(3)]


@pytest.mark.parametrize("form", ["csv", "xlsx"])
def test_files_of_every_form_are_those_of_one_at_a_time(bores: Shop, form: str) -> None:
    job = done(bores, ask(bores, characteristics=["bore-1"], format=form, last=10**9)["id"])
    inside = fetched(bores, job["id"]).read(f"report-bore-1.{form}")
    alone = bores.admin.get(f"/api/v1/characteristics/bore-1/report.{form}?last=all").content
    if form == "csv":
        made = [line for line in inside.splitlines() if b"made_at" not in line]
        assert made == [line for line in alone.splitlines() if b"made_at" not in line]
    else:
        one, two = (load_workbook(io.BytesIO(each)) for each in (inside, alone))
        assert one.sheetnames == two.sheetnames
        cells = [list(book["Report"].iter_rows(min_row=4, values_only=True)) for book in (one, two)]
        assert cells[0] == cells[1]


def test_a_workbook_with_a_sheet_for_each_of_a_machine(bores: Shop) -> None:
    job = done(bores, ask(bores, machines=[bores.machine], format="workbook", last=10**9, sections=["numbers"])["id"])
    answer = bores.admin.get(f"/api/v1/reports/{job['id']}/file")
    book = load_workbook(io.BytesIO(answer.content))
    assert book.sheetnames == ["Summary", *sorted([*keys(), bores.characteristic])]
    rows = {row[0]: row for row in book["Summary"].iter_rows(min_row=4, values_only=True) if row[0]}
    found = bores.call("GET", "/characteristics/bore-5/statistics")
    assert rows["bore-5"][4] == found["count"] == 60
    assert rows["bore-5"][5] == pytest.approx(found["mean"] * 1000)


def test_progress_can_be_watched_and_counts_up(bores: Shop) -> None:
    with held_up(bores) as let_one_pass:
        number = ask(bores, characteristics=keys(2), sections=["numbers"])["id"]
        for ready, key in enumerate(keys(2)):
            working_on(bores, number, key)
            assert (state(bores, number)["state"], state(bores, number)["done"]) == ("running", ready)
            let_one_pass(number)
        assert state(bores, number)["done"] == 2
    assert done(bores, number)["state"] == "done"


def test_cancelled_while_it_runs(bores: Shop) -> None:
    with held_up(bores) as let_one_pass:
        number = ask(bores, characteristics=keys(3), sections=["numbers"])["id"]
        let_one_pass(number)
        job = bores.call("POST", f"/reports/{number}/cancel")
        assert (job["state"], job["done"]) == ("cancelled", 1)
    # The thread goes on with the next one: it has noticed.
    assert done(bores, ask(bores, characteristics=["bore-0"], sections=["numbers"])["id"])["state"] == "done"
    later = state(bores, number)
    assert (later["state"], later["done"], later["file"], later["current"]) == ("cancelled", 1, None, None)
    with bores.server.database.begin() as session:
        from app.views.reports.queries import parts

        assert list(parts(session, number)) == [], "what was ready is thrown away"
    refused = bores.call("POST", f"/reports/{number}/cancel", 409)
    assert "cancelled" in refused["detail"]
    assert bores.call("GET", f"/reports/{number}/file", 409)["status"] == 409


def test_cancelled_in_the_middle_of_one_characteristic(bores: Shop) -> None:
    with held_up(bores):
        number = ask(bores, characteristics=keys(2), sections=["numbers"])["id"]
        working_on(bores, number, "bore-0")
        bores.call("POST", f"/reports/{number}/cancel")
    done(bores, ask(bores, characteristics=["bore-0"], sections=["numbers"])["id"])
    assert (state(bores, number)["state"], state(bores, number)["done"]) == ("cancelled", 0)


def test_two_jobs_at_once_are_both_made_and_not_mixed(bores: Shop) -> None:
    one = ask(bores, characteristics=keys(3), sections=["numbers"], format="csv")["id"]
    two = ask(bores, characteristics=keys(6)[3:], sections=["numbers"], format="csv")["id"]
    assert {done(bores, one)["state"], done(bores, two)["state"]} == {"done"}
    assert sorted(fetched(bores, one).namelist()) == [*(f"report-bore-{n}.csv" for n in range(3)), "summary.csv"]
    assert sorted(fetched(bores, two).namelist()) == [*(f"report-bore-{n}.csv" for n in range(3, 6)), "summary.csv"]


def test_only_who_asked_or_an_engineer_may_cancel(bores: Shop) -> None:
    ana, boris, engineer = (
        caller(bores, *who) for who in (("ana", "viewer"), ("boris", "viewer"), ("eva", "engineer"))
    )
    with held_up(bores):
        number = ask(bores, client=bores.admin, characteristics=keys(1))["id"]
        refused = bores.call("POST", f"/reports/{number}/cancel", 403, boris)
        assert "engineer" in refused["what_to_do"]
        own = bores.call("POST", "/reports", 201, ana, characteristics=keys(1))["id"]
        namesake = caller(bores, "ana", "viewer")
        bores.call("POST", f"/reports/{own}/cancel", 403, namesake)  # a name may be had twice: the number counts
        assert bores.call("POST", f"/reports/{own}/cancel", 200, ana)["state"] == "cancelled"
        bores.call("POST", f"/reports/{number}/cancel", 200, engineer)


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
        ({"characteristics": ["bore-0"], "from": "2026-11-22", "to": "2026-11-21"}, "from", "2026-11-22 is later than"),
        (
            {"characteristics": ["bore-0"], "from": "2026-11-22", "to": "2026-11-21", "timezone": "Asia/Tokyo"},
            "from",
            "exchange the two",
        ),
        ({"characteristics": ["bore-0"], "to": "9999-12-31"}, "to", "9999"),
        ({"characteristics": ["bore-0"], "timezone": "Europe/Atlantis"}, "timezone", "Atlantis"),
        ({"characteristics": ["bore-0"], "last": 0}, "last", "1"),
        ({"characteristics": ["bore-0"], "sections": ["poetry"]}, "sections.0", "numbers"),
        ({"characteristics": ["bore-0"] * 501}, "characteristics", "500"),
    ],
)
def test_what_cannot_be_made_is_refused_by_name(bores: Shop, body: dict[str, Any], field: str, said: str) -> None:
    before = len(bores.call("GET", "/reports")["items"])
    refused = ask(bores, 422, **body)
    assert any(error["field"].startswith(field.split(".", maxsplit=1)[0]) for error in refused["errors"]), refused
    assert said in str(refused)
    assert len(bores.call("GET", "/reports")["items"]) == before


def test_no_more_wait_than_can_be_made(bores: Shop) -> None:
    with held_up(bores):
        waiting = [ask(bores, characteristics=["bore-0"])["id"] for _each in range(actions.MOST_WAITING)]
        refused = bores.admin.post("/api/v1/reports", json={"characteristics": ["bore-0"]})
        assert refused.status_code == 429
        assert int(refused.headers["retry-after"]) > 0
        for number in waiting:
            bores.call("POST", f"/reports/{number}/cancel")


class TestKilled:
    """SIGKILL in the middle of it; nobody was told anything."""

    @pytest.mark.long
    def test_it_goes_on_behind_what_was_ready(self, bores: Shop, server: Server) -> None:
        with held_up(bores) as let_one_pass:
            number = ask(bores, characteristics=keys(4))["id"]
            for _ready in range(2):
                let_one_pass(number)
            server.kill()
            left = ready(server, number)
        assert len(left) == 2
        server.restart()
        job = done(bores, number)
        assert (job["state"], job["done"], job["problems"]) == ("done", 4, 0)
        whole = fetched(bores, number)
        assert len(whole.namelist()) == 5
        for place, content in left.items():
            assert whole.read(f"report-bore-{place}.pdf") == content, "what was ready was not made again"

    @pytest.mark.long  # a small one of its kind: test_worker
    def test_the_process_that_makes_them_takes_nothing_else_along(self, bores: Shop, server: Server) -> None:
        with held_up(bores) as let_one_pass:
            number = ask(bores, characteristics=keys(2), sections=["numbers"])["id"]
            let_one_pass(number)
            (maker,) = makers(server)
            os.kill(maker, signal.SIGKILL)
            (failure,) = until(lambda: failures(bores, number))
            left = ready(server, number)
        assert "the process that makes reports ended with -9" in failure["error"]
        with psycopg.connect(server.database.dsn) as connection:
            connection.execute("UPDATE job_failure SET retry_at = now()")  # not in a minute
        another = ask(bores, characteristics=keys(1))["id"]  # the server looks at once, not within two seconds
        bores.call("POST", f"/reports/{another}/cancel")
        job = done(bores, number)
        assert (job["state"], job["done"], job["problems"]) == ("done", 2, 0)
        whole = fetched(bores, number)
        assert {place: whole.read(f"report-bore-{place}.pdf") for place in left} == left, "it was not made again"
        assert len(left) == 1
        until(lambda: not failures(bores, number))

    @pytest.mark.long
    def test_another_process_takes_it_up(self, bores: Shop, server: Server, run_server: RunServer) -> None:
        """Two servers on one database: one is killed while it works, the other one finishes."""
        with run_server(server.database.dsn) as second:
            other = second.client(second.key())
            with held_up(bores) as let_one_pass:
                number = ask(bores, characteristics=keys(4))["id"]
                let_one_pass(number)
                server.kill()
            until(lambda: other.get(f"/api/v1/reports/{number}").json()["state"] == "done", 120)
            found = other.get(f"/api/v1/reports/{number}").json()
            assert (found["done"], found["problems"]) == (4, 0)
            whole = zipfile.ZipFile(io.BytesIO(other.get(f"/api/v1/reports/{number}/file").content))
            assert len(whole.namelist()) == 5
        server.restart()


def makers(server: Server) -> list[int]:
    """Processes of this server that make reports."""
    children = [
        int(pid)
        for file in Path(f"/proc/{server.process.pid}/task").glob("*/children")
        for pid in file.read_text().split()
    ]
    return [pid for pid in children if b"app.views.reports.maker" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def failures(shop: Shop, number: int) -> list[Any]:
    with psycopg.connect(shop.server.database.dsn, row_factory=dict_row) as connection:
        return connection.execute("SELECT * FROM job_failure WHERE subject = %s", [f"reports/{number}"]).fetchall()


def ready(server: Server, number: int) -> dict[int, bytes]:
    with server.database.begin() as session:
        from app.views.reports.queries import parts

        return {part.place: part.content for part in parts(session, number) if part.content is not None}


def test_a_process_that_was_only_slow_writes_no_more(bores: Shop) -> None:
    """Its token is another one's by now: what it brings is not kept."""
    with held_up(bores):
        number = ask(bores, characteristics=keys(1), sections=["numbers"])["id"]
        working_on(bores, number, "bore-0")
        with bores.server.database.begin() as session:
            assert actions.take(session, number, "another process") is not None
            assert actions.keep(session, number, "the first process", 0, "bore-0", b"late", None) is False
            assert actions.finish(session, number, "the first process", "late.zip", b"late") is False
        bores.call("POST", f"/reports/{number}/cancel")


def test_finished_ones_are_thrown_away_after_a_week(bores: Shop) -> None:
    old, young = (done(bores, ask(bores, characteristics=["bore-0"], sections=["numbers"])["id"])["id"] for _n in "12")
    with psycopg.connect(bores.server.database.dsn, autocommit=True) as connection:
        connection.execute(
            "UPDATE report_job SET finished_at = now() - make_interval(days => %s, mins => 1) WHERE id = %s",
            [actions.KEPT_DAYS, old],
        )
    with bores.server.database.begin() as session:
        actions.drop_old(session)
    assert bores.call("GET", f"/reports/{old}", 404)["status"] == 404
    assert bores.call("GET", f"/reports/{old}/file", 404)["status"] == 404
    assert len(fetched(bores, young).namelist()) == 2


@pytest.mark.long
def test_the_oldest_files_go_first_when_they_are_too_much(bores: Shop, monkeypatch: pytest.MonkeyPatch) -> None:
    old, young = (done(bores, ask(bores, characteristics=["bore-0"], sections=["numbers"])["id"]) for _n in "12")
    monkeypatch.setattr(actions, "KEPT_BYTES", young["size"] + 1)
    with bores.server.database.begin() as session:
        actions.drop_old(session)
    assert bores.call("GET", f"/reports/{old['id']}", 404)["status"] == 404
    assert state(bores, young["id"])["state"] == "done"


def test_thrown_away_at_once_by_who_asked_for_them(bores: Shop) -> None:
    number = done(bores, ask(bores, characteristics=["bore-0"], sections=["numbers"])["id"])["id"]
    stranger = caller(bores, "carl", "viewer")
    assert stranger.delete(f"/api/v1/reports/{number}").status_code == 403
    assert bores.admin.delete(f"/api/v1/reports/{number}").status_code == 204
    assert bores.call("GET", f"/reports/{number}", 404)["status"] == 404
    with held_up(bores):
        running = ask(bores, characteristics=["bore-0"])["id"]
        refused = bores.call("DELETE", f"/reports/{running}", 409)
        assert "cancel" in refused["what_to_do"].lower()
        bores.call("POST", f"/reports/{running}/cancel")


def test_one_that_cannot_be_made_spoils_no_other(bores: Shop, viewer: Person) -> None:
    """A characteristic that is not there any more."""
    bundle = Bundle(ReportRequest(sections=(SectionName.NUMBERS,)), "csv")
    with bores.server.database.begin() as session:
        job = ReportJob(asked_by="tests", request=bundle.stored(["=gone", "bore-1"]), total=2)
        session.add(job)
        session.flush()
        number = job.id
    found = done(bores, number)
    assert (found["state"], found["done"], found["problems"]) == ("done", 2, 1)
    assert found["without_report"][0]["characteristic"] == "=gone"
    whole = fetched(bores, number)
    assert "report-bore-1.csv" in whole.namelist()
    assert "\r\n'=gone,," in whole.read("summary.csv").decode()
    assert "1 without a report" in viewer.open("/reports")


class TestPage:
    """The same on the page."""

    def test_ask_watch_and_fetch(self, bores: Shop, viewer: Person) -> None:
        text = viewer.send(
            "/reports", characteristic="bore-2", format="csv", timezone="Europe/Belgrade", section="numbers"
        )
        assert viewer.name in text
        number = bores.call("GET", "/reports")["items"][0]["id"]
        done(bores, number)
        text = viewer.open("/reports")
        assert f'href="/api/v1/reports/{number}/file"' in text
        assert viewer.browser.get(f"/api/v1/reports/{number}/file").status_code == 200

    @pytest.mark.long
    def test_the_bar_moves_and_ends_in_a_file_without_a_reload(self, bores: Shop, viewer: Person, page: Page) -> None:
        viewer.sign_in(page)
        page.goto("/reports?characteristic=bore-3")
        for key in keys(3):
            page.locator(f"input[value={key}]").check()
        page.get_by_role("button", name="Create reports").click()
        page.wait_for_url("**/reports#jobs")
        number = bores.call("GET", "/reports")["items"][0]["id"]
        row = page.locator(f"#job-{number}")
        expect(row).to_contain_text("4 characteristics")
        expect(row).to_contain_text(viewer.name)
        page.evaluate("window.stayed = true")
        with page.expect_download(timeout=120_000) as got:
            row.get_by_role("link", name="Fetch").click(timeout=120_000)
        assert got.value.suggested_filename == f"reports-{number}.zip"
        assert page.evaluate("window.stayed"), "the page was not loaded again"
        expect(row.locator("progress")).to_have_count(0)
        row.get_by_role("button", name="Throw away").click()
        expect(page.locator(f"#job-{number}")).to_have_count(0)

    @pytest.mark.usefixtures("bores")
    def test_what_was_typed_wrong_is_kept_and_named(self, viewer: Person) -> None:
        text = viewer.send("/reports", 422, characteristic="bore-2", **{"from": "yesterday", "timezone": "Mars"})
        assert 'id="f-from-error"' in text
        assert 'value="bore-2" checked' in text
        assert "Mars" in text

    def test_cancelling_what_is_finished_says_so(self, bores: Shop, engineer: Person) -> None:
        number = done(bores, ask(bores, characteristics=["bore-0"], sections=["numbers"])["id"])["id"]
        assert "finished already" in engineer.send(f"/reports/{number}/cancel", 409)
        assert f'id="job-{number}"' not in engineer.send(f"/reports/{number}/throw-away")
