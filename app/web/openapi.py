"""The OpenAPI document: what the routes declare, completed so that a program can be written from it alone.

FastAPI describes parameters, bodies and answers. Added here: the schemas of the readings door (msgspec's), who may call,
every error in the shape it really has, and an example at every place where one is looked for: those of bodies and answers are
files, named as their schemas.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from fastapi import FastAPI
from fastapi.dependencies.models import Dependant
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute, iter_route_contexts

from app import HOUSE, __version__
from app.errors import PROBLEM_JSON, InbandError, Unexpected
from app.web.api import BASE, EVERY_ERROR
from app.web.deps import SESSION_COOKIE

Json = dict[str, Any]

SUMMARY = "Machines push probe readings; Inband decides, stores, and hands the tool-offset correction back."
DESCRIPTION = f"""\
Lengths are millimetres, times RFC 3339 with an offset, keys are slugs (`[a-z0-9][a-z0-9._-]{{0,63}}`). What is here is kept within \
version 1; fields may be added to answers, so skip those you do not know.

A program sends its key: `Authorization: Bearer KEY`. The key of a machine pushes readings and handles corrections, \
tools, averages, calibrations and pairs of that machine only; other keys have a role: viewer, operator, engineer or admin, each of which may do what those before it may. A browser's \
session works too; then a change carries the header `X-CSRF-Token`.

Errors are `{PROBLEM_JSON}` (RFC 9457) with what is wrong, where, and what to do about it. After a 5xx nothing was stored, but for \
`outcome-unknown`: send it again with the same key and you get its answer.

Unknown fields of a body and unknown parameters of a query are 422. The filter of states is `status` in some lists and `state` in \
others; each takes both names.

What is edited answers `GET` with an `ETag`. Sent with the change as `If-Match`, it makes that 412 where somebody else has changed the \
thing meanwhile; without it nothing is compared.

Lists answer `items` and `next`: pass `next` as the cursor of the following page (`after`, or `before` where the newest come first) \
until it is null."""

REQUEST_ID = "9f3c1a70-2b"

TAGS = {
    "readings": "What the probe measured. The answer says what was decided, why, and what to correct.",
    "offsets": "Tool memory (R10), average memory (R11), and the corrections on their way into the offsets.",
    "calibration": "Gauge, ring and external gauge: the measuring error of each machine, and when calibration is due.",
    "what-if": "Stored readings replayed with other settings, side by side and as a map, and the changes proposed from them.",
    "gauges": "Gauge studies: type 1, bias, linearity, repeatability and reproducibility, and what they say about R33.",
    "kinematics": "Rotary axes by the preset compensation (cycle 452): runs, what to enter, drift, back-ups.",
    "work zeros": "Work zero and size from the touches of an edge finder, as program text, and whether the fixture shifts.",
    "alignments": "Where a part lies, from six touches or more: the frame, how well it is known, pallets composed with parts.",
    "forms": "Form and position of features from their touches: deviation, verdict, uncertainty, touches that do not belong.",
    "programs": "Program text of the controls: read, written, and fetched where a machine has no network.",
    "alarms": "What needs a person, and what that person did about it.",
    "notifications": "Who is notified of which alarm: routes, receivers, maintenance, and each delivery with what was answered.",
    "connections": "Bridges beside the machines: their heartbeats, how each machine is connected, and what waits there.",
    "notes": "What people wrote down at a machine or a characteristic, at a moment; shown on every chart there.",
    "machines": "The machines that push readings.",
    "characteristics": "What is measured, by which R parameters it is judged, and its charts.",
    "statistics": "What a run of readings amounts to.",
    "control charts": "Baselines frozen on purpose, charts judged by them, run rules, and the signals that these gave.",
    "search": "Machines, characteristics, tools, alarms, parts, people, pages and help by their names.",
    "overview": "What needs attention first: every characteristic ranked, with the reasons.",
    "reports": "What is handed over about a characteristic and a period: JSON, PDF, XLSX, CSV; of many at once in the background.",
    "wear": "True wear behind the corrections, how long an edge will last, and whether a loop over-corrects.",
    "events": "What changes, as it changes.",
    "keys": "Keys by which machines and other programs call.",
    "people": "People who sign in, and invitations.",
    "audit": "Who changed what, when and why.",
    "health": "For those who run the server. These need no key.",
    "documentation": "This description. It needs no key.",
}
OPEN_TAGS = {"health", "documentation"}
USUAL = {
    "items": "The rows of this page.",
    "next": "Where the next page begins: sent as `after`. Null on the last page.",
    "machine": "Key of the machine.",
    "characteristic": "Key of the characteristic.",
    "id": "Identifies it.",
    "name": "Its name.",
    "text": "In words, for people.",
    "code": "A stable name, for programs.",
    "what_to_do": "What to do, for people.",
    "by": "Who did it: a person, a key, or the server itself.",
    "at": "When it was done.",
    "created_at": "When it was made.",
    "updated_at": "When it was changed last.",
    "measured_at": "When it was measured.",
    "received_at": "When the server received it.",
    "reason": "Why, in words.",
    "actor": "Who did it: a person, a key, or the server itself.",
    "part": "The part, as it was named.",
    "key": "Sent with it, so that it is stored once; null: none was.",
    "readings": "Number of readings that it was made of.",
    "corrections": "Number of corrections.",
    "mean": "Mean deviation from the target, mm.",
    "p_value": "Probability of as much by chance alone; null: it was not tested.",
    "cautions": "What the numbers should not be read without.",
    "unit": "Unit of the numbers beside it.",
    "role": "What the person or key may do.",
    "first_sequence": "Number of the first reading.",
    "last_sequence": "Number of the last reading.",
}
"""Descriptions of fields that mean the same wherever they are, where a model says nothing of its own."""
EXAMPLES = HOUSE / "docs" / "reference" / "api-examples"


def example_of(schema: str) -> Any:
    """The example of a body or an answer."""
    return json.loads((EXAMPLES / f"{schema}.json").read_bytes())


def document(app: FastAPI, schemas: Mapping[str, Any], root: str = "/") -> Json:
    """The document of this application, made once.

    schemas: components that routes refer to and FastAPI does not know. root: where it is served.
    """
    if app.openapi_schema is None:
        app.openapi_schema = _made(app, schemas, root)
    return app.openapi_schema


def operations(openapi: Json) -> Iterator[tuple[str, str, Json]]:
    """Every operation of a document as (method, path, description), by path as it was declared."""
    for path, item in openapi["paths"].items():
        for method, operation in item.items():
            yield method, path, operation


def resolve(openapi: Json, part: Json) -> Json:
    """Target of a ``$ref`` of the document; anything else as it is.

    Raises `KeyError` for a reference to nothing.
    """
    while "$ref" in part:
        target: Any = openapi
        for step in part["$ref"].removeprefix("#/").split("/"):
            target = target[step]
        part = target
    return part


def _made(app: FastAPI, schemas: Mapping[str, Any], root: str) -> Json:
    openapi = get_openapi(
        title="Inband",
        version=__version__,
        summary=SUMMARY,
        description=DESCRIPTION,
        routes=app.routes,
        tags=[{"name": name, "description": words} for name, words in TAGS.items()],
        servers=[{"url": root, "description": "this server"}],
        license_info={"name": "MIT", "identifier": "MIT"},
    )
    components = openapi["components"]
    components["schemas"] |= schemas
    for file in EXAMPLES.glob("*.json"):
        components["schemas"][file.stem]["example"] = example_of(file.stem)
    components["securitySchemes"] = {
        "key": {"type": "http", "scheme": "bearer", "description": "The key of a machine, or a key with a role."},
        "session": {
            "type": "apiKey",
            "in": "cookie",
            "name": SESSION_COOKIE,
            "description": "The browser's session; changes carry X-CSRF-Token as well.",
        },
    }
    components["responses"] = {_name(status): _problem(described) for status, described in _errors()}
    openapi["security"] = [{"key": []}, {"session": []}]
    roles = dict(_roles(app))
    for _method, _path, operation in operations(openapi):
        _complete(openapi, operation)
        if OPEN_TAGS.intersection(operation["tags"]):
            operation["security"] = []
        else:
            operation["x-role"], operation["x-machine-key"] = roles[operation["operationId"]]
    _tidy(openapi["paths"])
    _tidy(components["schemas"])
    _describe(components["schemas"])
    return openapi


# --- errors


def _errors() -> Iterable[tuple[int, Json]]:
    unexpected = Unexpected(
        "An unexpected error. Nothing of this request was stored.",
        f"Try again. If it happens again, tell your administrator the request number {REQUEST_ID}.",
    )
    described = {int(status): dict(error) for status, error in EVERY_ERROR.items()}
    described[InbandError.status] = {
        "description": unexpected.title,
        "content": {PROBLEM_JSON: {"example": unexpected.as_problem()}},
    }
    return sorted(described.items())


def _name(status: int) -> str:
    return f"Problem{status}"


def _problem(described: Json) -> Json:
    example = described["content"][PROBLEM_JSON]["example"]
    example |= {"request_id": REQUEST_ID}
    content = {"schema": {"$ref": "#/components/schemas/Problem"}, "example": example}
    response: Json = {"description": described["description"], "content": {PROBLEM_JSON: content}}
    words = "Names this answer in the server's log; yours, if you have sent one of letters, digits, dots, dashes."
    response["headers"] = {"X-Request-ID": {"schema": {"type": "string"}, "description": words}}
    if example["status"] in {429, 503}:
        response["headers"]["Retry-After"] = {"schema": {"type": "integer"}, "description": "Seconds to wait."}
    return response


# --- one operation


def _complete(openapi: Json, operation: Json) -> None:
    operation["summary"] = operation["operationId"].replace("_", " ").capitalize()
    responses = operation["responses"]
    errors = {int(status) for status in responses if status >= "4"}
    if not OPEN_TAGS.intersection(operation["tags"]):
        errors |= {500} | ({413} if "requestBody" in operation else set())
    for status in errors:
        responses[str(status)] = {"$ref": f"#/components/responses/{_name(status)}"}
    operation["responses"] = dict(sorted(responses.items()))
    for status, response in operation["responses"].items():
        if status < "4":
            _with_examples(openapi, response.get("content", {}))
            if response["description"] == "Successful Response":
                response["description"] = "Done"
    if "requestBody" in operation:
        _with_examples(openapi, operation["requestBody"]["content"])
    for parameter in operation.get("parameters", []):
        examples = parameter["schema"].pop("examples", [None])
        if examples[0] is not None:
            parameter["example"] = examples[0]


def _with_examples(openapi: Json, content: Json) -> None:
    """Copy the schema's example to a place of use that has none."""
    for media in content.values():
        if "example" in media or "examples" in media:
            continue
        schema = media.get("schema", {})
        if "anyOf" in schema:  # a body that may be left out
            schema = schema["anyOf"][0]
        example = _example(openapi, resolve(openapi, schema))
        if example is not None:
            media["example"] = example


def _example(openapi: Json, schema: Json) -> Any:
    if "example" in schema:
        return schema["example"]
    properties = schema.get("properties", {})
    if set(properties) == {"items", "next"}:  # one page of a list
        item = _example(openapi, resolve(openapi, properties["items"]["items"]))
        return None if item is None else {"items": [item], "next": None}
    return None


# --- who may call


def _roles(app: FastAPI) -> Iterator[tuple[str, tuple[str, bool]]]:
    """By operation id: the least role, and whether a machine's own key will do. A test holds the server to it."""
    for context in iter_route_contexts(app.routes):
        route = context.original_route
        if not isinstance(route, APIRoute) or not route.path.startswith(BASE):
            continue
        roles = {
            dependency.call.__name__.removeprefix("require_")
            for dependency in _all_dependencies(route.dependant)
            if dependency.call is not None and dependency.call.__name__.startswith("require_")
        }
        if roles:
            (role,) = roles  # a route that asks for two says two things
            yield route.name, (role, False)
        else:  # any caller; the route itself then looks for the role at the machine in question
            yield route.name, ("viewer" if route.methods == {"GET"} else "operator", True)


def _all_dependencies(of: Dependant) -> Iterator[Dependant]:
    """Those of a route, and those that find what it acts on."""
    for dependency in of.dependencies:
        yield dependency
        yield from _all_dependencies(dependency)


def _describe(schemas: Json) -> None:
    """Describe fields that have no description: by that of the type that may be null, or as `USUAL` has it."""
    for schema in schemas.values():
        for name, field in schema.get("properties", {}).items():
            if "description" in field or "$ref" in field:
                continue
            said = [option["description"] for option in field.get("anyOf", ()) if "description" in option]
            if said or name in USUAL:
                field["description"] = said[0] if said else USUAL[name]


def _tidy(part: Any) -> None:
    """Take out the titles that are only the names again."""
    if isinstance(part, dict):
        if isinstance(part.get("title"), str) and "status" not in part:
            del part["title"]
        for name, inner in part.items():
            if name not in {"example", "examples"}:  # what is sent and answered may well have a title
                _tidy(inner)
    elif isinstance(part, list):
        for inner in part:
            _tidy(inner)
