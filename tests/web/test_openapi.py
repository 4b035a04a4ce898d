"""The OpenAPI document is complete and true."""

import json
import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import msgspec
import pytest
from fastapi import FastAPI
from fastapi.routing import APIRoute, iter_route_contexts
from pydantic import BaseModel, TypeAdapter

from app.loop.readings.answers import ReadingAnswer
from app.loop.readings.api import BatchCounts
from app.loop.readings.schemas import ReadingIn
from app.web.openapi import EXAMPLES, example_of, operations, resolve
from tests.in_process import application
from tests.servers import RunServer, Server
from tests.web.api_operations import document

pytestmark = pytest.mark.own_server  # the examples name machines and characteristics

Json = dict[str, Any]
ROLES = ("viewer", "operator", "engineer", "admin")
SHARES = 4  # of all operations, where each is called many times


@pytest.fixture(scope="module")
def app() -> FastAPI:
    return application()


@pytest.fixture(scope="module")
def made(app: FastAPI) -> Json:
    """Of the program that is loaded here: its models are looked at, too."""
    return document()


def api_routes(app: FastAPI) -> Iterator[APIRoute]:
    for context in iter_route_contexts(app.routes):
        route = context.original_route
        if isinstance(route, APIRoute) and route.path.startswith(("/api/v1", "/health", "/metrics")):
            yield route


def media_of(described: Json) -> list[tuple[str, Json]]:
    return list(described.get("content", {}).items())


def ids(made: Json) -> list[str]:
    return [operation["operationId"] for _method, _path, operation in operations(made)]


class TestComplete:
    def test_it_says_which_openapi_it_is(self, made: Json) -> None:
        assert made["openapi"].startswith("3.1.")
        assert made["info"]["title"] == "Inband"
        assert [server["url"] for server in made["servers"]] == ["/"]

    def test_every_route_is_in_it(self, app: FastAPI, made: Json) -> None:
        described = {(method, path) for method, path, _operation in operations(made)}
        served = {(method.lower(), route.path_format) for route in api_routes(app) for method in route.methods or ()}
        assert described == served

    def test_every_field_is_described(self, made: Json) -> None:
        """What means the same wherever it is, is described once, in `USUAL`."""
        schemas = made["components"]["schemas"]
        assert schemas["CalibrationOut"]["properties"]["machine"]["description"] == "Key of the machine."
        assert schemas["GaugeIn"]["properties"]["key"]["description"].startswith("Unique per machine")
        bare = [
            f"{name}.{field}"
            for name, schema in schemas.items()
            for field, described in schema.get("properties", {}).items()
            if "description" not in described and "$ref" not in described
        ]
        assert bare == []

    def test_calibrations_may_be_sent_by_the_numbers_of_the_control(self, made: Json) -> None:
        for name, body in (
            (
                "GaugeIn",
                {"R11", "R32", "R33", "R34", "R36", "R29", "touches", "key"},
            ),  # as docs/how-to/calibrate.md sends it
            ("RingIn", {"tool_memory", "#502", "#505", "#506", "#507", "sections"}),
        ):
            schema = made["components"]["schemas"][name]
            assert body <= set(schema["properties"])
            assert set(schema["required"]) <= body

    def test_figures_have_a_schema(self, made: Json) -> None:
        for _method, path, operation in operations(made):
            for media, described in media_of(operation["responses"].get("200", {})):
                assert media != "application/json" or described.get("schema"), path

    def test_operation_ids_are_unique_words(self, made: Json) -> None:
        found = ids(made)
        assert len(found) == len(set(found))
        assert all(each.isidentifier() for each in found)

    def test_every_reference_leads_somewhere(self, made: Json) -> None:
        def walk(part: Any) -> Iterator[str]:
            if isinstance(part, dict):
                if isinstance(part.get("$ref"), str):
                    yield part["$ref"]
                for inner in part.values():
                    yield from walk(inner)
            elif isinstance(part, list):
                for inner in part:
                    yield from walk(inner)

        references = set(walk(made))
        assert "#/components/schemas/ReadingIn" in references
        for reference in references:
            assert resolve(made, {"$ref": reference})

    def test_every_schema_has_a_name_of_its_own(self, made: Json) -> None:
        """Two classes of one name would be named by their modules, which is nothing for a program of somebody else."""
        assert [name for name in made["components"]["schemas"] if "__" in name or name.startswith("app")] == []

    def test_generators_of_programs_can_write_every_body(self, made: Json) -> None:
        """openapi-python-client leaves out what has an object as default, or an enum of more than one type."""

        def odd(part: Any, path: str) -> Iterator[str]:
            if isinstance(part, dict):
                kinds = {type(each) for each in part.get("enum", []) if each is not None} if "type" in part else set()
                if len(kinds) > 1 or ("type" in part and isinstance(part.get("default"), dict) and part["default"]):
                    yield path
                for name, inner in part.items():
                    yield from odd(inner, f"{path}/{name}") if name not in {"example", "examples"} else ()
            elif isinstance(part, list):
                for at, inner in enumerate(part):
                    yield from odd(inner, f"{path}/{at}")

        assert list(odd(made, "")) == []

    def test_r_numbers_stand_in_what_is_sent(self, made: Json) -> None:
        given = made["components"]["schemas"]["CharacteristicIn"]["properties"]["parameters"]["properties"]
        assert {"R10", "R24", "R33", "R42"} <= set(given)
        assert given["R33"]["minimum"] == 0
        answered = made["components"]["schemas"]["CharacteristicOut"]["properties"]["parameters"]["properties"]
        assert "R33" not in answered

    def test_every_tag_has_a_sentence_and_every_operation_one_tag(self, made: Json) -> None:
        tags = {tag["name"]: tag["description"] for tag in made["tags"]}
        used = {tag for _m, _p, operation in operations(made) for tag in operation["tags"]}
        assert used == set(tags)
        assert all(words.endswith(".") for words in tags.values())
        assert all(len(operation["tags"]) == 1 for _m, _p, operation in operations(made))

    def test_everything_is_explained(self, made: Json) -> None:
        silent = [
            f"{operation['operationId']} {parameter.get('name', '')}"
            for _method, _path, operation in operations(made)
            for parameter in [{"description": operation.get("description")}, *operation.get("parameters", [])]
            if not parameter.get("description")
        ]
        assert silent == []

    def test_every_path_parameter_is_declared(self, made: Json) -> None:
        for _method, path, operation in operations(made):
            declared = [each["name"] for each in operation.get("parameters", []) if each["in"] == "path"]
            assert declared == re.findall(r"\{(\w+)\}", path), path

    def test_every_body_and_every_answer_has_an_example(self, made: Json) -> None:
        missing = [
            f"{operation['operationId']} {status} {kind}"
            for _method, _path, operation in operations(made)
            for status, described in [("body", operation.get("requestBody", {})), *operation["responses"].items()]
            for kind, media in media_of(resolve(made, described))
            if "example" not in media
        ]
        assert missing == []

    def test_keys_and_cookies_are_declared_and_health_needs_neither(self, made: Json) -> None:
        assert {tuple(each) for each in made["security"]} == {("key",), ("session",)}
        assert set(made["components"]["securitySchemes"]) == {"key", "session"}
        for _method, path, operation in operations(made):
            open_to_all = path.startswith(("/health", "/metrics")) or path.endswith("openapi.json")
            assert (operation.get("security") == []) is open_to_all, path

    def test_every_operation_says_how_it_fails(self, made: Json) -> None:
        for _method, path, operation in operations(made):
            if operation.get("security") == []:
                continue
            expected = {"401", "403", "422", "500", "503"}
            expected |= {"404"} if "{" in path else set()
            expected |= {"413"} if "requestBody" in operation else set()
            assert expected <= set(operation["responses"]), path

    def test_errors_are_problem_documents(self, made: Json) -> None:
        for response in made["components"]["responses"].values():
            ((kind, media),) = media_of(response)
            assert kind == "application/problem+json"
            problem = media["example"]
            assert {"type", "title", "status", "detail", "errors", "what_to_do"} <= set(problem)
            assert ("Retry-After" in response.get("headers", {})) is (problem["status"] in {429, 503})


def models(base: type[BaseModel] = BaseModel) -> Iterator[type[BaseModel]]:
    for model in base.__subclasses__():
        yield model
        yield from models(model)


def shape(value: Any) -> Any:
    """Names of the fields, all the way down."""
    if isinstance(value, dict):
        return {name: shape(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return [shape(inner) for inner in value if isinstance(inner, dict | list)] or None
    return None


class TestExamples:
    @pytest.mark.parametrize("name", sorted(file.stem for file in EXAMPLES.glob("*.json")))
    def test_a_file_is_what_its_schema_says(self, made: Json, name: str) -> None:
        assert made["components"]["schemas"][name]["example"] == example_of(name)
        if name == "ReadingIn":
            msgspec.convert(example_of(name), ReadingIn)
            return
        (model,) = [model for model in models() if (model.__name__, model.__module__[:4]) == (name, "app.")]
        read = TypeAdapter(model).validate_python(example_of(name))
        written = TypeAdapter(model).dump_python(read, mode="json", exclude_unset=True, by_alias=True)
        assert shape(written) == shape(example_of(name))

    def test_bodies_are_what_the_routes_take(self, app: FastAPI, made: Json) -> None:
        routes = {route.name: route for route in api_routes(app)}
        checked = 0
        for _method, _path, operation in operations(made):
            route = routes[operation["operationId"]]
            if route.body_field is None:
                continue
            ((_type, media),) = media_of(operation["requestBody"])
            model: Any = route.body_field.field_info.annotation
            TypeAdapter(model).validate_python(media["example"])
            checked += 1
        assert checked > 10

    def test_answers_are_what_the_routes_give(self, app: FastAPI, made: Json) -> None:
        checked = 0
        for route in api_routes(app):
            operation = made["paths"][route.path_format][min(route.methods or ()).lower()]
            models = {status: described.get("model") for status, described in route.responses.items()}
            models |= {route.status_code or 200: models.get(route.status_code or 200) or route.response_model}
            for status, model in models.items():
                if model is None or int(status) >= 400:
                    continue
                example = dict(media_of(operation["responses"][str(status)]))["application/json"]["example"]
                answer = TypeAdapter(model).validate_python(example)
                assert TypeAdapter(model).dump_python(answer, mode="json", exclude_unset=True).keys() == example.keys()
                checked += 1
        assert checked > 30

    def test_readings_are_what_the_door_takes(self, made: Json) -> None:
        one = dict(media_of(made["paths"]["/api/v1/readings"]["post"]["requestBody"]))
        many = dict(media_of(made["paths"]["/api/v1/readings/batch"]["post"]["requestBody"]))
        assert msgspec.convert(one["application/json"]["example"], ReadingIn).measured == 39.9981
        assert msgspec.convert(many["application/json"]["example"], list[ReadingIn])
        lines = many["application/x-ndjson"]["example"].encode()
        assert msgspec.json.Decoder(ReadingIn).decode_lines(lines)


# --- the document against the server
@pytest.fixture(scope="module")
def plant(server: Server, made: Json) -> Json:
    """The server of this file, for tests that leave the things of the examples as they are."""
    return planted(server, made)


def planted(server: Server, made: Json) -> Json:
    """A server where the things stand that the document's examples name: lathe-1, shaft-d40, corrections, an alarm."""
    clients = {role: server.client(server.key(role)) for role in ROLES}
    engineer = clients["engineer"]
    paths = made["paths"]
    for path in ("/api/v1/machines", "/api/v1/characteristics"):
        ((_type, media),) = media_of(paths[path]["post"]["requestBody"])
        assert engineer.post(path, json=media["example"]).status_code == 201
    reading = without_time(
        dict(media_of(paths["/api/v1/readings"]["post"]["requestBody"]))["application/json"]["example"]
    )
    clients["machine"] = server.client(server.key(machine="lathe-1"))
    corrected = [{"characteristic": "shaft-d40", "measured": 39.9981, "correction_in_effect": n} for n in range(20)]
    for each in corrected:  # so that there is a correction 17
        assert engineer.post("/api/v1/readings", json=each).json()["action"] == "correct"
    return {"clients": clients, "reading": reading}


def without_time(example: Any) -> Any:
    """The example, but measured now, and ended within a day: the times in it are far ahead or over, whatever the clock shows."""
    if isinstance(example, list):
        return [without_time(each) for each in example]
    made = {name: value for name, value in example.items() if name != "measured_at"}
    if "T" in str(made.get("ends")):
        made["ends"] = (datetime.now(UTC) + timedelta(hours=20)).isoformat()
    return made


def send(client: httpx.Client, method: str, path: str, operation: Json, number: int = 1) -> httpx.Response:
    """Call an operation with the examples of the document; numbers that have no example there are ``number``."""
    query: Json = {}
    for parameter in operation.get("parameters", []):
        example = parameter.get("example", number)
        if parameter["in"] == "path":
            path = path.replace(f"{{{parameter['name']}}}", str(example))
        elif parameter.get("required"):
            query[parameter["name"]] = example
    body = body_of(operation)
    if operation["operationId"] == "events":
        with client.stream(method, path) as answer:
            return answer
    return client.request(method, path, params=query, **body)


def is_number(made: Json, parameter: Json) -> bool:
    schema = resolve(made, parameter["schema"])
    return "integer" in {schema.get("type"), *(each.get("type") for each in schema.get("anyOf", []))}


def strange_value(made: Json, parameter: Json) -> Any:
    """Something of the right kind that nothing here is called: a number, a key, or the first of the words."""
    if is_number(made, parameter):
        return 999_999
    schema = resolve(made, parameter["schema"])
    for each in [schema, *schema.get("anyOf", [])]:
        one = resolve(made, each)
        if "enum" in one:
            return one["enum"][0]
        if one.get("type") == "boolean":
            return "true"
        if one.get("format") == "date-time":
            return "2026-11-21T08:15:02Z"
    return "nope"


def body_of(operation: Json) -> Json:
    if "requestBody" not in operation:
        return {}
    kind, media = media_of(operation["requestBody"])[0]
    return {"content": json.dumps(without_time(media["example"])).encode(), "headers": {"Content-Type": kind}}


# What these ask for, the twenty readings of this server do not carry: a good request, and a refusal in words.
OF_MANY_READINGS = (
    "/baselines",
    "/trial",
    "/sampling",
    "/temperature",
    "/baselines/preview",
    "/gauge-studies/from-readings",
)


class TestAgainstTheServer:
    def test_answers_to_readings_are_as_described(self, plant: Json) -> None:
        machine = plant["clients"]["machine"]
        first = machine.post("/api/v1/readings", json=plant["reading"] | {"key": "one"})
        again = machine.post("/api/v1/readings", json=plant["reading"] | {"key": "one"})
        assert (first.status_code, again.status_code) == (201, 200)
        assert first.json() == again.json()
        assert first.json().keys() == ReadingAnswer.model_fields.keys()
        ReadingAnswer.model_validate(first.json())
        batch = machine.post("/api/v1/readings/batch?decisions=true", json=[plant["reading"] | {"key": "two"}])
        assert batch.json().keys() == BatchCounts.model_fields.keys()
        BatchCounts.model_validate(batch.json())

    @pytest.mark.parametrize("share", range(SHARES))
    def test_the_examples_work_and_the_roles_are_true(self, run_server: RunServer, made: Json, share: int) -> None:
        """Every operation with the examples as they stand: refused by the role below its own, taken (or not found) with it.

        What is answered has the fields of the example of an answer. Each share has a server of its own: the examples change it.
        """
        with run_server() as server:
            planted(server, made)
            clients = {role: server.client(server.key(role)) for role in ROLES}  # others' keys are revoked by examples
            clients["machine"] = server.client(server.key(machine="lathe-1"))
            wrong, as_described = [], 0
            for method, path, operation in list(operations(made))[share::SHARES]:
                if operation.get("security") == []:
                    continue
                least = operation["x-role"]
                below = ROLES[: ROLES.index(least)][-1:]
                for role in (*below, least, "machine"):
                    may = operation["x-machine-key"] if role == "machine" else role == least
                    answer = send(clients[role], method, path, operation, number=999_999)
                    refused = answer.status_code in {401, 403}
                    too_few = answer.status_code == 422 and path.endswith(OF_MANY_READINGS)
                    if refused is may or (answer.status_code == 422 and not too_few) or answer.status_code >= 500:
                        wrong.append(f"{role}: {method} {path} answered {answer.status_code}")
                    if answer.is_success and answer.headers.get("content-type") == "application/json":
                        described = resolve(made, operation["responses"][str(answer.status_code)])
                        assert answer.json().keys() == described["content"]["application/json"]["example"].keys(), path
                        as_described += 1
        assert wrong == []
        assert as_described > 40

    def test_errors_are_described_where_they_happen(self, server: Server, made: Json) -> None:
        anonymous = server.client()
        for method, path, operation in operations(made):
            answer = send(anonymous, method, path, operation)
            if operation.get("security") == []:
                assert answer.status_code == 200, path
            else:
                assert answer.status_code == 401, path
                assert answer.headers["content-type"] == "application/problem+json"

    @pytest.mark.parametrize("of", [pytest.param(3, id="some"), pytest.param(1, id="all", marks=pytest.mark.long)])
    @pytest.mark.parametrize("share", range(SHARES))
    def test_every_status_that_is_answered_is_described(self, plant: Json, made: Json, share: int, of: int) -> None:
        """With names and numbers that nobody has: in the path, and in one query parameter of so many alone."""
        admin, undescribed = plant["clients"]["admin"], set()
        for method, path, operation in list(operations(made))[share::SHARES]:
            if operation["operationId"] == "events":
                continue
            parameters = operation.get("parameters", [])
            strange = {each["name"]: strange_value(made, each) for each in parameters}
            known = {each["name"]: each.get("example", 1) for each in parameters if each["in"] == "path"}
            wanted = {each["name"]: each.get("example", 1) for each in parameters if each.get("required")}
            names = [each["name"] for each in parameters if each["in"] == "query"]
            queries = [{}, *({name: strange[name]} for name in names[len(path) % of :: of])]
            attempts = [({name: strange[name] for name in known}, {})] + [(known, query) for query in queries]
            for in_path, query in attempts:
                asked = {name: value for name, value in wanted.items() if name not in known} | query
                answer = admin.request(method, path.format(**in_path), params=asked, **body_of(operation))
                if str(answer.status_code) not in operation["responses"]:
                    undescribed.add(f"{method} {path} {query}: {answer.status_code}")
        assert sorted(undescribed) == []

    @pytest.mark.parametrize("share", range(SHARES))
    def test_numbers_beyond_what_is_stored_are_named(self, plant: Json, made: Json, share: int) -> None:
        admin, wrong = plant["clients"]["admin"], []
        for method, path, operation in list(operations(made))[share::SHARES]:
            if method != "get" or operation["operationId"] == "events":
                continue
            parameters = operation.get("parameters", [])
            known = {each["name"]: each.get("example", 1) for each in parameters if each["in"] == "path"}
            wanted = {each["name"]: each.get("example", 1) for each in parameters if each.get("required")}
            for name in [each["name"] for each in parameters if is_number(made, each)]:
                for value in (-1, 2**31, 2**63 - 1, 2**63, 10**30):
                    given = known | wanted | {name: value}
                    query = {each: given[each] for each in given if each not in known}
                    answer = admin.get(path.format(**given), params=query)
                    named = (
                        [error["field"] for error in answer.json()["errors"]] if answer.status_code == 422 else [name]
                    )
                    if answer.status_code not in {200, 404, 422} or named != [name]:
                        wrong.append(f"{path} {name}={value}: {answer.status_code} {named}")
        assert wrong == []

    def test_the_document_needs_no_key(self, server: Server, made: Json) -> None:
        answer = server.client().get("/api/v1/openapi.json")
        assert answer.headers["content-type"] == "application/json"
        assert answer.json() == made
