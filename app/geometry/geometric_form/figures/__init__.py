"""Pictures of form: pure, values in, charts out. mm in, µm on the axes."""

from collections.abc import Mapping
from typing import Any

from app.charts import Chart
from app.geometry.geometric_form.figures.axes import axis_figure, position_figure
from app.geometry.geometric_form.figures.rounds import round_figure
from app.geometry.geometric_form.figures.surfaces import profile_figure, surface_figure
from app.geometry.geometric_form.figures.trends import Mark, trend

__all__ = ["Mark", "figure", "trend"]


def figure(
    kind: str,
    inputs: Mapping[str, Any],
    result: Mapping[str, Any],
    tolerance: float | None,
    *,
    section: int = 1,
) -> Chart:
    """The picture of a measurement. section: which one is drawn, of roundness."""
    suspects = [suspect for suspect in result["suspects"] if suspect["of"] == "feature"]
    details = result["details"]
    if kind == "roundness":
        return round_figure(inputs["sections"], details["sections"], suspects, section)
    if kind == "straightness":
        return profile_figure(details, suspects)
    if "residuals" in details:
        return surface_figure(inputs["points"], details, suspects)
    if kind == "position":
        return position_figure(details, suspects, tolerance)
    return axis_figure(kind, details, suspects, tolerance)
