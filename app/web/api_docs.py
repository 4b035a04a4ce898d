"""The documentation of the API, for people: the OpenAPI document as a page, and the document itself for programs.

Neither needs a key: what can be read here is no secret, and who connects a machine has no account yet.
"""

import json
from collections.abc import Iterator
from html import escape
from itertools import groupby
from typing import Any, NamedTuple
from urllib.parse import quote

from fastapi import APIRouter, Request, Response
from markupsafe import Markup

from app.language.i18n import _
from app.web.api import BASE
from app.web.deps import SettingsDep
from app.web.openapi import Json, operations, resolve
from app.web.templates import page

router = APIRouter(tags=["documentation"], generate_unique_id_function=lambda route: route.name)
DOCUMENT = f"{BASE}/openapi.json"
DEEPEST = 3


class FieldRow(NamedTuple):
    """One field of a body or an answer, or one parameter of an address."""

    name: str
    kind: str
    meaning: Markup
    required: bool
    default: str | None = None


class Answer(NamedTuple):
    """Answer of an operation that succeeds."""

    status: str
    text: str
    fields: list[FieldRow]
    example: str


class Operation(NamedTuple):
    """One operation as the page shows it."""

    id: str
    method: str
    path: str
    summary: str
    text: Markup
    role: str | None
    machine_key: bool
    parameters: list[tuple[str, FieldRow]]
    body: list[FieldRow]
    body_optional: bool
    curl: str
    answers: list[Answer]
    errors: list[tuple[str, str]]


@router.get(
    DOCUMENT,
    responses={200: {"content": {"application/json": {"example": {"openapi": "3.1.0", "info": {}, "paths": {}}}}}},
)
def openapi_document(request: Request) -> dict[str, Any]:
    """This description as OpenAPI 3.1, for programs that make clients of it."""
    return request.app.openapi()  # type: ignore[no-any-return]


@router.get("/api/docs", include_in_schema=False)
async def api_documentation(request: Request, settings: SettingsDep) -> Response:
    """Every operation with its parameters, fields, examples, a line for curl and its errors."""
    await request.app.state.recognise(request)
    openapi = request.app.openapi()
    return page(
        request,
        "api_docs.html",
        info=openapi["info"],
        introduction=prose(openapi["info"]["description"]),
        groups=groups(openapi, settings.address),
        problems=problems(openapi),
        document=DOCUMENT,
        address=settings.address,
    )


def groups(openapi: Json, address: str) -> list[tuple[str, str, list[Operation]]]:
    """Name, sentence and operations of every tag, in the order of the document's tags."""
    order = [tag["name"] for tag in openapi["tags"]]
    ordered = sorted(operations(openapi), key=lambda operation: order.index(operation[2]["tags"][0]))
    sentences = {tag["name"]: tag["description"] for tag in openapi["tags"]}
    return [
        (tag, sentences[tag], [_operation(openapi, *operation, address) for operation in of_tag])
        for tag, of_tag in groupby(ordered, lambda operation: operation[2]["tags"][0])
    ]


def problems(openapi: Json) -> list[tuple[str, str, str]]:
    """Status, title and example of every error."""
    return [
        (name.removeprefix("Problem"), response["description"], _json(_media(response)["example"]))
        for name, response in openapi["components"]["responses"].items()
    ]


def _operation(openapi: Json, method: str, path: str, described: Json, address: str) -> Operation:
    responses = {status: resolve(openapi, response) for status, response in described["responses"].items()}
    body = described.get("requestBody", {})
    return Operation(
        id=described["operationId"],
        method=method.upper(),
        path=path,
        summary=described["summary"],
        text=prose(described.get("description", "")),
        role=described.get("x-role"),
        machine_key=described.get("x-machine-key", False),
        parameters=[(parameter["in"], _parameter(openapi, parameter)) for parameter in described.get("parameters", [])],
        body=list(_fields(openapi, _media(body).get("schema", {}))) if body else [],
        body_optional=bool(body) and not body.get("required", False),
        curl=curl(method, path, described, address),
        answers=[
            Answer(
                status,
                response["description"],
                list(_fields(openapi, _media(response).get("schema", {}))),
                _json(_media(response).get("example")),
            )
            for status, response in sorted(responses.items(), reverse=True)  # something new (201) first
            if status < "4"
        ],
        errors=[(status, response["description"]) for status, response in responses.items() if status >= "4"],
    )


def _media(described: Json) -> Json:
    media: Json = next(iter(described.get("content", {}).values()), {})
    return media


def _json(value: Any) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return json.dumps(value, indent=2, ensure_ascii=False)


# --- a line that can be tried


def curl(method: str, path: str, described: Json, address: str) -> str:
    """The operation as a command for curl, with the document's examples. The key is in $INBAND_KEY."""
    query: list[str] = []
    for parameter in described.get("parameters", []):
        example = parameter.get("example", 1 if parameter["schema"].get("type") == "integer" else "…")
        if parameter["in"] == "path":
            path = path.replace(f"{{{parameter['name']}}}", quote(str(example), safe=""))
        elif parameter["in"] == "query" and parameter.get("required"):
            query.append(f"{parameter['name']}={quote(str(example), safe='')}")
    parts = ["curl -sS" if "text/event-stream" not in str(described["responses"]) else "curl -sSN"]
    if method != "get":
        parts[0] += f" -X {method.upper()}"
    parts.append(_quoted(address + path + ("?" + "&".join(query) if query else "")))
    if described.get("security") != []:
        parts.append('-H "Authorization: Bearer $INBAND_KEY"')
    if "requestBody" in described:
        kind, media = next(iter(described["requestBody"]["content"].items()))
        example = media.get("example")
        body = example if isinstance(example, str) else json.dumps(example, ensure_ascii=False)
        parts += [f"-H 'Content-Type: {kind}'", f"-d {_quoted(body)}"]
    return " \\\n  ".join(parts)


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "'\\''") + "'"


# --- fields


def _parameter(openapi: Json, parameter: Json) -> FieldRow:
    schema = parameter["schema"]
    return FieldRow(
        parameter["name"],
        _kind(openapi, schema),
        _line(parameter.get("description", "")),
        parameter.get("required", False),
        _default(schema),
    )


def _default(schema: Json) -> str | None:
    default = schema.get("default")
    return None if default in (None, "", []) else json.dumps(default, ensure_ascii=False)


def _fields(openapi: Json, schema: Json, prefix: str = "", seen: tuple[int, ...] = ()) -> Iterator[FieldRow]:
    """The fields of an object, those of objects in it behind them: `correction.number`, `items[].sequence`."""
    schema = _bare(openapi, schema)
    if schema.get("type") == "array":
        yield from _fields(openapi, schema["items"], f"{prefix}[]", seen)
        return
    if id(schema) in seen or len(seen) > DEEPEST:
        return
    required = schema.get("required", [])
    for name, inner in schema.get("properties", {}).items():
        whole = f"{prefix}.{name}" if prefix else name
        bare = _bare(openapi, inner)
        meaning = inner.get("description") or bare.get("description", "")
        yield FieldRow(whole, _kind(openapi, inner), _line(meaning), name in required, _default(inner))
        yield from _fields(openapi, inner, whole, (*seen, id(schema)))


def _bare(openapi: Json, schema: Json) -> Json:
    """The schema itself: references followed, `or null` left out."""
    schema = resolve(openapi, schema)
    if "anyOf" in schema:
        others = [option for option in schema["anyOf"] if option.get("type") != "null"]
        if len(others) == 1:
            return resolve(openapi, others[0])
    return schema


def _kind(openapi: Json, schema: Json) -> str:
    """Type of a value, in words."""
    bare = _bare(openapi, schema)
    kinds = bare.get("type", "")
    nullable = ("anyOf" in schema and bare is not schema) or "null" in kinds
    kind = next((name for name in kinds if name != "null"), "") if isinstance(kinds, list) else kinds
    if "enum" in bare:
        words = " | ".join(str(name) for name in bare["enum"] if name is not None)
    elif "const" in bare:
        words = str(bare["const"])
    elif kind == "array":
        words = _("list of {kind}").format(kind=_kind(openapi, bare["items"]).partition(",")[0])
    elif bare.get("format") == "date-time":
        words = _("time")
    else:
        words = {
            "string": _("text"),
            "integer": _("whole number"),
            "number": _("number"),
            "boolean": _("true or false"),
            "object": _("object"),
        }.get(kind, _("any"))
        words += _range(bare)
    return _("{kind} or null").format(kind=words) if nullable else words


def _range(schema: Json) -> str:
    least, most = schema.get("minimum"), schema.get("maximum")
    if "maxLength" in schema:
        return _(", at most {n} characters").format(n=schema["maxLength"])
    if least is not None and most is not None and most < 2**31 - 1:
        return _(", {least:g} to {most:g}").format(least=least, most=most)
    return _(", at least {least:g}").format(least=least) if least is not None else ""


# --- prose


def prose(text: str) -> Markup:
    """Paragraphs, lists (`- `), `code` and *emphasis* of a docstring as HTML; everything else is escaped."""
    parts: list[str] = []
    for block in text.split("\n\n"):
        lines = [line.strip() for line in block.strip().splitlines()]
        if not lines:
            continue
        if all(line.startswith("- ") for line in lines):
            parts.append("<ul>" + "".join(f"<li>{_inline(line[2:])}</li>" for line in lines) + "</ul>")
        else:
            parts.append(f"<p>{_inline(' '.join(lines))}</p>")
    return Markup("".join(parts))  # noqa: S704 - escaped piece by piece


def _line(text: str) -> Markup:
    return Markup(_inline(text))  # noqa: S704 - escaped piece by piece


def _inline(text: str) -> str:
    pieces = text.split("`")
    for at, piece in enumerate(pieces):
        words = escape(piece, quote=False)
        pieces[at] = f"<code>{words}</code>" if at % 2 else _emphasised(words)
    return "".join(pieces)


def _emphasised(words: str) -> str:
    pieces = words.split("*")
    if len(pieces) % 2 == 0:
        return words
    return "".join(f"<em>{piece}</em>" if at % 2 else piece for at, piece in enumerate(pieces))
