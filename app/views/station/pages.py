"""Pages: the station of a machine, and what a person does there. Everything works as plain links and posts."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from secrets import token_hex
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access import devices
from app.access import queries as access
from app.access.deps import AtStation, Caller, Station
from app.access.new_keys import digest
from app.access.sign_in import sign_out
from app.errors import Conflict, InbandError, Invalid, NotFound
from app.language.i18n import _
from app.loop.alarm_response import verbs as alarm_verbs
from app.loop.alarm_response import wording as alarm_wording
from app.loop.alarm_response.outcomes import outcomes
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarm_response.reaction_queries import Reactions
from app.loop.machines.queries import machine_named
from app.loop.notes import actions as note_actions
from app.loop.notes import queries as notes
from app.loop.notes.schemas import NoteIn
from app.loop.notes.wording import beginning
from app.loop.tools import verbs
from app.loop.tools.verbs import CHANGE, OfCorrection, OfTool
from app.quality.wear.queries import next_event
from app.settings import Settings
from app.views.approvals.verbs import APPROVE_ALL, shown_in
from app.views.approvals.verbs import OfTool as Together
from app.views.characteristic.glance import band_picture
from app.views.characteristic.wording import state_word
from app.views.station import context_pages, picture_pages, queries, sheet_pages
from app.views.station.who import REFUSED, asked, who
from app.views.station.wording import next_action
from app.web.deps import (
    SESSION_COOKIE,
    STATION_COOKIE,
    FormDep,
    Number,
    SessionDep,
    SettingsDep,
    Word,
    from_this_site,
    keep_cookie,
)
from app.web.fields import LARGEST_ID
from app.web.forms import by_field, typed
from app.web.limits import FEW, takes
from app.web.live import Access, stream
from app.web.paging import address
from app.web.templates import page
from app.web.verb import Verb, carry_out, named, said

router = APIRouter(prefix="/station", include_in_schema=False)
router.routes += [*sheet_pages.router.routes, *context_pages.router.routes, *picture_pages.router.routes]
NO_FORM: Mapping[str, str] = {}
NOBODY = Caller("person", "")
"""Asks the question; who acts is asked with it."""


@router.get("")
def bind_page(request: Request, session: SessionDep, code: Annotated[str, Query(max_length=40)] = "") -> Response:
    """The form in which a device is bound; one that is bound already is led to its machine."""
    token = request.cookies.get(STATION_COOKIE)
    device = devices.device_of(session, token) if token and not code else None
    if device is not None:
        return RedirectResponse(f"/station/{device.machine}", 303)
    return page(request, "station/bind.html", code=code, errors={}, ended=bool(token) and not code)


@router.post("", dependencies=[Depends(from_this_site)])
@takes(FEW, by="anybody")
def bind(request: Request, session: SessionDep, settings: SettingsDep, form: FormDep) -> Response:
    """Bind this browser to the machine of the code. Anyone who is signed in on it is signed out: it is everybody's from now on."""
    try:
        device, token = devices.bind(session, form.get("code", ""))
    except Invalid as error:
        code, errors = form.get("code", ""), by_field(error)
        return page(request, "station/bind.html", status=error.status, code=code, errors=errors, ended=False)
    answer = RedirectResponse(f"/station/{device.machine}", 303)
    _keep(answer, token, settings)
    signed_in = request.cookies.get(SESSION_COOKIE)
    person = access.signed_in(session, signed_in, {}) if signed_in else None
    if signed_in and person:
        sign_out(session, signed_in, person.caller.name)
    answer.delete_cookie(SESSION_COOKIE, httponly=True, samesite="lax")
    return answer


def _keep(answer: Response, token: str, settings: Settings) -> None:
    """Keep the device bound for another while."""
    keep_cookie(answer, settings, STATION_COOKIE, token, devices.UNUSED.total_seconds(), "/station")


@router.get("/{machine}")
def station_page(
    request: Request,
    session: SessionDep,
    at: Station,
    settings: SettingsDep,
    machine: str,
    done: Number = None,
    late: Number = None,
    tool: Number = None,
    decided: Word = None,
    too_late: Word = None,
    n: Number = None,
    note: Number = None,
) -> Response:
    """The machine as it is.

    done, late: the alarm of the last action; tool: the tool that was changed; note: the one that was written. decided, too_late: the verb of what was done
    about correction ``n``, or had been decided before.
    """
    station = queries.station(session, machine)
    answer = page(
        request,
        "station/station.html",
        station=station,
        machine=station.machine,
        next_action=next_action(station),
        may_act=at.may_act,
        done=queries.alarm_of_machine(session, station.machine.key, done) if done else None,
        late=queries.alarm_of_machine(session, station.machine.key, late) if late else None,
        tool=verbs.done("change", tool) if tool else None,
        said=said((APPROVE_ALL,), decided, n) or verbs.done(decided, n) if decided and n else None,
        refused=verbs.too_late(session, station.machine, too_late, n) if too_late and n else None,
        written=_beginning_of(session, station.machine.key, note) if note else None,
        offered=verbs.offered,
        now=datetime.now(UTC),
        state_word=state_word,
        band=lambda row: band_picture(
            row.stream.last_deviation,
            row.parameters,
            None,
            None if row.stream.last_deviation is None else row.average,  # a mark on the target would pass for a reading
        ),
        next_event=lambda row: next_event(row.outlook),
        wording=alarm_wording,
        outcomes=outcomes,
        reactions=Reactions(session),
        address=address,
    )
    if at.device is not None:
        _keep(answer, request.cookies[STATION_COOKIE], settings)
    return answer


@router.get("/{machine}/alarms/{number}")
def ask_alarm(
    request: Request,
    session: SessionDep,
    at: Station,
    machine: str,
    number: int,
    action: Annotated[str, Query(max_length=40)] = "",
) -> Response:
    """The second touch at an alarm. One that is acknowledged meanwhile leads back."""
    at.must_act()
    row = queries.alarm_of_machine(session, machine, number)
    if row.alarm.acknowledged_at is not None:
        return RedirectResponse(address(f"/station/{machine}", late=number), 303)
    return _ask_alarm(request, session, at, row, action)


def _ask_alarm(
    request: Request,
    session: Session,
    at: AtStation,
    row: AlarmRow,
    action: str,
    form: Mapping[str, str] = NO_FORM,
    error: InbandError | None = None,
) -> Response:
    if action not in alarm_wording.offered(row):
        raise NotFound(_("There is nothing at this address."), _("Go back to the station of the machine."))
    return page(
        request,
        "station/ask_alarm.html",
        refusal=error,
        machine=row.machine,
        row=row,
        action=action,
        **asked(session, at, form, error),
        wording=alarm_wording,
        reactions=Reactions(session),
        address=address,
    )


@router.post("/{machine}/alarms/{number}")
def acknowledge(
    request: Request, session: SessionDep, at: Station, machine: str, number: int, form: FormDep
) -> Response:
    """Acknowledge the alarm. Sent twice, or after someone else, it changes nothing and says so."""
    row = queries.alarm_of_machine(session, machine, number)
    try:
        outcome = alarm_verbs.acknowledge(session, number, form, who(request, session, at, form))
    except REFUSED as error:
        return _ask_alarm(request, session, at, row, form.get("action", ""), form, error)
    return RedirectResponse(address(f"/station/{machine}", **{outcome.kind: number}), 303)


@router.get("/{machine}/tools/{number}/change")
def ask_tool(request: Request, session: SessionDep, at: Station, machine: str, number: int) -> Response:
    """The second touch of a tool change."""
    at.must_act()
    return _ask(request, at, CHANGE, OfTool(session, machine_named(session, machine), number, NOBODY))


@router.post("/{machine}/tools/{number}/change")
def change_tool(
    request: Request, session: SessionDep, at: Station, machine: str, number: int, form: FormDep
) -> Response:
    """Say that the tool was changed."""
    on = OfTool(session, machine_named(session, machine), number, NOBODY)
    try:
        carry_out(CHANGE, replace(on, caller=who(request, session, at, form)), form)
    except REFUSED as error:
        return _ask(request, at, CHANGE, on, form, error)
    return RedirectResponse(address(f"/station/{machine}", tool=number), 303)


@router.get("/{machine}/tools/{number}/corrections")
def ask_all(request: Request, session: SessionDep, at: Station, machine: str, number: int) -> Response:
    """The second touch before all that awaits approval for one tool is approved."""
    at.must_act()
    return _ask(request, at, APPROVE_ALL, Together(session, machine_named(session, machine), number, NOBODY))


@router.post("/{machine}/tools/{number}/corrections")
def approve_all(
    request: Request, session: SessionDep, at: Station, machine: str, number: int, form: FormDep
) -> Response:
    """Approve exactly those that were shown; if one of them was decided about meanwhile, none."""
    on = Together(session, machine_named(session, machine), number, NOBODY, shown_in(form))
    try:
        outcome = carry_out(APPROVE_ALL, replace(on, caller=who(request, session, at, form)), form)
    except REFUSED as error:
        return _ask(request, at, APPROVE_ALL, on, form, error)
    if outcome.kind == "late":
        return RedirectResponse(address(f"/station/{machine}", too_late="approve", n=on.decided.number), 303)
    return RedirectResponse(address(f"/station/{machine}", decided=APPROVE_ALL.name, n=number), 303)


@router.get("/{machine}/corrections/{number}")
def ask_correction(
    request: Request,
    session: SessionDep,
    at: Station,
    machine: str,
    number: int,
    do: Annotated[str, Query(max_length=40)] = "",
) -> Response:
    """The second touch at a correction that waits for a person, or for its place in the control. One that does not leads back."""
    at.must_act()
    return _ask_correction(request, at, OfCorrection(session, machine_named(session, machine), number, NOBODY), do)


def _ask_correction(
    request: Request,
    at: AtStation,
    on: OfCorrection,
    name: str,
    form: Mapping[str, str] = NO_FORM,
    error: InbandError | None = None,
) -> Response:
    status = on.row.correction.status
    if not verbs.offered(status):
        back = address(f"/station/{on.machine.key}", too_late=name or "approve", n=on.number)
        return RedirectResponse(back, 303)
    return _ask(
        request,
        at,
        named(verbs.offered(status), name, on, _("Go back to the station of the machine.")),
        on,
        form,
        error,
    )


@router.post("/{machine}/corrections/{number}")
def decide(request: Request, session: SessionDep, at: Station, machine: str, number: int, form: FormDep) -> Response:
    """Approve, release or reject a correction, or say that it is in the control. A person who comes too late sees the state now."""
    on = OfCorrection(session, machine_named(session, machine), number, NOBODY)
    verb = named(verbs.CORRECTION, form.get("do", ""), on, _("Go back to the station of the machine."))
    try:
        outcome = carry_out(verb, replace(on, caller=who(request, session, at, form)), form)
    except REFUSED as error:
        return _ask_correction(request, at, on, verb.name, form, error)
    if outcome.kind == "ask":
        return _ask_correction(request, at, on, verb.name, form)
    said = {"decided": verb.name} if outcome.kind == "done" else {"too_late": verb.name}
    return RedirectResponse(address(f"/station/{machine}", n=number, **said), 303)


def _ask(
    request: Request,
    at: AtStation,
    verb: Verb[Any, Any],
    on: OfTool | OfCorrection | Together,
    form: Mapping[str, str] = NO_FORM,
    error: InbandError | None = None,
) -> Response:
    where = {OfTool: f"tools/{on.number}/change", Together: f"tools/{on.number}/corrections"}.get(
        type(on), f"corrections/{on.number}"
    )
    return page(
        request,
        "station/ask.html",
        refusal=error,
        machine=on.machine,
        question=verb.question(on, f"/station/{on.machine.key}/{where}"),
        **asked(on.session, at, form, error),
    )


@router.get("/{machine}/note")
def ask_note(request: Request, session: SessionDep, at: Station, machine: str) -> Response:
    """The form of a note at the machine."""
    at.must_act()
    return _ask_note(request, session, at, machine)


def _ask_note(
    request: Request,
    session: Session,
    at: AtStation,
    key: str,
    form: Mapping[str, str] = NO_FORM,
    error: InbandError | None = None,
) -> Response:
    return page(
        request,
        "station/ask_note.html",
        refusal=error,
        machine=machine_named(session, key),
        key=token_hex(8),
        **asked(session, at, form, error),
    )


@router.post("/{machine}/note")
def write_note(request: Request, session: SessionDep, at: Station, machine: str, form: FormDep) -> Response:
    """Write a note at the machine; sent twice, it is one."""
    written = {"machine": machine, "text": form.get("text", ""), "key": form.get("key", "")}
    try:
        row = note_actions.write_note(session, typed(NoteIn, written), who(request, session, at, form)).row
    except (*REFUSED, Conflict) as error:
        return _ask_note(request, session, at, machine, form, error)
    return RedirectResponse(address(f"/station/{machine}", note=row.note.id), 303)


@router.get("/{machine}/events")
def events(
    request: Request,
    session: SessionDep,
    at: Station,
    machine: str,
    last_event_id: Annotated[str | None, Header()] = None,
    after: Annotated[int | None, Query(ge=0, le=LARGEST_ID)] = None,
) -> Response:
    """The live events of this machine, for its station."""
    cookie = STATION_COOKIE if at.device else SESSION_COOKIE
    token, role = request.cookies.get(cookie), at.caller.role if at.caller else None
    granted = Access(digest(token) if token else None, at.caller.key_id if at.caller else None, role)
    return stream(request, granted, machine_named(session, machine).key, last_event_id, after)


def _beginning_of(session: Session, machine: str, number: int) -> str | None:
    """The first words of a note of this machine."""
    row = notes.note(session, number)
    return beginning(row.note.text, 60) if row.machine.key == machine else None
