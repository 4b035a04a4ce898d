"""JSON routes: alarms and their acknowledgement."""

from typing import Annotated

from fastapi import Path, Query

from app.access.deps import AnyCaller, Operator
from app.loop.alarm_response import acknowledging, queries
from app.loop.alarm_response.by_hand import ByHand
from app.loop.alarm_response.queries import AlarmState
from app.loop.alarm_response.schemas import AlarmAcknowledgeIn, AlarmOut, alarm_out
from app.loop.characteristics.queries import characteristic_named
from app.loop.machines.queries import only_machine
from app.web.api import After, Limit, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import Page, Slug, Text200, page_of

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
    return page_of([alarm_out(row) for row in rows], limit, lambda alarm: alarm.id)


@router.get("/alarms/{alarm}", responses=problems(404))
def get_alarm(session: SessionDep, caller: AnyCaller, alarm: Number) -> AlarmOut:
    """One alarm, and what followed if it is acknowledged."""
    row = queries.alarm(session, alarm)
    caller.must_at(row.alarm.machine_id, "viewer")
    return alarm_out(row)


@router.post("/alarms/{alarm}/acknowledge", responses=problems(404, 409))
def acknowledge_alarm(session: SessionDep, caller: Operator, alarm: Number, given: AlarmAcknowledgeIn) -> AlarmOut:
    """Say what the alarm was; what follows from that follows at once and stands in `outcome`.

    - `tool_replaced`: open corrections of the tool are superseded, its averages and its life begin again, with `offset`
    - `keep_cutting`: the held correction is released to the machine
    - `false_reading`: the readings behind the alarm are excluded, and what they asked for is withdrawn
    - `sister_tool`: the characteristics of the tool correct its sister from now on
    - `offset_set`: *offset differs* only: `offset` is true, `changed_by` has changed it; handled as a manual edit
    - `measured_by_hand`: needs `hand_measured`, `hand_verdict` or both; nothing else follows
    - `noted`: nothing else; at *offset differs* the reported offset is true

    What was measured by hand (`hand_measured`, `hand_verdict`) is kept beside the machine's value of the last reading behind
    the alarm, or of `hand_sequence`; that reading is neither excluded nor decided anew.

    After a probe fault the paused characteristic goes on, after *offset differs* the paused tool, whichever it was. Acknowledging twice is 409 and says who was
    first.
    """
    return alarm_out(
        acknowledging.acknowledge(
            session,
            alarm,
            given.action,
            given.comment,
            caller,
            offset=given.offset,
            changed_by=given.changed_by,
            hand=ByHand(given.hand_measured, given.hand_verdict, given.hand_sequence),
        )
    )
