"""Control charts as their JSON. Lengths in mm."""

import numpy as np

from app.core.spc.refusal import Floats
from app.quality.baselines.answers import left_out
from app.quality.baselines.queries import Baseline
from app.quality.chart_rules import wording as rules_wording
from app.quality.control_charts.schemas import ChartSignalOut, ControlOut, PointsOut
from app.quality.control_charts.view import View

MOST_POINTS, MOST_SIGNALS = 10_000, 1_000


def signals_out(view: View, most: int) -> list[ChartSignalOut]:
    """The newest signals, newest first; their sequences are those of the readings."""
    runs = view.signals.newest(most) if view.signals else []
    return [
        ChartSignalOut(
            rule=run.rule.value,
            side=run.side,
            first=int(view.first[run.start]),
            last=int(view.last[run.end]),
            points=run.points,
            text=rules_wording.looks_for(run.rule, view.kind),
        )
        for run in reversed(runs)
    ]


def control_out(view: View, key: str, baseline: Baseline | None) -> ControlOut:
    """A chart in numbers."""
    cut = slice(-MOST_POINTS, None)

    def limit(values: float | Floats | None) -> list[float] | float | None:
        if values is None or np.ndim(values) == 0:
            return None if values is None else float(values)
        listed: list[float] = np.asarray(values)[cut].tolist()
        return listed

    return ControlOut(
        characteristic=key,
        chart=view.kind.value,
        quantity=view.quantity,
        baseline=None if baseline is None else baseline.version,
        first_sequence=int(view.first[0]) if len(view) else None,
        last_sequence=int(view.last[-1]) if len(view) else None,
        count=len(view),
        waiting=view.waiting,
        settling=view.settling,
        left_out=left_out(view.left_out),
        points=PointsOut(
            first=view.first[cut].tolist(),
            last=view.last[cut].tolist(),
            size=view.sizes[cut].tolist(),
            value=view.points[cut].tolist(),
            below=None if view.below is None else view.below[cut].tolist(),
            centre=limit(view.centre),
            lower=limit(view.lower),
            upper=limit(view.upper),
        ),
        signal_count=sum(len(rows) for rows in view.signals.runs.values()) if view.signals else 0,
        signals=signals_out(view, MOST_SIGNALS),
    )
