"""A rotary axis that is known, touched by a probe that scatters. It turns the table rigidly; nothing is linearised."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from app.core.rotary.axis import AXES, AxisName, Position

Floats = NDArray[np.float64]


def positions(
    axis: AxisName,
    ball: Sequence[float],
    angles: Sequence[float],
    *,
    errors: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
    shift: Sequence[float] = (0.0, 0.0, 0.0),
    backlash: float = 0.0,
    noise: float = 0.0,
    both: bool = False,
    seed: int = 1,
) -> list[Position]:
    """Position to which a table carries the sphere. errors: two in mm, two in degrees, in the order of the result string.

    The axis stands at t and leans by w = (w1, w2, 0): a turn about it is T W R W⁻¹ T⁻¹.
    """
    third = AXES.index(axis)
    order = [(third + 1) % 3, (third + 2) % 3, third]
    place, lean = np.zeros(3), np.zeros(3)
    place[order[0]], place[order[1]] = errors[:2]
    lean[order[0]], lean[order[1]] = np.radians(errors[2:])
    leaning = Rotation.from_rotvec(lean)
    random = np.random.default_rng(seed)
    start = np.asarray(ball, dtype=np.float64) + np.asarray(shift)
    about = np.zeros(3)
    about[third] = 1.0
    made = []
    for angle in angles:
        for approach in (1, -1) if both else (0,):
            turn = leaning * Rotation.from_rotvec(about * np.radians(angle - approach * backlash / 2)) * leaning.inv()
            centre = (
                turn.apply(start - place) + place + random.normal(0.0, noise, 3)
                if noise
                else (turn.apply(start - place) + place)
            )
            made.append(Position(angle, tuple(centre.tolist()), approach))
    return made
