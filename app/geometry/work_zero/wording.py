"""The sentences about work zeros and touches: why there is none, what to look at, whether a fixture has shifted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from app.core.geometry.edges import Problem, Unfit
from app.core.geometry.points import Degenerate, Reason
from app.core.geometry.work_zero import MOST_TURNED, Notice, Shift
from app.language.formatting import fixed, mm, signed, um
from app.language.i18n import _, ngettext

MICROMETRES_UP_TO = 10.0  # mm


def kind_word(kind: str) -> str:
    """Name of a kind of part."""
    return {
        "bore": _("Bore"),
        "boss": _("Boss"),
        "pocket": _("Pocket"),
        "web": _("Web"),
        "corner": _("Corner"),
    }.get(kind, kind)


def how(kind: str) -> str:
    """Instruction for probing, for the form."""
    return {
        "bore": _(
            "Probe the wall in opposite pairs: 1 and 2 give X, 3 and 4 give Y. Or at three points or more with X and Y of each."
        ),
        "boss": _(
            "Probe the boss from outside in opposite pairs: 1 and 2 give X, 3 and 4 give Y. Or at three points or more with X and Y of each."
        ),
        "pocket": _(
            "Probe opposite walls from within: 1 and 2 give X, 3 and 4 give Y. A second point on one wall shows the rotation."
        ),
        "web": _(
            "Probe opposite sides from outside: 1 and 2 give X, 3 and 4 give Y. A second point on one side shows the rotation."
        ),
        "corner": _(
            "Probe one side in X and the other in Y. Two points on a side show the rotation; two on both sides show if the corner is square."
        ),
    }[kind]


def value_word(name: str) -> str:
    """Name of a result."""
    return {
        "x": _("X"),
        "y": _("Y"),
        "z": _("Z"),
        "rotation": _("Rotation"),
        "diameter": _("Diameter"),
        "length": _("Length (X)"),
        "width": _("Width (Y)"),
        "squareness": _("Angle beyond 90°"),
    }.get(name, name)


def size(zero: Any) -> str:
    """Diameter, or length × width; what is not known is a dash."""
    if zero.diameter is not None:
        return f"⌀{fixed(zero.diameter, 3)}"
    if zero.length is None and zero.width is None:
        return "\N{EN DASH}"
    return " × ".join("\N{EN DASH}" if length is None else fixed(length, 3) for length in (zero.length, zero.width))


def numbers(at: Sequence[int]) -> str:
    """Touches as they are counted: 2, 3."""
    return ", ".join(map(str, at))


def unfit(problem: Unfit) -> tuple[str, str]:
    """Reason for which the points determine no zero, and the remedy."""
    at, axis = numbers(problem.at), problem.axis
    match problem.why:
        case Problem.TOO_FEW:
            return (
                ngettext("{have} point received", "{have} points received", int(problem.have)).format(
                    have=int(problem.have)
                ),
                _("Probe at least {needed} points.").format(needed=int(problem.needed)),
            )
        case Problem.NO_APPROACH:
            return (
                _("point {at} has no approach direction").format(at=at),
                _("State the approach: +X, −X, +Y or −Y."),
            )
        case Problem.NO_COORDINATE:
            return (
                _("point {at} has no {axis}").format(at=at, axis=axis),
                _(
                    "Every point needs X and Y where two lie on one side, because the part may be turned, and on a circle that is not probed in opposite pairs."
                ),
            )
        case Problem.ONE_SIDE if problem.at:
            return (
                _("{axis} was probed from one side only (point {at})").format(axis=axis, at=at),
                _("Probe the opposite side as well, or leave this axis out."),
            )
        case Problem.ONE_SIDE:
            return _("no side was probed in {axis}").format(axis=axis), _("A corner needs a side in X and one in Y.")
        case Problem.WRONG_SIDE:
            return (
                _("points {at} lie on the wrong side for their approach direction").format(at=at),
                _(
                    "Inside, the tip moves outwards; outside, towards the part. Is it the right kind, are X1 and X2 mixed up?"
                ),
            )
        case Problem.SAME_PLACE:
            return _("points {at} are at the same place").format(at=at), _("Probe two places that lie apart.")
        case Problem.SMALLER_THAN_TIP:
            return (
                _("the size would be {have}, with a tip of {needed}").format(
                    have=mm(problem.have), needed=mm(problem.needed)
                ),
                _("Check the tip's diameter, and if the part was probed from inside or outside."),
            )
        case Problem.TURNED_TOO_FAR:
            return (
                _("the part would be turned by {have}°").format(have=signed(problem.have, 1)),
                _("Beyond {most:g}° another side was probed: check the order of the points.").format(most=MOST_TURNED),
            )


def degenerate(problem: Degenerate) -> tuple[str, str]:
    """Reason for which nothing can be fitted through points, and the remedy."""
    at = numbers(problem.at)
    spread = _("Probe points that are spread out.")
    return {
        Reason.TOO_FEW: (
            ngettext("{have} point received", "{have} points received", int(problem.have)).format(
                have=int(problem.have)
            ),
            _("Probe at least {needed} points.").format(needed=int(problem.needed)),
        ),
        Reason.NOT_FINITE: (_("point {at} is not a number").format(at=at), _("Send numbers in mm.")),
        Reason.TOO_FAR: (_("point {at} lies too far away").format(at=at), _("Lengths are in mm.")),
        Reason.COINCIDENT: (_("points {at} are at the same place").format(at=at), spread),
        Reason.COLLINEAR: (_("the points lie on one line"), spread),
        Reason.COPLANAR: (_("the points lie in one plane"), spread),
        Reason.SHORT_ARC: (
            _("the points cover {have:g}° of the circle; {needed:g}° are needed").format(
                have=problem.have, needed=problem.needed
            ),
            _("Probe the other side of the circle as well."),
        ),
        Reason.NO_DIRECTION: (_("point {at} has no direction").format(at=at), _("A normal is not 0, 0, 0.")),
        Reason.NO_SOLUTION: (_("nothing fits the points"), _("Check the order of the points.")),
    }[problem.reason]


def notice(which: str) -> str:
    """Reason to check a zero before it is used."""
    return {
        Notice.ONE_SIDED.value: _(
            "The points lie on one side of the circle: its centre is several times less certain than a point."
        ),
        Notice.CHORDS.value: _(
            "Probed in pairs: X and Y are right, the diameter only if the tip went through the middle. A third point beside them would show it."
        ),
        Notice.MISFIT.value: _(
            "The residual of a point is larger than the probe's repeatability explains: a chip, a burr, a typing error, or another shape. The stated uncertainty is then wrong: probe again, or compute again without that point."
        ),
        Notice.ONE_AXIS.value: _(
            "The part is turned and was probed along one axis only: the zero is right only in the middle between these points, so the text leaves the rotation out. Probe the other axis as well."
        ),
        Notice.NOT_SQUARE.value: _("The sides of the corner are not at a right angle. X follows the side along X."),
    }.get(which, which)


def length(value: float | None) -> str:
    """A shift: µm, or mm where it is larger."""
    if value is not None and abs(value) >= MICROMETRES_UP_TO:
        return f"{signed(value, 3)}\N{NO-BREAK SPACE}mm"
    return um(value)


def shift_word(state: Shift | str) -> str:
    """State of a fixture, in one or two words."""
    return {
        "unknown": _("Not compared"),
        "steady": _("Steady"),
        "warning": _("Shifted"),
        "alarm": _("Shifted too far"),
    }[str(state)]


def shift(shifts: Mapping[str, float], reference: str) -> str:
    """Shift of the fixture, axis by axis."""
    if not shifts:
        return _("There is nothing to compare it with yet.")
    axes = ", ".join(f"{axis.upper()} {length(value)}" for axis, value in shifts.items())
    return _("Shifted against {reference}: {axes}.").format(reference=reference, axes=axes)


def basis_word(basis: str, reference: int | None = None) -> str:
    """Name of the reference of a comparison."""
    if basis == "frozen":
        return _("work zero {n}").format(n=reference)
    return {"first": _("the first zero"), "median": _("the median of the zeros before")}[basis]


def shifted(data: Mapping[str, Any]) -> str:
    """The sentence of the alarm *fixture shifted*."""
    axes = ", ".join(f"{axis.upper()} {length(value)}" for axis, value in (data.get("shifts") or {}).items())
    return _("Fixture {fixture} has shifted by {axes}; {limit} is allowed (work zero {zero}).").format(
        fixture=data.get("location"), axes=axes, limit=length(data.get("limit")).lstrip("+"), zero=data.get("zero")
    )
