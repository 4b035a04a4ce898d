"""JSON routes: keys with a role."""

from typing import Annotated

from fastapi import Path, Response

from app.access import actions, queries
from app.access.deps import Admin, require
from app.access.schemas import KeyOut, NewKeyOut, RoleKeyIn, key_out
from app.web.api import Limit, SerialAfter, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import LARGEST_SERIAL, Page, page_of

router = api_router("keys")
KeyId = Annotated[int, Path(ge=1, le=LARGEST_SERIAL, description="The number of the key.")]


@router.get("/keys", dependencies=[require("admin")])
def list_keys(session: SessionDep, after: SerialAfter = 0, limit: Limit = 100) -> Page[KeyOut]:
    """The keys with a role, revoked ones too; never their secrets."""
    rows = [key_out(key) for key in queries.role_keys(session, after, limit + 1)]
    return page_of(rows, limit, lambda key: key.id)


@router.post("/keys", status_code=201)
def make_key(session: SessionDep, caller: Admin, key: RoleKeyIn) -> NewKeyOut:
    """A key for a program, with a person's role. The secret is shown only this once."""
    new_key = actions.add_key(session, name=key.name, role=key.role, actor=caller.name)
    return NewKeyOut(id=new_key.id, name=key.name, secret=new_key.secret, role=key.role)


@router.delete("/keys/{key}", status_code=204, responses=problems(404))
def revoke_key(session: SessionDep, caller: Admin, key: KeyId) -> Response:
    """The key stops working within a second. Revoking twice is harmless."""
    actions.revoke_key(session, key, caller.name)
    return Response(status_code=204)
