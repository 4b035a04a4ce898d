"""Pages: one touch test, step by step."""

from datetime import timedelta
from typing import Final

from fastapi import APIRouter, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import Operator, Viewer
from app.errors import Conflict
from app.loop.connections.queries import find_connection
from app.loop.connections.touch_tests import actions, queries, wording
from app.loop.connections.touch_tests.schemas import QUESTIONS, TouchTestAnswer, TouchTestIn
from app.loop.machines.queries import machine_named
from app.settings import Settings
from app.web.deps import FormDep, Number, SessionDep
from app.web.forms import parsed, whole
from app.web.templates import page

router = APIRouter(include_in_schema=False)
TESTS = "/machines/{machine}/touch-tests"
TOO_SOON: Final = 1.0
"""s: nobody has looked at the control since the question is there; a second click, or another browser, came in between."""
LATE: Final = 15.0
"""s within which a bridge writes or takes back."""


@router.post(TESTS)
def ask(request: Request, session: SessionDep, caller: Operator, machine: str, form: FormDep) -> Response:
    """Ask for a touch test; then its page, or that of the one that is open already."""
    settings: Settings = request.app.state.settings
    owner = machine_named(session, machine)
    given = parsed(TouchTestIn, {"tool_memory": whole(form.get("tool_memory"))})
    row = queries.open_test(session, owner)
    if row is None:
        row = actions.ask(session, machine, given, caller, timedelta(seconds=settings.bridge_silent_after))
    return _to(machine, row.test.id)


@router.get(TESTS + "/{number}")
def touch_test_page(
    request: Request, session: SessionDep, _caller: Viewer, machine: str, number: int, late: Number = None
) -> Response:
    """One touch test: what to compare now, or what came of it. late: the question was answered or stopped before."""
    row = queries.touch_test(session, machine_named(session, machine), number)
    settings: Settings = request.app.state.settings
    connection = find_connection(session, row.machine.id)
    silent = connection is None or connection.silent(timedelta(seconds=settings.bridge_silent_after))
    return page(
        request,
        "connections/touch_test.html",
        machine=row.machine,
        test=row.test,
        question=QUESTIONS.get(row.test.state),
        late=bool(late),
        awaited=wording.awaited(row, LATE, silent=silent),
        said=None if connection is None or silent else connection.connection.detail,
        wording=wording,
    )


@router.post(TESTS + "/{number}/answer")
def answer(session: SessionDep, caller: Operator, machine: str, number: int, form: FormDep) -> Response:
    """Answer the question. Sent late, it changes nothing and says so."""
    yes = {"yes": True, "no": False}.get(form.get("answer", ""))
    given = parsed(TouchTestAnswer, {"question": form.get("question"), "yes": yes})
    row = queries.touch_test(session, machine_named(session, machine), number)
    if given.yes and row.test.ended_at is None and row.state_age < TOO_SOON:
        return _to(machine, number, late=True)
    try:
        actions.answer(session, machine, number, given, caller)
    except Conflict:
        return _to(machine, number, late=True)
    return _to(machine, number)


@router.post(TESTS + "/{number}/stop")
def stop(session: SessionDep, caller: Operator, machine: str, number: int) -> Response:
    """Stop the test and take back; one that is over stays as it is."""
    try:
        actions.stop(session, machine, number, caller)
    except Conflict:
        return _to(machine, number, late=True)
    return _to(machine, number)


def _to(machine: str, number: int, *, late: bool = False) -> Response:
    return RedirectResponse(f"/machines/{machine}/touch-tests/{number}{'?late=1' if late else ''}", 303)
