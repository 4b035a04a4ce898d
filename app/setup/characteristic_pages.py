"""Set-up pages: characteristics and their parameters."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote, urlencode

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.characteristics import actions, queries
from app.characteristics.actions import CharacteristicChange, CharacteristicIn
from app.characteristics.wording import history
from app.core.parameters import BY_NAME
from app.core.plausibility import suggested_jump
from app.errors import Conflict, InbandError, Invalid
from app.machines import queries as machines
from app.machines.tables import Machine
from app.programs import queries as programs
from app.readings import queries as readings
from app.setup import parameter_form
from app.setup.frame import setup_page
from app.web.deps import Caller, Engineer, FormDep, SessionDep, Viewer
from app.web.forms import by_field, parsed
from app.whatif import queries as what_if
from app.whatif import wording

router = APIRouter()
ON_PAGE = 200
LOOKED_BACK = 100  # readings from which a plausible jump is suggested


@router.get("/setup/characteristics")
def characteristics_page(
    request: Request, session: SessionDep, caller: Viewer, machine: str = "", after: str = ""
) -> Response:
    chosen = machines.find_machine(session, machine)
    rows = queries.characteristics(session, machine_id=chosen.id if chosen else None, after=after, limit=ON_PAGE + 1)
    more = rows[ON_PAGE - 1].characteristic.key if len(rows) > ON_PAGE else None
    return setup_page(
        request,
        "characteristics.html",
        caller,
        "characteristics",
        rows=rows[:ON_PAGE],
        older=_page_of(chosen, more) if more else None,
        newest=_page_of(chosen, None) if after else None,
        machines=machines.machines(session, limit=100_000),
        machine=chosen,
        mode_words=lambda mode: parameter_form.choice("mode", mode.value),
    )


def _page_of(machine: Machine | None, after: str | None) -> str:
    query = urlencode(
        {name: value for name, value in (("machine", machine and machine.key), ("after", after)) if value}
    )
    return "/setup/characteristics" + (f"?{query}" if query else "")


@router.get("/setup/characteristics/new")
def new_characteristic_page(
    request: Request, session: SessionDep, caller: Engineer, machine: str = "", like: str = ""
) -> Response:
    typed = parameter_form.typed_defaults() | {"machine": machine}
    if like:
        standing = queries.characteristic_named(session, like)
        typed = parameter_form.typed_from(standing.version.parameters) | {
            "machine": standing.machine.key,
            "part": standing.characteristic.part or "",
        }
    return _new(request, session, caller, typed, {})


@router.post("/setup/characteristics/new")
def send_new_characteristic(request: Request, session: SessionDep, caller: Engineer, form: FormDep) -> Response:
    named = {name: form.get(name, "") for name in ("key", "name", "machine", "part")}
    try:
        given = parsed(CharacteristicIn, named | {"parameters": parameter_form.parameters_from(form)})
        made = actions.add_characteristic(session, given, caller.name)
    except InbandError as error:
        if not error.errors:
            raise
        return _new(request, session, caller, form, _all_errors(error, form), error.status)
    return RedirectResponse(f"/setup/characteristics/{made.characteristic.key}?done=added", 303)


def _all_errors(error: InbandError, form: Mapping[str, str]) -> dict[str, str]:
    """What is wrong with the names and with the parameters at once, each once."""
    errors = [*error.errors, *actions.refusals(parameter_form.parameters_from(form))]
    return by_field(Invalid(error.detail, errors=dict.fromkeys(errors)))


def _new(
    request: Request,
    session: Session,
    caller: Caller,
    typed: Mapping[str, str],
    errors: Mapping[str, str],
    status: int = 200,
) -> Response:
    return setup_page(
        request,
        "characteristic_new.html",
        caller,
        "characteristics",
        status=status,
        machines=[(machine.key, machine.name) for machine in machines.machines(session, limit=100_000)],
        **_form(typed, errors),
    )


def prefilled_new(request: Request, session: Session, caller: Caller, typed: Mapping[str, str]) -> Response:
    """The form of a new characteristic with what is known of it already, as if it had been typed."""
    return _new(request, session, caller, typed, {})


@router.get("/setup/characteristics/{characteristic}")
def characteristic_page(request: Request, session: SessionDep, caller: Viewer, characteristic: str) -> Response:
    """Parameters named in the address (`?zero_range=0.0012&reason=…`) are typed into the form; nothing is changed by it."""
    standing = queries.characteristic_named(session, characteristic)
    suggested = {name: text[:1000] for name, text in request.query_params.items() if name in {*BY_NAME, "reason"}}
    if not suggested:
        return _characteristic(request, session, caller, standing)
    typed = parameter_form.typed_from(standing.version.parameters) | suggested
    return prefilled_change(request, session, caller, standing, typed)


@router.post("/setup/characteristics/{characteristic}")
def send_characteristic(
    request: Request, session: SessionDep, caller: Engineer, characteristic: str, form: FormDep
) -> Response:
    version = form.get("parameters_version", "")
    looked_at = int(version) if version.isascii() and version.isdigit() and len(version) < 10 else None
    standing = queries.characteristic_named(session, characteristic)
    before = (standing.version.version, standing.characteristic.name, standing.characteristic.part)
    try:
        change = parsed(
            CharacteristicChange,
            {
                "name": form.get("name", "").strip() or " ",  # refused in words; left out it would just stay
                "parameters": parameter_form.parameters_from(form),
                "parameters_version": looked_at,
                "reason": form.get("reason", "").strip(),
            },
        )
        part = parsed(CharacteristicChange, {"part": form.get("part", "").strip()}).part
        change = change.model_copy(update={"part": part})
        standing = actions.change_characteristic(session, characteristic, change, caller.name)
    except InbandError as error:
        if not error.errors and error.status != Conflict.status:
            raise
        session.expire_all()
        return _characteristic(
            request,
            session,
            caller,
            queries.characteristic_named(session, characteristic),
            status=error.status,
            typed=form,
            errors=by_field(error),
            problem=error if error.status == Conflict.status else None,
        )
    after = (standing.version.version, standing.characteristic.name, standing.characteristic.part)
    done = "same" if before == after else "changed"
    return RedirectResponse(f"/setup/characteristics/{quote(characteristic)}?done={done}", 303)


def prefilled_change(
    request: Request, session: Session, caller: Caller, standing: queries.Standing, typed: Mapping[str, str]
) -> Response:
    """The form of a characteristic with other parameters typed into it; nothing is changed until it is sent."""
    names = {"name": standing.characteristic.name, "part": standing.characteristic.part or ""}
    return _characteristic(request, session, caller, standing, typed=names | dict(typed))


def _characteristic(
    request: Request,
    session: Session,
    caller: Caller,
    standing: queries.Standing,
    *,
    status: int = 200,
    typed: Mapping[str, str] | None = None,
    errors: Mapping[str, str] | None = None,
    problem: InbandError | None = None,
) -> Response:
    characteristic = standing.characteristic
    if typed is None:
        typed = parameter_form.typed_from(standing.version.parameters) | {
            "name": characteristic.name,
            "part": characteristic.part or "",
        }
    return setup_page(
        request,
        "characteristic.html",
        caller,
        "characteristics",
        status=status,
        characteristic=characteristic,
        machine=standing.machine,
        version=standing.version,
        problem=problem,
        warnings=actions.warnings_of(standing.parameters, standing.machine.zero_range_floor),
        history=history(queries.versions(session, characteristic)),
        program=programs.shown(standing),
        proposals=[
            (row, wording.proposed(row))
            for row in what_if.proposals(session, characteristic=characteristic, status="open")
        ],
        suggested_jump=_suggested_jump(session, standing),
        **_form(typed, errors or {}),
    )


def _suggested_jump(session: Session, standing: queries.Standing) -> float | None:
    """What the last readings suggest for the largest plausible jump, mm."""
    factor = standing.parameters.factor
    characteristic = standing.characteristic
    return suggested_jump(
        readings.course_of(session, characteristic.machine_id, characteristic.id, factor, LOOKED_BACK)
    )


def _form(typed: Mapping[str, str], errors: Mapping[str, str]) -> dict[str, Any]:
    shown = parameter_form.typed_defaults() | {"key": "", "name": "", "machine": "", "part": "", "reason": ""}
    return {
        "typed": shown | dict(typed),
        "errors": errors,
        "inputs": parameter_form.inputs(),
        "factors": parameter_form.factor_choices(),
        "diagram": parameter_form.diagram(typed),
        "sentences": parameter_form.sentences(),
        "short": parameter_form.short,
        "micrometres": lambda name: parameter_form.micrometres(name, typed.get(name, "")),
    }
