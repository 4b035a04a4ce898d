"""Layout of probed points on a part: if they hold it, how well, and which further point would help most.

The rows ``[n, (r - g) x n]`` are taken about the middle g of the touches and turns are counted in the touches' reach L, so
that shifts and turns compare: a unit of either moves a touch by about as much. The ratio of the largest to the smallest
singular value of these rows is the condition; the motion of the smallest is the one that is known worst.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from app.core.geometry.points import Floats

MOTIONS = ("a", "b", "c", "lambda", "beta", "gamma")
WORST_CONDITION = 1e5  # beyond it a micrometre at a touch is a tenth of a metre of the part
SAME_NORMAL = 0.999  # cosine: a face


class Loose(StrEnum):
    """Reasons for which points do not hold the part. Worded at the edge."""

    TOO_FEW = "too_few"
    PARALLEL_NORMALS = "parallel_normals"  # no touch in some direction
    COLLINEAR_BASE = "collinear_base"  # C = 0: three touches of a face on one line
    SAME_PLACE = "same_place"  # two guide touches at one place
    LOOSE = "loose"  # some other motion is free
    NOT_321 = "not_321"  # the short form asks for another layout


class NotLaidOut(ValueError):
    """Touches that leave the part free to move.

    at: the touches meant, from 1; move: the one to move. free: the motion that nothing stops, shift and turn. helpful: the
    place and normal of a touch that would stop it.
    """

    def __init__(
        self,
        why: Loose,
        at: tuple[int, ...] = (),
        *,
        move: int | None = None,
        free: tuple[float, ...] = (),
        helpful: "Helpful | None" = None,
        have: int = 0,
        needed: int = 0,
    ) -> None:
        """Say why."""
        super().__init__(f"{why.value}: touches {', '.join(map(str, at))}" if at else why.value)
        self.why, self.at, self.move, self.free = why, at, move, free
        self.helpful, self.have, self.needed = helpful, have, needed


Helpful = tuple[tuple[float, float, float], tuple[float, float, float], float]


@dataclass(frozen=True, eq=False)
class Layout:
    """The touches as rows, scaled, and what follows from them whatever they have found."""

    places: Floats
    normals: Floats
    middle: Floats
    reach: float
    columns: tuple[int, ...]  # of the motions that are solved for
    scaled: Floats

    @property
    def solved_for(self) -> tuple[str, ...]:
        """The names of the unknowns."""
        return tuple(MOTIONS[column] for column in self.columns)

    @property
    def factors(self) -> Floats:
        """Factors that turn the scaled unknowns into mm and radians."""
        return np.array([1.0, 1.0, 1.0, *([1 / self.reach] * 3)])

    def scale(self, facing: Floats, moments: Floats) -> Floats:
        """Rows of this scaling for other normals and moments."""
        rows: Floats = (np.column_stack([facing, moments]) * self.factors)[:, self.columns]
        return rows

    def spread(self, scaled: Floats) -> Floats:
        """Scaled unknowns as all six motions, mm and radians."""
        motions = np.zeros(6)
        motions[list(self.columns)] = scaled
        return motions * self.factors

    @property
    def singular(self) -> Floats:
        """The singular values, largest first, one per unknown."""
        values = np.linalg.svd(self.scaled, compute_uv=False)
        return np.pad(values, (0, len(self.columns) - len(values)))

    @property
    def condition(self) -> float:
        """Largest by smallest singular value; infinite where a motion is free."""
        values = self.singular
        return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")

    @property
    def weakest(self) -> Floats:
        """The motion that is known worst: shift and scaled turn about the middle, of length 1."""
        directions = np.linalg.svd(self.scaled)[2]
        motion = np.zeros(6)
        motion[list(self.columns)] = directions[-1]
        return motion

    @property
    def covariance(self) -> Floats:
        """Covariance of all six motions about the middle, mm and radians, for points with variance 1."""
        full = np.zeros((6, 6))
        full[np.ix_(self.columns, self.columns)] = np.linalg.inv(self.scaled.T @ self.scaled)
        covariance: Floats = full * np.outer(self.factors, self.factors)
        return covariance

    @property
    def leverage(self) -> Floats:
        """Share of each point in its own fitted value: 1 where no other checks it."""
        q = np.linalg.qr(self.scaled)[0]
        held: Floats = (q**2).sum(axis=1)
        return held

    @property
    def helpful(self) -> Helpful | None:
        """The touch more, on a face or across an axis that has none, which makes the weakest motion most certain."""
        before = float(self.singular[-1])
        best: tuple[float, float, Floats, Floats] | None = None
        for normal, places in _candidates(self.places, self.normals):
            for place in places:
                row = self.scale(normal[None, :], np.cross(place - self.middle, normal)[None, :])
                values = np.linalg.svd(np.vstack([self.scaled, row]), compute_uv=False)
                least = float(np.pad(values, (0, len(self.columns) - len(values)))[-1])
                volume = float(np.log(values + 1e-12).sum())
                if best is None or (round(least, 12), volume) > (round(best[0], 12), best[1] + 1e-12):
                    best = (least, volume, place, normal)
        if best is None or best[0] <= before * 1.001:
            return None
        gain = best[0] / before if before > best[0] / WORST_CONDITION else float("inf")
        x, y, z = (float(value) for value in best[2])
        i, j, k = (float(value) for value in best[3])
        return (x, y, z), (i, j, k), gain


def layout_of(places: Floats, normals: Floats, solve_for: Sequence[str] = MOTIONS) -> Layout:
    """The layout of these touches. Raises `NotLaidOut` where there are fewer of them than unknowns."""
    columns = tuple(at for at, name in enumerate(MOTIONS) if name in solve_for)
    # Taken about the middle, a motion that is not solved for would come in by the back door.
    middle = places.mean(axis=0) if len(columns) == len(MOTIONS) else np.zeros(3)
    about = places - middle
    reach = float(np.sqrt((about**2).sum(axis=1).mean())) or 1.0
    rows = np.column_stack([normals, np.cross(about, normals) / reach])[:, columns]
    layout = Layout(places, normals, middle, reach, columns, rows)
    if len(places) < len(columns):
        raise NotLaidOut(Loose.TOO_FEW, have=len(places), needed=len(columns), helpful=layout.helpful)
    return layout


def refuse_loose(layout: Layout) -> None:
    """Raises `NotLaidOut` where a motion is free, or as good as free."""
    if layout.condition <= WORST_CONDITION:
        return
    free = tuple((layout.weakest + 0.0).tolist())
    why, at, move = _cause(layout)
    raise NotLaidOut(why, at, move=move, free=free, helpful=layout.helpful)


def faces_of(normals: Floats) -> list[list[int]]:
    """The touches by the face they are on: those whose normals are parallel."""
    faces: list[list[int]] = []
    for at, normal in enumerate(normals):
        mine = next((face for face in faces if abs(float(normals[face[0]] @ normal)) > SAME_NORMAL), None)
        if mine is None:
            faces.append([at])
        else:
            mine.append(at)
    return faces


def _cause(layout: Layout) -> tuple[Loose, tuple[int, ...], int | None]:
    """Fault of the layout, the points concerned, and the one of them to move."""
    directions = layout.normals if len(layout.columns) == len(MOTIONS) else np.eye(3)
    faces = faces_of(layout.normals)
    if np.linalg.svd(directions, compute_uv=False)[-1] < 1e-6 or len(directions) < 3:
        spare = _spare(layout)
        mine = next(face for face in faces if spare in face)
        return Loose.PARALLEL_NORMALS, tuple(at + 1 for at in mine), spare + 1
    for face in sorted(faces, key=len, reverse=True):
        places = layout.places[face]
        normal = layout.normals[face[0]]
        flat = places - places.mean(axis=0)
        flat -= np.outer(flat @ normal, normal)
        extents = np.linalg.svd(flat, compute_uv=False)
        numbers = tuple(at + 1 for at in face)
        if len(face) > 1 and extents[0] < 1e-6 * max(1.0, layout.reach):
            return Loose.SAME_PLACE, numbers, numbers[-1]
        if len(face) > 2 and extents[1] < 1e-6 * extents[0]:
            return Loose.COLLINEAR_BASE, numbers, numbers[int(np.linalg.norm(flat, axis=1).argmin())]
        across = _guiding(layout, face)
        if across is not None and len(face) == 2 and float(np.ptp(flat @ across)) < 1e-6 * max(1.0, layout.reach):
            return Loose.SAME_PLACE, numbers, numbers[-1]
    return Loose.LOOSE, (), int(layout.leverage.argmin()) + 1


def _spare(layout: Layout) -> int:
    """The touch that is missed least where it is moved: of whose finding the others say most; the last of equals."""
    left, sizes, _right = np.linalg.svd(layout.scaled, full_matrices=False)
    held = (left[:, sizes > sizes[0] / WORST_CONDITION] ** 2).sum(axis=1).round(9)
    return int(np.flatnonzero(held == held.min())[-1])


def _guiding(layout: Layout, face: list[int]) -> Floats | None:
    """For a face with two touches, the direction in which they must lie apart: along the face with the most touches."""
    base = max(faces_of(layout.normals), key=len)
    if base is face or len(base) < 3:
        return None
    across = np.cross(layout.normals[base[0]], layout.normals[face[0]])
    length = float(np.linalg.norm(across))
    return across / length if length > 1e-6 else None


def _candidates(places: Floats, normals: Floats) -> list[tuple[Floats, Floats]]:
    """Places for a further point: the corners of each face, as far as points reach, and across axes without a point."""
    low, high = places.min(axis=0), places.max(axis=0)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    candidates = []
    for face in faces_of(normals):
        normal = normals[face[0]]
        level = float((places[face] @ normal).mean())
        onto = corners - np.outer(corners @ normal - level, normal)
        candidates.append((normal, np.unique(onto.round(9), axis=0)))
    bare = [axis for axis in np.eye(3) if np.abs(normals @ axis).max() < 0.5]
    return candidates + [(axis, np.unique(corners.round(9), axis=0)) for axis in bare]
