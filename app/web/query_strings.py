"""Query strings of programs, read strictly: an unknown parameter, or one of a single value sent twice, is refused as
fields of bodies are. A filter that is ignored answers with everything, and a machine would take that for what it asked for.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import get_args, get_origin
from urllib.parse import urlencode

from fastapi import Request, params
from fastapi.dependencies.models import Dependant
from fastapi.dependencies.utils import get_flat_params
from starlette.datastructures import QueryParams

from app.errors import FieldError, Invalid
from app.language.i18n import _

SAME = {"state": "status", "status": "state"}
"""The filter of states has one of these names in each list and is taken under the other as well."""

MOST = 1000
"""Parameters of one query; nobody needs as many."""


def known_parameters(dependant: Dependant) -> dict[str, bool]:
    """The query parameters of a route, and whether each may be given several times."""
    return {
        field.alias: _is_list(field.field_info.annotation)
        for field in get_flat_params(dependant)
        if isinstance(field.field_info, params.Query)
    }


def read_strictly(request: Request, known: Mapping[str, bool]) -> None:
    """Give every parameter the name that the route knows it by. Raises `Invalid` for all that cannot be meant."""
    if request.scope["query_string"].count(b"&") >= MOST:
        raise Invalid(_("The query of the address holds more than {most} parameters.").format(most=MOST))
    given = QueryParams(request.scope["query_string"]).multi_items()
    named = [name if name in known else SAME.get(name, name) for name, _value in given]
    times = Counter(named)
    errors: dict[str, str] = {}
    for (written, _value), name in zip(given, named, strict=True):
        if name not in known:
            errors[written] = _unknown(known)
        elif not known[name] and times[name] > 1:
            errors[written] = _("is given twice; send it once")
    if errors:
        found = [FieldError(name[:64], message) for name, message in errors.items()]
        raise Invalid(
            "; ".join(f"{field}: {message}" for field, message in found[:3]),
            _("Correct the query of the address. Nothing was read or changed."),
            errors=found[:20],
        )
    request.scope["query_string"] = urlencode(
        [(name, value) for name, (_w, value) in zip(named, given, strict=True)]
    ).encode()


def _unknown(known: Mapping[str, bool]) -> str:
    if not known:
        return _("is not a parameter of this address, which takes none")
    return _("is not a parameter of this address; there are: {names}").format(names=", ".join(sorted(known)))


def _is_list(annotation: object) -> bool:
    kind = get_origin(annotation) or annotation
    several = isinstance(kind, type) and issubclass(kind, Sequence | AbstractSet) and not issubclass(kind, str | bytes)
    return several or any(map(_is_list, get_args(annotation)))
