"""Pages: the results of a search, and everything measured on one part."""

from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import Viewer, require
from app.views.characteristic.glance import tolerance_bar
from app.views.search import parts, queries
from app.views.search.parts import Part, part_path
from app.views.search.readings import Filters, cursor_of
from app.views.search.readings_api import CURSOR
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.paging import Part as PageOfList
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])
ON_PAGE = 100


@router.get("/search")
def search_page(
    request: Request, session: SessionDep, caller: Viewer, q: Annotated[str, Query(max_length=128)] = ""
) -> Response:
    """Everything that bears the name, by kind: for browsers without scripts, and for those who press Enter."""
    clean = q.replace("\0", "")
    found = queries.hits(session, clean, caller)
    kinds = list(dict.fromkeys(hit.kind for hit in found))
    groups = [(kind, [hit for hit in found if hit.kind == kind]) for kind in kinds]
    return page(request, "search/results.html", q=clean, groups=groups)


@router.get("/parts", dependencies=[require("viewer")])
def part_page(
    request: Request,
    session: SessionDep,
    part: Annotated[Part | None, Query()] = None,
    after: Annotated[str | None, Query(pattern=CURSOR)] = None,
) -> Response:
    """Everything measured on a part, newest first; without a name the field to look for one."""
    if part is None:
        last = parts.last_measured(session)
        return page(request, "search/part.html", name=None, part=PageOfList([], None, None), last=last)
    rows = parts.measured(session, part, after, ON_PAGE + 1)
    shown = rows[:ON_PAGE]
    here = part_path(part)
    more = urlencode({"after": cursor_of(shown[-1].record, Filters())}) if len(rows) > ON_PAGE else None
    listed = PageOfList(shown, f"{here}&{more}" if more else None, here if after else None)
    return page(request, "search/part.html", name=part, part=listed, last=[], bar=tolerance_bar)


@router.get("/parts/{part:path}", dependencies=[require("viewer")])
def part_by_path(part: str) -> Response:
    """The same, for labels and bookmarks that say the name in the path."""
    return RedirectResponse(part_path(part), 308)
