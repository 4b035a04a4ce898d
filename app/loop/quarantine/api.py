"""JSON routes: affected parts of an alarm, quarantines, and what becomes of their parts."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Path, Query, Response

from app.access.audit.actions import record
from app.access.deps import AnyCaller, Operator, require
from app.files.documents.content import Format
from app.files.documents.files import MEDIA_TYPES
from app.loop.machines.queries import only_machine
from app.loop.quarantine import actions, queries
from app.loop.quarantine.document import file_of_quarantine
from app.loop.quarantine.history import Doubt
from app.loop.quarantine.queries import State
from app.loop.quarantine.schemas import (
    AffectedOut,
    ByHandOnly,
    QuarantinedPartOut,
    QuarantineOut,
    QuarantineWithParts,
    SetAsideIn,
)
from app.loop.quarantine.verbs import PART, OfPart
from app.web.api import Before, Limit, MachineFilter, api_router, problems
from app.web.deps import SessionDep
from app.web.downloads import download
from app.web.fields import LARGEST_ID, Page, page_of
from app.web.verb import add_json_route

router = api_router("alarms")
AlarmNumber = Annotated[int, Path(description="Number of the alarm.", examples=[41])]
Number = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the quarantine.", examples=[1])]
PartNumber = Annotated[int, Path(ge=1, le=2_147_483_647, description="Number of the part in it.", examples=[1])]
InFormat = Annotated[Format, Query(alias="format", description="`csv`: a line a part; `xlsx`; `pdf`.")]
FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The parts as a file",
        "content": {
            media.partition(";")[0]: {"schema": {"type": "string", "format": "binary"}, "example": "(the file)"}
            for media in MEDIA_TYPES.values()
        },
    }
}


@router.get("/alarms/{alarm}/affected-parts", responses=problems(404))
def list_affected_parts(
    session: SessionDep,
    caller: AnyCaller,
    alarm: AlarmNumber,
    guard: Annotated[float, Query(ge=0, le=1, description="Expanded measuring uncertainty, mm.")] = 0.0,
    by_hand_only: Annotated[ByHandOnly, Query()] = False,
) -> AffectedOut:
    """The parts that an alarm concerns: those since the last one that was certainly good, to the next one that is.

    Certainly good is a part that was measured in tolerance (by its guard), with the same tool, not changed since, and without a
    fault of the probe; what was measured by hand counts before the probe's value.
    """
    found = queries.affected(session, alarm, Doubt(guard, by_hand_only))
    caller.must_at(found.alarm.machine.id, "viewer")
    made = queries.of_alarm(session, alarm)
    return AffectedOut.of(found, made.id if made else None)


@router.post("/quarantines", status_code=201, responses=problems(404, 409) | {200: {"model": QuarantineWithParts}})
def set_parts_aside(
    session: SessionDep, caller: Operator, given: SetAsideIn, response: Response
) -> QuarantineWithParts:
    """Set the affected parts of an alarm aside. 201; 200 where the alarm has a quarantine: parts that came since are added.

    409 where no part is affected. Nothing is changed on the machine, and no reading waits.
    """
    done = actions.set_aside(session, given, caller)
    if done.again:
        response.status_code = 200
    made = done.row.quarantine
    response.headers["Location"] = f"/api/v1/quarantines/{made.id}"
    return QuarantineWithParts.with_parts(done.row, queries.parts(session, made))


@router.get("/quarantines", responses=problems(404))
def list_quarantines(
    session: SessionDep,
    caller: AnyCaller,
    state: Annotated[State, Query(description="`open`: with a part that waits for a decision.")] = "all",
    machine: MachineFilter = None,
    before: Before = None,
    limit: Limit = 100,
) -> Page[QuarantineOut]:
    """Quarantines, the newest first. The key of a machine sees those of that machine."""
    machine_id = only_machine(session, caller, machine)
    rows = queries.quarantines(session, machine_id=machine_id, state=state, before=before, limit=limit + 1)
    return page_of([QuarantineOut.of(row) for row in rows], limit, lambda row: row.id)


@router.get("/quarantines/{quarantine}", responses=problems(404))
def get_quarantine(session: SessionDep, caller: AnyCaller, quarantine: Number) -> QuarantineWithParts:
    """One quarantine with all its parts."""
    row = queries.quarantine(session, quarantine)
    caller.must_at(row.machine.id, "viewer")
    return QuarantineWithParts.with_parts(row, queries.parts(session, row.quarantine))


@router.get("/quarantines/{quarantine}/file", response_class=Response, responses=problems(404) | FILE)
def get_quarantine_file(
    session: SessionDep, caller: AnyCaller, quarantine: Number, as_: InFormat = Format.CSV
) -> Response:
    """Its parts as a file. Who has taken it is on record."""
    row = queries.quarantine(session, quarantine)
    caller.must_at(row.machine.id, "viewer")
    content = file_of_quarantine(row, queries.parts(session, row.quarantine), as_, datetime.now(UTC))
    record(session, caller.name, "quarantine exported", f"quarantine/{quarantine}", None, {"format": as_.value})
    return download(content, f"quarantine-{quarantine}.{as_.value}", MEDIA_TYPES[as_])


def _part(session: SessionDep, caller: AnyCaller, quarantine: Number, number: PartNumber) -> OfPart:
    return OfPart(session, quarantine, number, caller)


for _verb in PART:
    add_json_route(
        router,
        f"/quarantines/{{quarantine}}/parts/{{number}}/{_verb.name}",
        _verb,
        _part,
        lambda _on, row: QuarantinedPartOut.of(row),
        QuarantinedPartOut,
        [require(_verb.role)],
    )
