"""Pages of groups of receivers, who is on duty, and days off; for administrators."""

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Admin, Caller
from app.errors import Conflict, InbandError, Invalid
from app.language.i18n import _
from app.language.times import plant_shifts
from app.loop.notifications import calendar_actions, calendar_queries, group_actions, queries
from app.loop.notifications.calendar_schemas import CalendarIn
from app.loop.notifications.group_schemas import EVERY_DAY, GroupIn, GroupOut
from app.views.set_up.frame import setup_page
from app.web.deps import FormDep, SessionDep
from app.web.forms import by_field, of_lists, parsed, ticked_numbers

router = APIRouter(include_in_schema=False)
MOST_TURNS = 6


@router.get("/setup/notifications/groups/new")
def new_group(request: Request, session: SessionDep, caller: Admin) -> Response:
    return _group(request, session, caller, {}, None)


@router.post("/setup/notifications/groups/new")
def send_new_group(request: Request, session: SessionDep, caller: Admin, form: FormDep) -> Response:
    return _send(request, session, caller, form, None)


@router.get("/setup/notifications/groups/{group}")
def group_page(request: Request, session: SessionDep, caller: Admin, group: int) -> Response:
    return _group(request, session, caller, _fields(GroupOut.of(queries.group(session, group))), group)


@router.post("/setup/notifications/groups/{group}")
def send_group(request: Request, session: SessionDep, caller: Admin, group: int, form: FormDep) -> Response:
    row = queries.group(session, group)
    if form.get("do") == "delete":
        try:
            with session.begin_nested():
                group_actions.delete_group(session, group, caller)
        except Conflict as error:
            return _group(request, session, caller, _fields(GroupOut.of(row)), group, error)
        return RedirectResponse("/setup/notifications?done=deleted", 303)
    if len(row.rota) > MOST_TURNS:
        raise Conflict(_("This group has more turns than the form."), _("Change it by REST."))
    return _send(request, session, caller, form, group)


def _send(request: Request, session: Session, caller: Caller, form: Mapping[str, str], number: int | None) -> Response:
    try:
        given = parsed(GroupIn, _read(form))
        if number is None:
            group_actions.add_group(session, given, caller)
        else:
            group_actions.change_group(session, number, given, caller)
    except Invalid as error:
        return _group(request, session, caller, form, number, error)
    return RedirectResponse(f"/setup/notifications?done={'added' if number is None else 'changed'}", 303)


def _group(
    request: Request,
    session: Session,
    caller: Caller,
    form: Mapping[str, str],
    number: int | None,
    error: InbandError | None = None,
) -> Response:
    errors = by_field(error) if error else {}
    return setup_page(
        request,
        "notification_group.html",
        caller,
        "notifications",
        refusal=error,
        number=number,
        form=form,
        errors=errors,
        other_errors=of_lists(errors, {"members": _("Members"), "rota": _("Rota")}),
        fits=number is None or len(queries.group(session, number).rota) <= MOST_TURNS,
        receivers=queries.receivers(session),
        shifts=[("", _("By hours"))]
        + [(f"{each:%H:%M}", _("Shift from {time}").format(time=f"{each:%H:%M}")) for each in plant_shifts()],
        turns=range(1, MOST_TURNS + 1),
    )


def _read(form: Mapping[str, str]) -> dict[str, Any]:
    turns = []
    for at in range(1, MOST_TURNS + 1):
        whom = ticked_numbers(form, f"turn-{at}")
        if whom:
            names = ("shift", "begins", "ends", "first", "last")
            turn = {name: form.get(f"{name}-{at}", "").strip() or None for name in names}
            turns.append({"receivers": whom, "days": ticked_numbers(form, f"day-{at}") or EVERY_DAY} | turn)
    return {"name": form.get("name"), "members": ticked_numbers(form, "member"), "rota": turns}


def _fields(group: GroupOut) -> dict[str, str]:
    """The form of a stored group."""
    fields = {"name": group.name} | {f"member-{number}": "true" for number in group.members}
    for at, turn in enumerate(group.rota[:MOST_TURNS], 1):
        clocks = {"shift": turn.shift, "begins": turn.begins, "ends": turn.ends, "first": turn.first, "last": turn.last}
        fields |= {f"{name}-{at}": str(value or "") for name, value in clocks.items()}
        fields |= {f"turn-{at}-{number}": "true" for number in turn.receivers}
        fields |= {f"day-{at}-{day}": "true" for day in turn.days}
    return fields


# --- days off


@router.get("/setup/notifications/days-off")
def days_off_page(request: Request, session: SessionDep, caller: Admin) -> Response:
    row = calendar_queries.calendar(session)
    form = {"country": row.country or "", "subdivision": row.subdivision or "", "days": "\n".join(row.days)}
    return _days_off(request, caller, form)


@router.post("/setup/notifications/days-off")
def send_days_off(request: Request, session: SessionDep, caller: Admin, form: FormDep) -> Response:
    sent: dict[str, Any] = {name: form.get(name, "").strip() or None for name in ("country", "subdivision")}
    sent["days"] = form.get("days", "").replace(",", " ").split()
    try:
        calendar_actions.set_calendar(session, parsed(CalendarIn, sent), caller)
    except Invalid as error:
        return _days_off(request, caller, form, error)
    return RedirectResponse("/setup/notifications?done=changed#days-off", 303)


def _days_off(request: Request, caller: Caller, form: Mapping[str, str], error: Invalid | None = None) -> Response:
    known = calendar_queries.countries()
    errors = by_field(error) if error else {}
    return setup_page(
        request,
        "days_off.html",
        caller,
        "notifications",
        refusal=error,
        form=form,
        errors=errors,
        wrong_days=next((text for field, text in errors.items() if field.startswith("days")), None),
        countries=[("", _("No country"))] + [(code, calendar_queries.country_name(code)) for code in known],
        parts=sorted(known.get(form.get("country", ""), ())),
    )
