"""Whatever is wrong with a request, the answer is a problem in words: a document for programs, a page for people."""

import json
import socket
from typing import Any
from urllib.parse import urlsplit

import httpx
import psycopg
import pytest
from fastapi import FastAPI
from sqlalchemy import exc as sql
from starlette.requests import Request

from app.errors import FieldError, Invalid, NotFound, TooManyRequests
from app.web.json_bodies import MOST_ERRORS, read_json
from app.web.limits import MEGABYTE
from app.web.problems import add_problem_handlers
from app.web.validation import field_path
from tests.loops import run
from tests.shop import PARAMETERS, Shop

JSON = {"Content-Type": "application/json"}


def refused(answer: httpx.Response, status: int) -> dict[str, Any]:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = answer.json()
    assert problem["type"].startswith("urn:inband:problem:")
    assert problem["status"] == status
    assert problem["title"]
    assert problem["detail"]
    assert isinstance(problem["errors"], list)
    assert "Traceback" not in answer.text
    return problem


def test_what_is_wrong_by_what_is_stored_says_what_to_do_too(shop: Shop) -> None:
    body = {"key": "seat", "name": "Seat", "machine": "nowhere", "parameters": PARAMETERS}
    problem = refused(shop.admin.post("/api/v1/characteristics", json=body), 422)
    assert [error["field"] for error in problem["errors"]] == ["machine"]
    assert problem["what_to_do"]


def test_a_refusal_of_one_field_names_it_as_a_list_of_one_would() -> None:
    wrong, remedy = "needs more than one value in each reading", "Take the touches."
    written_out = Invalid(f"take: {wrong}.", remedy, errors=[FieldError("take", wrong)])
    assert Invalid.at("take", wrong, do=remedy).as_problem() == written_out.as_problem()
    assert Invalid.at("take", wrong).as_problem()["what_to_do"] == "Correct the named fields and send it again."


class TestQueries:
    """A filter that nobody reads would answer with everything."""

    def test_an_unknown_parameter_is_named_with_the_known_ones(self, shop: Shop) -> None:
        problem = refused(shop.admin.get("/api/v1/readings", params={"limitt": 1}), 422)
        (error,) = problem["errors"]
        assert error["field"] == "limitt"
        assert "characteristic, " in error["message"]
        assert "limit, " in error["message"]

    @pytest.mark.parametrize(
        ("method", "path"),
        [("POST", "/api/v1/readings"), ("POST", "/api/v1/readings/batch"), ("GET", "/api/v1/machines/none/tools")],
    )
    def test_at_every_address(self, shop: Shop, method: str, path: str) -> None:
        answer = shop.admin.request(method, path, params={"as_of": "x"}, json={} if method == "POST" else None)
        assert [error["field"] for error in refused(answer, 422)["errors"]] == ["as_of"]

    def test_the_door_of_machines_refuses_them_too(self, shop: Shop) -> None:
        reading = {"characteristic": shop.characteristic, "measured": 40.0}
        answer = shop.machine_client.post("/api/v1/readings?dry_run=true", json=reading)
        assert "takes none" in refused(answer, 422)["errors"][0]["message"]

    def test_one_value_is_sent_once(self, shop: Shop) -> None:
        problem = refused(shop.admin.get("/api/v1/alarms?state=active&state=all"), 422)
        assert problem["errors"] == [{"field": "state", "message": "is given twice; send it once"}]

    def test_states_are_filtered_under_either_name(self, shop: Shop) -> None:
        corrections = f"/api/v1/machines/{shop.machine}/corrections"
        for path in (corrections, "/api/v1/alarms", "/api/v1/signals", "/api/v1/proposals"):
            asked = [refused(shop.admin.get(path, params={name: "no such"}), 422) for name in ("state", "status")]
            assert asked[0]["errors"] == asked[1]["errors"]
        refused(shop.admin.get("/api/v1/alarms?state=active&status=all"), 422)
        assert shop.admin.get(f"{corrections}?state=pending&status=held").status_code == 200

    def test_a_plant_that_is_not_there_answers_programs_too(self, shop: Shop) -> None:
        refused(shop.admin.get("/p/nope/api/v1/machines"), 404)

    def test_without_credentials_nobody_learns_of_parameters(self, shop: Shop) -> None:
        with httpx.Client(base_url=shop.admin.base_url, timeout=60) as nobody:
            refused(nobody.get("/api/v1/readings?limitt=1"), 401)


class TestBodies:
    @pytest.mark.parametrize(
        ("body", "field", "words"),
        [
            (b"", "body", "is missing"),
            (b"nonsense", "body", "is not JSON: line 1, column 1"),
            (b'{"key": "a"', "body", "is not JSON"),
            (b"[]", "body", "must be a JSON object"),
            (b"null", "body", ""),
            (b'"text"', "body", "must be a JSON object"),
            (b"NaN", "body", "must be a finite number"),
            (b'{"key": "\xff"}', "body", "is not UTF-8"),
            (b'\xef\xbb\xbf{"key": "a"}', "body", ""),
            (b'{"key": "a", "key": "b"}', "body", 'gives "key" twice'),
            (b'{"name": "\\ud800"}', "name", "half a character"),
            (b'{"name": "\\u0000"}', "name", "U+0000"),
            (b'{"na\\u0000me": 1}', "body", "U+0000"),
            (b'{"name": 1e999}', "name", "finite"),
            (b'{"name": -Infinity}', "name", "finite"),
            (b'{"name": ' + b"9" * 5000 + b"}", "body", "too large a number"),
            (b"[" * 100_000, "body", ""),
            (b'{"name": ' + b"[" * 30 + b"]" * 30 + b"}", "body", "nested too deeply"),
        ],
    )
    def test_traps(self, shop: Shop, body: bytes, field: str, words: str) -> None:
        problem = refused(shop.admin.post("/api/v1/machines", content=body, headers=JSON), 422)
        assert field in [error["field"] for error in problem["errors"]]
        assert words in problem["errors"][0]["message"]

    @pytest.mark.parametrize(
        "media_type",
        ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data", "application/xml", "", "json"],
    )
    def test_another_content_type_is_refused_with_what_to_send(self, shop: Shop, media_type: str) -> None:
        answer = shop.admin.post("/api/v1/machines", content=b'{"key": "a"}', headers={"Content-Type": media_type})
        problem = refused(answer, 422)
        assert problem["errors"][0]["field"] == "Content-Type"
        assert "-H 'Content-Type: application/json'" in problem["what_to_do"]

    def test_who_calls_is_asked_before_what_is_sent(self, shop: Shop) -> None:
        for body in (b"nonsense", b"{}", b'{"key": NaN}'):
            refused(shop.server.client().post("/api/v1/machines", content=body, headers=JSON), 401)

    def test_a_stranger_need_not_send_the_body(self, shop: Shop) -> None:
        """With `Expect: 100-continue` it is not asked for; what comes all the same is thrown away."""
        address = urlsplit(shop.server.url)
        for key, expected in ("", b"HTTP/1.1 401"), (f"Authorization: Bearer {shop.machine_key}\r\n", b"HTTP/1.1 100"):
            with socket.create_connection((address.hostname, address.port), timeout=30) as line:
                head = f"POST /api/v1/machines HTTP/1.1\r\nHost: {address.netloc}\r\nContent-Type: application/json\r\n{key}"
                line.sendall(f"{head}Content-Length: 900000\r\nExpect: 100-continue\r\n\r\n".encode())
                assert line.recv(4096).startswith(expected)

    def test_charset_and_json_dialects_are_welcome(self, shop: Shop) -> None:
        for number, media_type in enumerate(("application/json; charset=utf-8", "application/merge-patch+json")):
            body = json.dumps({"key": f"dialect-{number}", "name": "x", "control": "other"})
            answer = shop.admin.post("/api/v1/machines", content=body, headers={"Content-Type": media_type})
            assert answer.status_code == 201

    def test_too_large_is_413_announced_or_not(self, shop: Shop) -> None:
        large = b" " * (MEGABYTE + 1)
        for content in (large, iter([large[: MEGABYTE // 2]] * 3)):
            problem = refused(shop.admin.post("/api/v1/machines", content=content, headers=JSON), 413)
            assert "1 MB" in problem["detail"]
        fits = b" " * (MEGABYTE - 100) + b"{}"
        refused(shop.admin.post("/api/v1/machines", content=fits, headers=JSON), 422)

    def test_paths_of_fields(self) -> None:
        assert field_path(("body", "parameters", "zero_range")) == "parameters.zero_range"
        assert field_path(("body", 17, "measured")) == "[17].measured"
        assert field_path(("query", "limit")) == "limit"
        assert field_path(("body",)) == "body"

    def test_a_doubled_name_is_found_among_a_hundred_thousand(self) -> None:
        """In one pass: to look through all names for each of them took minutes."""
        names = ",".join(f'"{number:x}":1' for number in range(100_000))
        with pytest.raises(Invalid) as refusal:
            read_json(f'{{{names},"last":1,"last":2}}'.encode(), "application/json")
        assert refusal.value.errors == [FieldError("body", 'gives "last" twice; give it once')]

    def test_lists_by_the_ten_thousand_are_not_made(self) -> None:
        """Python makes them while everybody waits. Brackets in a text are no lists, however it ends."""
        for lists in (b"[" + b"[]," * 60_000 + b"[]]", b"[" * 60_000, b'{"a":' * 60_000):
            with pytest.raises(Invalid) as refusal:
                read_json(lists, "application/json")
            assert "50000 lists" in refusal.value.errors[0].message
        text = '[mm] {5} "quoted" \\' * 30_000
        assert read_json(json.dumps({"content": text}).encode(), "application/json") == {"content": text}
        for cut in (json.dumps(text).encode()[:-1], b'"' + b'\\"[' * 60_000, b'"[' * 60_000 + b"\\"):
            with pytest.raises(Invalid):
                read_json(cut, "application/json")

    def test_a_hundred_thousand_mistakes_are_not_all_named(self) -> None:
        with pytest.raises(Invalid) as refusal:
            read_json(b"[" + b"NaN," * 100_000 + b"1]", "application/json")
        assert len(refusal.value.errors) == MOST_ERRORS

    def test_good_json_is_read_as_it_is(self) -> None:
        assert read_json('{"a": [1, 2.5, "ш", null, true]}'.encode(), "application/json") == {
            "a": [1, 2.5, "ш", None, True]
        }


class TestAddresses:
    @pytest.mark.parametrize(
        "path", ["/api/v1/nothing", "/api/v2/machines", "/api/", "/api/v1/machines/a/b/c", "/api/v1/%00"]
    )
    def test_programs_get_a_document(self, shop: Shop, path: str) -> None:
        refused(shop.admin.get(path), 404)

    def test_a_wrong_method_says_the_right_ones(self, shop: Shop) -> None:
        answer = shop.admin.put(f"/api/v1/machines/{shop.machine}", json={})
        assert "PUT" in refused(answer, 405)["detail"]
        assert set(answer.headers["allow"].split(", ")) >= {"GET", "PATCH"}

    def test_a_word_is_not_taken_for_the_number_of_a_neighbour(self, shop: Shop) -> None:
        """`PATCH /people/{person}` is another address than `/people/me`."""
        for method in ("PATCH", "DELETE"):
            answer = shop.admin.request(method, "/api/v1/people/me", json={"role": "viewer"})
            refused(answer, 405)
            assert answer.headers["allow"] == "GET"

    def test_people_get_a_page(self, shop: Shop) -> None:
        answer = shop.server.client().get("/nothing-here")
        assert answer.status_code == 404
        assert answer.headers["content-type"].startswith("text/html")
        assert "There is nothing at /nothing-here" in answer.text

    def test_what_comes_back_is_escaped(self, shop: Shop) -> None:
        answer = shop.server.client().get("/<script>alert(1)</script>")
        assert "<script>alert" not in answer.text


class Away(psycopg.OperationalError):
    pass


class Trouble(psycopg.DataError):
    sqlstate = "22003"


class Taken(psycopg.IntegrityError):
    sqlstate = "23505"


class Broken(psycopg.IntegrityError):
    sqlstate = "23514"


def wrapped(error: psycopg.Error) -> sql.DBAPIError:
    return sql.DBAPIError("SELECT secret", {}, error)


ERRORS: dict[str, tuple[Exception, int]] = {
    "ours": (NotFound("There is no such thing.", "Look elsewhere.", errors=[FieldError("key", "x")]), 404),
    "slower": (TooManyRequests("Slower.", retry_after=7), 429),
    "away": (wrapped(Away("connection refused to 10.1.2.3")), 503),
    "away-raw": (Away("gone"), 503),
    "pool": (sql.TimeoutError("QueuePool limit"), 503),
    "data": (wrapped(Trouble("out of range")), 422),
    "taken": (wrapped(Taken("duplicate key")), 409),
    "broken": (wrapped(Broken("check constraint")), 500),
    "bug": (ZeroDivisionError("secret detail"), 500),
}


@pytest.fixture
def raising() -> FastAPI:
    app = FastAPI()

    @app.get("/{kind:path}")
    def fail(request: Request, kind: str) -> None:
        raise ERRORS[kind.rpartition("/")[2]][0]

    async def nobody(_request: Request) -> None:
        pass

    add_problem_handlers(app, nobody)
    return app


def get(app: FastAPI, path: str) -> httpx.Response:
    """One request in this process; whatever is not made an answer is raised here."""

    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://inband.test") as client:
            return await client.get(path)

    return run(ask())


@pytest.mark.parametrize("kind", ERRORS)
def test_every_error_becomes_an_answer(raising: FastAPI, kind: str, caplog: pytest.LogCaptureFixture) -> None:
    status = ERRORS[kind][1]
    answer = get(raising, f"/api/{kind}")
    refused(answer, status)
    assert "secret" not in answer.text
    assert "10.1.2.3" not in answer.text
    if status in {429, 503}:
        assert int(answer.headers["retry-after"]) > 0
    if status == 500:
        assert "unhandled error in GET" in caplog.text
    page = get(raising, f"/{kind}")
    assert page.status_code == status
    assert page.headers["content-type"].startswith("text/html")
    assert "secret" not in page.text


def test_the_largest_length_is_refused_with_its_unit(shop: Shop) -> None:
    far = {"nominal": [0, 0, 200_000.0], "normal": "+Z", "deviation": 0}
    told = shop.call("POST", "/alignments", 422, machine=shop.machine, touches=[far])
    assert told["errors"][0]["message"] == "must be at most 100000 mm"
    told = shop.call("PATCH", f"/machines/{shop.machine}", 422, probing_feed=200_000.0)
    assert told["errors"][0]["message"] == "must be at most 100000 mm/min"
    zero: dict[str, Any] = {"kind": "corner", "work_offset": "G54", "touches": [{"x": 0, "approach": "-X"}] * 2}
    told = shop.call("POST", "/work-zeros", 422, machine=shop.machine, **zero, tip=2000.0, feeler=200.0)
    assert {"field": "tip", "message": "must be at most 1000 mm"} in told["errors"]
    assert {"field": "feeler", "message": "must be at most 100 mm"} in told["errors"]


def test_a_field_of_two_kinds_is_refused_once_by_its_own_name(shop: Shop) -> None:
    told = shop.call("POST", "/kinematics/measuring-plans", 422, cycle=451, ball_radius=12.5, feed="FAST", axes=[])
    assert told["errors"] == [{"field": "feed", "message": "must be a number, or must be one of FMAX, FAUTO or PREDEF"}]
