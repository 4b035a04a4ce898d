"""`GET /api/v1/events`: what changes, as it changes."""

from typing import Annotated

from fastapi import Header, Query, Request
from starlette.responses import StreamingResponse

from app.access.deps import AnyCaller
from app.access.new_keys import digest
from app.web.api import api_router
from app.web.deps import SESSION_COOKIE
from app.web.fields import LARGEST_ID
from app.web.live import Access, stream

router = api_router("events")


@router.get(
    "/events",
    response_class=StreamingResponse,
    responses={
        200: {"content": {"text/event-stream": {"example": 'id: 17\nevent: reading\ndata: {"kind": "reading"}\n'}}}
    },
)
async def events(
    request: Request,
    caller: AnyCaller,
    last_event_id: Annotated[str | None, Header(description="Resume after this event.")] = None,
    after: Annotated[
        int | None, Query(ge=0, le=LARGEST_ID, description="The same, for programs that cannot set the header.")
    ] = None,
) -> StreamingResponse:
    """Server-sent events: reading, correction, alarm, tool, signal, work_zero and what else changes; `heartbeat` while all is quiet.

    Each carries what changed (machine, characteristic, numbers); look the thing itself up. Of many readings of one
    characteristic within a tenth of a second the last one is reported. `resync` means: more was missed than is kept.
    The stream ends when the key is revoked, the session ends, or the role of its owner changes.
    """
    if caller.only_machine is None:
        caller.must("viewer")
    token = request.cookies.get(SESSION_COOKIE, "")
    access = Access(digest(token) if caller.kind == "person" else None, caller.key_id, caller.role)
    return stream(request, access, caller.machine, last_event_id, after)
