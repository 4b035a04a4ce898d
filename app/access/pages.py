"""Pages: signing in and out, an invitation, one's own account."""

import logging
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access import actions, queries
from app.access.deps import AnyCaller, Caller
from app.access.identification import LONGEST_PIN, SHORTEST_PIN, remove_badges, set_pin
from app.access.passwords import SHORTEST
from app.access.sign_in import SignedIn, begin_session, sign_in, sign_out
from app.db.engine import Database
from app.errors import InbandError, Invalid, NotAllowed, TooManyRequests
from app.language.i18n import _
from app.web.deps import IN_TURN, SESSION_COOKIE, FormDep, SessionDep, SettingsDep, from_this_site, keep_cookie
from app.web.forms import by_field
from app.web.limits import FEW, takes
from app.web.problems import local_path
from app.web.templates import page

log = logging.getLogger(__name__)
router = APIRouter(include_in_schema=False)
FromThisSite = Depends(from_this_site)
DEVICE_COOKIE = "inband_device"
Next = Annotated[str, Query(alias="next", max_length=2000)]


def _with_session(answer: Response, signed_in: SignedIn, settings: SettingsDep) -> Response:
    keep_cookie(answer, settings, SESSION_COOKIE, signed_in.token, settings.session_hours * 3600)
    return answer


@router.get("/sign-in")
def sign_in_page(request: Request, session: SessionDep, after: Next = "/", ended: str = "") -> Response:
    token = request.cookies.get(SESSION_COOKIE)
    if token and queries.signed_in(session, token, {}):
        return RedirectResponse(local_path(after), 303)
    return page(
        request,
        "access/sign_in.html",
        after=local_path(after),
        name="",
        ended=actions.SessionEnded() if ended == "password" else None,
        anybody=queries.anybody(session),
    )


@router.post("/sign-in", dependencies=[FromThisSite, IN_TURN])
@takes(FEW, by="anybody")
def send_sign_in(request: Request, form: FormDep, settings: SettingsDep) -> Response:
    database: Database = request.app.state.database
    name, after = form.get("name", ""), local_path(form.get("next"))
    address = request.client.host if request.client else "unknown"
    device = request.cookies.get(DEVICE_COOKIE, "")
    try:
        signed_in = sign_in(database, name, form.get("password", ""), address, settings.session_hours, device)
    except InbandError as error:
        if isinstance(error, TooManyRequests):
            log.warning("sign-in from %s refused: too many have failed", address)
        else:
            with database.begin() as session:  # what is no name may be a password, typed in the wrong place
                known = queries.person_named(session, name.strip()) if name.isprintable() else None
            log.warning("sign-in of %s from %s refused", known.name if known else "an unknown name", address)
        return page(
            request,
            "access/sign_in.html",
            refusal=error,
            after=after,
            name=name,
            ended=None,
            anybody=True,
        )
    log.info("%s signed in from %s", name.strip(), address)
    answer = _with_session(RedirectResponse(after, 303), signed_in, settings)
    if signed_in.device:
        kept = queries.PLACE_KEPT.total_seconds()
        keep_cookie(answer, settings, DEVICE_COOKIE, signed_in.device, kept, "/sign-in")
    return answer


@router.post("/sign-out")
def send_sign_out(request: Request, session: SessionDep, caller: AnyCaller) -> Response:
    if caller.kind != "person":
        raise NotAllowed(
            _("A key is not signed in, so it cannot be signed out."),
            _("Who wants to end it revokes it: Set-up, Keys, or the page of its machine."),
        )
    sign_out(session, request.cookies.get(SESSION_COOKIE, ""), caller.name)
    answer = RedirectResponse("/sign-in", 303)
    answer.delete_cookie(SESSION_COOKIE, httponly=True, samesite="lax")
    return answer


@router.get("/invitation/{token}")
def invitation_page(request: Request, session: SessionDep, token: str) -> Response:
    invitation = queries.open_invitation(session, token)
    return page(
        request,
        "access/invitation.html",
        status=200 if invitation else 404,
        role=invitation.role if invitation else None,
        name="",
        shortest=SHORTEST,
    )


@router.post("/invitation/{token}", dependencies=[FromThisSite])
@takes(FEW, by="anybody")
def send_invitation(
    request: Request, session: SessionDep, form: FormDep, settings: SettingsDep, token: str
) -> Response:
    invitation = queries.open_invitation(session, token)
    try:
        if form.get("password", "") != form.get("again", ""):
            raise Invalid.at("again", _("Is not the same as the password above"))
        with session.begin_nested():  # a refused name must leave the invitation unused
            person = actions.accept_invitation(session, token, form.get("name", ""), form.get("password", ""))
    except InbandError as error:
        return page(
            request,
            "access/invitation.html",
            refusal=error,
            role=invitation.role if invitation else None,
            name=form.get("name", ""),
            shortest=SHORTEST,
        )
    signed_in = begin_session(session, person.id, settings.session_hours)
    return _with_session(RedirectResponse("/", 303), signed_in, settings)


@router.get("/account")
def account_page(request: Request, session: SessionDep, caller: AnyCaller, done: str = "") -> Response:
    return _account(request, session, caller, {}, done=done)


@router.post("/account/password")
def send_password(request: Request, session: SessionDep, caller: AnyCaller, form: FormDep) -> Response:
    errors: dict[str, str] = {}
    if form.get("new", "") != form.get("again", ""):
        errors = {"again": _("Is not the same as the new password")}
    else:
        try:
            token = request.cookies.get(SESSION_COOKIE)
            had_pin = actions.change_password(session, caller, form.get("old", ""), form.get("new", ""), token)
            if form.get("remove_badges") and caller.person_id is not None:
                remove_badges(session, caller.person_id, caller.name)
        except actions.SessionEnded:  # answered here, so that what was counted stays
            answer = RedirectResponse("/sign-in?ended=password", 303)
            answer.delete_cookie(SESSION_COOKIE, httponly=True, samesite="lax")
            return answer
        except InbandError as error:
            if not error.errors:
                raise
            errors = by_field(error)
        else:
            return RedirectResponse(f"/account?done={'password-pin' if had_pin else 'password'}", 303)
    session.commit()  # a wrong password is counted, although the page refuses
    return _account(request, session, caller, errors, status=422)


@router.post("/account/pin")
def send_pin(request: Request, session: SessionDep, caller: AnyCaller, form: FormDep) -> Response:
    """Set one's own PIN, or remove it."""
    pin = "" if form.get("remove") else form.get("pin", "")
    errors: dict[str, str] = {}
    if not pin and not form.get("remove"):
        errors = {"pin": _("Is missing")}
    else:
        try:
            set_pin(session, caller, form.get("password", ""), pin, request.cookies.get(SESSION_COOKIE))
        except actions.SessionEnded:  # answered here, so that what was counted stays
            answer = RedirectResponse("/sign-in?ended=password", 303)
            answer.delete_cookie(SESSION_COOKIE, httponly=True, samesite="lax")
            return answer
        except Invalid as error:
            errors = by_field(error)
        else:
            return RedirectResponse(f"/account?done={'pin' if pin else 'no-pin'}", 303)
    session.commit()  # a wrong password is counted, although the page refuses
    return _account(request, session, caller, errors, status=422)


def _account(
    request: Request, session: Session, caller: Caller, errors: dict[str, str], *, done: str = "", status: int = 200
) -> Response:
    return page(
        request,
        "access/account.html",
        status=status,
        me=caller,
        errors=errors,
        done=done,
        badges=queries.badges(session, caller.person_id) if caller.person_id is not None else 0,
        shortest=SHORTEST,
        pin_lengths=(SHORTEST_PIN, LONGEST_PIN),
    )
