"""Page: what needs attention first."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import require
from app.core.spc.capability import CAPABLE
from app.loop.machines import queries as machines
from app.quality.capability import wording as capability_wording
from app.quality.capability.pictures import stored_interval, trend
from app.quality.capability.queries import USUAL
from app.quality.proof.queries import failing
from app.quality.proof.wording import warning
from app.quality.wear.queries import next_event
from app.views.characteristic.glance import sparkline, tolerance_bar
from app.views.characteristic.state_queries import TREND
from app.views.characteristic.wording import state_word
from app.views.overview import queries, wording
from app.views.overview.queries import By, Ranked
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
    reverse: Annotated[bool, Query()] = False,
    part: Annotated[str | None, Query(max_length=128)] = None,
    after: Annotated[int, Query(ge=0, le=1_000_000)] = 0,
    q: Sought = "",
) -> Response:
    """Every characteristic ranked, one line each; of one part with the tolerance that each of its characteristics uses."""
    ranked = [
        each
        for each in queries.ranking(session, machine=machine or None, by=by, reverse=reverse)
        if (not part or each.row.characteristic.part == part) and holds(q, *_names(each))
    ]

    def link(**changes: object) -> str:
        """This page with something else chosen."""
        chosen = {
            "machine": machine or None,
            "part": part or None,
            "by": by.value if by is not By.ATTENTION else None,
            "reverse": "true" if reverse else None,
            "q": q or None,
        } | changes
        return address("/overview", **chosen)

    def sort_link(column: By) -> str:
        """This page sorted by a column; the other way round where it is already."""
        turn = column is by and not reverse
        return link(by=column.value if column is not By.ATTENTION else None, reverse="true" if turn else None)

    return page(
        request,
        "overview/overview.html",
        rows=slice_of(ranked, ON_PAGE, after, link),
        total=len(ranked),
        after=after,
        q=q,
        by=by,
        By=By,
        reverse=reverse,
        direction="descending" if by.largest_first != reverse else "ascending",
        part=part or "",
        machine=machine or "",
        machines=machines.machines(session),
        link=link,
        sort_link=sort_link,
        reasons=wording.reasons,
        state_word=state_word,
        next_event=next_event,
        capable=CAPABLE,
        alarm_flood=ALARM_FLOOD,
        last=USUAL,
        newest=TREND,
        interval=stored_interval,
        weekly=trend,
        spark=lambda row: sparkline(row.trend, row.parameters),
        used=lambda row: tolerance_bar(row.trend, row.parameters),
        capability_wording=capability_wording,
        now=datetime.now(UTC),
        proof_failing=failing(),
        proof_warning=warning(len(failing())),
    )


def _names(ranked: Ranked) -> tuple[str | None, ...]:
    characteristic = ranked.row.characteristic
    return characteristic.name, characteristic.key, characteristic.part, ranked.machine.name
