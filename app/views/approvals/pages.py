"""Pages: everything that waits for a person's decision about a correction, and approving all of one tool together."""

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Operator, require
from app.errors import Conflict, Invalid, NotFound
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named
from app.loop.tools import actions, confirmation, queries, wording
from app.loop.tools.schemas import DecisionsIn
from app.quality.what_if import queries as what_if
from app.views.approvals import queries as queue
from app.views.characteristic.glance import band_picture
from app.web.deps import FormDep, Number, SessionDep, Word
from app.web.forms import by_field, parsed, words
from app.web.paging import address
from app.web.templates import page

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
        done=confirmation.done(done, n) if done and n else None,
        late=_too_late(session, at, late, n) if at and late and n else None,
        wording=wording,
        picture=lambda one: band_picture(one.deviation, one.parameters, one.zone),
        address=queue_address,
        offered=confirmation.offered,
        proposals=what_if.count_open(session),
    )


def _too_late(session: Session, machine: str, verb: str, number: int) -> list[str]:
    return list(wording.refused(queries.correction(session, machine_named(session, machine), number), machine, verb))


@router.get("/corrections/{machine}/tools/{tool}", dependencies=[require("operator")])
def ask_all(request: Request, session: SessionDep, machine: str, tool: int) -> Response:
    """Asks before all that awaits approval for one tool is approved."""
    return _ask(request, _group(session, machine, tool))


def _group(session: Session, key: str, tool: int) -> queue.Group:
    machine = machine_named(session, key)
    queries.tool(session, machine, tool)
    group = queue.group_of(session, machine, tool)
    if group is None or not group.approvable:
        raise NotFound(
            _("No correction of tool {tool} awaits approval any more.").format(tool=tool),
            _("Somebody else has decided. Go back to the list of approvals."),
        )
    return group


@router.post("/corrections/{machine}/tools/{tool}")
def approve_all(
    request: Request, session: SessionDep, caller: Operator, machine: str, tool: int, form: FormDep
) -> Response:
    """Approves exactly those that were shown; if one of them was decided about meanwhile, none."""
    of_machine = machine_named(session, machine)
    queries.tool(session, of_machine, tool)
    numbers = [int(number) for number in form.get("numbers", "").split() if number.isdecimal() and len(number) < 11]
    try:
        decision = parsed(DecisionsIn, {"numbers": numbers, "reason": words(form, "reason")})
        actions.approve_all(session, of_machine, decision.numbers, decision.reason, caller)
    except Conflict:
        first = next(
            c
            for c in (queries.correction(session, of_machine, number) for number in numbers)
            if c.status != "awaiting_approval"
        )
        if first.decided_by != caller.name or first.status != "pending":
            return RedirectResponse(queue_address(late="approve", at=machine, n=first.number), 303)
    except Invalid as error:
        return _ask(request, _group(session, machine, tool), form, error)
    return RedirectResponse(queue_address(done="approve-all", n=tool), 303)


def _ask(
    request: Request,
    group: queue.Group,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    return page(
        request,
        "tools/ask.html",
        status=error.status if error else 200,
        machine=group.machine,
        question=confirmation.about_all(group.machine.key, group.tool, group.approvable, group.total, group.after),
        form=form or {},
        errors=by_field(error) if error else {},
        trail=[(_("Approvals"), "/corrections")],
        back="/corrections",
    )
