"""Pages of notifications: receivers, routes and deliveries for administrators; one's own mail address and browsers."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Admin, Caller, Viewer
from app.errors import Conflict, InbandError, Invalid
from app.language.i18n import _
from app.language.times import local
from app.loop.alarms.kinds import kinds
from app.loop.notifications import actions, browser_actions, queries
from app.loop.notifications.calendar_queries import coming
from app.loop.notifications.failing_wording import what_to_look_at
from app.loop.notifications.schemas import OwnAddressIn, OwnBrowserIn, ReceiverIn, RouteIn, shown_address
from app.loop.notifications.wording import (
    changes_word,
    delivery_word,
    group_words,
    means_word,
    on_duty_word,
    tones,
    when,
)
from app.views.set_up.frame import setup_page
from app.web.deps import Before, FormDep, SessionDep, SettingsDep, get_settings
from app.web.forms import by_field, of_lists, parsed, ticked, ticked_numbers, whole
from app.web.paging import address, part_of
from app.web.states import word_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 50
MOST_STEPS = 3
EVERY_DAY = range(1, 8)
STEP_PARTS = {"step": "receivers", "group": "groups", "duty": "on_duty"}
"""Ticks of a step in the form, and what they are in its schema."""


@router.get("/setup/notifications")
def notifications_page(
    request: Request, session: SessionDep, caller: Admin, before: Before = None, show: str = ""
) -> Response:
    return _overview(request, session, caller, before=before, everything=show == "all")


@router.post("/setup/notifications/receivers")
def send_receiver(
    request: Request, session: SessionDep, caller: Admin, settings: SettingsDep, form: FormDep
) -> Response:
    """Add a receiver. The answer shows the secret of a webhook, this once, so it is no redirect then."""
    try:
        given = parsed(
            ReceiverIn,
            {name: form.get(name, "").strip() for name in ("name", "means", "address")}
            | {"quiet": _hours(form, "quiet", EVERY_DAY), "events": ticked(form, "events")},
        )
        row = actions.add_receiver(session, given, caller, settings)
    except InbandError as error:
        return _overview(request, session, caller, typed=form, error=error)
    if row.secret is None:
        return RedirectResponse("/setup/notifications?done=added", 303)
    return _overview(request, session, caller, secret={"name": row.name, "secret": row.secret})


@router.post("/setup/notifications/receivers/{receiver}/test")
def send_test(session: SessionDep, caller: Admin, receiver: int) -> Response:
    actions.ask_for_test(session, receiver, caller)
    return RedirectResponse("/setup/notifications?done=test-sent#deliveries", 303)


@router.post("/setup/notifications/receivers/{receiver}/delete")
def send_delete_receiver(request: Request, session: SessionDep, caller: Admin, receiver: int) -> Response:
    try:
        with session.begin_nested():
            actions.delete_receiver(session, receiver, caller)
    except InbandError as error:
        if error.status == 404:
            raise
        return _overview(request, session, caller, error=error)
    return RedirectResponse("/setup/notifications?done=deleted", 303)


def _overview(
    request: Request,
    session: Session,
    caller: Caller,
    *,
    before: int | None = None,
    everything: bool = False,
    typed: Mapping[str, str] | None = None,
    error: InbandError | None = None,
    secret: Mapping[str, str] | None = None,
) -> Response:
    rows = queries.deliveries(session, before=before, limit=ON_PAGE + 1, taken_changes=everything)
    here = partial(address, "/setup/notifications", show="all" if everything else None)
    receivers = queries.receivers(session)
    names, groups = {row.id: row.name for row in receivers}, queries.groups(session)
    of_groups, now = {row.id: row.name for row in groups}, datetime.now(UTC)
    return setup_page(
        request,
        "notifications.html",
        caller,
        "notifications",
        refusal=error,
        receivers=receivers,
        routes=[(row, _summary(row.rule, names, of_groups)) for row in queries.routes(session)],
        groups=[(row, *group_words(row, names, now)) for row in groups],
        coming=coming(session, local(now).date(), get_settings(request)).days,
        part=part_of(rows, ON_PAGE, before, lambda row: row.delivery.id, here),
        everything=everything,
        typed=typed or {},
        secret=secret,
        means=[(name, means_word(name)) for name in ("mail", "webhook", "apprise")],
        means_word=means_word,
        changes=[(name, changes_word(name)) for name in ("alarm", "reading", "correction", "tool")],
        delivery_word=delivery_word,
        shown_address=shown_address,
        what_to_look_at=what_to_look_at,
    )


def _summary(rule: Mapping[str, Any], names: Mapping[int, str], groups: Mapping[int, str]) -> dict[str, str]:
    """A route in words: its alarms, its hours, its receivers."""
    alarms = [*map(word_of, rule["kinds"]), *map(dict(tones()).__getitem__, rule["tones"])]
    places = [*rule["machines"], *rule["characteristics"]]
    steps = []
    for step in rule["steps"]:
        parts = [names.get(number, str(number)) for number in step["receivers"]]
        parts += [groups.get(number, str(number)) for number in step.get("groups", ())]
        parts += [on_duty_word(groups.get(number, str(number))) for number in step.get("on_duty", ())]
        whom = ", ".join(parts)
        steps.append(_("after {n} min {names}").format(n=step["after"], names=whom) if step["after"] else whom)
    return {
        "alarms": ", ".join(alarms) or _("all"),
        "places": ", ".join(places) or _("all"),
        "when": "; ".join(map(when, rule["hours"])) or _("always"),
        "steps": "; ".join(steps),
    }


# --- routes


@router.get("/setup/notifications/routes/new")
def new_route(request: Request, session: SessionDep, caller: Admin) -> Response:
    return _route(request, session, caller, {"hold_off": "5", "enabled": "true", "on_days_off": "true"})


@router.post("/setup/notifications/routes/new")
def send_new_route(request: Request, session: SessionDep, caller: Admin, form: FormDep) -> Response:
    return _send_route(request, session, caller, form, None)


@router.get("/setup/notifications/routes/{route}")
def route_page(request: Request, session: SessionDep, caller: Admin, route: int) -> Response:
    row = queries.route(session, route)
    fields = _fields(row.rule) | {"name": row.name} | ({"enabled": "true"} if row.enabled else {})
    return _route(request, session, caller, fields, route, fits=_fits(row.rule))


@router.post("/setup/notifications/routes/{route}")
def send_route(request: Request, session: SessionDep, caller: Admin, route: int, form: FormDep) -> Response:
    if form.get("do") == "delete":
        actions.delete_route(session, route, caller)
        return RedirectResponse("/setup/notifications?done=deleted", 303)
    if not _fits(queries.route(session, route).rule):
        raise Conflict(_("This route has more steps or hours than the form."), _("Change it by REST."))
    return _send_route(request, session, caller, form, route)


def _send_route(
    request: Request, session: Session, caller: Caller, form: Mapping[str, str], number: int | None
) -> Response:
    try:
        given = parsed(RouteIn, _read(form))
        if number is None:
            actions.add_route(session, given, caller)
        else:
            actions.change_route(session, number, given, caller)
    except Invalid as error:
        return _route(request, session, caller, form, number, error)
    return RedirectResponse(f"/setup/notifications?done={'added' if number is None else 'changed'}", 303)


def _route(
    request: Request,
    session: Session,
    caller: Caller,
    form: Mapping[str, str],
    number: int | None = None,
    error: Invalid | None = None,
    *,
    fits: bool = True,
) -> Response:
    errors = by_field(error) if error else {}
    return setup_page(
        request,
        "notification_route.html",
        caller,
        "notifications",
        refusal=error,
        number=number,
        fits=fits,
        form=form,
        errors=errors,
        other_errors=of_lists(
            errors,
            {"steps": _("Steps"), "hours": _("Open"), "kinds": _("Kinds of alarms"), "tones": _("How urgent")},
        ),
        kinds=sorted(((kind.name, kind.word()) for kind in kinds()), key=lambda kind: kind[1]),
        tones=tones(),
        receivers=queries.receivers(session),
        groups=queries.groups(session),
        on_duty_word=on_duty_word,
        steps=range(1, MOST_STEPS + 1),
    )


def _read(form: Mapping[str, str]) -> dict[str, Any]:
    """The form of a route as the API has it."""
    flags = {name: form.get(name) == "true" for name in ("enabled", "on_days_off", "urgent")}
    minutes = {name: whole(form.get(name)) or 0 for name in ("repeat", "digest", "hold_off")}
    steps = [
        {"after": whole(form.get(f"after-{at}")) or 0} | chosen
        for at in range(1, MOST_STEPS + 1)
        if any((chosen := {name: ticked_numbers(form, f"{part}-{at}") for part, name in STEP_PARTS.items()}).values())
    ]
    return {
        "name": form.get("name"),
        "kinds": ticked(form, "kind"),
        "tones": ticked(form, "tone"),
        "machines": form.get("machines", "").replace(",", " ").split(),
        "characteristics": form.get("characteristics", "").replace(",", " ").split(),
        "hours": _hours(form, "hours", ticked_numbers(form, "day") or EVERY_DAY),
        "steps": steps,
        **flags,
        **minutes,
    }


def _fits(rule: Mapping[str, Any]) -> bool:
    """Tell if the form holds all of a route that came by REST."""
    return len(rule["hours"]) <= 1 and len(rule["steps"]) <= MOST_STEPS


def _fields(rule: Mapping[str, Any]) -> dict[str, str]:
    """The form of a stored route; of its hours the first."""
    fields = {name: str(rule[name]) for name in ("repeat", "digest", "hold_off")}
    fields |= {name: "true" for name in ("on_days_off", "urgent") if rule[name]}
    fields |= {f"kind-{each}": "true" for each in rule["kinds"]} | {f"tone-{each}": "true" for each in rule["tones"]}
    for hours in rule["hours"][:1]:
        fields |= {"hours-begins": hours["begins"], "hours-ends": hours["ends"]}
        fields |= {f"day-{day}": "true" for day in hours["days"]}
    for at, step in enumerate(rule["steps"][:MOST_STEPS], 1):
        fields |= {f"after-{at}": str(step["after"])} | {
            f"{part}-{at}-{each}": "true" for part, name in STEP_PARTS.items() for each in step.get(name, ())
        }
    names = {name: ", ".join(rule[name]) for name in ("machines", "characteristics")}
    return fields | names


def _hours(form: Mapping[str, str], name: str, days: Any) -> list[dict[str, Any]]:
    begins, ends = form.get(f"{name}-begins", "").strip()[:5], form.get(f"{name}-ends", "").strip()[:5]
    return [{"days": list(days), "begins": begins, "ends": ends}] if begins or ends else []


# --- one's own address and browsers


@router.get("/account/notifications")
def own_page(request: Request, session: SessionDep, caller: Viewer, done: str = "") -> Response:
    return _own(request, session, caller, None, done=done)


@router.post("/account/notifications")
def send_own(request: Request, session: SessionDep, caller: Viewer, settings: SettingsDep, form: FormDep) -> Response:
    try:
        with session.begin_nested():
            if form.get("do") == "delete":
                actions.delete_own(session, caller)
            else:
                sent = _pauses(session, form, caller, "mail")
                sent |= {"address": form.get("address", "").strip(), "shift_report": form.get("shift_report") == "true"}
                actions.set_own(session, parsed(OwnAddressIn, sent), caller, settings)
    except InbandError as error:
        if caller.person_id is None:
            raise
        return _own(request, session, caller, form, error=error)
    return RedirectResponse(f"/account/notifications?done={form.get('do') or 'saved'}", 303)


@router.post("/account/notifications/browser")
def send_own_browser(
    request: Request, session: SessionDep, caller: Viewer, settings: SettingsDep, form: FormDep
) -> Response:
    try:
        with session.begin_nested():
            if form.get("do") == "delete":
                browser_actions.delete_browser(session, caller)
            elif form.get("do") == "test":
                actions.ask_for_test(session, browser_actions.own_browser(session, caller).id, caller)
            else:
                given = parsed(OwnBrowserIn, _pauses(session, form, caller, "browser"))
                browser_actions.set_browser(session, caller, settings, given)
    except InbandError as error:
        if caller.person_id is None:
            raise
        return _own(request, session, caller, None, error=error, of_browser=form)
    done = {"delete": "no-browser", "test": "test"}.get(form.get("do", ""), "browser")
    return RedirectResponse(f"/account/notifications?done={done}#browser", 303)


def _own(
    request: Request,
    session: Session,
    caller: Caller,
    form: Mapping[str, str] | None,
    *,
    done: str = "",
    error: InbandError | None = None,
    of_browser: Mapping[str, str] | None = None,
) -> Response:
    """of_browser: the form of the browsers, which came back with an error."""
    row, browser = (queries.own(session, caller.person_id, each) for each in ("mail", "browser"))
    errors = by_field(error) if error else {}
    if form is None:
        form = _quiet(row.quiet if row else ()) | {
            "address": row.address if row else "",
            "shift_report": "true" if row and row.shift_report else "",
        }
    return page(
        request,
        "access/notifications.html",
        refusal=error,
        row=row,
        form=form,
        errors={} if of_browser is not None else errors,
        browser=browser,
        beyond=_beyond(row),
        browser_beyond=_beyond(browser),
        browser_form=_quiet(browser.quiet if browser else ()) if of_browser is None else of_browser,
        browser_errors={} if of_browser is None else errors,
        last=next(iter(queries.deliveries(session, receiver_id=browser.id, limit=1)), None) if browser else None,
        delivery_word=delivery_word,
        done=done,
    )


def _beyond(row: Any) -> dict[str, Any] | None:
    """All quiet hours of a receiver in words, and absence, where the form does not hold them: more than one, not every day, or a date."""
    if row is None:
        return None
    held = len(row.quiet) <= 1 and all(set(each["days"]) == set(EVERY_DAY) for each in row.quiet)
    away = row.away_until if row.away_until and row.away_until > datetime.now(UTC) else None
    return None if held and away is None else {"hours": [] if held else list(map(when, row.quiet)), "away": away}


def _quiet(stored: Sequence[Any]) -> dict[str, str]:
    """The quiet hours of a form: the first of those stored."""
    quiet = stored[0] if stored else {}
    return {f"quiet-{name}": quiet.get(name, "") for name in ("begins", "ends")}


def _pauses(session: Session, form: Mapping[str, str], caller: Caller, means: str) -> dict[str, Any]:
    """Quiet hours and absence. What was entered by REST and is more than the form holds stays, unless the form changes it."""
    row = queries.own(session, caller.person_id, means)
    if row is None:
        return {"quiet": _hours(form, "quiet", EVERY_DAY)}
    same = all(form.get(name, "") == value for name, value in _quiet(row.quiet).items())
    return {"quiet": row.quiet if same else _hours(form, "quiet", EVERY_DAY), "away_until": row.away_until}
