"""JSON routes: the signals that rules gave, and what they were."""

from typing import Annotated

from fastapi import Path, Query

from app.access.deps import AnyCaller, Engineer
from app.loop.characteristics.queries import characteristic_for
from app.loop.machines.queries import only_machine
from app.quality.chart_signals import actions, queries
from app.quality.chart_signals.queries import SignalState
from app.quality.chart_signals.schemas import CommentIn, SignalOut, signal_out
from app.web.api import Before, Limit, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import Page, Slug, page_of

router = api_router("control charts")
Number = Annotated[int, Path(description="Number of the signal.", examples=[17])]


@router.get("/signals", responses=problems(404))
def list_signals(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: Annotated[Slug | None, Query(description="Only those of this characteristic.")] = None,
    machine: Annotated[Slug | None, Query(description="Only those of this machine.", examples=["lathe-1"])] = None,
    state: Annotated[SignalState, Query(description="`open`, `explained`, `withdrawn`, or all of them.")] = "all",
    before: Before = None,
    limit: Limit = 100,
) -> Page[SignalOut]:
    """Signals, newest first. The key of a machine sees those of that machine."""
    machine_id = only_machine(session, caller, machine)
    only = None
    if characteristic is not None:
        only = characteristic_for(session, caller, characteristic, "viewer").characteristic
    if only is not None and machine_id is not None and only.machine_id != machine_id:
        return Page(items=[])
    rows = queries.signals(
        session, machine_id=machine_id, characteristic=only, state=state, before=before, limit=limit + 1
    )
    return page_of([signal_out(row) for row in rows], limit, lambda signal: signal.id)


@router.get("/signals/{signal}", responses=problems(404))
def get_signal(session: SessionDep, caller: AnyCaller, signal: Number) -> SignalOut:
    """One signal, and what it was if somebody has said so."""
    row = queries.signal(session, signal)
    caller.must_at(row.machine.id, "viewer")
    return signal_out(row)


@router.post("/signals/{signal}/comment", responses=problems(404))
def comment_signal(session: SessionDep, caller: Engineer, signal: Number, given: CommentIn) -> SignalOut:
    """Say what a signal was; it is open no longer. Said again, the record of changes keeps both."""
    return signal_out(actions.explain(session, signal, given.cause, given.comment, caller))
