"""Pictures of form: pure, values in, Plotly figures as dicts out. mm in, µm on the axes."""

from collections.abc import Mapping
from typing import Any

from app.geometry.geometric_form.figures.axes import axis_figure, position_figure
from app.geometry.geometric_form.figures.rounds import round_figure
from app.geometry.geometric_form.figures.surfaces import profile_figure, surface_figure
from app.geometry.geometric_form.figures.trends import Mark, trend
from app.web.theme import ThemeName

__all__ = ["Mark", "figure", "trend"]


def figure(
    kind: str,
    inputs: Mapping[str, Any],
    result: Mapping[str, Any],
    tolerance: float | None,
    *,
    section: int = 1,
    theme: ThemeName = "light",
) -> dict[str, Any]:
    """The picture of a measurement. section: which one is drawn, of roundness."""
    suspects = [suspect for suspect in result["suspects"] if suspect["of"] == "feature"]
    details = result["details"]
    if kind == "roundness":
        return round_figure(inputs["sections"], details["sections"], suspects, section, theme)
    if kind == "straightness":
        return profile_figure(details, suspects, theme)
    if "residuals" in details:
        return surface_figure(inputs["points"], details, suspects, theme)
    if kind == "position":
        return position_figure(details, suspects, tolerance, theme)
    return axis_figure(kind, details, suspects, tolerance, theme)
