"""ETag and If-Match: an edit that names the state it was made from is refused where someone else has changed that since.

    @router.get("/machines/{machine}", responses=problems(404) | TAGGED)
    @tagged
    def get_machine(session: SessionDep, caller: AnyCaller, machine: MachineKey) -> MachineOut: ...

    @router.patch("/machines/{machine}", responses=problems(404, 412))
    @guarded(get_machine, hold_machine)
    def change_machine(session: SessionDep, caller: Engineer, machine: MachineKey, change: MachineChange) -> MachineOut: ...

Without If-Match nothing is compared.
"""

from collections.abc import Callable, Mapping
from functools import wraps
from hashlib import sha256
from inspect import Parameter, signature, unwrap
from typing import Annotated, Any, TypeVar

from fastapi import Header, Response
from pydantic import BaseModel
from sqlalchemy.orm import Session

from app.errors import ChangedMeanwhile
from app.language.i18n import _

Answer = TypeVar("Answer", bound=BaseModel)
Lock = Callable[[Session, Mapping[str, Any]], object]
"""Holds what is edited until the transaction ends, found by the parameters of the route."""
TAGGED: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "As it is now",
        "headers": {
            "ETag": {
                "schema": {"type": "string"},
                "description": "Names this state: sent as `If-Match` with a change, it is 412 once somebody has changed it.",
            }
        },
    }
}
_IfMatch = Annotated[
    str | None,
    Header(description="The `ETag` of what you looked at: 412 if it has changed since.", max_length=1000),
]


def held(find: Callable[..., object], name: str) -> Lock:
    """Holds what the parameter of this name names: `find` finds it, and with ``hold=True`` holds it."""
    return lambda session, given: find(session, given[name], hold=True)


def tag_of(answer: BaseModel) -> str:
    """The entity tag of a resource as it is answered. Warnings are about a request and do not count."""
    return f'"{sha256(answer.model_dump_json(exclude={"warnings"}).encode()).hexdigest()[:32]}"'


def tagged(get: Callable[..., Answer]) -> Callable[..., Answer]:
    """Let a route answer with the ETag of what it returns."""

    @wraps(get)
    def with_tag(*, tagged_response: Response, **given: Any) -> Answer:
        answer = get(**given)
        tagged_response.headers["ETag"] = tag_of(answer)
        return answer

    return _with(with_tag, get, tagged_response=Response)


def guarded(get: Callable[..., BaseModel], lock: Lock) -> Callable[[Callable[..., Answer]], Callable[..., Answer]]:
    """Let a route that edits what `get` returns take If-Match. get: of the same parameters, as far as it has them."""
    look = unwrap(get)
    names = signature(look).parameters

    def guard(edit: Callable[..., Answer]) -> Callable[..., Answer]:
        @wraps(edit)
        def if_it_is_the_same(*, if_match: str | None, **given: Any) -> Answer:
            if if_match is not None:
                seen = {name: value for name, value in given.items() if name in names}
                look(**seen)  # before anything is locked: it is there, and the caller may look at it
                lock(given["session"], given)
                given["session"].expire_all()
                _refuse_changed(if_match, tag_of(look(**seen)))
            return edit(**given)

        return _with(if_it_is_the_same, edit, if_match=_IfMatch)

    return guard


def _refuse_changed(if_match: str, now: str) -> None:
    # A proxy that compresses makes weak tags of ours; they name the same state.
    tags = [tag.strip().removeprefix("W/") for tag in if_match.split(",")]
    if "*" not in tags and now not in tags:
        raise ChangedMeanwhile(
            _("It has changed since you looked: If-Match names another state than the current one, {tag}.").format(
                tag=now
            ),
            _("Get it again, look at what has changed, and repeat your change with the new ETag. Nothing was changed."),
        )


def _with(wrapper: Callable[..., Answer], route: Callable[..., Answer], **more: Any) -> Callable[..., Answer]:
    """The wrapper with the parameters of the route, and more of them, as the framework reads them."""
    known = signature(route)
    default = {Response: Parameter.empty}
    added = [
        Parameter(name, Parameter.KEYWORD_ONLY, annotation=kind, default=default.get(kind))
        for name, kind in more.items()
    ]
    parameters = [each.replace(kind=Parameter.KEYWORD_ONLY) for each in known.parameters.values()]  # as it is called
    wrapper.__signature__ = known.replace(parameters=[*parameters, *added])  # type: ignore[attr-defined]
    return wrapper
