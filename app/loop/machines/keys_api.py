"""JSON routes: the keys of a machine."""

from typing import Annotated

from fastapi import Path, Response

from app.access.deps import Engineer, require
from app.access.keys import add_key
from app.access.schemas import KeyOut, MachineKeyIn, NewKeyOut, key_out
from app.loop.machines import keys
from app.loop.machines import queries as machines
from app.web.api import Limit, MachineKey, SerialAfter, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import LARGEST_SERIAL, Page, page_of

router = api_router("keys")
KeyId = Annotated[int, Path(ge=1, le=LARGEST_SERIAL, description="The number of the key.")]


@router.post("/machines/{machine}/keys", status_code=201, responses=problems(404))
def make_machine_key(session: SessionDep, caller: Engineer, machine: MachineKey, key: MachineKeyIn) -> NewKeyOut:
    """A key with which this machine pushes readings and handles its corrections. The secret is shown only this once."""
    created = add_key(session, machine=machines.machine_named(session, machine).key, name=key.name, actor=caller.name)
    return NewKeyOut(id=created.id, name=key.name, secret=created.secret)


@router.get("/machines/{machine}/keys", dependencies=[require("engineer")], responses=problems(404))
def list_machine_keys(
    session: SessionDep,
    machine: MachineKey,
    after: SerialAfter = 0,
    limit: Limit = 100,
) -> Page[KeyOut]:
    """The keys of this machine, revoked ones too; never their secrets."""
    machine_row = machines.machine_named(session, machine)
    rows = [key_out(key) for key in keys.machine_keys(session, machine_row.id, after, limit + 1)]
    return page_of(rows, limit, lambda key: key.id)


@router.delete("/machines/{machine}/keys/{key}", status_code=204, responses=problems(404))
def revoke_machine_key(
    session: SessionDep,
    caller: Engineer,
    machine: MachineKey,
    key: KeyId,
) -> Response:
    """The key stops working within a second. Revoking twice is harmless."""
    keys.revoke_machine_key(session, machine, key, caller.name)
    return Response(status_code=204)
