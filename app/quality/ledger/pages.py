"""Page: what corrections of a machine were worth."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from app.access.deps import require
from app.core.period import Period
from app.loop.machines import queries as machines
from app.quality.ledger import queries
from app.quality.ledger.schemas import money_of
from app.web.choice import in_address, period_on_page
from app.web.deps import FROM_REPLICA, SessionDep, SettingsDep, Word
from app.web.paging import address
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])


@router.get("/ledger", dependencies=[require("viewer")])
def ledger_page(
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    period: Annotated[Period, Depends(period_on_page)],
    machine: Word = None,
) -> Response:
    """The ledger of one machine: of the first where none is named."""
    every = machines.machines(session)
    chosen = machines.machine_named(session, machine) if machine else next(iter(every), None)
    found = queries.ledger_of(session, chosen, period, datetime.now(UTC)) if chosen else None

    def link(**changes: str | None) -> str:
        return address("/ledger", **{"machine": machine, **in_address(period), **changes})

    return page(
        request,
        "ledger/ledger.html",
        ledger=found,
        machine=chosen,
        machines=every,
        period=period,
        weeks=queries.WEEKS,
        link=link,
        part_cost=settings.part_cost,
        currency=settings.currency,
        money_of=money_of,
    )
