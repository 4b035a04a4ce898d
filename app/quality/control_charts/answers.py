"""Baselines and charts as their JSON. Lengths in mm."""

from typing import Any

import numpy as np

from app.core.spc.refusal import Floats
from app.quality.control_charts import rules_wording
from app.quality.control_charts.drafts import Draft
from app.quality.control_charts.schemas import (
    BaselineOut,
    CautionOut,
    ChartSignalOut,
    ControlOut,
    DraftAnswer,
    DraftOut,
    LeftOutOut,
    PointsOut,
)
from app.quality.control_charts.series_queries import LeftOut
from app.quality.control_charts.tables import Baseline
from app.quality.control_charts.view import View

MOST_POINTS, MOST_SIGNALS, MOST_LEFT_OUT = 10_000, 1_000, 1_000
_RENAMED = {"freedom": "degrees_of_freedom", "slope": "wear_per_reading", "slope_error": "wear_error"}


def _numbers(baseline: Baseline, key: str) -> dict[str, Any]:
    names = set(DraftOut.model_fields) | set(_RENAMED)
    values = {name: getattr(baseline, name) for name in names if hasattr(baseline, name)}
    values = {_RENAMED.get(name, name): value for name, value in values.items()}
    return values | {
        "characteristic": key,
        "lower": baseline.centre - 3 * baseline.sigma,
        "upper": baseline.centre + 3 * baseline.sigma,
        "provisional": baseline.provisional,
        "degrees_of_freedom": None if baseline.given else baseline.freedom,
    }


def draft_out(draft: Draft, key: str) -> DraftAnswer:
    """Draft of a baseline, as the API sends it."""
    cautions = [CautionOut(code=code, text=text) for code, text in draft.texts]
    return DraftAnswer(**_numbers(draft.baseline, key), left_out=left_out(draft.left_out), cautions=cautions)


def baseline_out(baseline: Baseline, key: str, in_force: int | None) -> BaselineOut:
    """Baseline, as the API sends it. in_force: the version that is in force."""
    names = (
        "version",
        "repeats",
        "parameters_version",
        "at",
        "actor",
        "reason",
        "retired_at",
        "retired_by",
        "retired_why",
    )
    frozen = {name: getattr(baseline, name) for name in names}
    return BaselineOut(**_numbers(baseline, key), **frozen, in_force=baseline.version == in_force)


def left_out(left: LeftOut | None) -> LeftOutOut:
    """Readings that count for nothing."""
    if left is None:
        return LeftOutOut(excluded=[], by_baseline=[], faults=[], unknown=[], count=0)
    kinds = ("excluded", "by_baseline", "faults", "unknown")
    numbers = {name: getattr(left, name)[-MOST_LEFT_OUT:].tolist() for name in kinds}
    return LeftOutOut(**numbers, count=len(left))


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
