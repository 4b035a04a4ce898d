"""Pages: a run typed in, pasted, or sent as the control's protocol. It can be looked at before it is kept."""

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, require
from app.errors import Invalid, NotFound
from app.geometry.rotary_axes import actions, form_reader, queries
from app.geometry.rotary_axes.control_results import protocol_apart
from app.geometry.rotary_axes.evaluation import evaluate
from app.geometry.rotary_axes.outcome import Evaluated
from app.geometry.rotary_axes.schemas import MOST_PROTOCOL, RunIn
from app.geometry.rotary_axes.view import COMMON
from app.language.i18n import _
from app.loop.machines.queries import machine_named, machines
from app.loop.readings import results_actions as readings
from app.web.deps import SessionDep, get_settings, texts
from app.web.forms import parsed
from app.web.templates import page

router = APIRouter(include_in_schema=False)
Word = Annotated[str, Query(max_length=64)]
EXAMPLE = {
    "as": "pasted",
    "pasted": 'Q143 = 0.0134\nQ146 = 0.0021\nQ147 = 0.0012\nQ148 = -0.0004\nQ149 = 0.0003\n'
    'QS146 = "0.01234567 -0.0123456 0.00123456 -0.0012345"',
}  # fmt: skip


@router.get("/kinematics/new", dependencies=[require("operator")])
def new_page(
    request: Request, session: SessionDep, machine: Word = "", head: Word = "", way: Word = "", example: Word = ""
) -> Response:
    """The form for a run; with the string that the manual prints, if that is wished for."""
    begun = {"machine": machine, "head": head, "as": way} | (EXAMPLE if example else {})
    return _form(request, session, begun)


def _form(
    request: Request,
    session: Session,
    form: Mapping[str, str],
    error: Invalid | NotFound | None = None,
    evaluated: Evaluated | None = None,
) -> Response:
    errors = form_reader.at_fields(error, form) if isinstance(error, Invalid) else {}
    if isinstance(error, NotFound):
        errors["machine"] = error.detail
    return page(
        request,
        "rotary_axes/new.html",
        refusal=error,
        form=form,
        way=form_reader.way(form),
        lines=form_reader.shown_lines(form),
        columns=form_reader.COLUMNS,
        errors=errors,
        evaluated=evaluated,
        **COMMON,
        machines=machines(session),
    )


@router.post("/kinematics/new")
async def send(request: Request, session: SessionDep, caller: Operator) -> Response:
    """`do`: look at it, draw the grid again, or keep it. Whatever comes of it, all that was typed is still there."""
    sent = await request.form()
    form = texts(sent)
    file = sent.get("file")
    if isinstance(file, UploadFile) and file.filename:
        form |= {"protocol": form_reader.decoded(await file.read(4 * MOST_PROTOCOL)), "file_name": file.filename[:200]}
        form["as"] = "protocol"
    return await run_in_threadpool(_send, request, session, caller, form)


def _send(request: Request, session: Session, caller: Caller, form: dict[str, str]) -> Response:
    if form.get("do") == "grid":
        return _form(request, session, form)
    try:
        body = _given(form)
        machine_named(session, body.machine)
        session.commit()  # nothing is kept open while a protocol is read
        protocol = protocol_apart(body.protocol, get_settings(request).rotary_words)
        machine = machine_named(session, body.machine)
        if form.get("do") == "look":
            limits = actions.limits_of(queries.plan(session, machine.id))
            return _form(request, session, form, evaluated=evaluate(body, limits, protocol))
        with readings.pushing(session) as own:
            created = actions.take(own, machine, body, caller, protocol)
            number = created.row.run.id
    except (Invalid, NotFound) as error:
        return _form(request, session, form, error)
    return RedirectResponse(f"/kinematics/runs/{number}?done={'again' if created.again else 'taken'}", 303)


def _given(form: Mapping[str, str]) -> RunIn:
    fields: dict[str, Any] = form_reader.run(form)
    if not fields["machine"]:
        raise Invalid.at("machine", _("choose the machine"))
    return parsed(RunIn, fields)
