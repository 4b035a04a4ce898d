"""Set-up pages for administrators: people, invitations, keys with a role."""

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access import actions, queries
from app.access.deps import Admin, Caller
from app.errors import InbandError, NotFound
from app.language.i18n import _
from app.views.set_up.frame import setup_page
from app.web.deps import AddressDep, FormDep, SessionDep

router = APIRouter(include_in_schema=False)
DONE = {"disable": "disabled", "enable": "enabled", "role": "role"}


def roles() -> list[tuple[str, str]]:
    """Each may also do what those before may."""
    return [
        ("viewer", _("Viewer: looks")),
        ("operator", _("Operator: acknowledges, applies corrections")),
        ("engineer", _("Engineer: sets up machines and parameters")),
        ("admin", _("Administrator: lets people in")),
    ]


@router.get("/setup/people")
def people_page(request: Request, session: SessionDep, caller: Admin) -> Response:
    return _people(request, session, caller)


@router.post("/setup/people/invitations")
def send_invitation(
    request: Request, session: SessionDep, caller: Admin, address: AddressDep, form: FormDep
) -> Response:
    """The answer shows the link, this once, so it is no redirect."""
    role = form.get("role", "")
    token = actions.create_invitation(session, role, caller.name)
    return _people(request, session, caller, link=f"{address}/invitation/{token}", link_role=role)


@router.post("/setup/people/invitations/{token_hash}/withdraw")
def send_withdraw(session: SessionDep, caller: Admin, token_hash: str) -> Response:
    try:
        digest = bytes.fromhex(token_hash)
    except ValueError:
        raise NotFound(_("There is no such invitation.")) from None
    actions.withdraw_invitation(session, digest, caller.name)
    return RedirectResponse("/setup/people?done=withdrawn", 303)


@router.post("/setup/people/keys")
def send_key(request: Request, session: SessionDep, caller: Admin, form: FormDep) -> Response:
    """The answer shows the secret, this once, so it is no redirect."""
    try:
        new_key = actions.add_role_key(session, name=form.get("name", ""), role=form.get("role", ""), actor=caller.name)
    except InbandError as error:
        return _people(request, session, caller, typed=form, refusal=error)
    return _people(request, session, caller, new_key=new_key)


@router.post("/setup/people/keys/{key}/revoke")
def send_revoke_key(session: SessionDep, caller: Admin, key: int) -> Response:
    actions.revoke_key(session, key, caller.name)
    return RedirectResponse("/setup/people?done=revoked", 303)


@router.post("/setup/people/{person}/password")
def send_new_password(request: Request, session: SessionDep, caller: Admin, person: int) -> Response:
    """The answer shows the password, this once, so it is no redirect."""
    return _people(request, session, caller, new_password=actions.reset_password(session, person, caller.name))


@router.post("/setup/people/{person}/{what}")
def send_person(
    request: Request, session: SessionDep, caller: Admin, person: int, what: str, form: FormDep
) -> Response:
    try:
        with session.begin_nested():
            if what == "disable":
                actions.disable_person(session, person, caller.name)
            elif what == "enable":
                actions.enable_person(session, person, caller.name)
            elif what == "role":
                actions.change_role(session, person, form.get("role", ""), caller.name)
            else:
                raise NotFound(_("There is nothing at this address."))
    except InbandError as error:
        if error.status == NotFound.status:
            raise
        return _people(request, session, caller, refusal=error)
    if person == caller.person_id and what != "enable":
        return RedirectResponse("/", 303)  # this page may not be theirs any more
    return RedirectResponse(f"/setup/people?done={DONE[what]}", 303)


def _people(
    request: Request,
    session: Session,
    caller: Caller,
    *,
    typed: Mapping[str, str] | None = None,
    **more: Any,
) -> Response:
    content: dict[str, Any] = {
        "link": None,
        "link_role": None,
        "new_key": None,
        "new_password": None,
    } | more
    return setup_page(
        request,
        "people.html",
        caller,
        "people",
        people=queries.people(session),
        invitations=queries.open_invitations(session),
        keys=[key for key in queries.role_keys(session) if key.revoked_at is None],
        roles=roles(),
        role_words={name: words.partition(":")[0] for name, words in roles()},
        typed=typed or {},
        **content,
    )
