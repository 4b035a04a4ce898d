"""What a run comes to, and what it is held against."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from app.core.kinematics.axis import AxisName

LETTERS = "XYZ"


@dataclass
class Evaluated:
    """What a run comes to. results: as they are kept; head: texts that the protocol says of itself."""

    form: str
    outcome: str = "measured"
    reason: dict[str, Any] = field(default_factory=lambda: {"code": "measured"})
    results: dict[str, Any] = field(default_factory=lambda: {"axes": [], "offsets": None, "balls": [], "notes": []})
    head: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Limits:
    """What the control's machine parameters permit; mm and degrees, None: nothing is said."""

    ball_radius: float | None = None
    max_modification: float | None = None
    max_modification_angle: float | None = None
    max_dev_cal_ball: float | None = None


def correction(axis: AxisName, errors: Mapping[str, float | None]) -> list[float]:
    """Where the axis has to go, X Y Z, mm."""
    return [(errors.get(f"E{letter}0{axis}") or 0.0) + 0.0 for letter in LETTERS]
