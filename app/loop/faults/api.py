"""The JSON route by which a machine reports its faults."""

from typing import Annotated

from fastapi import Response
from pydantic import BaseModel, Field

from app.access.deps import OperatorOrMachine
from app.loop.faults import actions
from app.loop.faults.alarm_kinds import Fault
from app.web.api import MachineKey, api_router, problems
from app.web.deps import DoorSessionDep
from app.web.fields import Body, Text200

router = api_router("machines")


class FaultIn(Body):
    """A fault that a machine reports, or its end."""

    kind: Annotated[Fault, Field(description="What has failed.")]
    text: Annotated[Text200 | None, Field(description="Words of the control; shown with the alarm.")] = None
    active: Annotated[bool, Field(strict=True, description="true: the fault is there; false: it is over.")] = True


class FaultOut(BaseModel):
    """The alarm that a fault has raised."""

    kind: Annotated[Fault, Field(description="What has failed.")]
    active: Annotated[bool, Field(description="true: the fault is there; false: it is over.")]
    alarm: Annotated[int | None, Field(description="Number of the alarm; null for the end of a fault nobody knew.")]
    count: Annotated[int, Field(description="Reports that this alarm counts.")]


@router.post("/machines/{machine}/faults", status_code=201, responses=problems(404) | {200: {"model": FaultOut}})
def report_fault(
    session: DoorSessionDep, caller: OperatorOrMachine, machine: MachineKey, fault: FaultIn, response: Response
) -> FaultOut:
    """Report a fault of the machine (battery of the probe low, receiver, probe not ready) or its end: the alarm
    *machine fault* is raised, counts up or ends. 201 for a new alarm, else 200.
    """
    reported = actions.report_fault(session, machine, fault.kind, fault.text or "", fault.active, caller)
    if not reported.is_new:
        response.status_code = 200
    return FaultOut(kind=fault.kind, active=reported.active, alarm=reported.alarm, count=reported.reports)
