"""Pages: everything that waits for a person's decision about a correction, and approving all of one tool together."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import Operator, require
from app.errors import Invalid, NotFound
from app.language.i18n import _, ngettext
from app.language.numbers import mm, um
from app.loop.machines import queries as machines
from app.loop.machines.queries import machine_named
from app.loop.tables.tools import Correction
from app.loop.tools import actions, queries, verbs, wording
from app.loop.tools.schemas import DecisionsIn
from app.loop.tools.verbs import OfMachine
from app.quality.what_if import queries as what_if
from app.views.approvals import queries as queue
from app.views.characteristic.glance import band_picture
from app.web.deps import FormDep, Number, SessionDep, Word
from app.web.forms import by_field
from app.web.paging import address
from app.web.templates import page
from app.web.verb import Said, Verb, carry_out, said

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


@dataclass(frozen=True)
class OfTool(OfMachine):
    """The corrections of a tool that await approval. numbers: those that were shown."""

    numbers: tuple[int, ...] = ()

    @property
    def group(self) -> queue.Group:
        """Them as they are now. Raises `NotFound` when none waits any more."""
        queries.tool(self.session, self.machine, self.number)
        group = queue.group_of(self.session, self.machine, self.number)
        if group is None or not group.approvable:
            raise NotFound(
                _("No correction of tool {tool} awaits approval any more.").format(tool=self.number),
                _("Somebody else has decided. Go back to the list of approvals."),
            )
        return group

    @property
    def values(self) -> Mapping[str, Any]:
        """Tool, numbers, their sum, and the offset before and after."""
        group = self.group
        return {
            "tool": self.number,
            "n": len(group.approvable),
            "numbers": ", ".join(map(str, group.approvable)),
            "total": um(group.total),
            "offset": mm(group.tool.offset),
            "after": mm(group.after),
        }

    @property
    def decided(self) -> Correction:
        """The first of those shown that somebody has decided about meanwhile."""
        shown = (queries.correction(self.session, self.machine, number) for number in self.numbers)
        return next(correction for correction in shown if correction.status != "awaiting_approval")


def _approve(on: OfTool, decision: DecisionsIn) -> Said:
    actions.approve_all(on.session, on.machine, decision.numbers, decision.reason, on.caller)
    return Said("approve-all", on.number)


def _approving(on: OfTool) -> list[str]:
    count = len(on.group.approvable)
    return [
        ngettext("Correction {numbers}: {total}.", "Corrections {numbers}: {total} in all.", count).format(**on.values),
        _("The machine fetches them; the offset of tool {tool} goes from {offset} to {after}.").format(**on.values),
    ]


APPROVE_ALL: Verb[OfTool, DecisionsIn] = Verb(
    name="approve-all",
    body=DecisionsIn,
    act=_approve,
    own=lambda on: on.decided.decided_by == on.caller.name and on.decided.status == "pending",
    word=lambda: _("Approve all"),
    title=lambda on: ngettext(
        "Approve {n} correction of tool {tool}?", "Approve {n} corrections of tool {tool}?", len(on.group.approvable)
    ),
    follows=_approving,
    reasons=lambda: [_("Part measured, agrees"), _("Process is known"), _("As expected")],
    hidden=lambda on: {"numbers": " ".join(map(str, on.group.approvable))},
    said=lambda: _("All that awaited approval for tool {n} is approved; it waits for the machine."),
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
    numbers = tuple(
        int(number) for number in form.get("numbers", "").split() if number.isdecimal() and len(number) < 11
    )
    on = OfTool(session, machine_named(session, machine), tool, caller, numbers)
    queries.tool(session, on.machine, tool)
    try:
        outcome = carry_out(APPROVE_ALL, on, form)
    except Invalid as error:
        return _ask(request, on, form, error)
    if outcome.kind == "late":
        return RedirectResponse(queue_address(late="approve", at=machine, n=on.decided.number), 303)
    return RedirectResponse(queue_address(done=outcome.said.code, n=tool), 303)


def _ask(request: Request, on: OfTool, form: Mapping[str, str] | None = None, error: Invalid | None = None) -> Response:
    return page(
        request,
        "tools/ask.html",
        status=error.status if error else 200,
        machine=on.machine,
        question=APPROVE_ALL.question(on, f"/corrections/{on.machine.key}/tools/{on.number}"),
        form=form or {},
        errors=by_field(error) if error else {},
        trail=[(_("Approvals"), "/corrections")],
        back="/corrections",
    )
