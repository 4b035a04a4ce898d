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

    version: int
    head: str | None
    at: Annotated[datetime, Field(description="When it was reported.")]
    since: Annotated[datetime, Field(description="Runs measured from then on were measured on it.")]
    by: str
    reason: str
    errors: dict[str, float]
    run: Annotated[int | None, Field(description="The run that led to it.")]
    restores: Annotated[int | None, Field(description="The version that was put back.")]


class DriftOut(BaseModel):
    """A value over the runs. true: with what had been entered by then; the slope, per day, is of that, without runs to be confirmed."""

    name: str
    unit: str
    limit: float | None
    beyond: bool
    last: float | None
    true: float | None
    runs: int
    slope_per_day: float | None
    slope_low: float | None
    slope_high: float | None
    text: str


class ChangeOut(BaseModel):
    """A value in two runs. moved: the difference is more than scatter; none where no run says how sure it is."""

    name: str
    words: str
    unit: str
    before: float
    after: float
    difference: float
    deviation: float | None
    moved: bool | None
    enter: Annotated[
        float | None,
        Field(
            description="What the later run asks to enter on the control; none once it was entered, or when it is not to be."
        ),
    ]


class HeadOut(BaseModel):
    """State of the axes with one of the heads, by its last run; changes: from the last run with the reference head."""

    head: str | None
    reference: bool
    run: int
    measured_at: datetime
    version: Annotated[int, Field(description="Of the kinematics in effect; 0: nothing was entered yet.")]
    in_effect: dict[str, float]
    changes: list[ChangeOut]


class MachineKinematicsOut(BaseModel):
    """Limits of a machine's runs, the values in effect, and their drift."""

    machine: str
    ball_radius: float | None
    max_modification: float | None
    max_modification_angle: float | None
    max_dev_cal_ball: float | None
    reference_head: str | None
    limits: dict[str, float]
    characteristics: dict[str, str]
    in_effect: dict[str, float]
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
    before: int
    after: int
    changes: list[ChangeOut]


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
