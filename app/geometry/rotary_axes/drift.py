"""Drift of values over the runs, one run compared with another, and a head with the reference head. Pure."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, NamedTuple

from app.core.rotary.drift import Change, Trend, change, trend
from app.geometry.rotary_axes.result_values import UNITS, deviations_of, values_of

DAY = 86_400.0
SHORTEST = 1 / 24
"""Days: runs within an hour say how they repeat, not how the machine drifts in a day."""


class Measured(NamedTuple):
    """Values of a run for the drift; in_effect: the values entered on the control by then.

    waits: it waits to be confirmed, because its change is too large or hardly plausible; no trend is computed of it.
    """

    number: int
    measured_at: datetime
    results: Mapping[str, Any]
    in_effect: Mapping[str, float]
    head: str = ""
    waits: bool = False


class Reached(NamedTuple):
    """A value at one run, mm or degrees. value: as it was measured; true: with what had been entered before."""

    number: int
    at: datetime
    value: float
    true: float
    deviation: float | None
    waits: bool = False


class Drift(NamedTuple):
    """A value over the runs. trend: of its true course, whatever was entered meanwhile, without runs to be confirmed."""

    name: str
    limit: float | None
    points: list[Reached]
    trend: Trend | None

    @property
    def last(self) -> Reached | None:
        return self.points[-1] if self.points else None

    @property
    def beyond(self) -> bool:
        """True if the last run lies beyond the limit."""
        return self.limit is not None and self.last is not None and abs(self.last.value) > self.limit


class Compared(NamedTuple):
    """A value in two runs, or with two heads. enter: what would bring the second to the first."""

    name: str
    change: Change
    unit: str


def drift(name: str, runs: Sequence[Measured], limit: float | None) -> Drift:
    """Course of a value over the runs, which are in the order of their time."""
    points = []
    for run in runs:
        value = values_of(run.results).get(name)
        if value is not None:
            true = value + run.in_effect.get(name, 0.0)
            sure = deviations_of(run.results).get(name)
            points.append(Reached(run.number, run.measured_at, value, true, sure, run.waits))
    counting = [point for point in points if not point.waits]
    days = [point.at.timestamp() / DAY for point in counting]
    long = bool(days) and days[-1] - days[0] >= SHORTEST
    return Drift(name, limit, points, trend(days, [point.true for point in counting]) if long else None)


def drifts(runs: Sequence[Measured], limits: Mapping[str, float]) -> list[Drift]:
    """Every value that any run holds, in the order in which values are known."""
    held = {name for run in runs for name in values_of(run.results)}
    return [drift(name, runs, limits.get(name)) for name in UNITS if name in held]


def compared(before: Measured, after: Measured, *, true: bool = True) -> list[Compared]:
    """Every value that both runs hold. true: with what had been entered by then, so that an entry is no movement."""
    first, second = values_of(before.results), values_of(after.results)
    sure, sure_too = deviations_of(before.results), deviations_of(after.results)

    def course(run: Measured, values: Mapping[str, float], name: str) -> float:
        return values[name] + (run.in_effect.get(name, 0.0) if true else 0.0)

    return [
        Compared(
            name,
            change(course(before, first, name), course(after, second, name), sure.get(name), sure_too.get(name)),
            UNITS[name],
        )
        for name in UNITS
        if name in first and name in second
    ]
