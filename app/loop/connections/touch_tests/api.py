"""JSON routes: touch tests, for people who ask and answer, and for the bridge that makes them."""

from datetime import timedelta
from typing import Annotated

from fastapi import Path, Request, Response

from app.access.deps import AnyCaller, Operator, OperatorOrMachine
from app.loop.connections.touch_tests import actions, queries
from app.loop.connections.touch_tests.schemas import TouchTestAnswer, TouchTestIn, TouchTestOut, TouchTestReport
from app.loop.machines.queries import machine_for
from app.settings import Settings
from app.web.api import Before, Limit, MachineKey, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID, Page, page_of

router = api_router("connections")
Number = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the touch test.", examples=[7])]
TESTS = "/machines/{machine}/touch-tests"


@router.post(TESTS, status_code=201, responses=problems(404, 409))
def ask_for_touch_test(
    request: Request, session: SessionDep, caller: Operator, machine: MachineKey, test: TouchTestIn, response: Response
) -> TouchTestOut:
    """Ask the bridge for a touch test of one location, which a person then guides: the bridge reads the offset, changes it by
    some µm, and takes it back whatever happens. The bridge's configuration has to allow it.
    """
    settings: Settings = request.app.state.settings
    row = actions.ask(session, machine, test, caller, timedelta(seconds=settings.bridge_silent_after))
    response.headers["Location"] = f"/api/v1/machines/{machine}/touch-tests/{row.test.id}"
    return TouchTestOut.of(row)


@router.get(TESTS, responses=problems(404))
def list_touch_tests(
    session: SessionDep, caller: AnyCaller, machine: MachineKey, before: Before = None, limit: Limit = 100
) -> Page[TouchTestOut]:
    """The touch tests of a machine that were asked for here, the newest first; those of the command are not among them."""
    rows = queries.touch_tests(session, machine_for(session, caller, machine, "viewer"), before, limit + 1)
    return page_of([TouchTestOut.of(row) for row in rows], limit, lambda test: test.id)


@router.get(TESTS + "/{number}", responses=problems(404))
def get_touch_test(session: SessionDep, caller: AnyCaller, machine: MachineKey, number: Number) -> TouchTestOut:
    """One touch test, with the question that waits for a person."""
    return TouchTestOut.of(queries.touch_test(session, machine_for(session, caller, machine, "viewer"), number))


@router.post(TESTS + "/{number}/answer", responses=problems(404, 409))
def answer_touch_test(
    session: SessionDep, caller: Operator, machine: MachineKey, number: Number, answer: TouchTestAnswer
) -> TouchTestOut:
    """Answer the question that is open, after a look at the control's screen. A yes to `before` lets the bridge write."""
    return TouchTestOut.of(actions.answer(session, machine, number, answer, caller))


@router.post(TESTS + "/{number}/stop", responses=problems(404, 409))
def stop_touch_test(session: SessionDep, caller: Operator, machine: MachineKey, number: Number) -> TouchTestOut:
    """Stop a touch test; the bridge takes back what it has written. Stopping twice is harmless."""
    return TouchTestOut.of(actions.stop(session, machine, number, caller))


@router.post(TESTS + "/{number}/report", responses=problems(404, 409))
def report_touch_test(
    session: SessionDep, caller: OperatorOrMachine, machine: MachineKey, number: Number, report: TouchTestReport
) -> TouchTestOut:
    """The bridge says how far it has come; the answer is the test as it is, with what people have answered meanwhile."""
    return TouchTestOut.of(actions.report(session, machine, number, report, caller))
