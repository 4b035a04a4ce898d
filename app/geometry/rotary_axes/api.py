"""JSON routes: runs of the preset compensation, what they ask to enter, the kinematics of machines and its back-ups."""

from typing import Annotated, Literal

from fastapi import Path, Query, Response
from pydantic import StringConstraints

from app.access.deps import AnyCaller, Caller, Engineer, Operator, OperatorOrMachine
from app.errors import Invalid
from app.geometry.rotary_axes import actions, figures, queries, run_history
from app.geometry.rotary_axes.answers import RecomputedOut, RunOut, axis_out, run_out
from app.geometry.rotary_axes.control_results import protocol_apart
from app.geometry.rotary_axes.drift import drift
from app.geometry.rotary_axes.drift_answers import (
    BackupOut,
    ComparisonOut,
    MachineKinematicsOut,
    backup_out,
    changes_out,
    machine_state,
)
from app.geometry.rotary_axes.result_values import UNITS
from app.geometry.rotary_axes.schemas import EnterIn, KinematicsPlanIn, RestoreIn, RunIn
from app.language.i18n import _
from app.loop.machines.queries import hold_machine, machine_for, machine_named, only_machine
from app.loop.readings import results_actions as readings
from app.loop.timeline.queries import with_events_of_machine
from app.web.api import (
    FIGURE,
    After,
    Limit,
    MachineKey,
    SerialAfter,
    Theme,
    Width,
    api_router,
    chart_answer,
    problems,
    sent_again,
)
from app.web.deps import SessionDep, SettingsDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import Page, ReasonIn, Text200, page_of

router = api_router("kinematics")
RunNumber = Annotated[int, Path(description="Number of the run.", examples=[118])]
Version = Annotated[int, Path(description="Version of the kinematics.", examples=[3])]
Other = Annotated[int, Query(alias="with", ge=1, le=2**63 - 1, description="Number of the other run.", examples=[97])]
HeadName = Annotated[str, StringConstraints(strip_whitespace=True, max_length=64, pattern=r"^[^\x00-\x1f]*$")]


# --- runs


@router.post("/kinematics/runs", status_code=201, responses=problems(404, 409) | sent_again(RunOut))
def take_kinematics_run(
    session: SessionDep, caller: OperatorOrMachine, body: RunIn, response: Response, settings: SettingsDep
) -> RunOut:
    """Take a run of cycle 452: ball touches or centres (`axes`, `shift`), result parameters, or the control's protocol.

    A ball further off than maxDevCalBall makes a refused run: that is kept, and counts for nothing. A change larger than
    maxModification, and one with `warnings` (an axis further off than is plausible on this machine), waits to be confirmed
    (`"status": "to_confirm"`). What of a protocol was not understood is answered.
    """
    machine_for(session, caller, body.machine, "operator")
    session.commit()  # nothing is kept open while a protocol is read
    protocol = protocol_apart(body.protocol, settings.rotary_words)
    with readings.pushing(session) as own:
        machine = machine_for(own, caller, body.machine, "operator")
        created = actions.take(own, machine, body, caller, protocol)
    response.status_code = 200 if created.again else 201
    return run_out(queries.run(session, created.row.run.id))


@router.get("/kinematics/runs", responses=problems(404))
def list_kinematics_runs(
    session: SessionDep,
    caller: AnyCaller,
    machine: Annotated[str | None, Query(max_length=64, description="Only of this machine.")] = None,
    head: Annotated[Text200 | None, Query(max_length=64, description="Only with this head.")] = None,
    after: After = 0,
    limit: Limit = 100,
) -> Page[RunOut]:
    """Runs, oldest first, refused ones too."""
    only = only_machine(session, caller, machine)
    rows = queries.runs(session, only, head=head, after=after, limit=limit + 1)
    return page_of([run_out(row) for row in rows], limit, lambda answer: answer.run)


@router.get("/kinematics/runs/{run}", responses=problems(404))
def get_kinematics_run(session: SessionDep, caller: AnyCaller, run: RunNumber) -> RunOut:
    """One run."""
    return run_out(_run(session, caller, run))


def _run(session: SessionDep, caller: Caller, run: int) -> queries.RunRow:
    row = queries.run(session, run)
    caller.must_at(row.machine.id, "viewer")
    return row


@router.post("/kinematics/runs/{run}/confirm", responses=problems(404, 409))
def confirm_kinematics_run(session: SessionDep, caller: Operator, run: RunNumber, body: ReasonIn) -> RunOut:
    """A change larger than maxModification is meant, or its warnings are seen and it is right.

    409 where nothing is to be confirmed; says who was first.
    """
    return run_out(actions.confirm(session, run, body.reason, caller))


@router.post("/kinematics/runs/{run}/acknowledge", responses=problems(404, 409))
def acknowledge_kinematics_run(session: SessionDep, caller: Operator, run: RunNumber, body: ReasonIn) -> RunOut:
    """Acknowledge the warnings of a run; the same as `confirm`."""
    return run_out(actions.confirm(session, run, body.reason, caller))


@router.post("/kinematics/runs/{run}/enter", responses=problems(404, 409))
def enter_kinematics_run(session: SessionDep, caller: Operator, run: RunNumber, body: EnterIn) -> RunOut:
    """Its position errors have been entered on the control. The kinematics before and after is backed up.

    409 for a run that was refused, has to be confirmed, was entered already, or was measured on another kinematics.
    """
    return run_out(actions.enter(session, run, body.reason, caller, offsets=body.offsets, at=body.at))


@router.post("/kinematics/runs/{run}/undo", responses=problems(404, 409))
def undo_kinematics_run(session: SessionDep, caller: Engineer, run: RunNumber, body: ReasonIn) -> RunOut:
    """Take back what was entered because of it: the kinematics before it is put back, as a new version.

    409 where it was not entered, was undone, or others were entered on top of it; says which.
    """
    return run_out(actions.undo(session, run, body.reason, caller))


@router.post("/kinematics/runs/{run}/recompute", responses=problems(404))
def recompute_kinematics_run(session: SessionDep, caller: OperatorOrMachine, run: RunNumber) -> RecomputedOut:
    """Evaluate it again from what was sent, and say whether that comes to what is on record; nothing is changed."""
    _run(session, caller, run)
    row, evaluated = actions.recompute(session, run)
    return RecomputedOut(
        run=run,
        same=run_history.same(row.run.results, evaluated.results),
        outcome=evaluated.outcome,
        axes=[axis_out(axis) for axis in evaluated.results["axes"]],
        offsets=evaluated.results["offsets"],
    )


@router.get("/kinematics/runs/{run}/comparison", responses=problems(404))
def compare_kinematics_runs(session: SessionDep, caller: AnyCaller, run: RunNumber, other: Other) -> ComparisonOut:
    """Compare two runs of a machine, whichever is older, with the values that the later asks to enter."""
    _run(session, caller, run)
    before, after = queries.two_runs(session, run, other)
    changes = run_history.changes(before, after)
    return ComparisonOut(
        machine=before.machine.key,
        before=before.run.id,
        after=after.run.id,
        changes=changes_out(changes, run_history.to_enter(after, offsets=True)),
    )


@router.get("/kinematics/runs/{run}/comparison-figure", responses=problems(404) | FIGURE)
def kinematics_comparison_figure(
    session: SessionDep, caller: AnyCaller, run: RunNumber, other: Other, theme: Theme = "light"
) -> Response:
    """The same as one picture: an arrow from then to now for every position error, and what to enter."""
    _run(session, caller, run)
    before, after = queries.two_runs(session, run, other)
    entered = run_history.to_enter(after)
    return chart_answer(figures.comparison(run_history.changes(before, after), entered), theme)


@router.get("/kinematics/runs/{run}/figure", responses=problems(404) | FIGURE)
def kinematics_run_figure(
    session: SessionDep,
    caller: AnyCaller,
    run: RunNumber,
    axis: Annotated[Literal["A", "B", "C"], Query(description="The axis.", examples=["C"])],
    letter: Annotated[Literal["X", "Y", "Z"], Query(description="The direction of the deviation.", examples=["Y"])],
    theme: Theme = "light",
) -> Response:
    """The deviation in one direction against the angle of the axis (EYC: Y against C), measured and optimised."""
    row = _run(session, caller, run)
    result = next((axis_result for axis_result in row.run.results["axes"] if axis_result["axis"] == axis), None)
    if result is None:
        raise Invalid.at("axis", _("run {run} did not measure axis {axis}").format(run=run, axis=axis))
    return chart_answer(figures.diagram(result, letter, height=figures.greatest(result)), theme)


# --- machines


@router.get("/machines/{machine}/kinematics", responses=problems(404) | TAGGED)
@tagged
def get_kinematics(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    head: Annotated[HeadName | None, Query(description="Drift with this head; else the reference head.")] = None,
) -> MachineKinematicsOut:
    """Return a machine's limits, its entered values, the drift of every value, and its heads compared."""
    machine_row = machine_for(session, caller, machine, "viewer")
    return machine_state(session, machine_row, head)


@router.put("/machines/{machine}/kinematics", responses=problems(404, 412))
@guarded(get_kinematics, hold_machine)
def plan_kinematics(
    session: SessionDep, caller: Engineer, machine: MachineKey, body: KinematicsPlanIn
) -> MachineKinematicsOut:
    """Set maxModification, maxDevCalBall, the ball, limits of the drift, and which values become readings.

    A value beyond its limit raises the alarm `kinematics_drift`; the next run inside it ends it.
    """
    machine_row = machine_named(session, machine)
    actions.set_plan(session, machine_row, body, caller)
    return machine_state(session, machine_row)


@router.get("/machines/{machine}/kinematics/drift-figure", responses=problems(404) | FIGURE)
def kinematics_drift_figure(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    value: Annotated[str, Query(max_length=20, description="EX0C, Q146, backlash.C …", examples=["EX0C"])],
    head: Annotated[HeadName, Query(description="With this head.")] = "",
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """A value over the runs with its limit, what has been entered, and the trend."""
    machine_row = machine_for(session, caller, machine, "viewer")
    if value not in UNITS:
        raise Invalid.at("value", _("there is no such value; there are EX0C, EY0C, EA0C, Q141 to Q149, backlash.C …"))
    limits = queries.plan(session, machine_row.id).limits
    course = drift(value, run_history.measured(session, machine_row, head), limits.get(value))
    return chart_answer(with_events_of_machine(session, machine_row, figures.course(course), width), theme)


@router.get("/machines/{machine}/kinematics/backups", responses=problems(404))
def list_kinematics_backups(
    session: SessionDep,
    caller: AnyCaller,
    machine: MachineKey,
    after: SerialAfter = 0,
    limit: Limit = 100,
) -> Page[BackupOut]:
    """Every kinematics that was in effect, oldest first, as cycle 450 keeps them."""
    machine_row = machine_for(session, caller, machine, "viewer")
    rows = queries.backups(session, machine_row.id, after=after, limit=limit + 1)
    return page_of([backup_out(row) for row in rows], limit, lambda answer: answer.version)


@router.post("/machines/{machine}/kinematics/backups/{version}/restore", status_code=201, responses=problems(404, 409))
def restore_kinematics(
    session: SessionDep, caller: Engineer, machine: MachineKey, version: Version, body: RestoreIn
) -> BackupOut:
    """Put this kinematics back; that is a new version. 409 when it is in effect, or another than was seen."""
    machine_row = machine_named(session, machine)
    return backup_out(actions.restore(session, machine_row, version, body.reason, caller, instead_of=body.instead_of))
