"""Bodies of requests: nothing is read before it is known from the head who sends them, and no further than that caller may send."""

import asyncio
import json
import re
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import httpx
import pytest
from fastapi.routing import APIRoute
from starlette.types import Message, Receive, Scope, Send

from app import HOUSE
from app.access import bodies, devices
from app.main import ROUTERS
from app.web import json_bodies
from app.web.deps import SAFE_METHODS
from app.web.limits import FEW, MEGABYTE, Takes
from tests.access.pieces import PIECE, arrive, send
from tests.databases import NewDatabase, drop_database
from tests.in_process import Direct, InProcess, in_process
from tests.loops import run
from tests.shop import Person, Shop
from tests.waits import until

JSON, FORM, FILE = "application/json", "application/x-www-form-urlencoded", "multipart/form-data; boundary=b"
KINDS = (JSON, FORM, FILE)


class Address(NamedTuple):
    """Where something is changed."""

    method: str
    path: str


ADDRESSES = sorted(
    {
        Address(method, route.path)
        for router in ROUTERS
        for route in router.routes
        if isinstance(route, APIRoute)
        for method in (route.methods or set()) - SAFE_METHODS
    }
)
FOR_EVERYBODY = {"/sign-in", "/invitation/{token}", "/station"}
STRANGERS: dict[str, dict[str, str]] = {
    "nobody": {},
    "an unknown key": {"Authorization": "Bearer inband_nobody"},
    "Basic": {"Authorization": "Basic YTpi"},
    "foreign cookies": {"Cookie": "inband_session=nobody; inband_station=nobody"},
}


@pytest.fixture(scope="module")
def server(new_database: NewDatabase) -> Iterator[InProcess]:
    url = new_database()
    with in_process(url) as running:
        yield running
    drop_database(url)


@pytest.fixture(scope="module")
def shop(server: InProcess) -> Shop:
    return Shop(server)


def filled(path: str) -> str:
    return path.replace("{", "").replace("}", "").replace(":path", "")


@pytest.mark.parametrize("stranger", STRANGERS)
def test_no_route_reads_more_of_a_stranger_than_a_few_kilobytes(server: InProcess, stranger: str) -> None:
    """Walk all that change something, with a megabyte that comes in pieces without a length."""
    assert len(ADDRESSES) > 150
    wrong = []
    for number, (method, path) in enumerate(ADDRESSES):
        kind = KINDS[number % len(KINDS)]
        sent = send(server, method, filled(path), MEGABYTE, kind, STRANGERS[stranger])
        most = FEW + PIECE if path in FOR_EVERYBODY else 0
        usual = {401, 404, 413, 422} if path in FOR_EVERYBODY else {401} if path.startswith("/api/") else {303}
        if sent.read > most or sent.status not in usual:
            wrong.append((method, path, kind, sent))
    assert not wrong


def test_of_strangers_who_come_at_once_each_has_a_turn_of_the_event_loop(server: InProcess) -> None:
    direct = server.transport
    assert isinstance(direct, Direct)
    finished: list[int] = []

    async def all_at_once() -> list[int]:
        """Requests answered in each turn of the loop."""
        strangers = [asyncio.create_task(stranger(direct)) for _each in range(20)]
        turns = []
        while len(finished) < len(strangers):
            before = len(finished)
            await asyncio.sleep(0)
            turns.append(len(finished) - before)
        await asyncio.gather(*strangers)
        return turns

    async def stranger(direct: Direct) -> None:
        sent = await arrive(
            direct, "POST", "/api/v1/notes", 2, {"Host": "inband.test", "Content-Type": JSON}, leaves=False
        )
        finished.append(sent.status)

    turns = direct.portal.call(all_at_once)
    assert max(turns) == 1
    assert finished == [401] * 20


def test_nobody_waits_while_the_answer_to_one_guess_too_many_is_held_back(monkeypatch: pytest.MonkeyPatch) -> None:
    answered: list[int] = []
    held_back = asyncio.Event()

    async def application(scope: Scope, _receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": scope["status"], "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def wait(seconds: float) -> None:
        if seconds:
            held_back.set()
            while 200 not in answered:
                await now(0)
        await now(0)

    async def ask(limit: bodies.BodyLimit, status: int) -> None:
        async def receive() -> Message:
            return {"type": "http.request", "body": b""}

        async def send(message: Message) -> None:
            if message["type"] == "http.response.start":
                answered.append(message["status"])

        scope = {"type": "http", "method": "POST", "path": "/sign-in", "headers": [], "client": ("10.0.0.1", 1)}
        await limit({**scope, "status": status}, receive, send)

    async def both() -> None:
        limit = bodies.BodyLimit(application, [])
        monkeypatch.setattr(limit, "_taken", lambda _scope: Takes(FEW, "anybody"))
        async with asyncio.TaskGroup() as group:
            group.create_task(ask(limit, 429))
            await held_back.wait()
            group.create_task(ask(limit, 200))

    now = asyncio.sleep
    monkeypatch.setattr("app.access.bodies.asyncio.sleep", wait)
    run(both())
    assert answered == [200, 429]


@pytest.mark.parametrize(("path", "kind"), [("/api/v1/notes", JSON), ("/sign-in", FORM)])
def test_who_leaves_before_the_body_ends_is_no_error_of_the_server(
    server: InProcess, path: str, kind: str, caplog: pytest.LogCaptureFixture
) -> None:
    caller = {"Authorization": f"Bearer {server.key('engineer')}"}
    assert send(server, "POST", path, 2 * PIECE - 1, kind, caller, leaves=True).text == ""
    assert caplog.text == ""


@pytest.mark.parametrize("kind", [FORM, FILE])
@pytest.mark.parametrize("path", ["/sign-in", "/invitation/guess", "/station"])
def test_what_is_announced_too_large_is_not_read_at_all(server: InProcess, path: str, kind: str) -> None:
    sent = send(server, "POST", path, 64 * MEGABYTE, kind, {}, announced=True)
    assert (sent.status, sent.read) == (413, 0)
    assert "The request is larger than the 8 kB that are taken here." in sent.text


def test_a_bound_device_sends_forms_and_no_files(server: InProcess, shop: Shop) -> None:
    with server.database.begin() as session:
        device, token = devices.bind(session, devices.make_code(session, shop.machine, "Tablet", "tests"))
    cookie = {"Cookie": f"inband_station={token}"}
    path = f"/station/{device.machine}/note"
    assert send(server, "POST", path, 20_000, FORM, cookie).status == 403  # read, and without the token of the device
    too_much = send(server, "POST", path, MEGABYTE, FORM, cookie)
    assert too_much.status == 413
    assert too_much.read <= 64_000 + PIECE
    for path in ("/setup/reactions/new", "/api/v1/reactions/pictures"):  # takes pictures, of engineers
        assert send(server, "POST", path, MEGABYTE, FORM, cookie).read <= 64_000 + PIECE


@pytest.mark.parametrize("path", ["/import", "/api/v1/readings/aqdef", "/api/v1/readings/table"])
def test_sixty_four_megabytes_are_for_those_who_may_import(server: InProcess, shop: Shop, path: str) -> None:
    viewer, engineer = ({"Authorization": f"Bearer {server.key(role)}"} for role in ("viewer", "engineer"))
    machine = {"Authorization": f"Bearer {shop.machine_key}"}
    kind = FILE if path == "/import" else JSON
    for caller in (viewer, machine):
        sent = send(server, "POST", path, 64 * MEGABYTE, kind, caller)
        assert sent.status == 403
        assert sent.read <= MEGABYTE + PIECE
    assert send(server, "POST", path, 64 * MEGABYTE, kind, viewer, announced=True).read == 0
    assert send(server, "POST", path, 2 * MEGABYTE, kind, engineer).status == 422
    beyond = send(server, "POST", path, 64 * MEGABYTE + 1, kind, engineer, announced=True)
    assert (beyond.status, beyond.read) == (413, 0)
    assert "64 MB" in beyond.text


def test_batches_are_for_machines_and_operators(server: InProcess, shop: Shop) -> None:
    for key, status in ((shop.machine_key, 422), (server.key("operator"), 422), (server.key("viewer"), 403)):
        sent = send(server, "POST", "/api/v1/readings/batch", 2 * MEGABYTE, JSON, {"Authorization": f"Bearer {key}"})
        assert sent.status == status
    sent = send(server, "POST", "/api/v1/readings", MEGABYTE, JSON, {"Authorization": f"Bearer {shop.machine_key}"})
    assert sent.status == 413


def test_a_person_who_is_signed_in_may_send_a_megabyte_and_no_more(server: InProcess) -> None:
    session = Person(server, "admin").browser.cookies["inband_session"]
    browser = {"Cookie": f"inband_session={session}"}
    assert send(server, "POST", "/setup/machines/new", MEGABYTE // 2, FORM, browser).status == 403  # no token
    sent = send(server, "POST", "/setup/machines/new", 2 * MEGABYTE, FORM, browser)
    assert sent.status == 413
    assert MEGABYTE <= sent.read <= MEGABYTE + PIECE


def test_a_query_of_thousands_is_refused_before_it_is_looked_at(shop: Shop) -> None:
    """Before it is known who calls; each name was sought among all others."""
    answer = shop.admin.get("/api/v1/machines?" + "&".join(["limit=1"] * 5000))
    assert answer.status_code == 422
    assert answer.json()["detail"] == "The query of the address holds more than 1000 parameters."


def test_a_large_body_is_read_beside_the_event_loop(
    server: InProcess, shop: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, threads = json_bodies.read_json, []

    def reading(*given: Any) -> Any:
        threads.append(threading.current_thread())
        return read(*given)

    monkeypatch.setattr(json_bodies, "read_json", reading)
    assert isinstance(server.transport, Direct)
    loop = server.transport.portal.call(threading.current_thread)
    for size in (1000, json_bodies.ON_THE_LOOP + 1):
        problem = shop.admin.post("/api/v1/machines", json={"key": "a", "name": "n" * size, "control": "other"}).json()
        assert [error["field"] for error in problem["errors"]] == ["name"]
    small, large = threads
    assert small is loop
    assert large is not loop


def test_large_bodies_of_one_caller_are_read_one_after_the_other(
    server: InProcess, shop: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twenty threads that read at once left the event loop a twentieth of its time. Nobody else waits for them."""
    read, reading, most, go_on = json_bodies.read_json, 0, 0, threading.Event()

    def slowly(body: bytes, content_type: str | None) -> Any:
        nonlocal reading, most
        if b"slow" in body:
            reading += 1
            most = max(most, reading)
            assert go_on.wait(60)
            reading -= 1
        return read(body, content_type)

    def note(client: httpx.Client, text: str) -> int:
        return client.post("/api/v1/notes", json={"text": text + " " * 20_000, "machine": shop.machine}).status_code

    monkeypatch.setattr(json_bodies, "read_json", slowly)
    with ThreadPoolExecutor(4) as callers:
        flood = [callers.submit(note, shop.admin, "slow") for _ in range(4)]
        until(lambda: reading > 0)
        assert note(server.client(server.key("engineer")), "of another") == 201
        go_on.set()
        assert [each.result() for each in flood] == [201] * 4
    assert most == 1


def test_a_large_body_makes_what_a_small_one_would(server: InProcess, shop: Shop) -> None:
    """It is the route's own model before the framework sees it."""
    note = json.dumps({"text": "A note.", "machine": shop.machine}).ljust(20_000)
    answer = shop.admin.post("/api/v1/notes", content=note, headers={"Content-Type": JSON})
    assert answer.status_code == 201, answer.text
    assert answer.json()["text"] == "A note."


@pytest.mark.parametrize("field", ["%41", "%C3%A4", "%zz", "\u00e9a"])
def test_a_field_of_a_form_that_would_take_the_event_loop_is_refused(server: InProcess, field: str) -> None:
    """All of a field is unescaped in one turn: a megabyte of escapes took 180 ms."""
    browser = Person(server, "admin").browser
    head = {"Content-Type": FORM}
    large = f"csrf=none&note={field * 60_000}".encode("latin-1")
    answer = browser.post("/setup/machines/new", content=large, headers=head)
    assert answer.status_code == 413, answer.text[:500]
    assert "note: holds more than 50000 characters that are no plain letters or digits." in answer.text
    assert "multipart/form-data" in answer.text  # which takes it
    files = {"csrf": (None, "none"), "note": (None, "%" * 60_000)}
    assert browser.post("/setup/machines/new", files=files).status_code == 403  # no token
    many = "&".join(["csrf=none", *(f"note{at}={field * 1000}" for at in range(60))]).encode("latin-1")
    for allowed in (many, b"csrf=none&note=" + b"a" * 900_000):
        assert browser.post("/setup/machines/new", content=allowed, headers=head).status_code == 403  # no token


def test_no_page_takes_a_longer_text_than_its_form_can_send() -> None:
    """A blank line, a tab, a sign of a number: each is escaped in an ordinary form, and some in two or more bytes."""
    for path in (HOUSE / "frontend/templates").rglob("*.html"):
        for form in path.read_text().split("<form")[1:]:
            head, _end, rest = form.partition(">")
            longest = max(
                map(int, re.findall(r"textarea\(.*?maxlength=(\d+)", rest.partition("</form>")[0])), default=0
            )
            assert longest <= bodies.MOST_ESCAPED or "multipart" in head, (path.name, longest)


@pytest.mark.parametrize("size", [100, 2 * json_bodies.ON_THE_LOOP])
def test_who_may_not_hears_that_before_what_is_wrong(server: InProcess, size: int) -> None:
    viewer, engineer = (server.client(server.key(role)) for role in ("viewer", "engineer"))
    wrong: list[dict[str, Any]] = [
        {"content": json.dumps({"key": "a", "nonsense": "n" * size}), "headers": {"Content-Type": JSON}},
        {"content": "[" + "1" * size, "headers": {"Content-Type": JSON}},
        {"content": "n" * size, "headers": {"Content-Type": "text/plain"}},
        {"json": {"key": "a", "name": "n" * size, "control": "other"}, "params": {"no": "such"}},
    ]
    for how in wrong:
        assert viewer.post("/api/v1/machines", **how).status_code == 403, how
        assert engineer.post("/api/v1/machines", **how).status_code == 422, how


def test_the_key_of_a_machine_hears_all_that_it_may_do(shop: Shop) -> None:
    refused = shop.machine_client.post("/api/v1/machines", json={})
    assert refused.status_code == 403
    assert "send what the machine itself measures, applies and reports" in refused.json()["detail"]


VIEWERS_MAY = {
    "previews",
    "preview",
    "what-if",
    "sampling",
    "map",
    "read",
    "reports",
    "measuring-plans",
    "me",
    "me/browser",
    "me/browser/messages",
    "count-charts",
}


def test_a_viewer_hears_that_before_what_is_wrong_on_every_route(server: InProcess) -> None:
    viewer = server.client(server.key("viewer"))
    routes = [
        (method, route.path)
        for router in ROUTERS
        for route in router.routes
        if isinstance(route, APIRoute) and route.path.startswith("/api/v1/")
        for method in (route.methods or set()) & {"POST", "PUT", "PATCH"}
        if not route.path.endswith(tuple(VIEWERS_MAY))
    ]
    assert len(routes) > 80
    for method, path in routes:
        answer = viewer.request(method, re.sub(r"{\w+}", "1", path), json={"nonsense": 1})
        assert answer.status_code != 422, (method, path, answer.text)


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("PUT", "tools/9"),
        ("POST", "tools/9/change"),
        ("POST", "tools/9/reported"),
        ("PUT", "averages/5"),
        ("POST", "faults"),
        ("POST", "heartbeat"),
        ("PUT", "context"),
    ],
)
def test_a_viewer_hears_that_before_what_is_wrong_at_a_machine(shop: Shop, method: str, path: str) -> None:
    viewer = shop.server.client(shop.server.key("viewer"))
    for body in ({}, {"nonsense": 1}):
        answer = viewer.request(method, f"/api/v1/machines/{shop.machine}/{path}", json=body)
        assert answer.status_code == 403, answer.text
