"""The sentences about alignments: why touches do not hold a part, how well they do, what would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from app.core.geometry.layout import Loose, NotLaidOut
from app.language.formatting import MINUS, short
from app.language.i18n import _, ngettext

GOOD, WEAK = 10.0, 100.0  # conditions
WORTH_A_TOUCH = 1.05  # by less, a touch more makes nothing more certain that anybody would see

SHIFT_ALONE = 3  # points that find the shift of a part, one on each base


def kind_word(kind: str) -> str:
    """Name of a kind of alignment."""
    return {
        "points": _("Points"),
        "two_points": _("Two points"),
        "two_holes": _("Two holes"),
        "pallet": _("Pallet and part"),
    }.get(kind, kind)


def method_word(method: str) -> str:
    """Name of a method of computation."""
    return {
        "exact": _("exact, finite rotation"),
        "small": _("small angles, rows [n, r×n]"),
        "printed": _("printed short form, 3-2-1"),
    }.get(method, method)


def motion_word(name: str) -> str:
    """Name of an unknown motion."""
    return {
        "a": _("shift in X"),
        "b": _("shift in Y"),
        "c": _("shift in Z"),
        "lambda": _("turn about X"),
        "beta": _("turn about Y"),
        "gamma": _("turn about Z"),
    }[name]


def direction(normal: Sequence[float]) -> str:
    """A normal as one says it: +Z, or its numbers."""
    for axis, name in enumerate("XYZ"):
        if abs(normal[axis]) > 0.9995:
            return ("+" if normal[axis] > 0 else MINUS) + name
    return "(" + ", ".join(short(value, 3) for value in normal) + ")"


def place(point: Sequence[float]) -> str:
    """A point."""
    return "(" + ", ".join(short(value, 4) for value in point) + ")"


def motion(weakest: Sequence[float]) -> str:
    """A motion in words: the largest of its shifts and turns."""
    names = ("a", "b", "c", "lambda", "beta", "gamma")
    strongest = max(abs(share) for share in weakest) if weakest else 0.0
    words = [motion_word(name) for name, share in zip(names, weakest, strict=False) if abs(share) > 0.4 * strongest > 0]
    others = ", ".join(words[1:])
    return _("{motion} together with {others}").format(motion=words[0], others=others) if others else "".join(words)


def condition(value: float) -> str:
    """Sentence on how well the points hold the part."""
    if value <= GOOD:
        return _("The points locate the part well (condition {value:.3g}).").format(value=value)
    if value <= WEAK:
        return _(
            "The points locate the part, but one motion is much less certain than the others (condition {value:.3g})."
        ).format(value=value)
    return _(
        "The points locate the part poorly (condition {value:.3g}): a small error of one point moves it a lot."
    ).format(value=value)


def weakest(motion_shares: Sequence[float]) -> str:
    """Sentence on the least certain motion."""
    return _("Least certain: {motion}.").format(motion=motion(motion_shares))


def advice(point: Mapping[str, Any] | None) -> str:
    """Sentence on the point that would help most."""
    if point is None:
        return ""
    gain = point["gain"]
    where = {"place": place(point["place"]), "normal": direction(point["normal"])}
    if gain is None:
        return _("A point near {place} on the face {normal} would fix it.").format(**where)
    if gain < WORTH_A_TOUCH:
        return _("No single additional point makes this much more certain.")
    return _("One more point near {place} on the face {normal} makes this {gain:.2g} times as certain.").format(
        **where, gain=gain
    )


def misfits(groups: Sequence[Sequence[int]]) -> list[str]:
    """Touches that do not fit, each with what it may be."""
    sentences = []
    for group in groups:
        if len(group) == 1:
            sentences.append(_("Point {n} does not fit the others: chip, burr, or a wrong number?").format(n=group[0]))
        else:
            sentences.append(
                _("One of the points {n} does not fit; the others cannot show which one.").format(
                    n=", ".join(map(str, group))
                )
            )
    return sentences


def checked(touches: int, unknown: int) -> str:
    """Sentence on points that no other point checks."""
    spare = touches - unknown
    if spare <= 0:
        return _("As many points as unknowns, so nothing checks them. One more point would.")
    return ngettext(
        "{n} point more than needed checks the others.", "{n} points more than needed check the others.", spare
    ).format(n=spare)


def difference(method: str, value: float) -> str:
    """Sentence on what small angles leave out."""
    if method == "exact":
        return _("The small-angle solution would move a point by {value}.").format(value=f"{value * 1000:.1f} µm")
    return _("The exact solution is not the same: {method}.").format(method=method_word(method))


def loose(problem: NotLaidOut) -> tuple[str, str]:
    """Reason for which the points leave the part free, and the point to move."""
    at = ", ".join(map(str, problem.at))
    helpful = None
    if problem.helpful is not None:
        spot, normal, _gain = problem.helpful
        helpful = {"place": spot, "normal": normal, "gain": None}
    remedy = advice(helpful)
    moving = (
        _("Move point {n} away from the others on its face.").format(n=problem.move) if problem.move is not None else ""
    )
    match problem.why:
        case Loose.TOO_FEW:
            wrong = _("{have} points cannot determine {needed} motions").format(
                have=problem.have, needed=problem.needed
            )
            moving = (
                _('Or find the shift alone: Unknowns X, Y and Z, no turn (`"solve_for": ["a", "b", "c"]`).')
                if problem.have == SHIFT_ALONE
                else ""
            )
        case Loose.PARALLEL_NORMALS:
            wrong = _("no point determines the {motion}: too many faces are parallel (points {at})").format(
                motion=motion(problem.free), at=at
            )
            moving = _("Put point {n} on another face.").format(n=problem.move)
        case Loose.COLLINEAR_BASE:
            wrong = _("points {at} lie on one line, so the part can still turn about it (C = 0)").format(at=at)
            moving = _("Move point {n} off the line.").format(n=problem.move)
        case Loose.SAME_PLACE:
            wrong = _("points {at} are at the same place: nothing determines the {motion}").format(
                at=at, motion=motion(problem.free)
            )
        case Loose.NOT_321:
            wrong = _("the printed short form needs six points: 1–3 in Z, 4 and 5 in Y, 6 in X")
            moving, remedy = _("Choose another method, or put the points in this order."), ""
        case Loose.LOOSE:
            wrong = _("nothing determines the {motion}").format(motion=motion(problem.free))
    return wrong, " ".join(filter(None, (moving, remedy)))


def as_text(method: str) -> str:
    """Instruction for the use of the program text."""
    return {
        "frame": _("Sets the program's frame: the part program stays as it is."),
        "offset": _("Sets a new work offset: shift and rotation from the machine's zero."),
    }[method]
