"""Pages: the affected parts of an alarm, the list of quarantines, one of them, and what becomes of a part."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Operator, Viewer, require
from app.errors import Conflict, InbandError, Invalid
from app.language.i18n import _
from app.loop.alarm_response import wording as alarm_words
from app.loop.machines import queries as machines
from app.loop.quarantine import actions, queries, verbs, wording
from app.loop.quarantine.history import Doubt
from app.loop.quarantine.queries import State
from app.loop.quarantine.schemas import DoubtIn, SetAsideIn
from app.loop.quarantine.verbs import OfPart
from app.web.deps import Before, FormDep, Number, SessionDep, Word
from app.web.forms import typed
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.verb import Outcome, Verb, add_question_page, said

router = APIRouter(include_in_schema=False)
ON_PAGE = 50
Typed = Annotated[str, Query(max_length=40)]


@router.get("/alarms/{number}/affected")
def affected_page(
    request: Request,
    session: SessionDep,
    _caller: Viewer,
    number: int,
    guard: Typed = "",
    by_hand_only: Annotated[bool, Query()] = False,
) -> Response:
    """The parts that an alarm concerns, how they are doubted, and the form that sets them aside. guard: µm, as typed."""
    typed_so = {"guard": guard, "by_hand_only": "true" if by_hand_only else ""}
    return _affected(request, session, number, typed_so)


def _affected(
    request: Request, session: Session, number: int, form: Mapping[str, str], error: InbandError | None = None
) -> Response:
    try:
        doubt = typed(DoubtIn, form).doubt
    except Invalid as wrong:
        doubt, error = Doubt(0.0, form.get("by_hand_only") == "true"), error or wrong
    found = queries.affected(session, number, doubt)
    made = queries.of_alarm(session, number)
    return page(
        request,
        "quarantine/affected.html",
        refusal=error,
        found=found,
        made=queries.quarantine(session, made.id) if made else None,
        guard=form.get("guard", ""),
        form=form,
        wording=alarm_words,
        words=wording,
    )


@router.post("/alarms/{number}/affected")
def set_aside(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """Set them aside; sent twice, the second adds what has come since."""
    try:
        done = actions.set_aside(session, typed(SetAsideIn, form, alarm=number), caller)
    except (Invalid, Conflict) as error:
        return _affected(request, session, number, form, error)
    return RedirectResponse(f"/quarantines/{done.row.quarantine.id}?done=set-aside", 303)


@router.get("/quarantines", dependencies=[require("viewer")])
def quarantines_page(
    request: Request,
    session: SessionDep,
    machine: Word = None,
    state: Annotated[State, Query()] = "open",
    before: Before = None,
) -> Response:
    """Quarantines, the newest first: those with parts that wait for a decision, or all."""
    chosen = machines.machine_named(session, machine) if machine else None
    rows = queries.quarantines(
        session, machine_id=chosen.id if chosen else None, state=state, before=before, limit=ON_PAGE + 1
    )
    link = partial(address, "/quarantines", machine=machine, state=state)
    return page(
        request,
        "quarantine/list.html",
        part=part_of(rows, ON_PAGE, before, lambda row: row.quarantine.id, link),
        state=state,
        machine=chosen,
        machines=machines.machines(session),
        wording=alarm_words,
        address=address,
    )


@router.get("/quarantines/{number}")
def quarantine_page(
    request: Request, session: SessionDep, caller: Viewer, number: int, done: Word = None, n: Number = None,
    late: Number = None,
) -> Response:  # fmt: skip
    """One quarantine, to be worked through and printed. done: the verb of what was decided about part n; late: of the part."""
    row = queries.quarantine(session, number)
    message = said(verbs.PART, done, n) if done and n else None
    if done == "set-aside":
        message = _("The parts are set aside. Mark them at the machine: print this page.")
    return page(
        request,
        "quarantine/quarantine.html",
        row=row,
        rows=queries.parts(session, row.quarantine),
        offered=[verb for verb in verbs.PART if verb.permits(caller)],
        done=message,
        late=queries.part(session, row.quarantine, late).part if late else None,
        wording=alarm_words,
        words=wording,
    )


def _part(session: SessionDep, caller: Operator, number: int, part: int) -> OfPart:
    return OfPart(session, number, part, caller)


def _around(on: OfPart, _verb: Verb[OfPart, Any]) -> dict[str, Any]:
    back = f"/quarantines/{on.quarantine}"
    trail = [(_("Quarantines"), "/quarantines"), (_("Quarantine {number}").format(number=on.quarantine), back)]
    return {"machine": queries.quarantine(on.session, on.quarantine).machine, "trail": trail, "back": back}


def _decided(_request: Request, on: OfPart, verb: Verb[OfPart, Any], outcome: Outcome) -> Response:
    """Sent twice, or after someone else, it changes nothing and says so."""
    done = {"late": on.number} if outcome.kind == "late" else {"done": verb.name, "n": on.number}
    return RedirectResponse(address(f"/quarantines/{on.quarantine}", **done) + f"#part-{on.number}", 303)


add_question_page(
    router,
    "/quarantines/{number}/parts/{part}/{what}",
    verbs.PART,
    _part,
    around=_around,
    after=_decided,
    astray=lambda: _("Go back to the quarantine."),
)
