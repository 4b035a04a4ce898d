"""JSON routes: alarms and their acknowledgement."""

from typing import Annotated

from fastapi import Path, Query

from app.access.deps import AnyCaller, Operator
from app.loop.alarm_response import queries
from app.loop.alarm_response.queries import AlarmRow, AlarmState
from app.loop.alarm_response.reaction_queries import Reactions
from app.loop.alarm_response.schemas import AlarmOut, alarm_out
from app.loop.alarm_response.verbs import ACKNOWLEDGE, OfAlarm
from app.loop.characteristics.queries import characteristic_named
from app.loop.machines.queries import only_machine
from app.web.api import After, Limit, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import Page, Slug, Text200, page_of
from app.web.verb import draw

router = api_router("alarms")
Number = Annotated[int, Path(description="Number of the alarm.", examples=[41])]


@router.get("/alarms", responses=problems(404))
def list_alarms(
    session: SessionDep,
    caller: AnyCaller,
    state: Annotated[AlarmState, Query(description="`active`, `acknowledged`, or all of them.")] = "all",
    machine: Annotated[Slug | None, Query(description="Only those of this machine.", examples=["lathe-1"])] = None,
    characteristic: Annotated[Slug | None, Query(description="Only those of this characteristic.")] = None,
    kind: Annotated[Text200 | None, Query(description="Only this kind.", examples=["tool_worn"])] = None,
    after: After = 0,
    limit: Limit = 100,
) -> Page[AlarmOut]:
    """Alarms, oldest first. The key of a machine sees those of that machine."""
    machine_id = only_machine(session, caller, machine)
    if characteristic is not None:
        characteristic_named(session, characteristic)
    rows = queries.alarms(
        session,
        state=state,
        machine_id=machine_id,
        characteristic=characteristic,
        kind=kind,
        after=after,
        limit=limit + 1,
    )
    reactions = Reactions(session)
    return page_of([alarm_out(row, reactions) for row in rows], limit, lambda alarm: alarm.id)


@router.get("/alarms/{alarm}", responses=problems(404))
def get_alarm(session: SessionDep, caller: AnyCaller, alarm: Number) -> AlarmOut:
    """One alarm, and what followed if it is acknowledged."""
    row = queries.alarm(session, alarm)
    caller.must_at(row.alarm.machine_id, "viewer")
    return alarm_out(row, Reactions(session))


def _alarm(session: SessionDep, caller: Operator, alarm: Number) -> OfAlarm:
    return OfAlarm(session, alarm, caller)


def _answer(on: OfAlarm, row: AlarmRow) -> AlarmOut:
    return alarm_out(row, Reactions(on.session))


draw(router, "/alarms/{alarm}/acknowledge", ACKNOWLEDGE, _alarm, _answer, AlarmOut)
