"""Pages: everything that waits for a person, and the count of it."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import Viewer, require
from app.loop.machines import queries as machines
from app.loop.notifications.failing_queries import failing
from app.loop.tools import verbs
from app.views.to_do import queries
from app.web.deps import Number, SessionDep, Word
from app.web.templates import page

router = APIRouter(include_in_schema=False)


@router.get("/todo")
def to_do_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: Word = None,
    mine: Annotated[bool, Query()] = False,
    at: Word = None,
    done: Word = None,
    late: Word = None,
    n: Number = None,
) -> Response:
    """All that waits, with its next action; of one machine, or what the role of the one who asks may do.

    done, late: the verb of what was decided here about correction ``n`` at machine ``at``, or was decided before.
    """
    chosen = machines.machine_named(session, machine) if machine else None
    every, by_machine = machines.machines(session), queries.count_by_machine(session)
    waiting = queries.tasks(session, chosen)
    own = [task for task in waiting if caller.may(task.role)]
    return page(
        request,
        "to_do/to_do.html",
        tasks=own if mine else waiting,
        number=len(waiting),
        number_of_own=len(own),
        total=max(queries.count(session), len(waiting)),  # one more may have come in between
        machine=chosen,
        machines=every,
        by_machine={one.key: by_machine[one.id] for one in every if one.id in by_machine},
        mine=mine,
        offered=verbs.offered,
        done=verbs.done(done, n) if done and n else None,
        late=verbs.too_late(session, machines.machine_named(session, at), late, n) if at and late and n else None,
    )


@router.get("/todo/count", dependencies=[require("viewer")])
def count(request: Request, session: SessionDep) -> Response:
    """The number beside *To do* in the bar."""
    return page(request, "to_do_count.html", to_do=queries.count(session))


@router.get("/todo/not-reached", dependencies=[require("viewer")])
def not_reached(request: Request, session: SessionDep) -> Response:
    """The note about receivers that fail, for the page of the alarms."""
    return page(request, "to_do/not_reached.html", not_reached=failing(session))
