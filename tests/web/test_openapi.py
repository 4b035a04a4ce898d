"""The OpenAPI document is complete and true, and its page can be used."""

import json
import re
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import msgspec
import pytest
from fastapi import FastAPI
from fastapi.routing import APIRoute, iter_route_contexts
from playwright.sync_api import Page, expect
from pydantic import BaseModel, TypeAdapter

from app.loop.readings.answers import ReadingAnswer
from app.loop.readings.api import BatchCounts
from app.loop.readings.schemas import ReadingIn
from app.web.api_docs import _kind, curl, prose
from app.web.openapi import EXAMPLES, example_of, operations, resolve
from tests.conftest import RunServer, Server
from tests.in_process import application

pytestmark = pytest.mark.own_server  # the examples name machines and characteristics

Json = dict[str, Any]
ROLES = ("viewer", "operator", "engineer", "admin")
SHARES = 4  # of all operations, where each is called many times


@pytest.fixture(scope="module")
def app() -> FastAPI:
    return application()


@pytest.fixture(scope="module")
def made(app: FastAPI) -> Json:
    travelled: Json = json.loads(json.dumps(app.openapi()))
    return travelled


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


# What a page's form does, by the operations of the API that do the same; None: there is none, or it is for everybody.
FORMS: dict[str, tuple[str, ...] | None] = {
    "/account/password": None,
    "/account/pin": None,
    "/simulated": ("add_machine",),
    "/simulated/remove": ("add_machine",),
    "/alarms/{number}/acknowledge": ("acknowledge_alarm",),
    "/alarms/{number}/affected": ("set_parts_aside",),
    "/alarms/{number}/photos": ("add_photo_of_alarm",),
    "/alarms/{number}/photos/{photo}/remove": ("remove_photo_of_alarm",),
    "/characteristics/{characteristic}/trial/start": ("start_correcting",),
    "/characteristics/{characteristic}/control-plan": ("set_control_plan",),
    "/characteristics/{characteristic}/temperature": ("set_expansion",),
    "/quarantines/{number}/parts/{part}/{what}": ("measure_part_again", "release_part", "scrap_part"),
    "/alignments/new": ("align",),
    "/alignments/pallets/new": ("compose_pallet",),
    "/alignments/{number}/acknowledge": ("acknowledge_alignment",),
    "/alignments/{number}/recompute": ("recompute_alignment",),
    "/calibration/{machine}/{memory}/{location}": ("calibrate_gauge", "calibrate_ring", "add_pair", "plan_calibration"),
    "/calibration/{machine}/{memory}/{location}/{what}/{number}": (
        "accept_calibration",
        "accept_suggestion",
        "exclude_pair",
    ),
    "/characteristics/{characteristic}/control/baselines/{version}/{what}": (
        "put_baseline_in_force",
        "retire_baseline",
    ),
    "/characteristics/{characteristic}/control/freeze": ("freeze_baseline",),
    "/characteristics/{characteristic}/readings/{sequence}/by-hand": ("add_hand_measurement",),
    "/characteristics/{characteristic}/readings/{sequence}/exclude": ("exclude_reading",),
    "/characteristics/{characteristic}/rules": ("put_rules",),
    "/characteristics/{characteristic}/what-if": ("propose_change",),
    "/corrections/{machine}/tools/{tool}": ("approve_corrections",),
    "/forms/new": ("measure_form",),
    "/forms/{form}/recompute": ("recompute_form",),
    "/gauges/new": ("add_gauge_study", "take_gauge_study"),
    "/gauges/{number}/correct": ("correct_gauge_study",),
    "/import": None,
    "/import/{token}": None,
    "/invitation/{token}": None,
    "/kinematics/machines/{machine}": ("plan_kinematics",),
    "/kinematics/machines/{machine}/backups/{version}": ("restore_kinematics",),
    "/kinematics/new": ("take_kinematics_run",),
    "/kinematics/runs/{run}/recompute": ("recompute_kinematics_run",),
    "/kinematics/runs/{run}/{what}": ("confirm_kinematics_run", "enter_kinematics_run", "undo_kinematics_run"),
    "/machines/{machine}/averages/{location}/edit": ("set_empirical_value",),
    "/machines/{machine}/connection/remove": ("remove_connection",),
    "/machines/{machine}/touch-tests": ("ask_for_touch_test",),
    "/machines/{machine}/touch-tests/{number}/answer": ("answer_touch_test",),
    "/machines/{machine}/touch-tests/{number}/stop": ("stop_touch_test",),
    "/machines/{machine}/corrections/program": ("mark_fetched", "confirm_corrections"),
    "/machines/{machine}/corrections/{number}": ("approve_correction", "release_correction", "reject_correction"),
    "/machines/{machine}/tools/{number}": ("describe",),
    "/machines/{machine}/tools/{number}/{what}": ("edit_tool", "change_tool", "switch_tool"),
    "/account/notifications": None,
    "/account/notifications/browser": None,
    "/setup/notifications/days-off": ("set_days_off",),
    "/setup/notifications/groups/new": ("add_receiver_group",),
    "/setup/notifications/groups/{group}": ("change_receiver_group", "delete_receiver_group"),
    "/setup/notifications/receivers": ("add_receiver",),
    "/setup/notifications/receivers/{receiver}/delete": ("delete_receiver",),
    "/setup/notifications/receivers/{receiver}/test": ("send_test",),
    "/setup/notifications/routes/new": ("add_notification_route",),
    "/setup/notifications/routes/{route}": ("change_notification_route", "delete_notification_route"),
    "/setup/reactions/new": ("add_reaction_plan", "add_reaction_picture"),
    "/setup/reactions/{plan}": ("change_reaction_plan", "withdraw_reaction_plan", "add_reaction_picture"),
    "/setup/reactions/catalogue": ("add_catalogue_entry",),
    "/setup/reactions/catalogue/{entry}": ("change_catalogue_entry",),
    "/notes/new": ("write_note",),
    "/maintenance/new": ("enter_maintenance",),
    "/maintenance/{number}/end": ("end_maintenance",),
    "/maintenance/{number}/extend": ("extend_maintenance",),
    "/notes/{number}/withdraw": ("withdraw_note",),
    "/proposals/{number}": ("approve_proposal", "reject_proposal", "withdraw_proposal"),
    "/reports": ("ask_for_reports",),
    "/reports/{number}/cancel": ("cancel_reports",),
    "/reports/{number}/throw-away": ("throw_reports_away",),
    "/setup/characteristics/new": ("add_characteristic",),
    "/setup/characteristics/{characteristic}": ("change_characteristic",),
    "/setup/characteristics/{characteristic}/forms": ("add_characteristic",),
    "/setup/machines/new": ("add_machine",),
    "/setup/machines/{machine}": ("change_machine",),
    "/setup/machines/{machine}/keys": ("make_machine_key",),
    "/setup/machines/{machine}/keys/{key}/revoke": ("revoke_machine_key",),
    "/setup/parameters": ("change_characteristic",),
    "/setup/people/invitations": ("invite_person",),
    "/setup/people/invitations/{token_hash}/withdraw": ("invite_person",),
    "/setup/people/keys": ("make_key",),
    "/setup/people/keys/{key}/revoke": ("revoke_key",),
    "/setup/people/{person}/password": ("change_person",),
    "/setup/people/{person}/{what}": ("change_person",),
    "/setup/programs": ("read_program",),
    "/setup/screens": ("add_wall_screen",),
    "/setup/screens/{screen}/revoke": ("revoke_wall_screen",),
    "/setup/stations": None,
    "/setup/stations/badges": None,
    "/setup/stations/badges/{person}/remove": None,
    "/setup/stations/{device}/revoke": None,
    "/sign-in": None,
    "/station": None,
    "/station/{machine}/alarms/{number}": None,  # on a device it is asked who acts: tests/views/station
    "/station/{machine}/alarms/{number}/photos": None,
    "/station/{machine}/context": None,
    "/station/{machine}/corrections/{number}": None,
    "/station/{machine}/note": None,
    "/station/{machine}/sizes": None,
    "/station/{machine}/tools/{number}/change": None,
    "/station/{machine}/tools/{number}/corrections": None,
    "/sign-out": None,
    "/signals/{number}": ("comment_signal",),
    "/work-zeros/fixtures/{machine}/{fixture}": ("watch_fixture",),
    "/work-zeros/new": ("find_work_zero",),
    "/work-zeros/{number}/acknowledge": ("acknowledge_work_zero",),
    "/work-zeros/{number}/recompute": ("recompute_work_zero",),
}


def test_a_page_asks_for_the_role_that_the_api_asks_for(app: FastAPI, made: Json) -> None:
    """A form that does one of several things asks for the least of their roles, and its action for more where it must."""
    roles = {operation["operationId"]: operation.get("x-role") for _m, _p, operation in operations(made)}
    differing = {}
    for context in iter_route_contexts(app.routes):
        route = context.original_route
        if not isinstance(route, APIRoute) or route.path.startswith("/api") or (route.methods or set()) <= {"GET"}:
            continue
        same = FORMS[route.path]
        if same is None:
            continue
        dependencies = route.dependant.dependencies
        inner = [
            each for dependency in dependencies for each in dependency.dependencies
        ]  # of the kit: who acts on what
        calls = [dependency.call for dependency in (*dependencies, *inner)]
        names = [getattr(call, "__name__", "") for call in calls]
        asked = {name.removeprefix("require_") for name in names if name.startswith("require_")}
        wanted = min((roles[name] for name in same), key=ROLES.index)
        if asked != {wanted}:
            differing[route.path] = (asked, wanted)
    assert differing == {}


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


class TestPage:
    def test_every_operation_stands_on_it_with_a_command(self, server: Server, made: Json) -> None:
        text = server.client().get("/api/docs").text
        for each in ids(made):
            assert f'id="{each}"' in text
        assert text.count("curl -sS") == len(ids(made))
        assert "correction_in_effect" in text
        assert "R33. Zero range." in text

    def test_searching_opening_and_printing(self, page: Page) -> None:
        page.goto("/api/docs")
        assert page.locator("details.operation[open]").count() == 0
        page.keyboard.press("/")
        page.keyboard.type("offset_after")
        expect(page.locator("#mark_applied")).to_be_visible()
        expect(page.locator("#list_people")).to_be_hidden()
        page.get_by_role("searchbox").fill("no such words anywhere")
        expect(page.get_by_role("status").first).to_have_text("Nothing has all of these words.")
        page.get_by_role("searchbox").fill("")
        page.get_by_role("navigation", name="Operations").get_by_role("link", name="Push reading").click()
        expect(page.locator("#push_reading[open]")).to_be_visible()
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert page.locator("details.operation:not([open])").count() == 0
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert page.locator("details.operation[open]").count() == 1

    @pytest.mark.long
    def test_it_is_linked_and_knows_who_is_signed_in(self, page: Page, server: Server) -> None:
        password = server.person("Dora", "viewer")
        page.goto("/sign-in")
        page.get_by_label("Name").fill("Dora")
        page.locator("input[type=password]").fill(password)
        page.locator("main button[type=submit]").click()
        page.wait_for_url(f"{server.url}/")
        page.get_by_role("contentinfo").get_by_role("link", name="API").click()
        expect(page.get_by_role("heading", level=1)).to_have_text("API")
        expect(page.get_by_role("banner")).to_contain_text("Dora")

    def test_wide_things_do_not_widen_it(self, page: Page) -> None:
        page.set_viewport_size({"width": 800, "height": 1000})
        page.goto("/api/docs#add_characteristic")
        expect(page.locator("#add_characteristic[open]")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= 800


class TestWords:
    @pytest.mark.parametrize(
        ("text", "html"),
        [
            ("a `b<c` d", "<p>a <code>b&lt;c</code> d</p>"),
            ("<script>", "<p>&lt;script&gt;</p>"),
            ("raises *offset differs*", "<p>raises <em>offset differs</em></p>"),
            ("3 * 4", "<p>3 * 4</p>"),
            ("First\nline\n\n- one\n- `two`", "<p>First line</p><ul><li>one</li><li><code>two</code></li></ul>"),
        ],
    )
    def test_docstrings_become_html(self, text: str, html: str) -> None:
        assert prose(text) == html

    @pytest.mark.parametrize(
        ("schema", "words"),
        [
            ({"type": "integer", "minimum": 1, "maximum": 32}, "whole number, 1 to 32"),
            ({"type": "string", "maxLength": 64}, "text, at most 64 characters"),
            ({"enum": ["a", "b", None]}, "a | b"),
            ({"type": ["number", "null"], "minimum": 0}, "number, at least 0 or null"),
            ({"anyOf": [{"type": "string", "format": "date-time"}, {"type": "null"}]}, "time or null"),
            ({"type": "array", "items": {"type": "boolean"}}, "list of true or false"),
            ({}, "any"),
        ],
    )
    def test_schemas_become_words(self, schema: Json, words: str) -> None:
        assert _kind({}, schema) == words

    def test_the_command_survives_a_shell(self) -> None:
        body = {"content": {"application/json": {"example": {"reason": "it's $HOME `date`"}}}}
        line = curl("post", "/x/{key}", {"parameters": [], "requestBody": body, "responses": {}}, "http://host")
        said = subprocess.run(
            ["sh", "-c", f"curl() {{ printf '%s\\n' \"$@\"; }}\n{line}"], capture_output=True, text=True
        )
        assert '{"reason": "it\'s $HOME `date`"}' in said.stdout.splitlines()
