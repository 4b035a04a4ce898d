"""Looking at runs together: over time, two of them, head against head. Never writes."""

from collections.abc import Mapping, Sequence
from math import isclose
from typing import Any, NamedTuple, TypeVar

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from app.core.kinematics.axis import ERRORS
from app.core.kinematics.sureness import stated_deviations
from app.kinematics import queries
from app.kinematics.drift import Compared, Drift, Measured, compared
from app.kinematics.drift import drifts as drifts_of
from app.kinematics.queries import RunRow
from app.kinematics.tables import KinematicsPlan, KinematicsRun
from app.kinematics.values import UNITS
from app.kinematics.values import to_enter as to_be_entered
from app.machines.tables import Machine

Item = TypeVar("Item")
HORIZON = 365.0  # days; nobody foresees more
SAME_PLACE = 0.0002  # mm; a protocol states places with four decimals


class MachineRow(NamedTuple):
    """A machine with rotary axes: its newest run (maybe a refused one), the last that counts with each head, the drifts."""

    machine: Machine
    plan: KinematicsPlan
    newest: RunRow | None
    heads: Mapping[str, RunRow]
    drifts: Mapping[str, list[Drift]]

    @property
    def beyond(self) -> list[tuple[str, Drift]]:
        """Head and value of everything beyond its limit."""
        return [(head, each) for head, drifts in self.drifts.items() for each in drifts if each.beyond]

    @property
    def moving(self) -> list[tuple[str, Drift]]:
        """What moves more than scatter would, and will be beyond its limit at that rate."""
        return [
            (head, each)
            for head, drifts in self.drifts.items()
            for each in drifts
            if not each.beyond and days_left(each) is not None
        ]


def overview(session: Session, *, after: str = "", limit: int = 25) -> list[MachineRow]:
    """Machines that any run was taken of, by key."""
    wanted = (
        select(Machine)
        .where(Machine.key > after, exists().where(KinematicsRun.machine_id == Machine.id))
        .order_by(Machine.key)
        .limit(limit)
    )
    return [machine_row(session, machine) for machine in session.scalars(wanted)]


def machine_row(session: Session, machine: Machine) -> MachineRow:
    """How the rotary axes of a machine stand."""
    plan = queries.plan(session, machine.id)
    heads = queries.heads_of(session, machine.id)
    newest = queries.runs(session, machine.id, newest_first=True, limit=1)
    drifts = {head: drifts_of(measured(session, machine, head), plan.limits) for head in heads}
    return MachineRow(machine, plan, newest[0] if newest else None, heads, drifts)


def as_measured(run: KinematicsRun, unrecorded: Mapping[str, float] | None = None) -> Measured:
    """A run for the drift. unrecorded: what was entered on the control besides, which nobody has said here."""
    more = unrecorded or {}
    results = surer(run.results)
    in_effect = run.in_effect | {name: run.in_effect.get(name, 0.0) + value for name, value in more.items()}
    return Measured(run.id, run.measured_at, results, in_effect, run.head)


def surer(results: Mapping[str, Any]) -> Mapping[str, Any]:
    """The results with standard deviations, where a protocol states enough beside its errors to tell them."""
    axes = []
    for axis in results["axes"]:
        errors, angles = axis["errors"], [each["angle"] for each in axis["positions"]] or axis["angles"]
        if (
            axis["radius"]
            and axis["scatter_after"] is not None
            and any(e["deviation"] is None for e in errors.values())
        ):
            found = stated_deviations(axis["axis"], angles, axis["radius"], axis["scatter_after"]) or {}
            told = {
                name: {"value": each["value"], "deviation": each["deviation"] or found.get(name)}
                for name, each in errors.items()
            }
            axes.append({**axis, "errors": told})
        else:
            axes.append(axis)
    return {**results, "axes": axes}


def measured(session: Session, machine: Machine, head: str) -> list[Measured]:
    """The runs with one head, in the order of their time."""
    return chained([run for run in queries.of_machine(session, machine.id) if run.head == head])


def chained(runs: Sequence[KinematicsRun]) -> list[Measured]:
    """Runs with one head in the order of their time, each with what had been entered by then, recorded or not."""
    more: dict[str, float] = {}
    last: dict[str, KinematicsRun] = {}
    made = []
    for run in runs:
        for axis in run.results["axes"]:
            letter = axis["axis"]
            if letter in last:
                for name, value in unrecorded(last[letter], run, letter).items():
                    more[name] = more.get(name, 0.0) + value
            if axis["position_before"] is not None:
                last[letter] = run
        made.append(as_measured(run, more))
    return made


def unrecorded(before: KinematicsRun, after: KinematicsRun, only: str | None = None) -> dict[str, float]:
    """What was entered on the control between two runs, as their protocols tell, though nobody has said so here.

    A protocol states where the kinematics has the axis. If it has moved, and no entry was recorded meanwhile, then the
    control was given other values. Where it moved just by what the earlier run asked for, its angles were taken as well.
    """
    if before.version != after.version or before.head != after.head:
        return {}
    found: dict[str, float] = {}
    axes = {axis["axis"]: axis for axis in after.results["axes"]}
    for then in before.results["axes"]:
        letter = then["axis"]
        now = axes.get(letter)
        if now is None or only not in (None, letter) or None in (then["position_before"], now["position_before"]):
            continue
        moves = [b - a for a, b in zip(then["position_before"], now["position_before"], strict=True)]
        if not any(abs(move) > SAME_PLACE for move in moves):
            continue
        asked = then["correction"]
        taken = asked is not None and all(abs(a - b) <= SAME_PLACE for a, b in zip(moves, asked, strict=True))
        for place, name in enumerate(ERRORS[letter]):
            if place < 2:
                found[name] = round(moves["XYZ".index(name[1])], 9)
            elif taken and name in then["errors"]:
                found[name] = then["errors"][name]["value"]
    return found


def drifts(session: Session, machine: Machine, head: str) -> list[Drift]:
    """How every value of a machine goes on, with one head."""
    return drifts_of(measured(session, machine, head), queries.plan(session, machine.id).limits)


def days_left(drift: Drift) -> float | None:
    """Days until a value that moves is beyond its limit, at the rate of its trend; None if that is over a year away."""
    if drift.limit is None or drift.trend is None or drift.last is None or not drift.trend.moves or drift.beyond:
        return None
    ahead = drift.limit - drift.last.value if drift.trend.slope > 0 else -drift.limit - drift.last.value
    left = ahead / drift.trend.slope
    return left if left <= HORIZON else None


def first_to_see(drifts: Sequence[Drift]) -> str | None:
    """The value to look at first: what is furthest beyond its limit, else nearest to it, else the first there is."""
    limited = [each for each in drifts if each.limit and each.last]
    if limited:
        return max(
            limited, key=lambda each: abs(each.last.value) / each.limit if each.last and each.limit else 0.0
        ).name
    return drifts[0].name if drifts else None


def earlier(row: RunRow, others: Sequence[RunRow]) -> RunRow | None:
    """The run before, with the same head and at least one axis of it; else with another head."""

    def axes(each: RunRow) -> set[str]:
        return {axis["axis"] for axis in each.run.results["axes"]}

    at = (row.run.measured_at, row.run.id)
    before = [each for each in others if (each.run.measured_at, each.run.id) < at and axes(each) & axes(row)]
    best = [each for each in before if each.run.head == row.run.head] or before
    return max(best, key=lambda each: (each.run.measured_at, each.run.id), default=None)


def changes(before: RunRow, after: RunRow) -> list[Compared]:
    """What moved between two runs; what was entered in between is no movement, as long as the head is the same."""
    same_head = before.run.head == after.run.head
    now = as_measured(after.run, unrecorded(before.run, after.run))
    return compared(as_measured(before.run), now, true=same_head)


def to_enter(row: RunRow, *, offsets: bool = False) -> dict[str, float]:
    """What is to be entered on the control because of this run; nothing, if it was entered or overtaken.

    offsets: those of the ball (Q147 to Q149) beside the errors of axes as well.
    """
    return in_order(to_be_entered(row.run.results, offsets=offsets)) if row.may_be_entered else {}


def in_order(values: Mapping[str, Item]) -> dict[str, Item]:
    """Values in the order in which the control has them: results are kept as JSON, which sorts by letters."""
    return {name: values[name] for name in UNITS if name in values}


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
