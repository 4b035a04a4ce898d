"""Page: one shift of the plant or of a machine."""

from datetime import UTC, datetime, timedelta
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import require
from app.errors import Invalid
from app.files.formats import cell_values, periods
from app.language.formatting import age
from app.language.times import begin_of_shift, plant_zone
from app.loop.alarm_response import wording
from app.loop.machines import queries as machines
from app.quality.wear.queries import next_event
from app.views.shift import queries
from app.web.deps import FROM_REPLICA, SessionDep, SettingsDep, Word
from app.web.paging import address
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])
ON_PAGE = 4
"""Lines of a list; what is more is named by its number, for the page fits a screen and a sheet."""


@router.get("/shift", dependencies=[require("viewer")])
def shift_page(
    request: Request,
    session: SessionDep,
    settings: SettingsDep,
    machine: Word = None,
    at: Annotated[str, Query(max_length=64)] = "",
) -> Response:
    """The shift in which a moment lies; the running one where none is named."""
    now = datetime.now(UTC)
    found = queries.shift(session, _moment(at) or now, now, machine or None)
    start, end = found.period.start, found.period.end
    assert start is not None
    assert end is not None
    return page(
        request,
        "shift/shift.html",
        shift=found,
        machines=machines.machines(session),
        back=address(
            "/shift", machine=machine, at=begin_of_shift(start.astimezone(UTC) - timedelta(microseconds=1)).isoformat()
        ),
        onward=None if found.running else address("/shift", machine=machine, at=end.isoformat()),
        entered="shifts" in settings.model_fields_set,
        shifts=settings.shifts.replace(",", ", "),
        wording=wording,
        most=ON_PAGE,
        age=lambda time: age(time.total_seconds()),
        next_event=next_event,
    )


def _moment(text: str) -> datetime | None:
    try:
        return periods.bound(text, plant_zone(), end=False)
    except cell_values.Unreadable as error:
        raise Invalid.at("at", str(error)) from None
