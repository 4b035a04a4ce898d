"""Page: the load by alarms."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from app.access.deps import require
from app.core import alarm_load as core
from app.core.period import Period
from app.loop.alarm_response.wording import kind_word
from app.loop.machines import queries as machines
from app.views.alarm_load import queries, wording
from app.web.choice import in_address, period_on_page
from app.web.deps import FROM_REPLICA, SessionDep, SettingsDep, Word
from app.web.paging import address
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])


@router.get("/alarms/load", dependencies=[require("viewer")])
def alarm_load_page(
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    period: Annotated[Period, Depends(period_on_page)],
    machine: Word = None,
) -> Response:
    """The load by alarms of each machine and the plant; the last 30 days where no period is named."""

    def link(**changes: str | None) -> str:
        return address("/alarms/load", **{"machine": machine or None, **in_address(period), **changes})

    return page(
        request,
        "alarms/load.html",
        load=queries.alarm_load(session, period, datetime.now(UTC), settings.bridge_silent_after, machine or None),
        period=period,
        link=link,
        machines=machines.machines(session),
        core=core,
        wording=wording,
        kind_word=kind_word,
    )
