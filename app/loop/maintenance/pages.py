"""Pages: maintenance that runs, is planned or over; the forms that enter and extend it, and the question that ends it."""

from collections.abc import Mapping
from datetime import UTC, datetime
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer
from app.errors import Conflict, InbandError, Invalid, NotAllowed
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.loop.maintenance import actions, queries, verbs
from app.loop.maintenance.queries import MaintenanceRow
from app.loop.maintenance.schemas import ExtendIn, MaintenanceIn
from app.loop.maintenance.verbs import END, OfMaintenance
from app.web.deps import Before, FormDep, Number, SessionDep, Word
from app.web.forms import typed
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.verb import Outcome, Verb, add_question_page, said

router = APIRouter(include_in_schema=False)
ON_PAGE = 50
ALL = "*"
"""In the form: all machines. No key of a machine is so."""


@router.get("/maintenance")
def maintenance_page(
    request: Request,
    session: SessionDep,
    _caller: Viewer,
    machine: Word = None,
    before: Before = None,
    done: Word = None,
    n: Number = None,
) -> Response:
    """Maintenance of a machine or of all, the last entered first. done: what was done to maintenance n."""
    chosen = machines.machine_named(session, machine) if machine else None
    rows = queries.all_maintenance(session, machine_id=chosen.id if chosen else None, before=before, limit=ON_PAGE + 1)
    return page(
        request,
        "maintenance/list.html",
        part=part_of(
            rows, ON_PAGE, before, lambda row: row.maintenance.id, partial(address, "/maintenance", machine=machine)
        ),
        machine=chosen,
        machines=machines.machines(session),
        now=datetime.now(UTC),
        done=said(
            (END,),
            done,
            n,
            {
                "entered": _("Maintenance {n} is entered."),
                "extended": _("Maintenance {n} is extended."),
                "late": _("Maintenance {n} is over already."),
            },
        )
        if done
        else None,
        address=address,
    )


@router.get("/maintenance/new")
def new_maintenance(request: Request, session: SessionDep, caller: Operator, machine: Word = None) -> Response:
    return _form(request, session, caller, {"machine": machine or "", "stopping_anyway": "true"})


def _form(
    request: Request, session: Session, caller: Caller, form: Mapping[str, str], error: InbandError | None = None
) -> Response:
    known = [(each.key, each.name) for each in machines.machines(session)]
    return page(
        request,
        "maintenance/new.html",
        refusal=error,
        form=form,
        choices=[("", _("choose …")), *known, *([(ALL, _("All machines"))] if caller.may("engineer") else [])],
        usual=actions.USUAL,
        longest=actions.OF_OPERATOR,
    )


def as_typed(form: Mapping[str, str]) -> MaintenanceIn:
    """Maintenance as typed. Raises `Invalid`, also where no machine is chosen: a default must not silence the whole plant."""
    machine = form.get("machine", "").strip()
    if not machine:
        raise Invalid.at("machine", _("choose one, or all machines"))
    named = {**form, "machine": "" if machine == ALL else machine}
    stopping = form.get("stopping_anyway") == "true"  # without the tick: no
    return typed(MaintenanceIn, named, stopping_anyway=stopping)


@router.post("/maintenance/new")
def enter(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Enter it; times are by the plant's clock."""
    try:
        row = actions.enter_maintenance(session, as_typed(form), caller)
    except (Invalid, Conflict, NotAllowed) as error:
        return _form(request, session, caller, form, error)
    machine = row.machine.key if row.machine else None
    return RedirectResponse(address("/maintenance", machine=machine, done="entered", n=row.maintenance.id), 303)


def _of_number(session: SessionDep, caller: Operator, number: int) -> OfMaintenance:
    return OfMaintenance(session, number, caller)


@router.get("/maintenance/{number}/extend")
def extend_form(request: Request, session: SessionDep, _caller: Operator, number: int) -> Response:
    """The form that moves its end; what is over leads back to the list."""
    row = queries.maintenance(session, number)
    if row.state(datetime.now(UTC)) in {"over", "cancelled"}:
        return RedirectResponse(address("/maintenance", done="late", n=number), 303)
    return _extend_form(request, row, {})


def _extend_form(
    request: Request, row: MaintenanceRow, form: Mapping[str, str], error: InbandError | None = None
) -> Response:
    return page(
        request,
        "maintenance/extend.html",
        refusal=error,
        row=row,
        form=form,
    )


@router.post("/maintenance/{number}/extend")
def extend(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """Move its end; times are by the plant's clock."""
    try:
        actions.extend(session, number, typed(ExtendIn, form), caller)
    except (Invalid, Conflict, NotAllowed) as error:
        return _extend_form(request, queries.maintenance(session, number), form, error)
    return RedirectResponse(address("/maintenance", done="extended", n=number), 303)


def _around(on: OfMaintenance, _verb: Verb[OfMaintenance, Any]) -> dict[str, Any]:
    row = on.row
    return {
        "machine": row.machine or {"name": row.name},
        "trail": [(_("Maintenance"), "/maintenance")],
        "back": "/maintenance",
    }


def _ended(_request: Request, on: OfMaintenance, _verb: Verb[OfMaintenance, Any], outcome: Outcome) -> Response:
    """Sent twice, or after another person, it changes nothing and says so."""
    done = "late" if outcome.kind == "late" else verbs.END.name
    return RedirectResponse(address("/maintenance", done=done, n=on.number), 303)


add_question_page(
    router,
    "/maintenance/{number}/end",
    (END,),
    _of_number,
    around=_around,
    after=_ended,
    astray=lambda: _("Go back to the list of maintenance."),
)
