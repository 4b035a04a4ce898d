"""Set-up page: one parameter of many characteristics, with a preview of each change."""

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer
from app.core.parameters import BY_NAME, FieldKind
from app.errors import InbandError, Invalid
from app.language.i18n import _
from app.loop.characteristics import many_actions, queries
from app.loop.characteristics.many_actions import NewValue
from app.loop.characteristics.wording import explanation, label
from app.loop.machines import queries as machines
from app.views.set_up import parameter_form
from app.views.set_up.frame import setup_page
from app.web.deps import SessionDep, texts
from app.web.paging import address

router = APIRouter(include_in_schema=False)
MOST = 2000  # characteristics on the page


@router.get("/setup/parameters")
def choose(
    request: Request,
    session: SessionDep,
    caller: Engineer,
    machine: str = "",
    parameter: str = "zero_range",
    value: Annotated[str | None, Query(max_length=40)] = None,
    unit: str = "",
    on: Annotated[list[str] | None, Query()] = None,
) -> Response:
    """Choose characteristics, a parameter and its new value; with all three said, what each change comes to."""
    said = {"machine": machine, "parameter": parameter, "value": value or "", "unit": unit}
    return _page(request, session, caller, said, set(on or ()), asked=value is not None)


@router.post("/setup/parameters")
async def send(request: Request, session: SessionDep, caller: Engineer) -> Response:
    """Show what the change comes to, or make what the preview showed. Posted: an address has no room for two thousand keys."""
    form = await request.form()
    said = texts(form)
    if "versions" in said:
        return await run_in_threadpool(_change, request, session, caller, said)
    chosen = {key for key in form.getlist("on") if isinstance(key, str)}
    return await run_in_threadpool(_page, request, session, caller, said, chosen, asked=True)


def _change(request: Request, session: Session, caller: Caller, form: Mapping[str, str]) -> Response:
    """Make the changes that the preview showed, all of them or none."""
    try:
        versions = _versions(form.get("versions", ""))
        number = many_actions.change_many(session, versions, _new(form), form.get("reason", "").strip(), caller.name)
    except InbandError as error:
        session.expire_all()
        chosen = {key for key, _colon, _version in (pair.partition(":") for pair in form.get("versions", "").split())}
        return _page(request, session, caller, form, chosen, asked=True, refusal=error)
    shown = address("/setup/parameters", machine=form.get("machine"), parameter=form.get("parameter"), changed=number)
    return RedirectResponse(shown, 303)


def _versions(text: str) -> dict[str, int]:
    """Keys with the versions that the preview showed, `shaft-d40:3 bore-d25:1`."""
    pairs = [pair.rpartition(":") for pair in text.split()]
    if not pairs or any(not version.isdecimal() or len(version) > 9 for _key, _colon, version in pairs):
        raise Invalid(_("No characteristic is chosen."), _("Choose at least one and look at the preview again."))
    return {key: int(version) for key, _colon, version in pairs}


def _new(said: Any) -> NewValue:
    """The new value as typed. Raises `Invalid` for a parameter that cannot be changed here."""
    field = BY_NAME.get(said.get("parameter", ""))
    if field is None or field.name in many_actions.OF_ONE:
        raise Invalid.at("parameter", _("Choose a parameter that several characteristics can have in common."))
    text = said.get("value", "").strip()
    if field.kind is FieldKind.YES_NO:
        return NewValue(field.name, text == "true")
    if field.kind is FieldKind.CHOICE:
        return NewValue(field.name, text or None)
    return NewValue(
        field.name, parameter_form.number(text), said.get("unit") == "share" and field.name in many_actions.LIMITS
    )


def _page(
    request: Request,
    session: Session,
    caller: Caller,
    said: Any,
    chosen: set[str],
    *,
    asked: bool,
    refusal: InbandError | None = None,
) -> Response:
    machine = machines.find_machine(session, said.get("machine", ""))
    field = BY_NAME.get(said.get("parameter", ""))
    if field is None or field.name in many_actions.OF_ONE:
        field = BY_NAME["zero_range"]
    said = {"machine": "", "value": "", "unit": ""} | dict(said) | {"parameter": field.name}
    rows = queries.characteristics(session, machine_id=machine.id if machine else None, limit=MOST)
    new = _new(said)
    plan = (
        many_actions.planned([row for row in rows if row.characteristic.key in chosen], new) if asked and chosen else []
    )
    return setup_page(
        request,
        "many.html",
        caller,
        "characteristics",
        refusal=refusal,
        machines=[("", _("All machines")), *((each.key, each.name) for each in machines.machines(session, limit=MOST))],
        fields=[
            (each.name, f"{each.r} {label(each.name)}" if each.r else label(each.name))
            for each in many_actions.changeable()
        ],
        field=field,
        help=explanation(field.name),
        input=parameter_form.inputs()[field.name],
        is_yes_no=field.kind is FieldKind.YES_NO,
        is_limit=field.name in many_actions.LIMITS,
        said=said,
        before=[(row, many_actions.worded_now(row, field.name)) for row in rows],
        chosen=chosen,
        asked=asked,
        plan=plan,
        versions=" ".join(f"{each.current.characteristic.key}:{each.current.version.version}" for each in plan),
        may_change=bool(plan) and not any(each.errors for each in plan) and not all(each.is_same for each in plan),
        changed=request.query_params.get("changed"),
        most=MOST if len(rows) == MOST else None,
    )
