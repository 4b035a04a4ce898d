"""Pages: the signals of a characteristic, and one of them with its chart, where an engineer says what it was."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Viewer, require
from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.summaries import wording as statistics
from app.quality.chart_rules import wording as rules_wording
from app.quality.chart_signals import actions, queries
from app.quality.chart_signals import wording as words
from app.quality.chart_signals.queries import SignalRow, SignalState
from app.quality.chart_signals.schemas import CommentIn
from app.quality.chart_signals.wording import Cause
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.web.deps import Before, FormDep, SessionDep
from app.web.forms import parsed
from app.web.paging import address, part_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 30


@router.get("/characteristics/{characteristic}/signals", dependencies=[require("viewer")])
def signals_page(
    request: Request,
    session: SessionDep,
    characteristic: str,
    state: Annotated[SignalState, Query()] = "all",
    before: Before = None,
) -> Response:
    """List the signals, newest first."""
    current = characteristics.characteristic_named(session, characteristic)
    rows = queries.signals(
        session, characteristic=current.characteristic, state=state, before=before, limit=ON_PAGE + 1
    )
    link = partial(address, f"/characteristics/{characteristic}/signals")
    return page(
        request,
        "chart_signals/signals_page.html",
        characteristic=current.characteristic,
        machine=current.machine,
        part=part_of(rows, ON_PAGE, before, lambda row: row.signal.id, partial(link, state=state)),
        counts=queries.counts(session, current.characteristic),
        state=state,
        link=link,
        words=words,
        **_proof(),
    )


@router.get("/signals/{number}")
def signal_page(request: Request, session: SessionDep, caller: Viewer, number: int) -> Response:
    """One signal on its chart, and what it was."""
    return _signal(request, queries.signal(session, number), caller)


@router.post("/signals/{number}")
def explain(request: Request, session: SessionDep, caller: Engineer, number: int, form: FormDep) -> Response:
    """Say what it was."""
    try:
        comment = parsed(CommentIn, {"cause": form.get("cause"), "comment": form.get("comment", "").strip()})
        actions.explain(session, number, comment.cause, comment.comment, caller)
    except Invalid as error:
        return _signal(request, queries.signal(session, number), caller, form, error)
    return RedirectResponse(f"/signals/{number}", 303)


def _signal(
    request: Request,
    row: SignalRow,
    caller: Caller,
    form: Mapping[str, str] | None = None,
    error: Invalid | None = None,
) -> Response:
    data = words.data_of(row.signal)
    query = words.window(data) | {
        "chart": row.signal.chart,
        "baseline": row.signal.baseline_version,
        "signal": row.signal.id,
    }
    return page(
        request,
        "chart_signals/signal.html",
        refusal=error,
        row=row,
        data=data,
        chart=Chart(row.signal.chart),
        rule=RuleName(row.signal.rule),
        figure=f"/api/v1/characteristics/{row.characteristic.key}/figures/control?{urlencode(query)}",
        causes=[("", _("Choose what it was")), *((cause.value, words.cause(cause)) for cause in Cause)],
        form=form or {},
        words=words,
        rules=rules_wording,
        said=statistics,
        may_explain=caller.may("engineer"),
        **_proof(),
    )


def _proof() -> dict[str, Any]:
    failing = proof.failing()
    return {"proof_failing": failing, "proof_warning": proof_wording.warning(len(failing))}
