"""Evaluated run, and the limits it is compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from app.core.rotary.axis import AxisName

LETTERS = "XYZ"


@dataclass
class Evaluated:
    """Evaluated run. results: as stored; head: texts that the protocol states about itself."""

    form: str
    outcome: str = "measured"
    reason: dict[str, Any] = field(default_factory=lambda: {"code": "measured"})
    results: dict[str, Any] = field(default_factory=lambda: {"axes": [], "offsets": None, "balls": [], "notes": []})
    head: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Limits:
    """Limits by the control's machine parameters; mm and degrees, None: not stated."""

    ball_radius: float | None = None
    max_modification: float | None = None
    max_modification_angle: float | None = None
    max_dev_cal_ball: float | None = None


def correction(axis: AxisName, errors: Mapping[str, float | None]) -> list[float]:
    """Correction of the axis' position, X Y Z, mm."""
    return [(errors.get(f"E{letter}0{axis}") or 0.0) + 0.0 for letter in LETTERS]
