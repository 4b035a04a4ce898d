"""Looking at runs together: over time, two of them, head against head. Never writes."""

from collections.abc import Mapping
from math import isclose
from typing import Any

from sqlalchemy.orm import Session

from app.kinematics import queries
from app.kinematics.drift import Compared, Drift, Measured, compared
from app.kinematics.drift import drifts as drifts_of
from app.kinematics.queries import RunRow
from app.kinematics.tables import KinematicsRun
from app.kinematics.values import errors_of
from app.machines.tables import Machine


def as_measured(run: KinematicsRun) -> Measured:
    return Measured(run.id, run.measured_at, run.results, run.in_effect, run.head)


def measured(session: Session, machine: Machine, head: str) -> list[Measured]:
    """The runs with one head, in the order of their time."""
    return [as_measured(run) for run in queries.of_machine(session, machine.id) if run.head == head]


def drifts(session: Session, machine: Machine, head: str) -> list[Drift]:
    """How every value of a machine goes on, with one head."""
    return drifts_of(measured(session, machine, head), queries.plan(session, machine.id).limits)


def changes(before: RunRow, after: RunRow) -> list[Compared]:
    """What moved between two runs; what was entered in between is no movement, as long as the head is the same."""
    return compared(as_measured(before.run), as_measured(after.run), true=before.run.head == after.run.head)


def to_enter(row: RunRow) -> dict[str, float]:
    """What is to be entered on the control because of this run; nothing, if it was entered or overtaken."""
    return errors_of(row.run.results) if row.may_be_entered else {}


def same(kept: Mapping[str, Any], anew: Mapping[str, Any]) -> bool:
    """Whether two evaluations come to the same, to the last digits that mean anything (a nanometre)."""
    return all(_alike(kept[name], anew[name]) for name in ("axes", "offsets", "balls"))


def _alike(one: Any, other: Any) -> bool:
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_alike(one[name], other[name]) for name in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_alike, one, other))
    if isinstance(one, float) or isinstance(other, float):
        return one is not None and other is not None and isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    return bool(one == other)
