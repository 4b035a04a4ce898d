"""Pages: the operator's board, one alarm, the history. Everything works as plain links and posts; scripts only save a page load."""

from collections.abc import Mapping
from datetime import UTC, datetime
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Operator, Viewer, require
from app.errors import Invalid
from app.loop.alarm_response import photo_actions, photo_queries, queries, verbs, wording
from app.loop.alarm_response.outcomes import outcomes
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarm_response.reaction_queries import Reactions
from app.loop.machines import queries as machines
from app.loop.maintenance.queries import running
from app.web.deps import FormDep, Number, SessionDep, Sought, Word
from app.web.fields import Reason
from app.web.limits import takes
from app.web.paging import address, part_of
from app.web.pictures import AS_FORM, FilesDep, pictures_of, sent
from app.web.templates import page
from app.web.validation import checked

router = APIRouter(include_in_schema=False)
MOST_ON_BOARD = 100
ON_HISTORY_PAGE = 50


@router.get("/alarms", dependencies=[require("viewer")])
def board(
    request: Request,
    session: SessionDep,
    machine: Word = None,
    done: Number = None,
    late: Number = None,
) -> Response:
    """Active alarms, the most urgent first; below them the alarms acknowledged last, with the consequences."""
    machine_row = machines.machine_named(session, machine) if machine else None
    machine_id = machine_row.id if machine_row else None
    rows = queries.alarms(session, state="active", machine_id=machine_id, limit=MOST_ON_BOARD, by_urgency=True)
    by_machine = queries.active_by_machine(session)
    return page(
        request,
        "alarms/board.html",
        rows=rows,
        active=queries.active_count(session, machine_id),
        last=queries.acknowledged_last(session, machine_id=machine_id),
        machines=machines.machines(session),
        by_machine=by_machine,
        maintenance=running(session, datetime.now(UTC), machine_id),
        machine=machine_row,
        done=queries.alarm(session, done) if done else None,
        late=queries.alarm(session, late) if late else None,
        wording=wording,
        outcomes=outcomes,
        reactions=Reactions(session),
        address=address,
    )


@router.get("/alarms/history", dependencies=[require("viewer")])
def history(
    request: Request, session: SessionDep, machine: Word = None, q: Sought = "", before: Number = None
) -> Response:
    """All alarms, newest first."""
    machine_row = machines.machine_named(session, machine) if machine else None
    only = machine_row.id if machine_row else None
    rows = queries.history(session, machine_id=only, holding=q, before=before, limit=ON_HISTORY_PAGE + 1)
    link = partial(address, "/alarms/history", machine=machine, q=q or None)
    return page(
        request,
        "alarms/history.html",
        photos=photo_queries.photo_counts(session, [row.alarm for row in rows]),
        part=part_of(rows, ON_HISTORY_PAGE, before, lambda row: row.alarm.id, link),
        q=q,
        machines=machines.machines(session),
        machine=machine_row,
        wording=wording,
        outcomes=outcomes,
        reactions=Reactions(session),
        address=address,
    )


@router.get("/alarms/{number}")
def alarm_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    number: int,
    action: Annotated[str | None, Query(max_length=40)] = None,
    machine: Word = None,
) -> Response:
    """One alarm; with ``action`` it asks for the second touch."""
    return _alarm(request, session, queries.alarm(session, number), caller, action, machine)


def _alarm(
    request: Request,
    session: Session,
    row: AlarmRow,
    caller: Caller,
    action: str | None,
    machine: str | None,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    active = row.alarm.acknowledged_at is None
    confirmed_action = action if active and action in wording.offered(row) and caller.may("operator") else None
    return page(
        request,
        "alarms/alarm.html",
        refusal=error,
        row=row,
        photos=photo_queries.photos(session, row.alarm),
        most_photos=photo_actions.MOST_PHOTOS,
        action=confirmed_action,
        machine=machine,
        form=form or {},
        wording=wording,
        outcomes=outcomes,
        reactions=Reactions(session),
        address=address,
    )


@router.post("/alarms/{number}/acknowledge")
def acknowledge(request: Request, session: SessionDep, caller: Operator, number: int, form: FormDep) -> Response:
    """The second touch. Sent twice, or after someone else, it changes nothing and says so."""
    machine = form.get("machine") or None
    try:
        outcome = verbs.acknowledge(session, number, form, caller)
    except Invalid as error:
        return _alarm(
            request, session, queries.alarm(session, number), caller, form.get("action"), machine, form, error
        )
    return RedirectResponse(address("/alarms", machine=machine, **{outcome.kind: number}), 303)


@router.post("/alarms/{number}/photos")
@takes(AS_FORM, by="operator", pictures=True)
def add_photos(request: Request, session: SessionDep, caller: Operator, number: int, files: FilesDep) -> Response:
    """Add photos, one or several; the script of the page sends each by itself and wants no page for an answer."""
    queries.alarm(session, number)
    session.commit()  # nothing is kept open while pictures are read
    for _field, picture in pictures_of(files, photo_actions.MOST_PHOTOS, "photo"):
        photo_actions.add_photo(session, number, picture, caller)
    return sent(request, f"/alarms/{number}#photos")


@router.post("/alarms/{number}/photos/{photo}/remove")
def remove_photo(session: SessionDep, caller: Engineer, number: int, photo: int, form: FormDep) -> Response:
    """Remove what a photo shows."""
    photo_actions.remove_photo(session, number, photo, checked(Reason, form.get("reason", ""), "reason"), caller)
    return RedirectResponse(f"/alarms/{number}#photos", 303)
