"""JSON bodies, read strictly: what two readers could take differently is refused, with the field named.

Python's reader takes NaN, doubled keys, half surrogates and numbers beyond any float; PostgreSQL takes no U+0000.
"""

import json
import re
from collections import Counter
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from itertools import islice
from math import isfinite
from typing import Any
from weakref import WeakValueDictionary

from anyio import CapacityLimiter, to_thread
from fastapi import Request, Response
from fastapi.dependencies.models import Dependant
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute

from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.web.query_strings import known_parameters, read_strictly
from app.web.validation import field_path

DEEPEST = 20
"""Nothing here has lists in lists deeper than three."""
ON_THE_LOOP = 16_000
"""Bytes of a body that are read where they come in, which takes some milliseconds; a larger one is read on a thread."""
MOST_ERRORS = 100
MOST_CONTAINERS = 50_000
"""Lists and objects of one body: Python makes each while everybody else waits, and of what else there is many at once."""
_readers: WeakValueDictionary[str, CapacityLimiter] = WeakValueDictionary()
"""Large bodies of one caller are read one after the other: twenty threads leave the event loop a twentieth of its time."""
_TEXT = re.compile(rb'"(?:[^"\\]|\\.)*+\\?(?:"|\Z)', re.DOTALL)
_SURROGATE = re.compile("[\ud800-\udfff]")


def read_json(body: bytes, content_type: str | None) -> Any:
    """The value of a JSON body.

    Raises `Invalid` for anything that is not JSON, is not UTF-8, or has no one meaning.
    """
    media_type = (content_type or "").partition(";")[0].strip().lower()
    if media_type != "application/json" and not (
        media_type.startswith("application/") and media_type.endswith("+json")
    ):
        raise _refused(
            "Content-Type",
            _("must be application/json"),
            _("Send JSON, with the header Content-Type: application/json (curl: -H 'Content-Type: application/json')."),
        )
    if _containers(body) > MOST_CONTAINERS:
        raise _refused(
            "body",
            _("holds more than {most} lists and objects").format(most=MOST_CONTAINERS),
            _("Send it in several requests."),
        )
    try:
        value = json.loads(body.decode("utf-8"), object_pairs_hook=_unique)
    except UnicodeDecodeError as error:
        raise _refused(
            "body", _("is not UTF-8 text: byte {n} cannot be read").format(n=error.start), _("Send JSON in UTF-8.")
        ) from None
    except json.JSONDecodeError as error:
        raise _refused(
            "body",
            _("is not JSON: line {line}, column {column}: {message}").format(
                line=error.lineno, column=error.colno, message=error.msg
            ),
            _("Correct the JSON at that place."),
        ) from None
    except RecursionError:
        raise _refused("body", _("is nested too deeply"), None) from None
    except ValueError as error:  # a whole number of thousands of digits, or a doubled key
        raise _refused(
            "body", str(error) if isinstance(error, _DoubledError) else _("holds too large a number"), None
        ) from None
    problems = list(islice(_unusable(value), MOST_ERRORS))
    if problems:
        raise Invalid(
            _("The request contains values that cannot be used."),
            _("Correct the named fields and send it again."),
            errors=problems,
        )
    return value


def _containers(body: bytes) -> int:
    """The number of lists and objects, or one that is larger if it does not matter: brackets in texts are no lists."""
    count = body.count(b"[") + body.count(b"{")
    if count > MOST_CONTAINERS:
        outside = _TEXT.sub(b"", body)
        count = outside.count(b"[") + outside.count(b"{")
    return count


def _refused(field: str, message: str, what_to_do: str | None) -> Invalid:
    return Invalid(_("The request is not usable JSON."), what_to_do, errors=[FieldError(field, message)])


class _DoubledError(ValueError):
    pass


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) != len(pairs):
        counted = Counter(name for name, _value in pairs)
        doubled = next(name for name, count in counted.items() if count > 1)
        raise _DoubledError(_("gives {name} twice; give it once").format(name=json.dumps(doubled)))
    return values


def _unusable(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[FieldError]:
    """Everything in the value that cannot be stored or compared."""
    if len(path) > DEEPEST:
        yield FieldError("body", _("is nested too deeply"))
    elif isinstance(value, dict):
        for name, item in value.items():
            if wrong := _wrong_text(name):
                yield FieldError(field_path(("body", *path)), wrong)
            elif not _plain(item):
                yield from _unusable(item, (*path, name))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            if not _plain(item):
                yield from _unusable(item, (*path, index))
    elif isinstance(value, float) and not isfinite(value):
        yield FieldError(field_path(("body", *path)), _("must be a finite number"))
    elif isinstance(value, str) and (wrong := _wrong_text(value)):
        yield FieldError(field_path(("body", *path)), wrong)


def _plain(value: Any) -> bool:
    """Tell if it is plain at a glance that `_unusable` has nothing to say, as of nearly all values."""
    return (isinstance(value, str) and value.isprintable()) or isinstance(value, int) or value is None


def _wrong_text(text: str) -> str | None:
    if "\0" in text:
        return _("holds the character U+0000, which cannot be stored; remove it")
    if _SURROGATE.search(text):
        return _("holds half a character (a lone surrogate); send complete Unicode text")
    return None


Check = Callable[[Request], Awaitable[None]]
_checks: dict[Callable[..., Any], Check] = {}


def checked_first(dependency: Callable[..., Any], check: Check) -> None:
    """Before a route that has this dependency says what is wrong with a request, this check may refuse its caller."""
    _checks[dependency] = check


def _checks_of(dependant: Dependant) -> Iterator[Check]:
    for each in dependant.dependencies:
        if each.call in _checks:
            yield _checks[each.call]
        yield from _checks_of(each)


class _Read(Request):
    """A request whose JSON has been read already."""

    value: Any = None

    async def json(self) -> Any:
        return self.value


class JsonRoute(APIRoute):
    """A route that reads strictly: its query by `read_strictly`, its JSON body, if it takes one, by `read_json`.

    Who may not use it hears that, and not what is wrong with the request.
    """

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        handle = super().get_route_handler()
        known = known_parameters(self.dependant)
        checks = list(_checks_of(self.dependant))

        async def handle_strictly(request: Request) -> Response:
            try:
                if request.scope["query_string"] and ("authorization" in request.headers or request.cookies):
                    read_strictly(request, known)  # before anything is done; nobody learns of it without credentials
                read = request if self.body_field is None else await self._with_body(request)
            except (Invalid, RequestValidationError):
                for check in checks:
                    await check(request)
                raise
            return await handle(read)

        return handle_strictly

    async def _with_body(self, request: Request) -> Request:
        read = _Read(request.scope, request.receive)
        body = await read.body()
        if len(body) > ON_THE_LOOP:
            caller = request.headers.get("authorization") or request.headers.get("cookie", "")
            one = _readers.setdefault(caller, CapacityLimiter(1))
            read.value = await to_thread.run_sync(self._read, body, request.headers.get("content-type"), limiter=one)
        elif body:
            read.value = read_json(body, request.headers.get("content-type"))
        return read

    def _read(self, body: bytes, content_type: str | None) -> Any:
        """The value of a large body, as the route's own model already: to make one takes as long as reading."""
        value = read_json(body, content_type)
        if self.body_field is None or len(self.dependant.body_params) != 1 or self._embed_body_fields:
            return value
        model, errors = self.body_field.validate(value, {}, loc=("body",))
        if errors:
            raise RequestValidationError(errors[:MOST_ERRORS])
        return model
