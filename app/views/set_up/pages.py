"""Set-up pages: the overview, and the routers of its parts."""

from fastapi import APIRouter, Response
from starlette.responses import RedirectResponse

from app.access.deps import require
from app.views.set_up import (
    audit_pages,
    characteristic_pages,
    group_pages,
    job_pages,
    machine_pages,
    many_pages,
    notification_pages,
    people_pages,
    program_pages,
    reaction_pages,
    screen_pages,
    station_pages,
)

router = APIRouter(include_in_schema=False)


@router.get("/setup", dependencies=[require("viewer")])
def setup() -> Response:
    return RedirectResponse("/setup/characteristics", 303)


for part in (
    machine_pages,
    characteristic_pages,
    many_pages,
    program_pages,
    reaction_pages,
    people_pages,
    station_pages,
    screen_pages,
    notification_pages,
    group_pages,
    audit_pages,
    job_pages,
):
    router.routes += part.router.routes
