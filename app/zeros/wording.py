"""The sentences about work zeros and touches: why there is none, what to look at, whether a fixture has shifted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from app.core.geometry.edges import Problem, Unfit
from app.core.geometry.points import Degenerate, Reason
from app.core.geometry.work_zero import MOST_TURNED, Notice, Shift
from app.web.i18n import _, ngettext
from app.web.numbers import mm, signed, um

MICROMETRES_UP_TO = 10.0  # mm


def kind_word(kind: str) -> str:
    """What is touched."""
    return {
        "bore": _("Bore"),
        "boss": _("Boss"),
        "pocket": _("Pocket"),
        "web": _("Web"),
        "corner": _("Corner"),
    }.get(kind, kind)


def how(kind: str) -> str:
    """How it is touched, for the form."""
    return {
        "bore": _(
            "Touch the wall in opposite pairs: 1 and 2 give X, 3 and 4 give Y. Or at three places or more with X and Y of each."
        ),
        "boss": _(
            "Touch the boss from outside in opposite pairs: 1 and 2 give X, 3 and 4 give Y. Or at three places or more with X and Y of each."
        ),
        "pocket": _(
            "Touch opposite walls from within: 1 and 2 give X, 3 and 4 give Y. A second touch on one wall shows the rotation."
        ),
        "web": _(
            "Touch opposite sides from outside: 1 and 2 give X, 3 and 4 give Y. A second touch on one side shows the rotation."
        ),
        "corner": _(
            "Touch one side in X and the other in Y. Two touches on a side show the rotation; two on both, whether the corner is square."
        ),
    }[kind]


def value_word(name: str) -> str:
    """What a result is called."""
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


def size(found: Any) -> str:
    """Diameter, or length × width; what is not known is a dash."""
    if found.diameter is not None:
        return f"⌀{mm(found.diameter, 3)[:-3]}"
    if found.length is None and found.width is None:
        return "\N{EN DASH}"
    return " × ".join("\N{EN DASH}" if each is None else mm(each, 3)[:-3] for each in (found.length, found.width))


def numbers(at: Sequence[int]) -> str:
    """Touches as they are counted: 2, 3."""
    return ", ".join(map(str, at))


def unfit(problem: Unfit) -> tuple[str, str]:
    """Why the touches make no zero, and what to do."""
    at, axis = numbers(problem.at), problem.axis
    match problem.why:
        case Problem.TOO_FEW:
            return (
                ngettext("{have} touch came", "{have} touches came", int(problem.have)).format(have=int(problem.have)),
                _("Touch at least {needed} places.").format(needed=int(problem.needed)),
            )
        case Problem.NO_APPROACH:
            return (
                _("touch {at} does not say in which direction the tip was moved").format(at=at),
                _("Say the approach: +X, −X, +Y or −Y."),
            )
        case Problem.NO_COORDINATE:
            return (
                _("touch {at} does not say {axis}").format(at=at, axis=axis),
                _(
                    "Every touch needs X and Y where two lie on one side, since the part may be turned, and on a circle that is not touched in opposite pairs."
                ),
            )
        case Problem.ONE_SIDE if problem.at:
            return (
                _("{axis} was touched from one side only (touch {at})").format(axis=axis, at=at),
                _("Touch the opposite side too, or leave this axis out."),
            )
        case Problem.ONE_SIDE:
            return _("no side was touched in {axis}").format(axis=axis), _("A corner needs a side in X and one in Y.")
        case Problem.WRONG_SIDE:
            return (
                _("touches {at} lie on the wrong side for the direction they were made in").format(at=at),
                _(
                    "Inside, the tip moves outwards; outside, towards the part. Is it the right kind, are X1 and X2 mixed up?"
                ),
            )
        case Problem.SAME_PLACE:
            return _("touches {at} are at the same place").format(at=at), _("Touch two places that lie apart.")
        case Problem.SMALLER_THAN_TIP:
            return (
                _("the size would be {have}, with a tip of {needed}").format(
                    have=mm(problem.have), needed=mm(problem.needed)
                ),
                _("Check the tip's diameter, and whether it was touched from inside or outside."),
            )
        case Problem.TURNED_TOO_FAR:
            return (
                _("the part would be turned by {have}°").format(have=signed(problem.have, 1)),
                _("Beyond {most:g}° another side was touched: check which touch is which.").format(most=MOST_TURNED),
            )


def degenerate(problem: Degenerate) -> tuple[str, str]:
    """Why nothing can be fitted through touches, and what to do."""
    at = numbers(problem.at)
    spread = _("Touch places that are spread out.")
    return {
        Reason.TOO_FEW: (
            ngettext("{have} touch came", "{have} touches came", int(problem.have)).format(have=int(problem.have)),
            _("Touch at least {needed} places.").format(needed=int(problem.needed)),
        ),
        Reason.NOT_FINITE: (_("touch {at} is not a number").format(at=at), _("Send numbers in mm.")),
        Reason.TOO_FAR: (_("touch {at} lies too far away").format(at=at), _("Lengths are in mm.")),
        Reason.COINCIDENT: (_("touches {at} are at the same place").format(at=at), spread),
        Reason.COLLINEAR: (_("the touches lie on one line"), spread),
        Reason.COPLANAR: (_("the touches lie in one plane"), spread),
        Reason.SHORT_ARC: (
            _("the touches cover {have:g}° of the circle; {needed:g}° are needed").format(
                have=problem.have, needed=problem.needed
            ),
            _("Touch on the other side of the circle too."),
        ),
        Reason.NO_DIRECTION: (_("touch {at} has no direction").format(at=at), _("A normal is not 0, 0, 0.")),
        Reason.NO_SOLUTION: (_("nothing fits the touches"), _("Check which touch is which.")),
    }[problem.reason]


def notice(which: str) -> str:
    """What a zero should not be used without looking at."""
    return {
        Notice.ONE_SIDED.value: _(
            "The touches lie on one side of the circle: its centre is several times less certain than a touch."
        ),
        Notice.CHORDS.value: _(
            "Touched in pairs: X and Y are right, the diameter only if the tip went through the middle. A third place beside them would show it."
        ),
        Notice.MISFIT.value: _(
            "More is left at a touch than the probe's repeatability explains: a chip, a burr, a slip, or no such shape. The stated uncertainty does not hold then: touch again, or compute again without that touch."
        ),
        Notice.ONE_AXIS.value: _(
            "The part lies turned and was touched along one axis alone: the zero is right in the middle between these touches, and nowhere else, so the text leaves the rotation out. Touch the other axis too."
        ),
        Notice.NOT_SQUARE.value: _("The sides of the corner are not at a right angle. X follows the side along X."),
    }.get(which, which)


def length(value: float | None) -> str:
    """A shift: µm, or mm where it is larger."""
    if value is not None and abs(value) >= MICROMETRES_UP_TO:
        return f"{signed(value, 3)}\N{NO-BREAK SPACE}mm"
    return um(value)


def shift_word(state: Shift | str) -> str:
    """How a fixture stands, in one or two words."""
    return {
        "unknown": _("Not compared"),
        "steady": _("Steady"),
        "warning": _("Shifted"),
        "alarm": _("Shifted too far"),
    }[str(state)]


def shift(shifts: Mapping[str, float], reference: str) -> str:
    """By how much the fixture has shifted, axis by axis."""
    if not shifts:
        return _("There is nothing to compare it with yet.")
    axes = ", ".join(f"{axis.upper()} {length(value)}" for axis, value in shifts.items())
    return _("Shifted against {reference}: {axes}.").format(reference=reference, axes=axes)


def basis_word(basis: str, reference: int | None = None) -> str:
    """What is compared with."""
    if basis == "frozen":
        return _("work zero {n}").format(n=reference)
    return {"first": _("the first zero"), "median": _("the median of the zeros before")}[basis]


def shifted(data: Mapping[str, Any]) -> str:
    """The sentence of the alarm *fixture shifted*."""
    axes = ", ".join(f"{axis.upper()} {length(value)}" for axis, value in (data.get("shifts") or {}).items())
    return _("Fixture {fixture} has shifted by {axes}; {limit} is allowed. Work zero {zero} says so.").format(
        fixture=data.get("location"), axes=axes, limit=length(data.get("limit")).lstrip("+"), zero=data.get("zero")
    )
