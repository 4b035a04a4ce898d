"""JSON routes: the keys of machines, and keys with a role."""

from typing import Annotated

from fastapi import Path, Query, Response

from app.machines import queries as machines
from app.people import actions, queries
from app.people.schemas import KeyOut, MachineKeyIn, NewKeyOut, RoleKeyIn, key_out
from app.web.api import api_router, problems
from app.web.deps import Admin, Engineer, SessionDep, require
from app.web.fields import LARGEST_SERIAL, Cursor, Limit, Page, page_of

router = api_router("keys")
MachineKey = Annotated[str, Path(description="The key of the machine.", examples=["lathe-1"])]
KeyId = Annotated[int, Path(ge=1, le=LARGEST_SERIAL, description="The number of the key.")]


@router.post("/machines/{machine}/keys", status_code=201, responses=problems(404))
def make_machine_key(session: SessionDep, caller: Engineer, machine: MachineKey, key: MachineKeyIn) -> NewKeyOut:
    """A key with which this machine pushes readings and handles its corrections. The secret is told this once."""
    found = machines.machine_named(session, machine)
    made = actions.add_key(session, name=key.name, machine=found.key, actor=caller.name)
    return NewKeyOut(id=made.id, name=key.name, secret=made.secret)


@router.get("/machines/{machine}/keys", dependencies=[require("engineer")], responses=problems(404))
def list_machine_keys(
    session: SessionDep,
    machine: MachineKey,
    after: Annotated[Cursor, Query()] = 0,
    limit: Annotated[Limit, Query()] = 100,
) -> Page[KeyOut]:
    """The keys of this machine, revoked ones too; never their secrets."""
    found = machines.machine_named(session, machine)
    rows = [key_out(key) for key in queries.machine_keys(session, found.id, after, limit + 1)]
    return page_of(rows, limit, lambda key: key.id)


@router.delete("/machines/{machine}/keys/{key}", status_code=204, responses=problems(404))
def revoke_machine_key(
    session: SessionDep,
    caller: Engineer,
    machine: MachineKey,
    key: KeyId,
) -> Response:
    """The key stops working within a second. Revoking twice is harmless."""
    found = machines.machine_named(session, machine)
    actions.revoke_key(session, key, caller.name, machine=found.key)
    return Response(status_code=204)


@router.get("/keys", dependencies=[require("admin")])
def list_keys(
    session: SessionDep, after: Annotated[Cursor, Query()] = 0, limit: Annotated[Limit, Query()] = 100
) -> Page[KeyOut]:
    """The keys with a role, revoked ones too; never their secrets."""
    rows = [key_out(key) for key in queries.role_keys(session, after, limit + 1)]
    return page_of(rows, limit, lambda key: key.id)


@router.post("/keys", status_code=201)
def make_key(session: SessionDep, caller: Admin, key: RoleKeyIn) -> NewKeyOut:
    """A key for a program, with a person's role. The secret is told this once."""
    made = actions.add_key(session, name=key.name, role=key.role, actor=caller.name)
    return NewKeyOut(id=made.id, name=key.name, secret=made.secret, role=key.role)


@router.delete("/keys/{key}", status_code=204, responses=problems(404))
def revoke_key(session: SessionDep, caller: Admin, key: KeyId) -> Response:
    """The key stops working within a second. Revoking twice is harmless."""
    actions.revoke_key(session, key, caller.name)
    return Response(status_code=204)
