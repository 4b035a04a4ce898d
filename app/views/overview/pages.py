"""Page: what needs attention first."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import require
from app.core.spc.capability import CAPABLE
from app.loop.machines import queries as machines
from app.quality.capability import wording as capability_wording
from app.quality.capability.queries import USUAL
from app.quality.proof.queries import failing
from app.quality.proof.wording import warning
from app.quality.wear.queries import next_event
from app.views.characteristic.wording import state_word
from app.views.overview import queries, wording
from app.views.overview.queries import By
from app.views.overview.ranking import ALARM_FLOOD
from app.web.deps import FROM_REPLICA, SessionDep, Sought
from app.web.paging import address, holds, slice_of
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA, require("viewer")])

ON_PAGE = 50


@router.get("/overview")
def overview_page(
    request: Request,
    session: SessionDep,
    machine: Annotated[str | None, Query()] = None,
    by: Annotated[By, Query()] = By.ATTENTION,
    after: Annotated[int, Query(ge=0, le=1_000_000)] = 0,
    q: Sought = "",
) -> Response:
    """Every characteristic ranked, with the reasons in words."""
    ranked = [
        each
        for each in queries.ranking(session, machine=machine or None, by=by)
        if holds(
            q,
            each.row.characteristic.name,
            each.row.characteristic.key,
            each.row.characteristic.part,
            each.machine.name,
        )
    ]

    def link(**changes: object) -> str:
        """This page with something else chosen."""
        chosen = {
            "machine": machine or None,
            "by": by.value if by is not By.ATTENTION else None,
            "q": q or None,
        } | changes
        return address("/overview", **chosen)

    return page(
        request,
        "overview/overview.html",
        part=slice_of(ranked, ON_PAGE, after, link),
        total=len(ranked),
        need=sum(1 for entry in ranked if entry.inputs.reasons),
        after=after,
        q=q,
        by=by.value,
        machine=machine or "",
        machines=machines.machines(session),
        link=link,
        reasons=wording.reasons,
        state_word=state_word,
        next_event=next_event,
        capable=CAPABLE,
        alarm_flood=ALARM_FLOOD,
        last=USUAL,
        capability_wording=capability_wording,
        now=datetime.now(UTC),
        proof_failing=failing(),
        proof_warning=warning(len(failing())),
    )
