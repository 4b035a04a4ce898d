"""Pages: one characteristic with its zone chart and decisions, and one of its readings.

The live parts of the page are fetched one by one (header `X-Live-Part`), so nothing is looked up that is not shown.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import cached_property
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Header, Path, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer
from app.core.context import ContextField
from app.core.parameters import BY_NAME
from app.core.probing import start_and_end
from app.core.variants import yielded_by
from app.errors import InbandError
from app.files.documents.content import Fact
from app.jobs.queries import failures_of
from app.jobs.wording import with_job_words
from app.loop.alarm_response.wording import action_word
from app.loop.calibration import queries as calibrations
from app.loop.characteristics import queries
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.wording import history, in_order, label, result_label, worded
from app.loop.control_plan import queries as control_plans
from app.loop.control_plan import wording as plan_words
from app.loop.control_plan.queries import Look
from app.loop.notes import queries as notes
from app.loop.notes.queries import NEWEST, NoteRow
from app.loop.readings import actions as readings
from app.loop.readings import queries as reading_queries
from app.loop.readings.by_hand.actions import measure_typed
from app.loop.readings.records import Entry
from app.loop.summaries import queries as statistics
from app.loop.summaries import wording as statistics_wording
from app.loop.summaries.queries import MOST_IN_HISTOGRAM, Window
from app.quality.wear import queries as wear
from app.quality.wear.queries import Wear
from app.quality.wear.wording import WearWords
from app.views.characteristic import chart
from app.views.characteristic import state_queries as plant
from app.views.characteristic.decisions import Decision, decision, decisions, version_of
from app.views.characteristic.figures import angle_of, residuals_of, touches_picture
from app.views.characteristic.figures_api import ResultName
from app.views.characteristic.glance import band_picture
from app.views.characteristic.wording import code_word, next_action, reading_link, result_short, state_word
from app.web.choice import Choice, ChosenOnPage
from app.web.deps import Before, FormDep, SessionDep
from app.web.fields import LARGEST_ID, Reason
from app.web.paging import part_of
from app.web.templates import page
from app.web.validation import checked

router = APIRouter(include_in_schema=False)

DECISIONS_ON_PAGE = 25  # decisions on a page
AROUND = 25  # readings on either side of one, in its own chart
VERSIONS = 50
Sequence_ = Annotated[int, Path(ge=1, le=LARGEST_ID, alias="sequence")]


class CharacteristicView:
    """Content of the page of a characteristic, each part queried when the template comes to it."""

    def __init__(
        self, session: Session, current: CurrentCharacteristic, choice: Choice, before: int | None, edge: str = "tool"
    ) -> None:
        self._session, self._choice, self._before, self._edge = session, choice, before, edge
        self.current = current
        self.now = datetime.now(UTC)

    @cached_property
    def row(self) -> plant.CharacteristicRow:
        return plant.row_of(self._session, self.current.machine.key, self.current.characteristic.key)

    @cached_property
    def empirical_value(self) -> float:
        return chart.empirical_value_of(self._session, self.current)

    @cached_property
    def last(self) -> dict[str, Any] | None:
        """The last reading, as it was answered: the one that the state is of."""
        entry = reading_queries.entry_of(self._session, self.current.characteristic.key)
        assert entry is not None
        found = plant.last_of(self._session, entry, self.row.stream)
        return reading_queries.answers(self._session, entry, found)[0] if found else None

    @cached_property
    def window(self) -> Window:
        return statistics.window_of(self._session, self.current.characteristic, **self._choice._asdict())

    @property
    def counted(self) -> Window:
        """The readings whose numbers are shown: of very many the last ones."""
        first = max(self.window.first, self.window.last - MOST_IN_HISTOGRAM + 1)
        return replace(self.window, first=first)

    @cached_property
    def facts(self) -> list[Fact]:
        """Numbers of the counted readings; with acceptance n of m parts and sections outside too, also of this tool."""
        session, characteristic = self._session, self.current.characteristic
        numbers = statistics.numbers_of(session, characteristic, self.counted)
        unworn = statistics.unworn_of(session, characteristic, self.counted, numbers)
        if self.current.parameters.accept_m == 1:
            return statistics_wording.facts(numbers, unworn=unworn)
        windows = self.counted, statistics.since_tool_change(session, characteristic)
        rejects, of_tool = (statistics.rejects_of(session, characteristic, window) for window in windows)
        return statistics_wording.facts(numbers, rejects, of_tool, unworn)

    @cached_property
    def wear(self) -> Wear:
        """Of the tool in the machine."""
        return wear.wear_of(self._session, self.current, wear.shown(self._session, self.current, self._edge))

    @cached_property
    def decisions(self) -> list[Decision]:
        of = self._choice.context
        return decisions(self._session, self.current, before=self._before, limit=DECISIONS_ON_PAGE + 1, context=of)

    @cached_property
    def plan(self) -> Look | None:
        """The control plan as it is kept; None where nothing is planned."""
        row = control_plans.plan_of(self._session, self.current)
        return control_plans.look(self._session, row, self.now) if row is not None and row.plan.asks else None

    @cached_property
    def missed(self) -> int:
        """Measurements of the plan that were missed in the last 30 days."""
        return control_plans.missed_lately(self._session, self.current.characteristic, self.now)[0]

    @property
    def notes(self) -> list[NoteRow]:
        return notes.notes(self._session, characteristic=self.current.characteristic, limit=NEWEST)

    @cached_property
    def history(self) -> list[Any]:
        versions = queries.versions(self._session, self.current.characteristic, limit=VERSIONS + 1)
        return history(versions)[:VERSIONS]


@router.get("/characteristics/{characteristic}")
def characteristic_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    characteristic: str,
    choice: ChosenOnPage,
    scale: Annotated[Literal["zones", "true", "time"], Query()] = "zones",
    before: Before = None,
    edge: Annotated[Literal["tool", "1000", "all"], Query()] = "tool",
    result: Annotated[ResultName | None, Query()] = None,
    by: Annotated[ContextField | Literal[""], Query()] = "",
    x_live_part: Annotated[str | None, Header()] = None,
) -> Response:
    """The zone chart, the numbers, the decisions and the parameters of one characteristic."""
    current = queries.characteristic_named(session, characteristic)
    path = f"/characteristics/{current.characteristic.key}"
    chosen = choice.query

    def link(**changes: Any) -> str:
        """This page with something else chosen."""
        unchanged = (chosen if not changes.keys() & {"last", "first", "from"} else choice.of_context) | {
            "by": by or None,
            "scale": scale,
            "edge": edge,
            "result": result,
        }
        values = {name: value for name, value in {**unchanged, **changes}.items() if value is not None}
        usual = {("scale", "zones"), ("edge", "tool")}
        return f"{path}?{urlencode({name: v for name, v in values.items() if (name, v) not in usual})}"

    yielded = yielded_by(current.parameters)
    drawn_result = result if result in yielded else next(iter(yielded), None)
    figure = "run" if scale == "time" else "zones"
    chart_query = chosen | ({} if scale == "time" else {"scale": scale}) | ({"by": by} if by else {})
    offered = statistics.offered(session, current.characteristic) if x_live_part is None else {}
    return page(
        request,
        "characteristics/characteristic.html",
        shown=CharacteristicView(session, current, choice, before, edge),
        edge=edge,
        wear_url=f"/api/v1{path}/figures/wear?{urlencode({'last': edge})}",
        wear_words=WearWords,
        plan_words=plan_words,
        wanted=lambda part: x_live_part is None or x_live_part == part,
        failing=with_job_words(failures_of(session, current.machine.id, current.characteristic.id)),
        may_see_jobs=caller.may("engineer"),
        characteristic=current.characteristic,
        machine=current.machine,
        parameters=current.parameters,
        travel=start_and_end(current.parameters),
        in_force=current.version,
        table=parameter_table(current.version.parameters),
        choice=choice,
        of_context=statistics_wording.context_form(offered, choice.context, by or None),
        tool_since=statistics.tool_since(session, current.characteristic) if x_live_part is None else None,
        scale=scale,
        result=result,
        before=before,
        decisions_of=lambda rows: part_of(
            rows, DECISIONS_ON_PAGE, before, lambda row: row.sequence, lambda **at: f"{link(**at)}#decisions"
        ),
        most=MOST_IN_HISTOGRAM,
        link=link,
        chart_url=f"/api/v1{path}/figures/{figure}?{urlencode(chart_query)}",
        results=[(result_short(name), link(result=name), name == drawn_result) for name in yielded],
        drawn_result=drawn_result and result_label(drawn_result),
        result_url=f"/api/v1{path}/figures/results?{urlencode(chosen | {'result': drawn_result})}",
        histogram_url=f"/api/v1{path}/figures/histogram?{urlencode(chosen)}",
        may_edit=caller.may("engineer"),
        state_word=state_word,
        next_action=next_action,
        action_word=action_word,
    )


def parameter_table(stored: Mapping[str, Any]) -> Sequence[tuple[str, str, str]]:
    """R number, name and value of every parameter that is set, in the order of the cycles."""
    ordered = in_order(stored)
    return [
        ((BY_NAME[name].r or "") if name in BY_NAME else "", label(name), worded(name, ordered))
        for name, value in ordered.items()
        if value is not None
    ]


@router.get("/characteristics/{characteristic}/readings/{sequence}")
def reading_page(
    request: Request, session: SessionDep, caller: Viewer, characteristic: str, sequence: Sequence_
) -> Response:
    """One reading: what was measured, what was decided, why, by which parameters, and what followed."""
    return _reading(request, session, caller, queries.characteristic_named(session, characteristic), sequence)


@router.get("/characteristics/{characteristic}/readings/{sequence}/panel")
def reading_panel(
    request: Request, session: SessionDep, caller: Viewer, characteristic: str, sequence: Sequence_
) -> Response:
    """One reading as a fragment, beside the cursor of a chart."""
    current = queries.characteristic_named(session, characteristic)
    return _reading(request, session, caller, current, sequence, template="characteristics/panel.html")


@router.post("/characteristics/{characteristic}/readings/{sequence}/by-hand")
def send_measured_by_hand(
    request: Request, session: SessionDep, caller: Operator, characteristic: str, sequence: Sequence_, form: FormDep
) -> Response:
    """Enter what was measured by hand on this part."""

    def measure(entry: Entry) -> None:
        measure_typed(session, entry, sequence, form, caller.name)

    return _done_to(measure, request, session, caller, characteristic, sequence, form)


@router.post("/characteristics/{characteristic}/readings/{sequence}/exclude")
def send_exclusion(
    request: Request, session: SessionDep, caller: Operator, characteristic: str, sequence: Sequence_, form: FormDep
) -> Response:
    """Take the reading out of the statistics."""

    def exclude(entry: Entry) -> None:
        reason = checked(Reason, form.get("reason", ""), "reason")
        readings.exclude(session, entry, sequence, caller.name, reason)

    return _done_to(exclude, request, session, caller, characteristic, sequence, form)


def _done_to(
    do: Callable[[Entry], None],
    request: Request,
    session: Session,
    caller: Caller,
    characteristic: str,
    sequence: int,
    form: Mapping[str, str],
) -> Response:
    """Do something to a reading; its page, with the refusal where there is one."""
    current = queries.characteristic_named(session, characteristic)
    try:
        do(reading_queries.entry_named(session, characteristic))
    except InbandError as error:
        if error.status == 404:
            raise
        session.expire_all()
        return _reading(request, session, caller, current, sequence, typed=form, refusal=error)
    return RedirectResponse(reading_link(characteristic, sequence), 303)


def _reading(
    request: Request,
    session: Session,
    caller: Caller,
    current: CurrentCharacteristic,
    sequence: int,
    *,
    template: str = "characteristics/reading.html",
    typed: Mapping[str, str] | None = None,
    refusal: InbandError | None = None,
) -> Response:
    shown_decision = decision(session, current, sequence)
    version = version_of(session, current, shown_decision.reading["parameters_version"])
    limits = queries.parameters_of(
        session, current.machine.id, current.characteristic.id, shown_decision.reading["parameters_version"]
    )
    newest = statistics.window_of(session, current.characteristic).newest
    key = current.characteristic.key
    points = [mean for mean in shown_decision.point_means if mean is not None] if shown_decision.believed else []
    around = {"first": max(1, sequence - AROUND), "through": min(newest, sequence + AROUND), "ringed": sequence}
    return page(
        request,
        template,
        refusal=refusal,
        decision=shown_decision,
        reading=shown_decision.reading,
        characteristic=current.characteristic,
        machine=current.machine,
        judged_by=version,
        origin=calibrations.origin(
            session, current.machine, limits.average_memory, shown_decision.reading["received_at"]
        )
        if "empirical_value" in shown_decision.reading["reason"]["notes"]
        else None,
        limits=limits,
        table=parameter_table(version.parameters),
        band=band_picture(
            shown_decision.reading["deviation"],
            limits,
            None,
            shown_decision.reading["average_after"] if limits.average_memory else None,
        ),
        newest=newest,
        older=reading_link(key, sequence - 1) if sequence > 1 else None,
        newer=reading_link(key, sequence + 1) if sequence < newest else None,
        chart_url=f"/api/v1/characteristics/{key}/figures/zones?{urlencode(around)}",
        may_exclude=caller.may("operator"),
        typed=typed or {},
        picture=touches_picture(limits, points) if points else None,
        residuals=residuals_of(limits, points) if points else [],
        sections=shown_decision.sections(limits),
        angle_of=angle_of,
        result_label=result_label,
        code_word=code_word,
        action_word=action_word,
    )
