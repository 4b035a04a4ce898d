"""Warnings about alignments and work zeros that a machine can hardly have measured. Lengths mm, angles degrees.

A part lies a little beside where it should, and a little turned: how much is set per machine (`Bounds`). What lies beyond is
more often a typing error, points exchanged, or inches taken for millimetres than a part. Residuals are held against the
probe's repeatability.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import hypot, radians
from typing import NamedTuple

import numpy as np

from app.core.geometry.alignment import Alignment, Touch
from app.core.geometry.frames import vector_of
from app.core.geometry.in_plane import InPlane
from app.core.geometry.points import Floats
from app.core.geometry.work_zero import MISFIT, Notice, Zero
from app.core.plausibility import looks_like_inches
from app.core.warning import CodedWarning, Value

RESIDUAL = 0.1  # mm; larger is suspicious where the user has not stated the repeatability of the probe
HOLES_APART = 1.0  # mm by which the distance of two holes may differ from the nominal one
FEELER = 1.0  # mm; a thicker feeler gauge is unusual
MOST_EXCHANGED = 40  # touches among which exchanged ones are looked for
MOST_NAMED = 20  # touches that are named one by one


class Bounds(NamedTuple):
    """Largest plausible set-up error of a machine: the turn in degrees, and the shift in mm."""

    turn: float = 5.0
    shift: float = 10.0


def motion_warnings(
    motion: Floats, middle: Sequence[float], bounds: Bounds, unknown: Floats | None = None
) -> Iterator[CodedWarning]:
    """Yield `turned_far` and `shifted_far` for a frame beyond the bounds.

    middle: of what was touched, nominal. The shift is the one of this place: a turn moves the origin, however far it lies.
    unknown: a direction along which the touches say nothing, as a unit vector; a shift along it does not count.

    >>> from app.core.geometry.frames import frame, from_angles
    >>> [w.code for w in motion_warnings(frame(from_angles(0, 0, 6), [0, 11, 0]), [0, 0, 0], Bounds())]
    ['turned_far', 'shifted_far']
    """
    turn = float(np.degrees(np.linalg.norm(vector_of(motion[:3, :3]))))
    if turn > bounds.turn:
        yield CodedWarning("turned_far", {"turn": round(turn, 4), "limit": bounds.turn})
    place = np.asarray(middle, dtype=np.float64)
    moved = motion[:3, :3] @ place + motion[:3, 3] - place
    if unknown is not None:
        moved = moved - unknown * (moved @ unknown)
    shift = float(np.linalg.norm(moved))
    if shift > bounds.shift:
        yield CodedWarning("shifted_far", {"shift": round(shift, 4), "limit": bounds.shift})


def alignment_warnings(
    touches: Sequence[Touch], alignment: Alignment, bounds: Bounds, repeatability: float | None = None
) -> list[CodedWarning]:
    """Return the warnings of an alignment by touches; the fields are those of ``touches[n]``."""
    nominal, measured = (np.array([touch[at] for touch in touches], dtype=np.float64) for at in (0, 2))
    warnings = list(_place_warnings(nominal, measured, alignment.motion, "touches", bounds))
    limit = RESIDUAL if repeatability is None else MISFIT * repeatability
    residuals = np.abs(alignment.residuals)
    if residuals.max() > limit:
        named = [group for group in alignment.misfits if residuals[[at - 1 for at in group]].max() > limit]
        for group in named or [(int(residuals.argmax()) + 1,)]:
            left = float(residuals[[at - 1 for at in group]].max())
            field = f"touches[{group[0] - 1}]"
            values: dict[str, Value] = {"touches": tuple(group), "residual": round(left, 6), "limit": limit}
            warnings.append(CodedWarning("touch_does_not_fit", values, field))
    return warnings


def plane_warnings(
    nominal: Sequence[Sequence[float]], measured: Sequence[Sequence[float]], fit: InPlane, name: str, bounds: Bounds
) -> list[CodedWarning]:
    """Return the warnings of an alignment by two points or two holes. name: of the field that holds them."""
    places, touched = (
        np.column_stack([np.asarray(rows, dtype=np.float64), np.zeros(len(rows))]) for rows in (nominal, measured)
    )
    warnings = list(_place_warnings(places, touched, fit.motion, name, bounds))
    unit_wrong = any(warning.code == "looks_like_inches" for warning in warnings)
    if fit.off is not None and abs(fit.off) > HOLES_APART and not unit_wrong:
        warnings.append(CodedWarning("holes_apart", {"off": round(fit.off, 6), "limit": HOLES_APART}, name))
    return warnings


def _place_warnings(
    nominal: Floats, measured: Floats, motion: Floats, name: str, bounds: Bounds
) -> Iterator[CodedWarning]:
    """Yield what the places say: the unit, points exchanged, touches far off; then what the frame says."""
    middle = nominal.mean(axis=0)
    reach = np.linalg.norm(nominal - middle, axis=1)
    allowed = bounds.shift + radians(bounds.turn) * reach  # what the largest plausible motion does to each place
    unit = _unit(reach, np.linalg.norm(measured - measured.mean(axis=0), axis=1))
    far = [int(at) for at in np.flatnonzero(np.linalg.norm(measured - nominal, axis=1) > allowed)]
    exchanged = None if unit else _exchanged(nominal, measured, far, allowed)
    if unit:
        yield CodedWarning("looks_like_inches", {"which": unit}, name)
    elif exchanged:
        one, other = exchanged
        yield CodedWarning("points_exchanged", {"touches": (one + 1, other + 1)}, f"{name}[{one}]")
    else:
        for at in far[:MOST_NAMED]:
            off = float(np.linalg.norm(measured[at] - nominal[at]))
            values: dict[str, Value] = {
                "touches": (at + 1,),
                "off": round(off, 4),
                "limit": round(float(allowed[at]), 4),
            }
            yield CodedWarning("touch_far_off", values, f"{name}[{at}]")
    along = measured[1] - measured[0]
    beside = along / (np.linalg.norm(along) or 1.0) if name == "side" else None
    yield from motion_warnings(motion, middle, bounds, beside)


def _unit(nominal: Floats, measured: Floats) -> str:
    """Return which of the two would fit in inches, by how far the places lie apart: `measured`, `nominal`, or neither."""
    nominal_reach, measured_reach = (float(np.sqrt((distances**2).sum())) for distances in (nominal, measured))
    if not nominal_reach or not measured_reach:
        return ""
    if looks_like_inches(measured_reach, nominal_reach):
        return "measured"
    return "nominal" if looks_like_inches(nominal_reach, measured_reach) else ""


def _exchanged(nominal: Floats, measured: Floats, far: Sequence[int], allowed: Floats) -> tuple[int, int] | None:
    """Return two touches that both fit where the other one should be."""
    for at, one in enumerate(far[:MOST_EXCHANGED]):
        for other in far[at + 1 : MOST_EXCHANGED]:
            crossed = np.linalg.norm(measured[[other, one]] - nominal[[one, other]], axis=1)
            if (crossed <= allowed[[one, other]]).all():
                return one, other
    return None


def zero_warnings(
    zero: Zero, bounds: Bounds, *, feeler: float = 0.0, before: Mapping[str, float] | None = None
) -> list[CodedWarning]:
    """Return the warnings of a work zero.

    before: the zero that its fixture is compared with, by axis (`x`, `y`, `z`).
    """
    warnings = []
    if abs(zero.rotation or 0.0) > bounds.turn:
        values = {"turn": round(abs(zero.rotation or 0.0), 4), "limit": bounds.turn}
        warnings.append(CodedWarning("turned_far", values))
    there = {
        axis: (value, (before or {})[axis])
        for axis in "xyz"
        if axis in (before or {}) and (value := getattr(zero, axis)) is not None
    }
    shift = hypot(*(here - was for here, was in there.values()))
    if there and all(looks_like_inches(here, was) for here, was in there.values()):
        warnings.append(CodedWarning("looks_like_inches", {"which": "measured"}))
    elif shift > bounds.shift:
        warnings.append(CodedWarning("shifted_far", {"shift": round(shift, 4), "limit": bounds.shift}))
    if Notice.MISFIT in zero.notices:
        worst = max(range(len(zero.residuals)), key=lambda at: abs(zero.residuals[at]))
        left = abs(zero.residuals[worst])
        warnings.append(CodedWarning("touch_does_not_fit", {"touches": (worst + 1,), "residual": round(left, 6)}))
    if Notice.NOT_SQUARE in zero.notices:
        warnings.append(CodedWarning("not_square", {"angle": round(zero.squareness or 0.0, 4)}))
    if feeler > FEELER:
        warnings.append(CodedWarning("feeler_unusual", {"feeler": feeler, "limit": FEELER}, "feeler"))
    return warnings
