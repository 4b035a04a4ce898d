"""One control chart as values: what figures draw and what the API says. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.core.spc.quantity import Quantity
from app.core.spc.refusal import Floats
from app.core.spc.rules import Signals
from app.core.spc.shewhart import Chart
from app.quality.baselines.series_queries import LeftOut

Whole = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class View:
    """One chart of a window; mm. below: the lower sum of a CUSUM, whose points are the upper one.

    centre, lower, upper: single numbers, or one for each point; None without a baseline. begins: comes first of a tool.
    left_out: readings of the window that count for nothing. given: its limits are given by the customer.
    """

    kind: Chart
    quantity: Quantity
    first: Whole
    last: Whole
    sizes: Whole
    points: Floats
    begins: NDArray[np.bool_]
    centre: float | Floats | None = None
    lower: float | Floats | None = None
    upper: float | Floats | None = None
    below: Floats | None = None
    signals: Signals | None = None
    waiting: int = 0
    settling: int = 0
    left_out: LeftOut | None = None
    given: bool = False

    def __len__(self) -> int:
        """Number of points."""
        return len(self.last)


@dataclass(frozen=True)
class Marks:
    """Marks beside the points: the period of a baseline with its name, and runs of readings that it leaves out."""

    first: int
    last: int
    name: str
    excluded: Sequence[tuple[int, int]] = ()


def since(view: View, first: int) -> View:
    """Without the points that end before this reading; a signal that goes on over the edge is cut there."""
    return only(view, view.last >= first)


def only(view: View, wanted: NDArray[np.bool_]) -> View:
    """Those points; a signal goes from its first to its last point that is left."""
    if wanted.all():
        return view

    def rest(values: float | Floats | None) -> float | Floats | None:
        return values if values is None or np.ndim(values) == 0 else np.asarray(values)[wanted]

    return replace(
        view,
        first=view.first[wanted],
        last=view.last[wanted],
        sizes=view.sizes[wanted],
        points=view.points[wanted],
        begins=view.begins[wanted],
        centre=rest(view.centre),
        lower=rest(view.lower),
        upper=rest(view.upper),
        below=None if view.below is None else view.below[wanted],
        signals=None if view.signals is None else _rest_of(view.signals, wanted),
    )


def _rest_of(signals: Signals, wanted: NDArray[np.bool_]) -> Signals:
    runs = {}
    before = np.concatenate(([0], np.cumsum(wanted)))  # points left before each
    for name, rows in signals.runs.items():
        moved = rows.copy()
        moved[:, 1], moved[:, 2] = before[rows[:, 1]], before[rows[:, 2] + 1] - 1
        runs[name] = moved[moved[:, 1] <= moved[:, 2]]
    return Signals(int(before[-1]), runs)
