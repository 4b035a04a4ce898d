"""The proof says so when something does not come out: the comparison, the command, the API, the page, the warning."""

import asyncio
import gc
import json
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from starlette.requests import Request

from app import HOUSE, main
from app.quality.proof import queries, wording
from app.quality.proof.cases import Case, Value, case_from, cases
from app.quality.proof.pages import proof_page
from app.quality.proof.queries import Proof, run
from app.settings import Settings
from app.web.templates import environment
from tests import loops
from tests.forked import inband
from tests.servers import Server
from tests.shop import Person


def l75(expected: Value = 9.998, tolerance: float | list[float] = 1e-9, **more: Any) -> Case:
    """The example of L75, with another answer than the published one."""
    given = {"nominal": 10, "upper_deviation": 0, "lower_deviation": -0.004}
    return Case(
        "mean_nominal",
        "10 with 0/-0.004",
        "made up for this test",
        given,
        {"target": expected},
        {"target": tolerance},
        **more,
    )


def broken() -> Proof:
    return run([*cases()[:2], l75(9.999)])


class TestComparing:
    def test_a_number_within_its_tolerance_passes_and_one_beyond_it_does_not(self) -> None:
        assert run([l75()]).passed
        found = run([l75(9.999)])
        assert not found.passed
        (check,) = found.failing[0].checks
        assert (check.expected, check.got, check.passed) == (9.999, 9.998, False)
        assert check.difference == pytest.approx(0.001)
        assert run([l75(9.999, 0.0011)]).passed
        assert run([l75(9.999, 0.0002, relative=True)]).passed

    def test_one_wrong_entry_of_a_list_is_enough(self) -> None:
        case = next(case for case in cases() if case.kind == "running_average")
        averages = case.expected["averages"]
        assert isinstance(averages, list)
        wrong = replace(case, expected={"averages": [*averages[:-1], averages[-1] + 1]})
        (check,) = run([wrong]).results[0].checks
        assert not check.passed
        assert check.difference == pytest.approx(1, abs=0.01)
        short = replace(case, expected={"averages": averages[:-1]})
        assert not run([short]).passed

    def test_nan_is_never_near_enough(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from app.quality.proof.engine import ENGINE

        monkeypatch.setitem(ENGINE, "mean_nominal", lambda _given: {"target": float("nan")})
        assert not run([l75(tolerance=float("inf"))]).passed

    def test_what_cannot_be_computed_fails_in_words(self) -> None:
        for wrong in (
            replace(l75(), kind="astrology"),
            replace(l75(), given={}),
            replace(l75(), expected={"luck": 7.0}),
        ):
            (result,) = run([wrong]).results
            assert not result.passed
            assert result.error

    def test_nothing_proves_nothing(self) -> None:
        assert not run([]).passed

    def test_a_broken_engine_is_seen(self, monkeypatch: pytest.MonkeyPatch) -> None:
        from app.core.spc import constants

        true = constants.d2_star
        monkeypatch.setattr(constants, "d2_star", lambda n, groups: true(n, groups) + 0.001)
        found = run(cases())
        assert {result.case.kind for result in found.failing} == {"d2_star"}


class TestOncePerProcess:
    @pytest.fixture(autouse=True)
    def fresh(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(queries, "_begun", None)
        monkeypatch.setattr(queries, "_proof", None)

    def test_it_is_run_once_and_by_a_thread_of_its_own(self) -> None:
        assert queries.begin() is queries.begin()
        assert queries.proof() is queries.proof()
        assert queries.proof().passed
        assert queries.failing() == ()

    def test_pages_do_not_wait_and_then_hear_of_it(
        self, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
    ) -> None:
        monkeypatch.setattr(queries, "cases", lambda: (l75(9.999),))
        assert queries.failing() == () or not queries.begin().is_alive()
        queries.begin().join()
        assert [result.case.name for result in queries.failing()] == ["10 with 0/-0.004"]
        assert "not as published: 10 with 0/-0.004" in caplog.text

    def test_a_server_keeps_for_good_what_is_there_at_its_start_and_after_the_proof(
        self, monkeypatch: pytest.MonkeyPatch, server: Server
    ) -> None:
        """The proof brings in the compiler: a hundred thousand objects that every full round of the collector would walk."""
        kept: list[bool] = []
        monkeypatch.setattr(main, "keep_for_good", lambda: kept.append(queries._proof is not None))
        started = threading.Event()
        monkeypatch.setattr(queries, "cases", lambda: (l75(),) if started.wait(60) else ())
        monkeypatch.setattr(queries, "SETTLED_AFTER", 0.1)
        app: Any = main.create_app(Settings(database_url=server.database.dsn)).front

        async def served() -> None:
            async with app.router.lifespan_context(app):
                assert kept == [False]
                started.set()
                for _moment in range(1200):
                    if len(kept) == 2:
                        break
                    await asyncio.sleep(0.05)

        loops.run(served())
        assert kept == [False, True]

    def test_what_is_kept_is_walked_no_more(self) -> None:
        chained: list[Any] = [[] for _one in range(10_000)]
        try:
            main.keep_for_good()
            assert len(gc.get_objects()) < 5_000 < len(chained) < gc.get_freeze_count()
        finally:
            gc.unfreeze()

    def test_a_server_that_ends_soon_does_not_begin(self) -> None:
        timer = queries.begin_later()
        timer.cancel()
        timer.join()
        assert queries._begun is None


class TestCommand:
    def test_the_published_examples_come_out(self) -> None:
        done = inband("proof", "--json")
        assert done.returncode == 0, done.stderr
        told = json.loads(done.stdout)
        assert told["passed"]
        assert told["examples"] == len(cases())

    def test_one_that_does_not_ends_it_with_1_and_is_named(self, tmp_path: Path) -> None:
        described = json.loads((HOUSE / "app/quality/proof/cases/decision.json").read_text(encoding="utf-8"))
        described[0]["expected"]["averages_um"][2] = 4.626
        path = tmp_path / "examples.json"
        path.write_text(json.dumps(described), encoding="utf-8")
        done = inband("proof", "--examples", path)
        assert done.returncode == 1
        assert "wrong averaging example of the measuring cycles" in done.stderr
        assert "1 not as published" in done.stderr

    @pytest.mark.parametrize("text", ["{", "[1]", '[{"kind": "summary"}]', "{}x"])
    def test_a_file_that_holds_no_examples_is_reported(self, tmp_path: Path, text: str) -> None:
        path = tmp_path / "examples.json"
        path.write_text(text, encoding="utf-8")
        done = inband("proof", "--examples", path)
        assert done.returncode == 1
        assert "no examples that can be read" in done.stderr
        assert "Traceback" not in done.stderr


def request_of(path: str) -> Request:
    scope = {"type": "http", "method": "GET", "path": path, "query_string": b"", "headers": [], "state": {}}
    return Request(scope)


class TestPage:
    def test_it_shows_every_example_with_its_source(self, viewer: Person, page: Page) -> None:
        viewer.sign_in(page)
        page.goto("/account")
        page.get_by_role("link", name="Proof").click()
        expect(page.get_by_role("heading", level=1)).to_have_text("Proof")
        expect(page.get_by_role("status").filter(has_text="all as published")).to_be_visible()
        expect(page.locator(".example")).to_have_count(len(cases()))
        example = page.locator(".example", has_text="flow rate of ten batches")
        example.locator("summary").click()
        expect(example.get_by_text("1.8778", exact=True)).to_be_visible()

    def test_it_says_so_when_one_does_not_come_out(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(queries, "proof", broken)
        text = bytes(proof_page(request_of("/proof")).body).decode()
        assert "1 published example does not come out as published" in text
        assert text.index("Not as published") < text.index("made up for this test")
        assert "9.999" in text

    def test_the_warning_stands_on_pages_with_statistics_only_when_something_fails(self) -> None:
        template = environment().from_string(
            '{% import "components.html" as ui with context %}{% include "proof/warning.html" %}'
        )

        def shown(failing: tuple[Any, ...]) -> str:
            return template.render(
                proof_failing=failing, proof_warning=wording.warning(len(failing)), csrf="", path="/", person=None
            ).strip()

        assert shown(()) == ""
        assert "1 published example does not come out" in shown(broken().failing)
        assert 'href="/proof"' in shown(broken().failing)


def test_the_api_tells_the_same(server: Server) -> None:
    answer = server.client(server.key()).get("/api/v1/proof")
    assert answer.status_code == 200
    told = answer.json()
    assert (told["passed"], told["failing"], told["examples"]) == (True, 0, len(cases()))
    assert told["numbers"] == sum(
        len(check["expected"]) if isinstance(check["expected"], list) else 1
        for result in told["results"]
        for check in result["checks"]
    )


def test_one_tolerance_may_stand_for_all() -> None:
    described = {
        "kind": "bias",
        "name": "n",
        "source": "s",
        "given": {},
        "expected": {"a": 1.0, "b": 2.0},
        "tolerance": 0.5,
    }
    assert case_from(described).tolerance == {"a": 0.5, "b": 0.5}
