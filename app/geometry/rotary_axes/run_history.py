"""Runs compared: over time, two of them, or two heads. Never writes."""

from collections.abc import Collection, Mapping, Sequence
from math import isclose
from typing import Any, NamedTuple, TypeVar

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from app.core.rotary.axis import ERRORS
from app.core.rotary.protocol_uncertainty import stated_deviations
from app.geometry.rotary_axes import queries
from app.geometry.rotary_axes.drift import Compared, Drift, Measured, compared
from app.geometry.rotary_axes.drift import drifts as drifts_of
from app.geometry.rotary_axes.queries import RunRow
from app.geometry.rotary_axes.result_values import UNITS
from app.geometry.rotary_axes.result_values import to_enter as to_be_entered
from app.geometry.rotary_axes.tables import KinematicsPlan, KinematicsRun
from app.loop.tables.machines import Machine

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
        return [(head, drift) for head, drifts in self.drifts.items() for drift in drifts if drift.beyond]

    @property
    def moving(self) -> list[tuple[str, Drift]]:
        """Head and value of everything that moves more than scatter would, and reaches its limit at that rate."""
        return [
            (head, drift)
            for head, drifts in self.drifts.items()
            for drift in drifts
            if not drift.beyond and days_left(drift) is not None
        ]


def overview(session: Session, *, after: str = "", limit: int = 25) -> list[MachineRow]:
    """Machines that any run was taken of, by key."""
    query = (
        select(Machine)
        .where(Machine.key > after, exists().where(KinematicsRun.machine_id == Machine.id))
        .order_by(Machine.key)
        .limit(limit)
    )
    return [machine_row(session, machine) for machine in session.scalars(query)]


def machine_row(session: Session, machine: Machine) -> MachineRow:
    """State of the rotary axes of a machine."""
    plan = queries.plan(session, machine.id)
    heads = queries.heads_of(session, machine.id)
    newest = queries.runs(session, machine.id, newest_first=True, limit=1)
    drifts = {head: drifts_of(measured(session, machine, head), plan.limits) for head in heads}
    return MachineRow(machine, plan, newest[0] if newest else None, heads, drifts)


def as_measured(run: KinematicsRun, unrecorded: Mapping[str, float] | None = None) -> Measured:
    """A run for the drift. unrecorded: what was entered on the control besides, without a record here."""
    more = unrecorded or {}
    results = surer(run.results)
    in_effect = run.in_effect | {name: run.in_effect.get(name, 0.0) + value for name, value in more.items()}
    return Measured(run.id, run.measured_at, results, in_effect, run.head)


def surer(results: Mapping[str, Any]) -> Mapping[str, Any]:
    """The results with standard deviations, where a protocol states enough beside its errors to tell them."""
    axes = []
    for axis in results["axes"]:
        errors, angles = axis["errors"], [error["angle"] for error in axis["positions"]] or axis["angles"]
        if (
            axis["radius"]
            and axis["scatter_after"] is not None
            and any(e["deviation"] is None for e in errors.values())
        ):
            computed = stated_deviations(axis["axis"], angles, axis["radius"], axis["scatter_after"]) or {}
            completed = {
                name: {"value": error["value"], "deviation": error["deviation"] or computed.get(name)}
                for name, error in errors.items()
            }
            axes.append({**axis, "errors": completed})
        else:
            axes.append(axis)
    return {**results, "axes": axes}


def measured(session: Session, machine: Machine, head: str) -> list[Measured]:
    """The runs with one head, in the order of their time."""
    runs = [run for run in queries.of_machine(session, machine.id) if run.head == head]
    return chained(runs, queries.to_confirm(session, machine, runs))


def chained(runs: Sequence[KinematicsRun], to_confirm: Collection[int]) -> list[Measured]:
    """Runs with one head in the order of their time, each with what had been entered by then, recorded or not.

    to_confirm: numbers of those that wait to be confirmed.
    """
    more: dict[str, float] = {}
    last: dict[str, KinematicsRun] = {}
    series = []
    for run in runs:
        for axis in run.results["axes"]:
            letter = axis["axis"]
            if letter in last:
                for name, value in unrecorded(last[letter], run, letter).items():
                    more[name] = more.get(name, 0.0) + value
            if axis["position_before"] is not None:
                last[letter] = run
        series.append(as_measured(run, more)._replace(waits=run.id in to_confirm))
    return series


def unrecorded(before: KinematicsRun, after: KinematicsRun, only: str | None = None) -> dict[str, float]:
    """Values entered on the control between two runs, as their protocols show, without a record here.

    A protocol states where the kinematics has the axis. If it has moved, and no entry was recorded meanwhile, then the
    control was given other values. Where it moved just by what the earlier run asked for, its angles were taken as well.
    """
    if before.version != after.version or before.head != after.head:
        return {}
    entered: dict[str, float] = {}
    axes = {axis["axis"]: axis for axis in after.results["axes"]}
    for then in before.results["axes"]:
        letter = then["axis"]
        now = axes.get(letter)
        if now is None or only not in (None, letter) or None in (then["position_before"], now["position_before"]):
            continue
        moves = [b - a for a, b in zip(then["position_before"], now["position_before"], strict=True)]
        if not any(abs(move) > SAME_PLACE for move in moves):
            continue
        correction = then["correction"]
        angles_entered = correction is not None and all(
            abs(a - b) <= SAME_PLACE for a, b in zip(moves, correction, strict=True)
        )
        for place, name in enumerate(ERRORS[letter]):
            if place < 2:
                entered[name] = round(moves["XYZ".index(name[1])], 9)
            elif angles_entered and name in then["errors"]:
                entered[name] = then["errors"][name]["value"]
    return entered


def drifts(session: Session, machine: Machine, head: str) -> list[Drift]:
    """Course of every value of a machine, with one head."""
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
    limited = [drift for drift in drifts if drift.limit and drift.last]
    if limited:
        return max(
            limited, key=lambda drift: abs(drift.last.value) / drift.limit if drift.last and drift.limit else 0.0
        ).name
    return drifts[0].name if drifts else None


def earlier(row: RunRow, others: Sequence[RunRow]) -> RunRow | None:
    """The run before, with the same head and at least one axis of it; else with another head."""

    def axes(other: RunRow) -> set[str]:
        return {axis["axis"] for axis in other.run.results["axes"]}

    at = (row.run.measured_at, row.run.id)
    before = [other for other in others if (other.run.measured_at, other.run.id) < at and axes(other) & axes(row)]
    best = [other for other in before if other.run.head == row.run.head] or before
    return max(best, key=lambda other: (other.run.measured_at, other.run.id), default=None)


def changes(before: RunRow, after: RunRow) -> list[Compared]:
    """Changes between two runs; values entered in between are no change, as long as the head is the same."""
    same_head = before.run.head == after.run.head
    now = as_measured(after.run, unrecorded(before.run, after.run))
    return compared(as_measured(before.run), now, true=same_head)


def to_enter(row: RunRow, *, offsets: bool = False) -> dict[str, float]:
    """Values to enter on the control after this run; none if it waits to be confirmed, was entered or overtaken.

    offsets: those of the ball (Q147 to Q149) beside the errors of axes as well.
    """
    return (
        in_order(to_be_entered(row.run.results, offsets=offsets))
        if row.may_be_entered and row.status != "to_confirm"
        else {}
    )


def in_order(values: Mapping[str, Item]) -> dict[str, Item]:
    """Values in the order in which the control has them: results are kept as JSON, which sorts by letters."""
    return {name: values[name] for name in UNITS if name in values}


def same(stored: Mapping[str, Any], computed: Mapping[str, Any]) -> bool:
    """Tell if two evaluations agree, to the last digits that mean anything (a nanometre)."""
    return all(_alike(stored[name], computed[name]) for name in ("axes", "offsets", "balls"))


def _alike(one: Any, other: Any) -> bool:
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_alike(one[name], other[name]) for name in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(_alike, one, other))
    if isinstance(one, float) or isinstance(other, float):
        return one is not None and other is not None and isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    return bool(one == other)
