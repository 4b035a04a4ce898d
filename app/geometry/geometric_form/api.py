"""JSON routes: form measurements, their pictures, their trend."""

from typing import Annotated

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Caller, OperatorOrMachine
from app.errors import NotFound
from app.geometry.geometric_form import actions, figures, queries, wording
from app.geometry.geometric_form.answers import FormOut, form_out
from app.geometry.geometric_form.queries import FormRow
from app.geometry.geometric_form.schemas import FormIn, KindName
from app.language.i18n import _
from app.loop.machines.queries import machine_for, only_machine
from app.loop.timeline.queries import with_events_of_machine
from app.web.api import (
    FIGURE,
    After,
    Limit,
    MachineFilter,
    MachineKey,
    Theme,
    Width,
    api_router,
    chart_answer,
    problems,
    sent_again,
)
from app.web.deps import SessionDep
from app.web.fields import Page, ReasonIn, Slug, page_of

router = api_router("forms")
Number = Annotated[int, Path(description="Number of the measurement.", examples=[17])]


@router.post("/forms", status_code=201, responses=problems(404, 409) | sent_again(FormOut))
def measure_form(session: SessionDep, caller: OperatorOrMachine, body: FormIn, response: Response) -> FormOut:
    """Evaluate form or position of a feature from its touches.

    Answers the deviation by every method that applies, the verdict, the uncertainty from the probe's repeatability, and
    names touches that do not belong. Touches that carry no result (on one line, at one place, on too short an arc) are
    refused with the reason. With `characteristic` the result becomes a reading of it, so that control charts, alarms and
    reports work on it.
    """
    machine = machine_for(session, caller, body.machine, "operator")
    created = actions.measure_and_push(session, machine, body, caller)
    response.status_code = 200 if created.again else 201
    return _answer(session, created.row)


@router.get("/forms", responses=problems(404))
def list_forms(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineFilter = None,
    feature: Annotated[Slug | None, Query(description="Only of this feature.")] = None,
    kind: Annotated[KindName | None, Query(description="Only of this kind.")] = None,
    after: After = 0,
    limit: Limit = 100,
) -> Page[FormOut]:
    """Form measurements, oldest first, with what counts of each."""
    only = only_machine(session, caller, machine)
    rows = queries.forms(session, machine_id=only, feature=feature, kind=kind, after=after, limit=limit + 1)
    readings = queries.became(session, rows)
    return page_of([form_out(row, readings.get(row.measurement.id)) for row in rows], limit, lambda form: form.id)


@router.get("/forms/{number}", responses=problems(404))
def get_form_measurement(session: SessionDep, caller: AnyCaller, number: Number) -> FormOut:
    """One measurement with its touches and everything that was found."""
    return _answer(session, _seen(session, caller, number))


@router.post("/forms/{number}/recompute", status_code=201, responses=problems(404))
def recompute_form(session: SessionDep, caller: OperatorOrMachine, number: Number, body: ReasonIn) -> FormOut:
    """Evaluate the stored touches again by the present code; what was found before stays on record."""
    row = queries.form(session, number)
    caller.must_at(row.measurement.machine_id, "operator")
    return _answer(session, actions.recompute(session, number, body.reason, caller))


@router.get("/forms/{number}/figure", responses=problems(404) | FIGURE)
def form_figure(
    session: SessionDep,
    caller: AnyCaller,
    number: Number,
    section: Annotated[int, Query(ge=1, le=1000, description="Which section, for the picture of one.")] = 1,
    theme: Theme = "light",
) -> Response:
    """The picture as a Plotly figure: section round, axis, map of a surface, or profile; deviations exaggerated."""
    row = _seen(session, caller, number)
    measurement, evaluation = row.measurement, row.evaluation
    chart = figures.figure(
        measurement.kind, measurement.given, evaluation.result, measurement.tolerance, section=section
    )
    return chart_answer(chart, theme)


@router.get("/machines/{machine}/forms/{feature}/figure", responses=problems(404) | FIGURE)
def form_trend_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    feature: Annotated[Slug, Path(description="The key of the feature.", examples=["bore-d50-axis"])],
    kind: Annotated[KindName | None, Query(description="Only of this kind.")] = None,
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """The deviations of a feature over time as a Plotly figure, with tolerance and uncertainty."""
    machine_row = machine_for(session, caller, machine, "viewer")
    rows = queries.trend(session, machine_row, feature, kind)
    if not rows:
        raise NotFound(
            _("There is no form measurement of the feature {feature} on this machine.").format(feature=repr(feature)),
            _("GET /api/v1/forms lists what was measured."),
        )
    marks = [
        figures.Mark(
            row.measurement.measured_at,
            row.measurement.id,
            row.evaluation.value,
            row.evaluation.uncertainty,
            row.measurement.tolerance,
            row.evaluation.verdict,
            wording.verdict_word(row.evaluation.verdict),
            row.evaluation.suspects,
        )
        for row in rows
    ]
    return chart_answer(with_events_of_machine(session, machine_row, figures.trend(marks), width), theme)


def _seen(session: SessionDep, caller: Caller, number: int) -> FormRow:
    row = queries.form(session, number)
    caller.must_at(row.measurement.machine_id, "viewer")
    return row


def _answer(session: SessionDep, row: FormRow) -> FormOut:
    return form_out(row, queries.became(session, [row]).get(row.measurement.id))
