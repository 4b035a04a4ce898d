"""A machine with one rotary axis, as built and as its control believes it; it measures the ball the way the control does.

Nothing is linearised, and nothing is taken from the core: what the core finds has to make this machine true.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
Point = Sequence[float] | NDArray[np.float64]
LETTERS = {"A": 0, "B": 1, "C": 2}


@dataclass(frozen=True)
class Place:
    """Position of an axis in the machine (mm) and its lean (a rotation vector, radians)."""

    at: tuple[float, float, float]
    lean: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def turn(self, letter: str, angle: float) -> tuple[Rotation, Floats]:
        """The turn about it as a rotation and the point that stays."""
        about = np.eye(3)[LETTERS[letter]] * radians(angle)
        leaning = Rotation.from_rotvec(self.lean)
        return leaning * Rotation.from_rotvec(about) * leaning.inv(), np.array(self.at)

    def moved(self, letter: str, point: Point, angle: float) -> Floats:
        """Position of a point that this axis carries."""
        rotation, stays = self.turn(letter, angle)
        made: Floats = rotation.apply(np.asarray(point) - stays) + stays
        return made

    def with_errors(self, errors: dict[str, float]) -> "Place":
        """Position errors entered: `EX0C` adds to where it stands in X, `EA0C` to how it leans about X."""
        at, lean = np.array(self.at), np.array(self.lean)
        for name, value in errors.items():
            if name[1] in "XYZ":
                at["XYZ".index(name[1])] += value
            else:
                lean["ABC".index(name[1])] += radians(value)
        return Place((at[0], at[1], at[2]), (lean[0], lean[1], lean[2]))


@dataclass(frozen=True)
class Machine:
    """built: where the axis is; believed: where the kinematics of the control has it. reversed_: it counts leftwards."""

    letter: str
    built: Place
    believed: Place
    reversed_: bool = False

    def corrected(self, errors: dict[str, float]) -> "Machine":
        return replace(self, believed=self.believed.with_errors(errors))

    def _angle(self, angle: float) -> float:
        return -angle if self.reversed_ else angle

    def table(self, ball: Point, angle: float) -> Floats:
        """The axis carries the ball; the probe finds it in the coordinates of the machine."""
        return self.built.moved(self.letter, ball, self._angle(angle))

    def table_expected(self, ball: Point, angle: float) -> Floats:
        """Position to which the control sends the probe for the same sphere."""
        return self.believed.moved(self.letter, ball, self._angle(angle))

    def head(self, ball: Point, angle: float) -> Floats:
        """The axis carries the probe, whose tip is in the ball at the angle 0; the centre that the control shows.

        The linear axes move so that the tip is truly in the ball; the control adds what it believes of the head.
        """
        tip = np.asarray(ball, dtype=np.float64)
        truly = self.built.moved(self.letter, tip, self._angle(angle))
        believed = self.believed.moved(self.letter, tip, self._angle(angle))
        linear = tip - truly  # how far the linear axes moved to bring the tip back into the ball
        made: Floats = linear + believed
        return made
