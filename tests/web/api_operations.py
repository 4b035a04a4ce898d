"""The operations of the OpenAPI document, and the schemas of their bodies."""

import fcntl
import json
from functools import cache
from typing import Any, NamedTuple

from tests import keeper
from tests.in_process import application


class Operation(NamedTuple):
    name: str
    method: str
    path: str
    declared: dict[str, Any]


@cache
def document() -> dict[str, Any]:
    """It takes some seconds: one worker makes it for all."""
    folder = keeper.in_memory()
    if folder is None:
        return dict(json.loads(json.dumps(application().openapi())))
    with (folder / "openapi.json").open("a+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0)
        if not (text := file.read()):
            text = json.dumps(application().openapi())
            file.write(text)
    return dict(json.loads(text))


@cache
def operations() -> tuple[Operation, ...]:
    return tuple(
        Operation(f"{method.upper()} {path}", method.upper(), path, declared)
        for path, methods in document()["paths"].items()
        for method, declared in methods.items()
    )


def resolved(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema itself, whatever it refers to or may be besides null."""
    while True:
        if "$ref" in schema:
            schema = document()["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
        elif len(options := [each for each in schema.get("anyOf", ()) if each.get("type") != "null"]) == 1:
            schema = options[0]
        elif len(schema.get("allOf", ())) == 1:
            schema = schema["allOf"][0]
        else:
            return schema


def operation_named(name: str) -> Operation:
    return next(each for each in operations() if each.name == name)


def body_schema(operation: Operation) -> dict[str, Any]:
    schema = resolved(operation.declared["requestBody"]["content"]["application/json"]["schema"])
    return resolved(schema["items"]) if schema.get("type") == "array" else schema
