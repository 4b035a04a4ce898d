"""The kinematics of a machine, its back-ups and drift, and two runs compared, as they are answered. mm and degrees."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from app.geometry.rotary_axes import queries, run_history, wording
from app.geometry.rotary_axes.drift import Compared, Drift
from app.geometry.rotary_axes.result_values import UNITS
from app.geometry.rotary_axes.tables import KinematicsBackup, KinematicsPlan
from app.loop.tables.machines import Machine
from app.web.fields import answer_from


class BackupOut(BaseModel):
    """The kinematics as it was from one moment on. errors: what has been entered so far, by name."""

    version: Annotated[int, Field(description="Counts up from 1.")]
    head: Annotated[str | None, Field(description="The interchangeable head that it belongs to; null: none is named.")]
    at: Annotated[datetime, Field(description="When it was reported.")]
    since: Annotated[datetime, Field(description="Runs measured from then on were measured on it.")]
    by: str
    reason: str
    errors: Annotated[dict[str, float], Field(description="What has been entered so far, by name; mm and degrees.")]
    run: Annotated[int | None, Field(description="The run that led to it.")]
    restores: Annotated[int | None, Field(description="The version that was put back.")]


class DriftOut(BaseModel):
    """A value over the runs. true: with what had been entered by then; the slope, per day, is of that, without runs to be confirmed."""

    name: str
    unit: str
    limit: Annotated[float | None, Field(description="Largest that is permitted, in `unit`; null: not limited.")]
    beyond: Annotated[bool, Field(description="The last value lies beyond the limit.")]
    last: Annotated[float | None, Field(description="In the last run, in `unit`; null: there is none.")]
    true: Annotated[float | None, Field(description="The same with what had been entered by then.")]
    runs: Annotated[int, Field(description="Number of runs.")]
    slope_per_day: Annotated[
        float | None, Field(description="Of the line through the true values, `unit` a day; null: too few runs.")
    ]
    slope_low: Annotated[float | None, Field(description="Low end of its 95 % interval.")]
    slope_high: Annotated[float | None, Field(description="High end of its 95 % interval.")]
    text: str


class ChangeOut(BaseModel):
    """A value in two runs. moved: the difference is more than scatter; none where no run says how sure it is."""

    name: str
    words: Annotated[str, Field(description="The value in words.")]
    unit: str
    before: Annotated[float, Field(description="In the earlier run, in `unit`.")]
    after: Annotated[float, Field(description="In the later run, in `unit`.")]
    difference: Annotated[float, Field(description="Later less earlier, in `unit`.")]
    deviation: Annotated[
        float | None, Field(description="Standard deviation of the difference; null where no run says how sure it is.")
    ]
    moved: Annotated[bool | None, Field(description="It is more than scatter; null where no run says how sure it is.")]
    enter: Annotated[
        float | None,
        Field(
            description="What the later run asks to enter on the control; none once it was entered, or when it is not to be."
        ),
    ]


class HeadOut(BaseModel):
    """State of the axes with one of the heads, by its last run; changes: from the last run with the reference head."""

    head: Annotated[str | None, Field(description="Name of the head; null: none is named.")]
    reference: Annotated[bool, Field(description="It is the head that the others are compared with.")]
    run: Annotated[int, Field(description="Number of its last run.")]
    measured_at: datetime
    version: Annotated[int, Field(description="Of the kinematics in effect; 0: nothing was entered yet.")]
    in_effect: Annotated[dict[str, float], Field(description="What has been entered for it, by name; mm and degrees.")]
    changes: Annotated[list[ChangeOut], Field(description="From the last run with the reference head to its own.")]


class MachineKinematicsOut(BaseModel):
    """Limits of a machine's runs, the values in effect, and their drift."""

    machine: str
    ball_radius: Annotated[float | None, Field(description="Q407 of the ball that is used here, mm.")]
    max_modification: Annotated[
        float | None, Field(description="A larger change, mm, has to be confirmed; null: not limited.")
    ]
    max_modification_angle: Annotated[float | None, Field(description="The same for how an axis leans, degrees.")]
    max_dev_cal_ball: Annotated[
        float | None, Field(description="A ball radius further off, mm, ends the run; null: not limited.")
    ]
    reference_head: Annotated[str | None, Field(description="The head that the others are compared with.")]
    limits: Annotated[dict[str, float], Field(description="Of the drift, by the name of a value; mm, degrees.")]
    characteristics: Annotated[
        dict[str, str], Field(description="Values that become readings, with the key of the characteristic.")
    ]
    in_effect: Annotated[
        dict[str, float], Field(description="What has been entered on the control, by name; mm and degrees.")
    ]
    drift: Annotated[list[DriftOut], Field(description="Of the head asked for, or of the reference head.")]
    heads: Annotated[list[HeadOut], Field(description="Every head, and how it differs from the reference head.")]


def backup_out(row: KinematicsBackup) -> BackupOut:
    """A back-up as it is answered."""
    return answer_from(BackupOut, row, head=row.head or None, by=row.actor)


def drift_out(drift: Drift) -> DriftOut:
    """A drift as it is answered."""
    last, trend = drift.last, drift.trend
    return DriftOut(
        name=drift.name,
        unit=UNITS[drift.name],
        limit=drift.limit,
        beyond=drift.beyond,
        last=last.value if last else None,
        true=last.true if last else None,
        runs=len(drift.points),
        slope_per_day=trend.slope if trend else None,
        slope_low=trend.low if trend else None,
        slope_high=trend.high if trend else None,
        text=wording.trend_sentence(drift),
    )


def machine_out(
    machine: str, plan: KinematicsPlan, in_effect: dict[str, float], drifts: list[Drift], heads: list[HeadOut]
) -> MachineKinematicsOut:
    """The kinematics of a machine as it is answered."""
    return answer_from(
        MachineKinematicsOut,
        plan,
        machine=machine,
        in_effect=in_effect,
        drift=[drift_out(drift_row) for drift_row in drifts],
        heads=heads,
    )


class ComparisonOut(BaseModel):
    """Changes between two runs, and the values to enter on the control."""

    machine: str
    before: Annotated[int, Field(description="Number of the earlier run.")]
    after: Annotated[int, Field(description="Number of the later run.")]
    changes: Annotated[list[ChangeOut], Field(description="Every value that both runs hold.")]


def changes_out(changes: list[Compared], errors: Mapping[str, float]) -> list[ChangeOut]:
    """Every value that both runs hold."""
    return [
        answer_from(
            ChangeOut,
            change_row.change,
            name=change_row.name,
            words=wording.name_words(change_row.name),
            unit=change_row.unit,
            enter=errors.get(change_row.name),
        )
        for change_row in changes
    ]


def machine_state(session: Session, machine: Machine, head: str | None = None) -> MachineKinematicsOut:
    """Limits of the machine, its entered values, the drifts of one head, and every head compared."""
    plan = queries.plan(session, machine.id)
    head_shown = head if head is not None else plan.reference_head or ""
    latest = queries.heads_of(session, machine.id)
    standard = latest.get(plan.reference_head or "")
    heads = []
    for name, row in latest.items():
        in_effect, version = queries.state_at(session, machine.id, name, None)
        against = run_history.changes(standard, row) if standard is not None and standard is not row else []
        heads.append(
            HeadOut(
                head=name or None,
                reference=row is standard,
                run=row.run.id,
                measured_at=row.run.measured_at,
                version=version,
                in_effect=in_effect,
                changes=changes_out(against, run_history.to_enter(row)),
            )
        )
    in_effect = queries.in_effect(session, machine.id, head_shown)
    return machine_out(machine.key, plan, in_effect, run_history.drifts(session, machine, head_shown), heads)
