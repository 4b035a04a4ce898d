"""Page: compared characteristics, versions, tools and periods."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.access.deps import require
from app.core.context import ContextField
from app.errors import InbandError
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.readings.wording import field_word
from app.loop.summaries.wording import context_words
from app.quality.capability import wording as capability
from app.views.compare.chart import row_of
from app.views.compare.series import MOST, Compared, SeriesBy, compared, tools_of
from app.web.choice import ChosenOnPage
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.fields import Moment
from app.web.paging import address
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA, require("viewer")])


@router.get("/compare")
def compare_page(
    request: Request,
    session: SessionDep,
    choice: ChosenOnPage,
    of: Annotated[list[str] | None, Query(max_length=12)] = None,
    by: SeriesBy = SeriesBy.CHARACTERISTIC,
    tool: Annotated[list[Moment] | None, Query(max_length=24)] = None,
    overlaid: bool = False,
    of_tolerance: bool = False,
    own_scale: bool = False,
) -> Response:
    """Choose what to compare, see it on one scale, with the statistics of each."""
    keys = list(dict.fromkeys(of or []))
    problem: InbandError | None = None
    rows, tools = [], []
    try:
        rows = [row_of(session, each) for each in compared(session, keys, by, choice, tool or ())]
        if by is SeriesBy.TOOL:
            currents = (characteristics.characteristic_named(session, key) for key in keys)
            tools = [each for current in currents for each in tools_of(session, current)]
    except InbandError as error:
        problem = error
    how = {"by": by.value, "overlaid": overlaid, "of_tolerance": of_tolerance, "own_scale": own_scale}
    said: dict[str, object] = {name: "true" if value is True else value for name, value in how.items() if value}
    if by is SeriesBy.TOOL:
        said["tool"] = [at.isoformat() for at in tool or ()]
    period = choice.query

    def link(**changes: object) -> str:
        """This page with something else chosen; None takes a choice away."""
        moved = {"last", "from", "to", "first", "through"} & set(changes)
        kept = choice.of_context if moved else period
        return _address("/compare", keys, {**said, **kept, **changes})

    return page(
        request,
        "compare/compare.html",
        refusal=problem,
        rows=rows,
        keys=keys,
        by=by.value,
        tools=[(each, _identity(each) in {_identity(row.compared) for row in rows}) for each in tools],
        bys=[
            (SeriesBy.CHARACTERISTIC.value, _("Characteristics")),
            (SeriesBy.VERSION.value, _("Versions of the parameters")),
            (SeriesBy.TOOL.value, _("Tools")),
            (SeriesBy.PERIOD.value, _("This period and the one before")),
            *((field.value, field_word(field)) for field in ContextField),
        ],
        how=how,
        kept={**said, "of": keys, **choice.of_context},
        choice=choice,
        only=context_words(choice.context),
        everywhere=_address("/compare", keys, {**said, **choice.of_range}),
        chart_url=_address("/api/v1/compare/figure", keys, {**said, **period}),
        link=link,
        known=characteristics.characteristics(session),
        most=MOST,
        capability=capability,
    )


def _identity(tool: Compared) -> tuple[int, datetime | None]:
    """The tool of a characteristic, however many readings it has by now."""
    return tool.current.characteristic.id, tool.began_at


def _address(path: str, keys: list[str], query: Mapping[str, object]) -> str:
    """A path with the keys, each as `of`, and what else is said."""
    return address(path, of=keys, **query)
