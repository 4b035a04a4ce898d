"""Rigid motions: a rotation and a shift as a 4 x 4 matrix, composed exactly, and as the angles that controls take.

A point r of the part lies at ``R r + t``. Angles are those of the frames of the controls (RPY): a turn about Z, then about
the new Y, then about the new X, so R = Rz Ry Rx. Lengths mm, angles degrees.
"""

from math import atan2, degrees, hypot

import numpy as np
from numpy.typing import ArrayLike

from app.core.geometry.points import Floats


def frame(rotation: ArrayLike, shift: ArrayLike) -> Floats:
    """The motion of this rotation (3 x 3) and shift."""
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = rotation, shift
    return motion


def turned(vector: ArrayLike) -> Floats:
    """The rotation about this vector by its length in radians (Rodrigues); exact also for the smallest angles.

    >>> turned([0.0, 0.0, np.pi / 2]).round(12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    x, y, z = np.asarray(vector, dtype=np.float64)
    angle = float(np.sqrt(x * x + y * y + z * z))
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Floats = (
        np.eye(3) + np.sinc(angle / np.pi) * cross + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * cross @ cross
    )
    return rotation


def vector_of(rotation: ArrayLike) -> Floats:
    """The vector about which and by whose length, in radians, this rotation turns; its length is at most half a turn.

    By the quaternion of the rotation, from its largest component (Shepperd 1978), so that it is right near half a turn,
    where the antisymmetric part vanishes. At exactly half a turn both senses are the same; the first component is positive.

    >>> vector_of(turned([1e-5, -2e-5, 3e-5])).round(15).tolist()
    [1e-05, -2e-05, 3e-05]
    >>> vector_of(turned([0.0, 0.0, np.pi])).round(9).tolist()
    [0.0, 0.0, 3.141592654]
    """
    r = np.asarray(rotation, dtype=np.float64)
    twice = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    trace, diagonal = float(np.trace(r)), np.diag(r)
    largest = int(diagonal.argmax())
    if trace >= diagonal[largest]:
        part = np.array([1 + trace, *twice])  # 4 w (w, x, y, z)
    else:
        axis = (r + r.T)[largest]
        axis[largest] = 1 + 2 * diagonal[largest] - trace
        part = np.array([twice[largest], *axis])
    w, vector = float(part[0]), part[1:]
    sign = np.sign(w) or np.sign(vector[np.flatnonzero(vector)[0]])
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        return np.zeros(3)
    rotation_vector: Floats = vector * (sign * 2 * atan2(length, abs(w)) / length) + 0.0
    return rotation_vector


def angles_of(rotation: ArrayLike) -> tuple[float, float, float]:
    """The angles about X, Y and Z that make this rotation (RPY: Z, Y', X''), degrees.

    >>> [round(angle, 9) for angle in angles_of(from_angles(1.0, -2.0, 30.0))]
    [1.0, -2.0, 30.0]
    """
    r = np.asarray(rotation, dtype=np.float64)
    return (
        degrees(atan2(r[2, 1], r[2, 2])),
        degrees(atan2(-r[2, 0], hypot(r[0, 0], r[1, 0]))),
        degrees(atan2(r[1, 0], r[0, 0])),
    )


def from_angles(x: float, y: float, z: float) -> Floats:
    """The rotation of these angles, degrees: R = Rz Ry Rx."""
    rotation: Floats = (
        turned(np.radians([0.0, 0.0, z])) @ turned(np.radians([0.0, y, 0.0])) @ turned(np.radians([x, 0.0, 0.0]))
    )
    return rotation


def inverse(motion: Floats) -> Floats:
    """The motion that takes this one back."""
    back = motion[:3, :3].T
    return frame(back, -back @ motion[:3, 3])


def applied(motion: Floats, points: ArrayLike) -> Floats:
    """Points as rows, moved."""
    moved: Floats = np.asarray(points, dtype=np.float64) @ motion[:3, :3].T + motion[:3, 3]
    return moved


def on_pallet(pallet: Floats, part: Floats, pose: Floats | None = None) -> Floats:
    """Motion of a part that is off by `part` on a pallet that is off by `pallet`: one after the other, exactly.

    pose: where the pallet's own coordinates lie in those of the machine, if the part was measured in them.

    >>> lifted, shifted = frame(np.eye(3), [0.0, 0.0, 0.1]), frame(np.eye(3), [0.02, 0.0, 0.0])
    >>> on_pallet(lifted, shifted)[:3, 3].tolist()
    [0.02, 0.0, 0.1]
    """
    if pose is None:
        return pallet @ part
    return pallet @ pose @ part @ inverse(pose)
