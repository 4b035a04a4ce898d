"""JSON route: one search for all that has a name."""

from typing import Annotated

from fastapi import Query
from pydantic import BaseModel, Field

from app.access.deps import Viewer
from app.views.search import queries
from app.views.search.parts import Part
from app.web.api import api_router, problems
from app.web.deps import FROM_REPLICA, SessionDep

router = api_router("search", FROM_REPLICA)


class SearchHit(BaseModel):
    """Something that bears the name that was searched."""

    kind: Annotated[queries.Kind, Field(description="Kind of thing.")]
    key: Annotated[str, Field(description="What programs call it; of a part or a person its name, of a page its path.")]
    title: Annotated[str, Field(description="What people call it.")]
    path: Annotated[str, Field(description="Its page.")]


class SearchOut(BaseModel):
    """Results of a search: of each kind the best few; first what is called so, then what begins so, then the rest."""

    items: list[SearchHit]


@router.get("/search", responses=problems())
def search(
    session: SessionDep,
    caller: Viewer,
    q: Annotated[
        Part,
        Query(
            description="Words of a name, a number of a tool or an alarm, or how a part's name begins or ends.",
            examples=["shaft"],
        ),
    ],
) -> SearchOut:
    """Machines, characteristics, tools, alarms, parts and pages by their names, notes and help by their words, people (engineer: what they did; admin).

    Every word has to occur; blanks, hyphens, dots and Ø do not count, so that *bore 30* finds *Bore Ø30 H7* and *lathe1* finds
    *lathe-1*. Parts are found by their whole name, or by its first or last three letters or more among the newest half a million
    readings; *report* before a name finds the report of a characteristic.
    """
    return SearchOut.model_validate({"items": [hit._asdict() for hit in queries.hits(session, q, caller)]})
