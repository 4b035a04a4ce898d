"""JSON routes: gauge studies."""

from typing import Annotated, Literal

from fastapi import Path, Query, Response

from app.access.deps import AnyCaller, Engineer, OperatorOrMachine
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import characteristic_for, characteristic_named
from app.loop.machines.queries import machine_for, machine_named
from app.quality.gauge_studies import actions, queries
from app.quality.gauge_studies.answers import StudyOut, study_out
from app.quality.gauge_studies.figures import figure_of
from app.quality.gauge_studies.schemas import CorrectionIn, FromReadingsIn, StudyIn
from app.web.api import FIGURE, Limit, Theme, api_router, chart_answer, problems, sent_again
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import LARGEST_ID, Page, page_of

router = api_router("gauges")
Number = Annotated[int, Path(description="Number of the study.", examples=[7])]
Revision = Annotated[int | None, Query(ge=1, description="Of this revision; of the newest if not said.")]


@router.post("/gauge-studies", status_code=201, responses=problems(404, 409) | sent_again(StudyOut))
def add_gauge_study(session: SessionDep, caller: OperatorOrMachine, given: StudyIn, response: Response) -> StudyOut:
    """Keep a gauge study with all its values, and answer what it says."""
    if given.machine is not None:
        machine = machine_for(session, caller, given.machine, "operator")
    elif given.characteristic is not None:
        machine = characteristic_for(session, caller, given.characteristic, "operator").machine
    else:
        raise Invalid.at("machine", _("name the machine, or a characteristic of it"))
    result = actions.add_study(session, machine, given, caller)
    response.status_code = 200 if result.again else 201
    return study_out(result.row, queries.advice(session, result.row))


@router.post("/gauge-studies/from-readings", status_code=201, responses=problems(404, 409) | sent_again(StudyOut))
def take_gauge_study(
    session: SessionDep, caller: OperatorOrMachine, given: FromReadingsIn, response: Response
) -> StudyOut:
    """Make a gauge study of stored readings: one part probed again and again, or the repeats of each touch.

    Excluded readings are left out. The values are copied: what becomes of the readings later does not change the study.
    """
    current = characteristic_for(session, caller, given.characteristic, "operator")
    result = actions.take_study(session, current, given, caller)
    response.status_code = 200 if result.again else 201
    return study_out(result.row, queries.advice(session, result.row))


@router.get("/gauge-studies", responses=problems(404))
def list_gauge_studies(
    session: SessionDep,
    caller: AnyCaller,
    machine: Annotated[str | None, Query(description="Only of this machine.", max_length=64)] = None,
    characteristic: Annotated[str | None, Query(description="Only for this characteristic.", max_length=64)] = None,
    before: Annotated[
        int, Query(ge=0, le=LARGEST_ID, description="Cursor: the `next` of the page before; 0 for the first.")
    ] = 0,
    limit: Limit = 100,
) -> Page[StudyOut]:
    """Gauge studies, newest first."""
    chosen = None if characteristic is None else characteristic_named(session, characteristic)
    where = None if machine is None else machine_named(session, machine)
    for place in filter(None, (where, chosen.machine if chosen else None)):
        caller.must_at(place.id, "viewer")
    rows = queries.studies(
        session,
        machine_id=where.id if where else caller.only_machine,
        characteristic_id=chosen.characteristic.id if chosen else None,
        before=before or None,
        limit=limit + 1,
    )
    return page_of([study_out(row, None) for row in rows], limit, lambda made: made.id)


@router.get("/gauge-studies/{study}", responses=problems(404) | TAGGED)
@tagged
def get_gauge_study(session: SessionDep, caller: AnyCaller, study: Number, revision: Revision = None) -> StudyOut:
    """One study with what it says and what it suggests for R33."""
    row = queries.study(session, study, revision)
    caller.must_at(row.machine.id, "viewer")
    return study_out(row, queries.advice(session, row))


@router.put("/gauge-studies/{study}", responses=problems(404, 412))
@guarded(get_gauge_study, queries.hold_study)
def correct_gauge_study(session: SessionDep, caller: Engineer, study: Number, given: CorrectionIn) -> StudyOut:
    """Put a study right, with the reason: it becomes a new revision, the one before stays on record."""
    row = actions.correct_study(session, study, given, caller)
    return study_out(row, queries.advice(session, row))


@router.get("/gauge-studies/{study}/figure", responses=problems(404) | FIGURE, response_model=None)
def get_gauge_figure(
    session: SessionDep,
    caller: AnyCaller,
    study: Number,
    picture: Annotated[
        Literal["values", "components", "parts", "operators"],
        Query(description="The values themselves; of gauge R&R also its components, by part and by operator."),
    ] = "values",
    revision: Revision = None,
    theme: Theme = "light",
) -> Response:
    """Draw the results of the study as a chart."""
    row = queries.study(session, study, revision)
    caller.must_at(row.machine.id, "viewer")
    figure = figure_of(picture, row.study.kind, row.settings, row.revision.rows, row.evaluation)
    return chart_answer(figure, theme)
