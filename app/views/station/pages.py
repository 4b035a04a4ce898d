"""Pages: the station of a machine, and what a person does there. Everything works as plain links and posts."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Operator, Viewer, require
from app.errors import Conflict, Invalid, NotFound
from app.language.i18n import _
from app.loop.alarm_response import queries as alarms
from app.loop.alarm_response import wording as alarm_wording
from app.loop.alarm_response.form_reader import acknowledge_as_typed
from app.loop.alarm_response.outcomes import outcomes
from app.loop.alarm_response.queries import AlarmRow
from app.loop.machines.queries import machine_named
from app.loop.tables.machines import Machine
from app.loop.tools import actions as tools
from app.loop.tools import confirmation
from app.loop.tools import queries as tool_queries
from app.loop.tools.schemas import ToolChange
from app.quality.wear.queries import next_event
from app.views.characteristic.glance import band_picture
from app.views.characteristic.wording import state_word
from app.views.station import queries
from app.views.station.wording import next_action
from app.web.deps import FormDep, Number, SessionDep
from app.web.forms import by_field, length, parsed, words
from app.web.paging import address
from app.web.templates import page

router = APIRouter(prefix="/station", include_in_schema=False)
NO_FORM: Mapping[str, str] = {}


@router.get("/{machine}")
def station_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: str,
    done: Number = None,
    late: Number = None,
    tool: Number = None,
) -> Response:
    """The machine as it stands. done, late: the alarm of the last action; tool: the tool that was changed."""
    station = queries.station(session, machine)
    return page(
        request,
        "station/station.html",
        station=station,
        machine=station.machine,
        next_action=next_action(station),
        may_act=caller.may("operator"),
        done=_of_machine(session, station.machine, done) if done else None,
        late=_of_machine(session, station.machine, late) if late else None,
        tool=confirmation.done("change", tool) if tool else None,
        now=datetime.now(UTC),
        state_word=state_word,
        band=lambda row: band_picture(row.stream.last_deviation, row.parameters, None, row.average),
        next_event=lambda row: next_event(row.outlook),
        wording=alarm_wording,
        outcomes=outcomes,
        address=address,
    )


@router.get("/{machine}/alarms/{number}", dependencies=[require("operator")])
def ask_alarm(
    request: Request,
    session: SessionDep,
    machine: str,
    number: int,
    action: Annotated[str, Query(max_length=40)] = "",
) -> Response:
    """The second touch at an alarm. One that is acknowledged meanwhile leads back."""
    machine_row = machine_named(session, machine)
    row = _of_machine(session, machine_row, number)
    if row.alarm.acknowledged_at is not None:
        return RedirectResponse(address(f"/station/{machine}", late=number), 303)
    return _ask_alarm(request, machine_row, row, action)


def _ask_alarm(
    request: Request,
    machine: Machine,
    row: AlarmRow,
    action: str,
    form: Mapping[str, str] = NO_FORM,
    error: Invalid | None = None,
) -> Response:
    if action not in alarm_wording.offered(row):
        raise NotFound(_("There is nothing at this address."), _("Go back to the station of the machine."))
    return page(
        request,
        "station/ask_alarm.html",
        status=error.status if error else 200,
        machine=machine,
        row=row,
        action=action,
        form=form,
        errors=by_field(error) if error else {},
        wording=alarm_wording,
        address=address,
    )


@router.post("/{machine}/alarms/{number}")
def acknowledge(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, form: FormDep
) -> Response:
    """Acknowledge the alarm. Sent twice, or after somebody else, it changes nothing and says so."""
    machine_row = machine_named(session, machine)
    row = _of_machine(session, machine_row, number)
    outcome = "done"
    try:
        acknowledge_as_typed(session, number, form, caller)
    except Conflict:
        alarm = alarms.alarm(session, number).alarm
        again = alarm.acknowledged_by == caller.name and alarm.action == form.get("action")
        outcome = "done" if again else "late"
    except Invalid as error:
        return _ask_alarm(request, machine_row, row, form.get("action", ""), form, error)
    return RedirectResponse(address(f"/station/{machine}", **{outcome: number}), 303)


@router.get("/{machine}/tools/{number}/change", dependencies=[require("operator")])
def ask_tool(request: Request, session: SessionDep, machine: str, number: int) -> Response:
    """The second touch of a tool change."""
    return _ask_tool(request, session, machine_named(session, machine), number)


def _ask_tool(
    request: Request,
    session: Session,
    machine: Machine,
    number: int,
    form: Mapping[str, str] = NO_FORM,
    error: Invalid | None = None,
) -> Response:
    tool_queries.tool(session, machine, number)
    (row,) = tool_queries.tools(session, machine, only=number)
    question = confirmation.about_tool(row, machine.key, "change")
    return page(
        request,
        "station/ask_tool.html",
        status=error.status if error else 200,
        machine=machine,
        question=replace(question, send_to=f"/station/{machine.key}/tools/{number}/change"),
        form=form,
        errors=by_field(error) if error else {},
    )


@router.post("/{machine}/tools/{number}/change")
def change_tool(
    request: Request, session: SessionDep, caller: Operator, machine: str, number: int, form: FormDep
) -> Response:
    """Say that the tool was changed."""
    machine_row = machine_named(session, machine)
    try:
        change = parsed(ToolChange, {"offset": length(form.get("offset")), "reason": words(form, "reason")})
        tools.change_tool(session, machine_row, number, change.offset, change.reason, caller)
    except Invalid as error:
        return _ask_tool(request, session, machine_row, number, form, error)
    return RedirectResponse(address(f"/station/{machine}", tool=number), 303)


def _of_machine(session: Session, machine: Machine, number: int) -> AlarmRow:
    """An alarm of this machine. Raises `NotFound`."""
    row = alarms.alarm(session, number)
    if row.machine.id != machine.id:
        raise NotFound(
            _("Alarm {number} is not of machine {machine}.").format(number=number, machine=machine.key),
            _("Go back to the station of the machine."),
        )
    return row
