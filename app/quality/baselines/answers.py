"""Baselines as their JSON. Lengths in mm."""

from typing import Any

from app.quality.baselines.draft_queries import Draft
from app.quality.baselines.schemas import BaselineOut, CautionOut, DraftAnswer, DraftOut, LeftOutOut
from app.quality.baselines.series_queries import LeftOut
from app.quality.baselines.tables import Baseline

MOST_LEFT_OUT = 1_000
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
