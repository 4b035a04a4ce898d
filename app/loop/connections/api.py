"""JSON routes: heartbeats of bridges, and the connections that they make."""

from datetime import timedelta

from fastapi import Request, Response

from app.access.deps import Admin, AnyCaller, OperatorOrMachine
from app.loop.connections import actions, queries
from app.loop.connections.queries import ConnectionRow
from app.loop.connections.schemas import ConnectionOut, HeartbeatIn, HeartbeatOut, ServerOut
from app.loop.connections.touch_tests.schemas import TouchTestOut
from app.loop.machines.queries import machine_for
from app.settings import Settings
from app.web.api import KeyAfter, Limit, MachineKey, api_router, problems
from app.web.deps import DoorSessionDep, SessionDep
from app.web.fields import Page, answer_from, page_of

router = api_router("connections")


@router.post("/machines/{machine}/heartbeat", responses=problems(404))
def take_heartbeat(
    request: Request, session: DoorSessionDep, caller: OperatorOrMachine, machine: MachineKey, heartbeat: HeartbeatIn
) -> HeartbeatOut:
    """A bridge says, every ten seconds, that it lives and the state of this machine. The answer tells where the
    server's database stands: one that was restored or has failed over may lack readings that it had stored; and which touch
    test is open.
    """
    settings: Settings = request.app.state.settings
    taken = actions.take_heartbeat(
        session,
        machine,
        heartbeat,
        caller,
        silent_after=settings.bridge_silent_after,
        backlog_after=settings.bridge_backlog_after,
    )
    return HeartbeatOut(
        received_at=taken.received_at,
        server=ServerOut(**taken.server._asdict()),
        touch_test=TouchTestOut.of(taken.touch_test) if taken.touch_test else None,
    )


@router.get("/connections")
def list_connections(
    request: Request, session: SessionDep, caller: AnyCaller, after: KeyAfter = "", limit: Limit = 100
) -> Page[ConnectionOut]:
    """The connection of every machine that has or had a bridge, by key; for the key of a machine, its own."""
    if caller.only_machine is None:
        caller.must("viewer")
    rows = queries.connections(session, after, limit + 1, caller.only_machine)
    return page_of([_out(request, row) for row in rows], limit, lambda connection: connection.machine)


@router.get("/machines/{machine}/connection", responses=problems(404))
def get_connection(request: Request, session: SessionDep, caller: AnyCaller, machine: MachineKey) -> ConnectionOut:
    """The connection of one machine."""
    return _out(request, queries.connection_of(session, machine_for(session, caller, machine, "viewer")))


@router.delete("/machines/{machine}/connection", status_code=204, responses=problems(404))
def remove_connection(session: SessionDep, caller: Admin, machine: MachineKey) -> Response:
    """Forget the connection of a machine that has no bridge any more, and end its alarms. Doing it twice is harmless; a
    bridge that still speaks makes it again.
    """
    actions.remove_connection(session, machine, caller)
    return Response(status_code=204)


def _out(request: Request, row: ConnectionRow) -> ConnectionOut:
    settings: Settings = request.app.state.settings
    return answer_from(
        ConnectionOut,
        row.connection,
        machine=row.machine.key,
        name=row.machine.name,
        silent=row.silent(timedelta(seconds=settings.bridge_silent_after)),
        age=round(row.age, 1),
        oldest_waiting=None if row.oldest_waiting is None else round(row.oldest_waiting, 1),
        backing_up=row.connection.backing_up_since is not None,
    )
