"""Bad input at every endpoint of the OpenAPI document: a problem in words, nothing stored, never a 5xx.

What is tried follows from the document itself, so an endpoint that is added is tried too; what it needs to be called
rightly is in `tests.web.good_bodies`, and a test fails while it is missing there.
"""

import itertools
import json
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import httpx
import psycopg
import pytest

from app.loop.notifications import notifier
from tests.databases import NewDatabase, drop_database
from tests.in_process import InProcess, in_process
from tests.loop.readings.record import counted
from tests.servers import Server
from tests.web.api_operations import Operation, body_schema, operation_named, operations, resolved
from tests.web.good_bodies import BODIES
from tests.web.whole_plant import Place

pytestmark = pytest.mark.own_server  # rows of all tables are counted

OF_A_PERSON = {"PUT /api/v1/notifications/me", "PUT /api/v1/notifications/me/browser"}  # the key that asks here is none
NEWER = {
    "POST /api/v1/machines/{machine}/heartbeat",
    "POST /api/v1/machines/{machine}/touch-tests/{number}/report",
}  # a bridge that is newer than the server may say more
SHARES = 6  # of all operations, so that several workers try them
DOORS = ("POST /api/v1/readings", "POST /api/v1/readings/batch")
# JSON that no field anywhere may take.
POISON = (
    "NaN",
    "Infinity",
    "-Infinity",
    "1e400",
    "-1e400",
    "9" * 400,
    "9" * 5000,
    '"\\u0000"',
    '"a\\u0000b"',
    '"\\ud800"',
    '"\\udc00x"',
    '{"x": {"y": []}}',
    "[[[[]]]]",
    json.dumps("x" * 100_000),
)
WRONG = {
    "string": ("true", "5", "5.5", "[]", '["x"]'),
    "number": ('"5"', '"five"', "true", "[]", '""'),
    "integer": ('"5"', "5.5", "true", "[]", "9" * 30, "-" + "9" * 30),
    "boolean": ("5", '"maybe"', "[]"),
    "array": ("5", '"x"', "true"),
    "object": ("5", '"x"', "true", "[]"),
}
WRONG_TIMES = ("1763709302", "1763709302120", '"1763709302"', '"2026-11-21T08:15:02"', '"yesterday"', '"2026-13-41"')
WHOLE = (
    b"",
    b" ",
    b"{",
    b"[]",
    b"[1]",
    b"7",
    b"true",
    b'"text"',
    b"null",
    b"NaN",
    b"\xff\xfe{}",
    b'{"x": "\xc3\x28"}',
    b'{"x": "\xed\xa0\x80"}',
    b"[" * 100_000,
    b'{"x":' * 100_000,
    b"\x00",
    b"offset=1&reason=x",
    b"<offset>1</offset>",
    b'{"reason": "x"} {"reason": "y"}',
    b"{'reason': 'x'}",
)
CALLED = ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "", "json")
BAD_NUMBERS = ("0", "-1", "x", "1.5", "%00", "9" * 30, "%D9%A3", "1e3", "NaN", "0x10", "%20")
BAD_KEYS = (
    "nowhere",
    "%00",
    "a%00b",
    "%ED%A0%80",
    "%FF",
    "UPPER",
    "x" * 300,
    "%F0%9F%98%80",
    "'%3B--",
    "-",
    ".%2e",
    "%0A",
)
LEAKS = (
    "Traceback",
    "psycopg",
    "sqlalchemy",
    "pydantic",
    "msgspec",
    "asyncio",
    'File "',
    "SELECT ",
    "validation error",
)


@contextmanager
def emptied(new_database: NewDatabase) -> Iterator[InProcess]:
    """Inband on a database of its own; what is sent to receivers leaves at once, and no bridge falls silent."""
    url = new_database()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(notifier, "EVERY", 0.1)
        # An alarm about a silent bridge would be counted as stored.
        with in_process(url, bridge_silent_after=86_400) as house:
            yield house
    drop_database(url)


@pytest.fixture(scope="module")
def place(new_database: NewDatabase) -> Iterator[Place]:
    with emptied(new_database) as house:
        yield Place(house)


@pytest.fixture
def house(new_database: NewDatabase) -> Iterator[InProcess]:
    with emptied(new_database) as made:
        yield made


def as_text(operation: Operation, body: dict[str, Any], field: str | None = None, value: str = "") -> str:
    """The body as JSON text, with one field written in a way that no JSON writer would."""
    parts = [f"{json.dumps(name)}: {json.dumps(each)}" for name, each in body.items() if name != field]
    if field is not None:
        parts.append(f"{json.dumps(field)}: {value}")
    text = "{" + ", ".join(parts) + "}"
    return f"[{text}]" if operation.path.endswith("/batch") else text


def complaint(answer: httpx.Response, what: str, statuses: range = range(400, 500)) -> str | None:
    """Fault of an answer to bad input; None if it is as it should be."""
    what = what if len(what) < 200 else what[:100] + " … " + what[-60:]
    if answer.status_code not in statuses:
        return f"{what}: {answer.status_code} {answer.text[:200]}"
    if answer.headers["content-type"] != "application/problem+json":
        return f"{what}: {answer.headers['content-type']}"
    problem = answer.json()
    if not {"type", "title", "status", "detail", "errors"} <= set(problem) or problem["status"] != answer.status_code:
        return f"{what}: {problem}"
    sentences = [problem["detail"], *(error["message"] for error in problem["errors"])]
    if any(len(sentence.split()) < 2 for sentence in sentences) or any(leak in answer.text for leak in LEAKS):
        return f"{what}: no help in {problem}"
    if answer.status_code == 422 and not problem["errors"]:
        return f"{what}: names no field: {problem}"
    return None


Complaints = Iterator[str | None]


def bad_fields(operation: Operation, place: Place, of: int) -> Complaints:
    """Every field with what it may not take, left out, twice; fields that nobody knows. Of what no field anywhere may take,
    each has one in so many, and its neighbours have the others."""
    body, schema = place.body(operation), body_schema(operation)

    def tried(field: str, value: str) -> str | None:
        return complaint(place.send(operation, as_text(operation, body, field, value)), f"{field}: {value}")

    for turn, (field, declared) in enumerate(schema["properties"].items(), len(operation.name)):
        kind = resolved(declared)
        either = "anyOf" in kind  # a number or a word, such as a feed
        bad = [*POISON[turn % of :: of], *(() if either else WRONG.get(kind.get("type", "string"), ()))]
        if kind.get("format") == "date-time":
            bad += WRONG_TIMES
        if "enum" in kind:
            bad += ['"nonsense"', '""']
        for value in bad:
            yield tried(field, value)
        if field in schema.get("required", ()):
            yield tried(field, "null")
            without = {name: value for name, value in body.items() if name != field}
            yield complaint(place.send(operation, as_text(operation, without)), f"without {field}")
    if operation.name not in NEWER:
        yield tried("colour", '"red"')
        yield tried("colo\\u0000ur", '"red"')
    first, value = next(iter(body.items()))
    doubled = as_text(operation, body).replace("{", f"{{{json.dumps(first)}: {json.dumps(value)}, ", 1)
    yield complaint(place.send(operation, doubled), "doubled")
    big = as_text(operation, body, "colour", json.dumps("x" * 1_100_000))
    yield complaint(place.send(operation, big), "large")


def bad_parameters(operation: Operation, place: Place, of: int) -> Complaints:
    """Every parameter of a characteristic with one in so many of what it may not take, and parameters that do not fit one
    another."""
    body = place.body(operation)
    parameters = body.pop("parameters")
    numbers = {f"R{number:02}" for number in (4, 10, 11, 23, 25, 26, 27, 28, 29, 30, 31, 33, 34, 36, 37)}
    every = resolved(resolved(body_schema(operation)["properties"]["parameters"]))["properties"]
    assert len(every) > 20
    for turn, name in enumerate(sorted({*every, *parameters, *numbers})):
        wrong = () if name == "rejected_may_correct" else ("true",)
        bad = (*POISON, '"five"', *wrong, "[]", "-1e300", '{"n": 1}', '{"n": 3, "m": 2}')
        for value in bad[turn % of :: of]:
            text = as_text(operation, body, "parameters", as_text(operation, parameters, name, value))
            yield complaint(place.send(operation, text), f"{name}: {value}", range(422, 423))
    for unfit in (
        {"zero_range": 0.006},
        {"averaging_limit": 0.009},
        {"wear_limit": 0.007},
        {"confidence_limit": 0.2},
        {"weighting_factor": 0.5},
        {"factor": 0},
        {"tool_memory": 33},
        {"average_memory": 21},
        {"tolerance_width": 0},
        {"accept": {"n": 2, "m": 1}},
        {"R33": 0.001, "zero_range": 0.002},
    ):
        text = as_text(operation, body | {"parameters": parameters | unfit})
        yield complaint(place.send(operation, text), str(unfit), range(422, 423))


def no_body(operation: Operation, place: Place, of: int) -> Complaints:
    """One in so many of what is no body at all, a good one that is called something else, and one that is not compressed
    as it says."""
    optional = not operation.declared["requestBody"].get("required")
    turn = list(BODIES).index(operation.name)
    for content in WHOLE[turn % of :: of]:
        if (content in {b"", b"null"} and optional) or (content == b"[]" and operation.path.endswith("/batch")):
            continue  # nothing to do is no mistake
        yield complaint(place.send(operation, content), repr(content))
    if operation.name not in DOORS:  # these read what a machine sends whatever it is called
        good = as_text(operation, place.body(operation))
        for kind in CALLED[turn % of :: of]:
            yield complaint(place.send(operation, good, **{"Content-Type": kind}), f"as {kind!r}")
    yield complaint(place.send(operation, b"\x1f\x8b\x08\x00", **{"Content-Encoding": "gzip"}), "compressed")


def bad_addresses(operation: Operation, place: Place, of: int) -> Complaints:
    """Every name and number of the address in turn as something that there is not, or that is no name and no number: one
    in so many of these."""
    content = as_text(operation, place.body(operation)) if operation.name in BODIES else None
    for turn, parameter in enumerate(operation.declared.get("parameters", ()), len(operation.name)):
        if parameter["in"] != "path":
            continue
        name = parameter["name"]
        bad = BAD_NUMBERS if resolved(parameter["schema"]).get("type") == "integer" else BAD_KEYS
        for value in bad[turn % of :: of]:
            answer = place.shop.admin.request(
                operation.method,
                operation.path.format(**(place.values | {name: value})),
                content=content,
                headers={"Content-Type": "application/json"} if content else {},
            )
            yield complaint(answer, f"{name}: {value}")


def bad_queries(operation: Operation, place: Place, of: int) -> Complaints:
    """Every parameter of the query in turn with one in so many of what it may not be, others with the rest; a text may be
    anything that finds nothing."""
    content = as_text(operation, place.body(operation)) if operation.name in BODIES else None
    parameters = [each for each in operation.declared.get("parameters", ()) if each["in"] == "query"]
    url = place.url(operation) if parameters else ""
    needed = {p["name"]: place.values.get(p["name"], "1") for p in parameters if p.get("required")}
    for turn, parameter in enumerate(parameters, len(operation.name)):
        name, kind = parameter["name"], resolved(parameter["schema"])
        several = "anyOf" in kind or kind.get("type") not in {"integer", "number", "boolean"}
        strict = not several or "enum" in kind or kind.get("format") == "date-time"
        bad = [
            "%00",
            "a%00b",
            "%ED%A0%80",
            "x" * 5000,
            "%FF",
            "NaN",
            "-1",
            "9" * 30,
            "",
            "1.5",
            "'%3B--",
            "%F0%9F%98%80",
        ]
        if kind.get("format") == "date-time":
            bad += ["1763709302", "2026-11-21T08:15:02", "2026-13-01T00:00:00Z"]
        if name == "limit":
            bad += ["0", "1001"]
        if kind.get("type") == "number":
            bad.remove("1.5")
            if kind.get("minimum", 0) <= -1:
                bad.remove("-1")
        query = "&".join(f"{key}={value}" for key, value in needed.items() if key != name)
        for value in bad[turn % of :: of]:
            if operation.path == "/api/v1/events" and not strict:
                continue
            answer = place.shop.admin.request(
                operation.method,
                f"{url}?{query}&{name}={value}",
                content=content if strict else None,
                headers={"Content-Type": "application/json"} if content else {},
            )
            if answer.status_code < 300 and not strict:
                continue  # a text that finds nothing
            yield complaint(answer, f"{name}={value}")


STRANGERS: tuple[dict[str, str], ...] = (
    {},
    {"Authorization": "Bearer inband_x"},
    {"Authorization": "Basic YTpi"},
    {"Cookie": "inband_session=x"},
)


def no_key(operation: Operation, place: Place, of: int = 1) -> Complaints:
    """Without a key, and with one in so many of what is none."""
    if not operation.path.startswith("/api/v1/") or "openapi" in operation.path:
        return
    content = as_text(operation, place.body(operation)) if operation.name in BODIES else None
    url = place.url(operation, key=1)
    turn = len(operation.name)
    for headers in (STRANGERS[0], *STRANGERS[1:][turn % of :: of]):
        answer = place.nobody.request(
            operation.method, url, content=content, headers=headers | {"Content-Type": "application/json"}
        )
        yield complaint(answer, str(headers), range(401, 402))


def wrong_methods(operation: Operation, place: Place) -> Complaints:
    """What else may be done to an address; the answer names what may."""
    path = operation.path
    here = [each for each in operations() if re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", each.path), path)]
    own = {each.method for each in operations() if each.path == path}
    if operation.method != min(own):
        return  # tried with the other one
    for method in {"GET", "POST", "PUT", "PATCH", "DELETE", "TRACE"} - {each.method for each in here}:
        answer = place.shop.admin.request(method, path.format(**place.values))
        yield complaint(answer, method, range(405, 406))
        if set(answer.headers["allow"].replace(" ", "").split(",")) != own:
            yield f"{method}: {answer.headers['allow']}"


Try = Callable[[Operation, Place], Complaints]


def refused_and_nothing_stored(attempt: Try, tried: Iterable[Operation], place: Place) -> None:
    with psycopg.connect(place.dsn, autocommit=True) as connection:
        before = counted(connection)
        for operation in tried:
            found = [each for each in attempt(operation, place) if each is not None]
            assert not found, f"{operation.name}, {len(found)}:\n" + "\n".join(found[:40])
            after = counted(connection)
            if operation.path.endswith("/report.{form}"):
                before["audit_entry"] = after["audit_entry"]  # reports that were written are in the record
            assert after == before, operation.name


def test_every_operation_with_a_body_is_tried() -> None:
    assert {each.name for each in operations() if "requestBody" in each.declared} == set(BODIES)
    assert len(operations()) > 40


some_or_all = pytest.mark.parametrize(
    "of", [pytest.param(16, id="some"), pytest.param(1, id="all", marks=pytest.mark.long)]
)


@some_or_all
@pytest.mark.parametrize("name", BODIES)
def test_bad_fields(name: str, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(bad_fields, of=of), [operation_named(name)], place)


@some_or_all
@pytest.mark.parametrize("name", [name for name, body in BODIES.items() if "parameters" in body])
def test_bad_parameters(name: str, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(bad_parameters, of=of), [operation_named(name)], place)


@some_or_all
@pytest.mark.parametrize("name", BODIES)
def test_what_is_no_body(name: str, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(no_body, of=of), [operation_named(name)], place)


@some_or_all
@pytest.mark.parametrize("share", range(SHARES))
@pytest.mark.parametrize("attempt", [bad_addresses, bad_queries])
def test_bad_addresses_and_queries(attempt: Callable[..., Complaints], share: int, place: Place, of: int) -> None:
    refused_and_nothing_stored(partial(attempt, of=of), operations()[share::SHARES], place)


@pytest.mark.parametrize("share", range(SHARES))
@pytest.mark.parametrize(
    "attempt",
    [
        pytest.param(partial(no_key, of=3), id="no_key-some"),
        pytest.param(no_key, id="no_key-all", marks=pytest.mark.long),
        wrong_methods,
    ],
)
def test_at_every_operation(attempt: Try, share: int, place: Place) -> None:
    refused_and_nothing_stored(attempt, operations()[share::SHARES], place)


def test_it_is_the_same_through_a_socket(server: Server) -> None:
    """A body for the door of readings, one for everything else, and an address with names, a number and a query."""
    place = Place(server)
    for attempt, name in (
        (partial(bad_fields, of=8), "POST /api/v1/readings"),
        (partial(no_body, of=8), "POST /api/v1/readings"),
        (partial(bad_fields, of=8), "PUT /api/v1/machines/{machine}/tools/{tool}"),
        (partial(no_body, of=8), "PUT /api/v1/machines/{machine}/tools/{tool}"),
        (partial(bad_addresses, of=8), "GET /api/v1/corrections/{machine}/{number}"),
        (partial(bad_queries, of=8), "GET /api/v1/readings"),
        (no_key, "GET /api/v1/readings"),
        (wrong_methods, "GET /api/v1/readings"),
    ):
        place.beat()  # an alarm about a silent bridge would be counted as stored
        refused_and_nothing_stored(attempt, [operation_named(name)], place)


@pytest.mark.parametrize("turn", [0, *(pytest.param(turn, marks=pytest.mark.long) for turn in range(1, SHARES))])
def test_what_all_this_was_tried_on_can_be_done(house: InProcess, turn: int) -> None:
    """The bodies above are good ones: what was refused was refused for what was changed in them."""

    def sent(place: Place, operation: Operation) -> httpx.Response:
        body = place.body(operation)
        if operation.name == "POST /api/v1/machines":
            body["key"] = f"mill-{place.shop.machine}"
        if operation.name == "POST /api/v1/characteristics":
            body["key"] = f"bore-{place.shop.machine}"
        return place.send(operation, as_text(operation, body))

    wrong = []
    places: list[Place] = []
    for name in list(BODIES)[turn::SHARES]:
        operation, answer = operation_named(name), None
        for number in itertools.count():  # what was done at one place before may stand in the way there
            fresh = number == len(places)
            if fresh:
                places.append(Place(house))
            answer = sent(places[number], operation)
            if fresh or not answer.is_error:
                break
        done = {200, 201, 204} | ({404} if name in OF_A_PERSON else set())
        if answer is None or answer.status_code not in done:
            wrong.append(f"{name}: {answer and answer.text}")
    assert wrong == []
