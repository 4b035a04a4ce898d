"""Page: the control charts of a characteristic with its baselines."""

from functools import cached_property
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Header, Path, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Viewer
from app.core.context import ContextField
from app.core.spc.refusal import Reason as Why
from app.core.spc.refusal import Refused
from app.core.spc.rules import RuleName
from app.core.spc.shewhart import FEWEST_READINGS, Chart
from app.errors import InbandError
from app.jobs.queries import failures_of
from app.jobs.wording import with_job_words
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries import wording as statistics_wording
from app.quality.baselines import actions, queries, wording
from app.quality.baselines.draft_queries import suited
from app.quality.baselines.queries import Baseline
from app.quality.chart_rules import wording as rules_wording
from app.quality.chart_signals import queries as signals_queries
from app.quality.chart_signals import wording as signals_wording
from app.quality.chart_signals.queries import SignalRow
from app.quality.control_charts import charts
from app.quality.control_charts.answers import signals_out
from app.quality.control_charts.schemas import ChartSignalOut
from app.quality.control_charts.view import View
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.web.choice import Choice, ChosenOnPage
from app.web.deps import FormDep, SessionDep
from app.web.fields import LARGEST_SERIAL, Reason
from app.web.templates import page
from app.web.validation import checked

router = APIRouter(include_in_schema=False)

VERSIONS = 25  # baselines on the page
LISTED = 8  # signals of a chart
KEPT = 5  # open ones
Remembering = Literal["ewma", "moving_average", "cusum"]
Version = Annotated[int, Path(ge=1, le=LARGEST_SERIAL)]


class ControlPage:
    """Content of the page; each part is queried when the template comes to it."""

    def __init__(
        self,
        session: Session,
        current: CurrentCharacteristic,
        choice: Choice,
        chart: Chart | None,
        judge: Baseline | None,
    ) -> None:
        self._session, self._choice, self._chart = session, choice, chart
        self.current, self.judge = current, judge

    @cached_property
    def in_force(self) -> Baseline | None:
        return queries.baseline_in_force(self._session, self.current.characteristic)

    @cached_property
    def baselines(self) -> list[Baseline]:
        return list(queries.baselines(self._session, self.current.characteristic, limit=VERSIONS))

    @cached_property
    def kinds(self) -> list[Chart]:
        """The charts on the page: a pair, or one that remembers."""
        if self.judge is None:
            return []
        if self._chart is not None:
            return [self._chart]
        return [kind for kind in charts.kinds(self.judge) if kind not in charts.REMEMBERING]

    @cached_property
    def views(self) -> list[View]:
        if self.judge is None:
            return []
        window = statistics.window_of(self._session, self.current.characteristic, **self._choice._asdict())
        return [charts.view(self._session, self.current, self.judge, window, kind) for kind in self.kinds]

    @property
    def missing(self) -> str:
        """Sentence about the readings that are missing before a baseline can be frozen; empty where there are enough."""
        have = statistics.window_of(self._session, self.current.characteristic).newest
        if have >= FEWEST_READINGS:
            return ""
        return statistics_wording.refusal(Refused(Why.TOO_FEW_READINGS, have=have, needed=FEWEST_READINGS))

    @property
    def excluded_since(self) -> int:
        """Readings of the baseline that were taken out of the statistics after it was frozen."""
        return 0 if self.judge is None else queries.excluded_since(self._session, self.judge)

    @cached_property
    def kept(self) -> list[SignalRow]:
        """Signals that are not explained yet, newest first; one more than the page lists if there are more."""
        return signals_queries.signals(
            self._session, characteristic=self.current.characteristic, state="open", limit=KEPT + 1
        )

    @property
    def signals(self) -> list[tuple[View, int, list[ChartSignalOut]]]:
        """Of each chart how many signals there are, and the newest."""
        return [
            (
                view,
                sum(len(rows) for rows in view.signals.runs.values()) if view.signals else 0,
                signals_out(view, LISTED),
            )
            for view in self.views
        ]


@router.get("/characteristics/{characteristic}/control")
def control_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    characteristic: str,
    choice: ChosenOnPage,
    chart: Annotated[Remembering | None, Query()] = None,
    baseline: Annotated[int | None, Query(ge=1, le=LARGEST_SERIAL)] = None,
    by: Annotated[ContextField | Literal[""], Query()] = "",
    x_live_part: Annotated[str | None, Header()] = None,
) -> Response:
    """The control charts by the baseline in force, or by an older one to compare."""
    current = characteristics.characteristic_named(session, characteristic)
    return _control(request, session, caller, current, choice, chart, baseline, x_live_part, by=by or None)


def _control(
    request: Request,
    session: Session,
    caller: Caller,
    current: CurrentCharacteristic,
    choice: Choice,
    chart: str | None = None,
    version: int | None = None,
    part: str | None = None,
    *,
    by: ContextField | None = None,
    error: InbandError | None = None,
) -> Response:
    key = current.characteristic.key
    judge = (
        queries.baseline_in_force(session, current.characteristic)
        if version is None
        else queries.baseline_of(session, current.characteristic, version)
    )
    kind = Chart(chart) if chart and judge is not None and Chart(chart) in charts.kinds(judge) else None
    chosen = choice.query
    kept = choice.of_context | {"chart": kind and kind.value, "baseline": version, "by": by and by.value}
    offered = statistics.offered(session, current.characteristic) if part is None else {}

    def link(**changes: Any) -> str:
        """This page with something else chosen."""
        parameters = (chosen if not changes.keys() & {"last", "first", "from"} else {}) | kept
        values = {name: value for name, value in {**parameters, **changes}.items() if value is not None}
        return f"/characteristics/{key}/control?{urlencode(values)}"

    def figure(which: Chart | None) -> str:
        values = chosen | {"chart": which and which.value, "baseline": version, "by": by and by.value}
        query = {name: value for name, value in values.items() if value is not None}
        return f"/api/v1/characteristics/{key}/figures/control?{urlencode(query)}"

    return page(
        request,
        "control_charts/control.html",
        refusal=error,
        shown=ControlPage(session, current, choice, kind, judge),
        machine=current.machine,
        characteristic=current.characteristic,
        parameters=current.parameters,
        suits=suited(session, current) if part is None else None,
        choice=choice,
        kept=kept,
        of_context=statistics_wording.context_form(offered, choice.context, by),
        tool_since=statistics.tool_since(session, current.characteristic) if part is None else None,
        chart=kind,
        version=version,
        remembering=[kind for kind in charts.REMEMBERING if judge is not None and kind in charts.kinds(judge)],
        link=link,
        figure=figure,
        wording=wording,
        said=statistics_wording,
        rule_name=lambda name, kind: rules_wording.name_of(RuleName(name), kind),
        words=signals_wording,
        most_kept=KEPT,
        proof_failing=proof.failing(),
        proof_warning=proof_wording.warning(len(proof.failing())),
        failing=with_job_words(failures_of(session, current.machine.id, current.characteristic.id)),
        may_see_jobs=caller.may("engineer"),
        may_freeze=caller.may("engineer"),
        wanted=lambda name: part is None or part == name,
    )


@router.post("/characteristics/{characteristic}/control/baselines/{version}/{what}")
def change(
    request: Request,
    session: SessionDep,
    caller: Engineer,
    characteristic: str,
    version: Version,
    what: Literal["retire", "put-in-force"],
    form: FormDep,
) -> Response:
    """Retire the baseline in force, or go back to an older one."""
    current = characteristics.characteristic_named(session, characteristic)
    change = actions.retire if what == "retire" else actions.put_in_force
    try:
        with session.begin_nested():
            change(session, current, version, checked(Reason, form.get("reason", ""), "reason"), caller)
    except InbandError as error:
        if error.status not in (409, 422):
            raise
        return _control(request, session, caller, current, Choice(200), error=error)
    return RedirectResponse(f"/characteristics/{current.characteristic.key}/control", 303)
