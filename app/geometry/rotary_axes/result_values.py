"""The numbers of a run by their names: what limits, charts and characteristics are about. Pure.

`EX0C` … are position errors; `Q141` … `Q149` results as the control counts them; `backlash.C` and the like belong to an axis.
"""

from collections.abc import Mapping
from math import radians
from typing import Any

from app.core.rotary.axis import AXES, ERRORS
from app.core.rotary.results import MEASURED, OFFSETS, OPTIMISED

OF_AXIS = {
    "backlash": "°",
    "greatest": "mm",
    "mean_error": "mm",
    "angle_error": "°",
    "radius": "mm",
}
UNITS: dict[str, str] = {
    **{name: "mm" if place < 2 else "°" for axis in AXES for place, name in enumerate(ERRORS[axis])},
    **dict.fromkeys((*MEASURED, *OPTIMISED, *OFFSETS), "mm"),
    **{f"{name}.{axis}": unit for axis in AXES for name, unit in OF_AXIS.items()},
}
"""Every name there is, with its unit."""
AXIS_OF: dict[str, str] = {
    **{name: axis for axis in AXES for name in ERRORS[axis]},
    **MEASURED,
    **OPTIMISED,
    **{f"{name}.{axis}": axis for axis in AXES for name in OF_AXIS},
}
"""The axis that a value is of; the offsets Q147 to Q149 are of the machine."""
METRE = 1000.0  # mm; what an angle becomes a reading by


def values_of(results: Mapping[str, Any]) -> dict[str, float]:
    """All numbers that the results of a run hold, mm and degrees."""
    values: dict[str, float | None] = {}
    for axis in results.get("axes", ()):
        letter = axis["axis"]
        values |= {name: error["value"] for name, error in axis["errors"].items()}
        values |= {name: axis["scatter_before"] for name, owner in MEASURED.items() if owner == letter}
        values |= {name: axis["scatter_after"] for name, owner in OPTIMISED.items() if owner == letter}
        backlash = axis["backlash"]
        values[f"backlash.{letter}"] = backlash["value"] if backlash else None
        values[f"greatest.{letter}"] = axis["greatest_before"]
        values |= {f"{name}.{letter}": axis[name] for name in ("mean_error", "angle_error", "radius")}
    offsets = results.get("offsets") or {}
    values |= {name: offsets.get(letter) for name, letter in OFFSETS.items()}
    return {name: value for name, value in values.items() if value is not None}


def deviations_of(results: Mapping[str, Any]) -> dict[str, float]:
    """The standard deviations of the position errors, as far as the run states them."""
    return {
        name: error["deviation"]
        for axis in results.get("axes", ())
        for name, error in axis["errors"].items()
        if error["deviation"] is not None
    }


def errors_of(results: Mapping[str, Any]) -> dict[str, float]:
    """The position errors alone: what is to be entered on the control."""
    return {name: value for name, value in values_of(results).items() if name in AXIS_OF and name.startswith("E")}


def to_enter(results: Mapping[str, Any], *, offsets: bool = False) -> dict[str, float]:
    """Position errors to enter; those of the sphere (Q147 to Q149) on request, or if there are no others."""
    errors = errors_of(results)
    if errors and not offsets:
        return errors
    return errors | {name: value for name, value in values_of(results).items() if name in OFFSETS}


def as_reading(name: str, value: float) -> float:
    """A value as a length in mm, which readings are: an angle as what it comes to over one metre.

    >>> as_reading("EX0C", 0.012), round(as_reading("EA0C", 0.001), 6)
    (0.012, 0.017453)
    """
    return radians(value) * METRE if UNITS[name] == "°" else value
