"""The sentences about alignments: why touches do not hold a part, how well they do, what would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from app.core.geometry.layout import Loose, NotLaidOut
from app.web.i18n import _, ngettext
from app.web.numbers import MINUS

GOOD, WEAK = 10.0, 100.0  # conditions
WORTH_A_TOUCH = 1.05  # by less, a touch more makes nothing more certain that anybody would see


def kind_word(kind: str) -> str:
    """What was touched."""
    return {
        "points": _("Points"),
        "two_points": _("Two points"),
        "two_holes": _("Two holes"),
        "pallet": _("Pallet and part"),
    }.get(kind, kind)


def method_word(method: str) -> str:
    """How it was computed."""
    return {
        "exact": _("exact, finite rotation"),
        "small": _("small angles, rows [n, r×n]"),
        "printed": _("printed short form, 3-2-1"),
    }.get(method, method)


def motion_word(name: str) -> str:
    """What an unknown is called."""
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
    return "(" + ", ".join(f"{each:.3g}".replace("-", MINUS) for each in normal) + ")"


def place(point: Sequence[float]) -> str:
    """A point."""
    return "(" + ", ".join(f"{each:.4g}".replace("-", MINUS) for each in point) + ")"


def motion(weakest: Sequence[float]) -> str:
    """A motion in words: the largest of its shifts and turns."""
    names = ("a", "b", "c", "lambda", "beta", "gamma")
    strongest = max(abs(each) for each in weakest) if weakest else 0.0
    said = [motion_word(name) for name, each in zip(names, weakest, strict=False) if abs(each) > 0.4 * strongest > 0]
    others = ", ".join(said[1:])
    return _("{motion} together with {others}").format(motion=said[0], others=others) if others else "".join(said)


def condition(value: float) -> str:
    """How well the touches hold the part, in words."""
    if value <= GOOD:
        return _("The touches hold the part well (condition {value:.3g}).").format(value=value)
    if value <= WEAK:
        return _(
            "The touches hold the part, but one motion is much less certain than the others (condition {value:.3g})."
        ).format(value=value)
    return _(
        "The touches hardly hold the part (condition {value:.3g}): a small error of a touch moves it by a lot."
    ).format(value=value)


def weakest(found: Sequence[float]) -> str:
    """What is known worst."""
    return _("Least certain: {motion}.").format(motion=motion(found))


def advice(found: Mapping[str, Any] | None) -> str:
    """Which touch would help most."""
    if found is None:
        return ""
    gain = found["gain"]
    where = {"place": place(found["place"]), "normal": direction(found["normal"])}
    if gain is None:
        return _("A touch near {place} on the face {normal} would stop it.").format(**where)
    if gain < WORTH_A_TOUCH:
        return _("No single touch more makes that much more certain.")
    return _("One touch more near {place} on the face {normal} makes that {gain:.2g} times as certain.").format(
        **where, gain=gain
    )


def misfits(groups: Sequence[Sequence[int]]) -> list[str]:
    """Touches that do not fit, each with what it may be."""
    said = []
    for group in groups:
        if len(group) == 1:
            said.append(_("Touch {n} does not fit the others: chip, burr, or a wrong number?").format(n=group[0]))
        else:
            said.append(
                _("One of the touches {n} does not fit; which of them, the others cannot tell.").format(
                    n=", ".join(map(str, group))
                )
            )
    return said


def checked(touches: int, unknown: int) -> str:
    """Whether anything checks the touches."""
    spare = touches - unknown
    if spare <= 0:
        return _("As many touches as unknowns: nothing is left over, so nothing checks them. One touch more would.")
    return ngettext(
        "{n} touch more than needed checks the others.", "{n} touches more than needed check the others.", spare
    ).format(n=spare)


def difference(method: str, value: float) -> str:
    """What small angles leave out."""
    if method == "exact":
        return _("Small angles would have put a touch {value} elsewhere.").format(value=f"{value * 1000:.1f} µm")
    return _("The exact solution is not the same: {method}.").format(method=method_word(method))


def loose(problem: NotLaidOut) -> tuple[str, str]:
    """Why the touches leave the part free, and which one to move."""
    at = ", ".join(map(str, problem.at))
    helpful = None
    if problem.helpful is not None:
        spot, normal, _gain = problem.helpful
        helpful = {"place": spot, "normal": normal, "gain": None}
    remedy = advice(helpful)
    moving = (
        _("Move touch {n} away from the others on its face.").format(n=problem.move) if problem.move is not None else ""
    )
    match problem.why:
        case Loose.TOO_FEW:
            wrong = _("{have} touches cannot hold {needed} motions").format(have=problem.have, needed=problem.needed)
            moving = ""
        case Loose.PARALLEL_NORMALS:
            wrong = _("no touch stops the {motion}: too many faces are parallel (touches {at})").format(
                motion=motion(problem.free), at=at
            )
            moving = _("Put touch {n} on another face.").format(n=problem.move)
        case Loose.COLLINEAR_BASE:
            wrong = _("touches {at} lie on one line, so the part can still turn about it (C = 0)").format(at=at)
            moving = _("Move touch {n} off the line.").format(n=problem.move)
        case Loose.SAME_PLACE:
            wrong = _("touches {at} guide at one and the same place: nothing stops the {motion}").format(
                at=at, motion=motion(problem.free)
            )
        case Loose.NOT_321:
            wrong = _("the printed short form is for six touches: 1–3 in Z, 4 and 5 in Y, 6 in X")
            moving, remedy = _("Choose another method, or order the touches so."), ""
        case Loose.LOOSE:
            wrong = _("nothing stops the {motion}").format(motion=motion(problem.free))
    return wrong, " ".join(filter(None, (moving, remedy)))


def as_text(method: str) -> str:
    """What is to be done with the text."""
    return {
        "frame": _("Sets the program's frame: the part program stays as it is."),
        "offset": _("Sets the work offset anew: shift and rotation from the machine's zero."),
    }[method]
