"""Pages: everything that waits for a person's decision about a correction, and approving all of one tool together."""

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import Operator, require
from app.errors import Invalid
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named
from app.loop.tools import queries, verbs, wording
from app.quality.what_if import queries as what_if
from app.views.approvals import queries as queue
from app.views.approvals.verbs import APPROVE_ALL, OfTool, shown_in
from app.views.characteristic.glance import band_picture
from app.web.deps import FormDep, Number, SessionDep, Word
from app.web.paging import address
from app.web.templates import page
from app.web.verb import ask, carry_out, said

router = APIRouter(include_in_schema=False)


def queue_address(machine: str | None = None, **query: Any) -> str:
    """The queue, of one machine or of all."""
    return address("/corrections", machine=machine, **query)


@router.get("/corrections", dependencies=[require("viewer")])
def queue_page(
    request: Request,
    session: SessionDep,
    machine: Word = None,
    at: Word = None,
    done: Word = None,
    late: Word = None,
    n: Number = None,
) -> Response:
    """Corrections that wait, by machine and tool; ``at``: the tool where something was done (``done``) or not (``late``)."""
    chosen = machine_named(session, machine) if machine else None
    by_machine, every = queue.count_by_machine(session), machines.machines(session)
    return page(
        request,
        "tools/queue.html",
        groups=queue.groups(session, chosen),
        machine=chosen,
        machines=[(one, by_machine.get(one.id, 0)) for one in every],
        by_machine={one.key: by_machine[one.id] for one in every if one.id in by_machine},
        done=said((APPROVE_ALL,), done, n) or verbs.done(done, n) if done and n else None,
        late=verbs.too_late(session, machine_named(session, at), late, n) if at and late and n else None,
        wording=wording,
        picture=lambda one: band_picture(one.deviation, one.parameters, one.zone),
        address=queue_address,
        offered=verbs.offered,
        proposals=what_if.count_open(session),
    )


@router.get("/corrections/{machine}/tools/{tool}")
def ask_all(request: Request, session: SessionDep, caller: Operator, machine: str, tool: int) -> Response:
    """Asks before all that awaits approval for one tool is approved."""
    return _ask(request, OfTool(session, machine_named(session, machine), tool, caller))


@router.post("/corrections/{machine}/tools/{tool}")
def approve_all(
    request: Request, session: SessionDep, caller: Operator, machine: str, tool: int, form: FormDep
) -> Response:
    """Approves exactly those that were shown; if one of them was decided about meanwhile, none."""
    on = OfTool(session, machine_named(session, machine), tool, caller, shown_in(form))
    queries.tool(session, on.machine, tool)
    try:
        outcome = carry_out(APPROVE_ALL, on, form)
    except Invalid as error:
        return _ask(request, on, form, error)
    if outcome.kind == "late":
        return RedirectResponse(queue_address(late="approve", at=machine, n=on.decided.number), 303)
    return RedirectResponse(queue_address(done=outcome.said.code, n=tool), 303)


def _ask(request: Request, on: OfTool, form: Mapping[str, str] | None = None, error: Invalid | None = None) -> Response:
    question = APPROVE_ALL.question(on, f"/corrections/{on.machine.key}/tools/{on.number}")
    more = {"machine": on.machine, "trail": [(_("Approvals"), "/corrections")], "back": "/corrections"}
    return ask(request, "tools/ask.html", question, form, error, **more)
