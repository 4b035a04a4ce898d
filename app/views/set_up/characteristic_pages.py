"""Set-up pages: characteristics and their parameters."""

from collections.abc import Mapping
from functools import cache, partial
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Viewer, require
from app.core.fits import fit_of
from app.core.named_size import size_in_name
from app.core.natural_limit import looks_natural
from app.core.parameters import AVERAGE_LOCATIONS, BY_NAME, Mode, Parameters
from app.core.plausibility import suggested_jump
from app.core.suggested import SuggestedLimits
from app.core.variants import forms_of
from app.errors import Conflict, InbandError, Invalid
from app.language.i18n import _
from app.loop.characteristics import actions, queries
from app.loop.characteristics.actions import CharacteristicChange, CharacteristicIn
from app.loop.characteristics.correction_queries import superseded_with
from app.loop.characteristics.wording import history, result_label
from app.loop.machines import queries as machines
from app.loop.programs import queries as programs
from app.loop.readings import queries as readings
from app.quality.gauge_studies import queries as gauge_studies
from app.quality.gauge_studies import wording as gauge_wording
from app.quality.what_if import queries as what_if
from app.quality.what_if import wording
from app.views.set_up import parameter_form
from app.views.set_up.frame import setup_page
from app.web.deps import FormDep, SessionDep, Sought
from app.web.fields import slug_of
from app.web.forms import by_field, parsed
from app.web.paging import Order, address, part_of

router = APIRouter(include_in_schema=False)
ON_PAGE = 200
SAME = 5e-7  # mm; a smaller difference of R33 is none
LOOKED_BACK = 100  # readings from which a plausible jump is suggested


@router.get("/setup/characteristics")
def characteristics_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: str = "",
    skip: Annotated[int, Query(ge=0, le=1_000_000)] = 0,
    sort: Annotated[str, Query(max_length=20)] = "key",
    q: Sought = "",
) -> Response:
    chosen, by = machines.find_machine(session, machine), sort if sort.removeprefix("-") in queries.ORDERS else "key"
    only = chosen.id if chosen else None
    rows = queries.characteristics(session, machine_id=only, named=q, by=by, skip=skip, limit=ON_PAGE + 1)
    link = partial(address, "/setup/characteristics", machine=chosen.key if chosen else None, q=q or None)
    return setup_page(
        request,
        "characteristics.html",
        caller,
        "characteristics",
        part=part_of(rows, ON_PAGE, skip, lambda _last: skip + ON_PAGE, partial(link, sort=by), "skip"),
        order=Order(by, link),
        machines=machines.machines(session),
        machine=chosen,
        q=q,
        mode_words=cache(lambda mode: parameter_form.choice("mode", mode.value)),
    )


@router.get("/setup/characteristics/new")
def new_characteristic_page(
    request: Request, session: SessionDep, caller: Engineer, machine: str = "", like: str = ""
) -> Response:
    typed = parameter_form.typed_defaults() | {"machine": machine, "tool_memory": "", "average_memory": ""}
    if like:
        current = queries.characteristic_named(session, like)
        typed = parameter_form.typed_from(current.version.parameters) | {
            "machine": current.machine.key,
            "part": current.characteristic.part or "",
        }
    return _new(request, session, caller, typed, {})


@router.post("/setup/characteristics/new")
def send_new_characteristic(request: Request, session: SessionDep, caller: Engineer, form: FormDep) -> Response:
    named = {name: form.get(name, "").strip() for name in ("key", "name", "machine", "part")}
    named["key"] = named["key"] or slug_of(named["name"])
    filled = _with_suggestions(session, form)
    try:
        if not form.get("tool_memory", "").strip():
            raise Invalid.at("tool_memory", _("enter the tool whose offset is corrected, or 0 to measure only"))
        new = parsed(CharacteristicIn, named | {"parameters": parameter_form.parameters_from(filled)})
        stored = actions.add_characteristic(session, new, caller.name)
    except InbandError as error:
        if not error.errors:
            raise
        return _new(request, session, caller, form, _all_errors(error, named, filled), error.status)
    return RedirectResponse(f"/setup/characteristics/{stored.characteristic.key}?done=added", 303)


def _with_suggestions(session: Session, form: Mapping[str, str]) -> dict[str, str]:
    machine = machines.find_machine(session, form.get("machine", ""))
    if machine is None:
        return parameter_form.with_suggestions(form, 0.0, (), AVERAGE_LOCATIONS)
    there = queries.characteristics(session, machine_id=machine.id)
    used = {each.parameters.average_memory for each in there}
    return parameter_form.with_suggestions(form, machine.zero_range_floor, used, machine.average_locations)


def _all_errors(error: InbandError, named: Mapping[str, str], form: Mapping[str, str]) -> dict[str, str]:
    """Errors of the names and of the parameters together, each once.

    Limits that are to be suggested once the tolerance is known are no errors; without a tool the rest is looked at as with one.
    """
    unsaid = {name for name in SuggestedLimits._fields if not form.get(name, "").strip()}
    assumed = dict(form) if form.get("tool_memory", "").strip() else dict(form) | {"tool_memory": "1"}
    errors = [*error.errors, *actions.refusals(parameter_form.parameters_from(assumed))]
    errors = [each for each in errors if each.field.removeprefix("parameters.") not in unsaid]
    try:
        parsed(CharacteristicIn, dict(named) | {"parameters": {}})
    except Invalid as of_names:
        made = () if named["key"] else ("key",)  # from the name
        errors += [each for each in of_names.errors if each.field not in made]
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
        machines=[(machine.key, machine.name) for machine in machines.machines(session)],
        **_form(typed, errors),
    )


def prefilled_new(request: Request, session: Session, caller: Caller, typed: Mapping[str, str]) -> Response:
    """The form of a new characteristic with what is known of it already, as if it had been typed."""
    return _new(request, session, caller, typed, {})


@router.get("/setup/characteristics/{characteristic}")
def characteristic_page(request: Request, session: SessionDep, caller: Viewer, characteristic: str) -> Response:
    """Parameters named in the address (`?zero_range=0.0012&reason=…`) are typed into the form; nothing is changed by it."""
    current = queries.characteristic_named(session, characteristic)
    suggested = {name: text[:1000] for name, text in request.query_params.items() if name in {*BY_NAME, "reason"}}
    if not suggested:
        return _characteristic(request, session, caller, current)
    typed = parameter_form.typed_from(current.version.parameters) | suggested
    return prefilled_change(request, session, caller, current, typed)


@router.post("/setup/characteristics/{characteristic}")
def send_characteristic(
    request: Request, session: SessionDep, caller: Engineer, characteristic: str, form: FormDep
) -> Response:
    version = form.get("parameters_version", "")
    looked_at = int(version) if version.isascii() and version.isdigit() and len(version) < 10 else None
    current = queries.characteristic_named(session, characteristic)
    before = (current.version.version, current.characteristic.name, current.characteristic.part)
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
        current = actions.change_characteristic(session, characteristic, change, caller.name)
    except InbandError as error:
        if not error.errors and error.status != Conflict.status:
            raise
        session.expire_all()
        return _characteristic(
            request,
            session,
            caller,
            queries.characteristic_named(session, characteristic),
            refusal=error,
            typed=form,
        )
    after = (current.version.version, current.characteristic.name, current.characteristic.part)
    done = "same" if before == after else "changed"
    return RedirectResponse(f"/setup/characteristics/{quote(characteristic)}?done={done}", 303)


@router.post("/setup/characteristics/{characteristic}/forms")
def send_form(request: Request, session: SessionDep, caller: Engineer, characteristic: str, form: FormDep) -> Response:
    """Set up a result of its readings – roundness, run-out, taper, straightness – as a characteristic of its own."""
    current = queries.characteristic_named(session, characteristic)
    names = {name: form.get(name, "").strip() for name in ("key", "name")}
    try:
        new = parsed(
            CharacteristicIn,
            names
            | {
                "machine": current.machine.key,
                "part": current.characteristic.part,
                "form_of": {"characteristic": characteristic, "result": form.get("result", "")},
                "parameters": {"upper_deviation": parameter_form.number(form.get("limit", ""))},
            },
        )
        stored = actions.add_characteristic(session, new, caller.name)
    except InbandError as error:
        if not error.errors:
            raise
        session.expire_all()
        errors = by_field(error)
        wrong = {"result": errors.get("form_of.result"), "limit": errors.get("upper_deviation")} | errors
        return _characteristic(request, session, caller, current, refusal=error, form_typed=form, form_errors=wrong)
    return RedirectResponse(f"/setup/characteristics/{stored.characteristic.key}?done=added", 303)


def prefilled_change(
    request: Request, session: Session, caller: Caller, current: queries.CurrentCharacteristic, typed: Mapping[str, str]
) -> Response:
    """The form of a characteristic with other parameters typed into it; nothing is changed until it is sent."""
    names = {"name": current.characteristic.name, "part": current.characteristic.part or ""}
    return _characteristic(request, session, caller, current, typed=names | dict(typed))


def _advised(session: Session, current: queries.CurrentCharacteristic) -> dict[str, Any] | None:
    """R33 as the newest gauge study suggests it, mm, with the study and the reason to give; None where it is so already."""
    found = gauge_studies.latest_advice(session, current)
    if found is None or found[1].suggestion.fits is False:
        return None
    (row, advice), suggested = found, found[1].suggestion.zero_range
    if abs(suggested - current.parameters.zero_range) < SAME:
        return None
    return {"study": row.study.id, "zero_range": suggested, "reason": gauge_wording.reason(row.study.id, advice)}


def _why_it_measures_only(parameters: Parameters) -> str | None:
    """Words for what keeps it from correcting: mode, missing tool, or both. None where it corrects."""
    by_mode, no_tool = parameters.mode is Mode.MEASURE_ONLY, parameters.tool_memory == 0
    if by_mode and no_tool:
        return _("It measures only: the mode is “Measure only”, and no tool is named (R10 = 0). Nothing is corrected.")
    if by_mode:
        return _("It measures only: the mode is “Measure only”. Nothing is corrected until another mode is chosen.")
    return _("It measures only: no tool is named (R10 = 0). Nothing is corrected until one is.") if no_tool else None


def _characteristic(
    request: Request,
    session: Session,
    caller: Caller,
    current: queries.CurrentCharacteristic,
    *,
    typed: Mapping[str, str] | None = None,
    refusal: InbandError | None = None,
    form_typed: Mapping[str, str] | None = None,
    form_errors: Mapping[str, str | None] | None = None,
) -> Response:
    characteristic = current.characteristic
    forms = queries.forms(session, characteristic)
    in_force = parameter_form.typed_from(current.version.parameters) | {
        "name": characteristic.name,
        "part": characteristic.part or "",
    }
    typed = in_force if typed is None else typed
    return setup_page(
        request,
        "characteristic.html",
        caller,
        "characteristics",
        refusal=refusal,
        characteristic=characteristic,
        machine=current.machine,
        read=readings.count_of(session, characteristic),
        version=current.version,
        changed={name for name, text in in_force.items() if typed.get(name, "") != text},
        measures_only=None if current.source else _why_it_measures_only(current.parameters),
        warnings=actions.warnings_of(
            current,
            queries.target_before(session, current),
            superseded=superseded_with(session, current) if request.query_params.get("done") == "changed" else (),
        ),
        history=history(queries.versions(session, characteristic)),
        program=programs.program_view(current),
        proposals=[
            (row, wording.proposed(row))
            for row in what_if.proposals(session, characteristic=characteristic, status="open")
        ],
        suggested_jump=_suggested_jump(session, current),
        advised=_advised(session, current),
        source=None if current.source is None else queries.characteristic_named(session, current.source),
        forms=forms,
        form_choices=[
            (form.value, result_label(form))
            for form in forms_of(current.parameters)
            if form not in {each.characteristic.form for each in forms}
        ],
        forms_of=forms_of,
        result_label=result_label,
        form_typed={"key": "", "name": "", "result": "", "limit": ""} | dict(form_typed or {}),
        form_errors=form_errors or {},
        **_form(typed, by_field(refusal) if refusal and not form_errors else {}),
    )


@router.get("/setup/fit", response_model=None, dependencies=[require("viewer")])
def fit(size: Annotated[str, Query(max_length=40)]) -> dict[str, str]:
    """Nominal and deviations of a size with a tolerance class (`40 h6`), as they are typed; empty for any other text."""
    found = fit_of(size)
    return {} if found is None else _as_typed(found._asdict())


def _as_typed(lengths: Mapping[str, float]) -> dict[str, str]:
    return {name: f"{value:.10g}" for name, value in lengths.items()}


@router.get("/setup/named", response_model=None, dependencies=[require("viewer")])
def named(name: Annotated[str, Query(max_length=200)]) -> dict[str, str]:
    """Proposal of the sizes that follow from a name: 0 as the natural limit of roundness, run-out, straightness; else its size."""
    if looks_natural(name):
        return {"natural_limit": "lower", "nominal": "0", "lower_deviation": "0"}
    return _as_typed(size_in_name(name))


def _suggested_jump(session: Session, current: queries.CurrentCharacteristic) -> float | None:
    """Largest plausible jump that the last readings suggest, mm."""
    factor = current.parameters.factor
    characteristic = current.characteristic
    return suggested_jump(
        readings.course_of(session, characteristic.machine_id, characteristic.id, factor, LOOKED_BACK)
    )


def _form(typed: Mapping[str, str], errors: Mapping[str, str]) -> dict[str, Any]:
    fields = parameter_form.typed_defaults() | {"key": "", "name": "", "machine": "", "part": "", "reason": ""}
    return {
        "typed": fields | dict(typed),
        "errors": errors,
        "inputs": parameter_form.inputs(),
        "factors": parameter_form.factor_choices(),
        "diagram": parameter_form.diagram(typed),
        "sentences": parameter_form.sentences(),
        "one_sided": parameter_form.sentences(natural=True),
        "short": parameter_form.short_limit,
        "micrometres": lambda name: parameter_form.micrometres(name, typed.get(name, "")),
    }
