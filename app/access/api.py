"""JSON routes: people and invitations. For administrators."""

from typing import Annotated

from fastapi import Path

from app.access import actions, queries
from app.access.deps import Admin, AnyCaller, require
from app.access.schemas import InvitationIn, InvitationOut, PersonChange, PersonOut
from app.access.tables import Person
from app.errors import NotFound
from app.language.i18n import _
from app.web.api import Limit, SerialAfter, api_router, problems
from app.web.deps import AddressDep, SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import LARGEST_SERIAL, Page, page_of

router = api_router("people")
PersonId = Annotated[int, Path(ge=1, le=LARGEST_SERIAL, description="The person's number.")]


@router.get("/people", dependencies=[require("admin")])
def list_people(session: SessionDep, after: SerialAfter = 0, limit: Limit = 100) -> Page[PersonOut]:
    """Everybody who may or might sign in, the disabled too."""
    rows = [PersonOut.model_validate(row.person) for row in queries.people(session, after, limit + 1)]
    return page_of(rows, limit, lambda person: person.id)


@router.get("/people/me", responses=problems(404))
def get_me(session: SessionDep, caller: AnyCaller) -> PersonOut:
    """The person who is signed in; 404 for a key, which is no person."""
    return PersonOut.model_validate(_found(queries.person(session, caller.person_id or 0)))


@router.get("/people/{person}", dependencies=[require("admin")], responses=problems(404) | TAGGED)
@tagged
def get_person(session: SessionDep, person: PersonId) -> PersonOut:
    """One person."""
    return PersonOut.model_validate(_found(queries.person(session, person)))


@router.patch("/people/{person}", responses=problems(404, 409, 412))
@guarded(get_person, queries.hold_person)
def change_person(session: SessionDep, caller: Admin, person: PersonId, change: PersonChange) -> PersonOut:
    """Give another role, end or restore access. The last administrator cannot be lost: 409."""
    row = _found(queries.person(session, person))
    if change.disabled is not None:
        set_access = actions.disable_person if change.disabled else actions.enable_person
        row = set_access(session, person, caller.name)
    if change.role is not None:
        row = actions.change_role(session, person, change.role, caller.name)
    return PersonOut.model_validate(row)


@router.post("/people/invitations", status_code=201)
def invite_person(session: SessionDep, caller: Admin, address: AddressDep, invitation: InvitationIn) -> InvitationOut:
    """Make a one-time link with which somebody chooses a name and a password."""
    token = actions.create_invitation(session, invitation.role, caller.name)
    return InvitationOut(role=invitation.role, url=f"{address}/invitation/{token}")


def _found(person: Person | None) -> Person:
    if person is None:
        raise NotFound(_("There is no such person."), _("GET /api/v1/people lists everybody."))
    return person
