"""The sentences about form: kinds, methods, verdicts, suspected touches, and why nothing can be said."""

from collections.abc import Mapping
from typing import Any

from app.core.geometry.elements import WrongSection
from app.core.geometry.form import FormKind
from app.core.geometry.points import Degenerate, Reason
from app.core.geometry.relations import DatumRefused
from app.errors import FieldError, Invalid
from app.language.formatting import NO_BREAK_SPACE, fixed, um
from app.language.i18n import _


def kind_word(kind: str) -> str:
    """Name of a kind of form."""
    return {
        "roundness": _("Roundness"),
        "straightness": _("Straightness"),
        "axis_straightness": _("Straightness of an axis"),
        "flatness": _("Flatness"),
        "coaxiality": _("Coaxiality"),
        "position": _("Position"),
        "parallelism": _("Parallelism"),
        "perpendicularity": _("Perpendicularity"),
    }.get(kind, kind)


def kinds() -> list[tuple[str, str]]:
    """Every kind with its name."""
    return [(kind.value, kind_word(kind)) for kind in FormKind]


def method_word(method: str) -> str:
    """The rule by which a deviation is judged."""
    return {
        "minimum_zone": _("Minimum zone"),
        "least_squares": _("Least squares"),
        "printed": _("Printed method"),
        "inscribed": _("Largest inscribed circle"),
        "circumscribed": _("Smallest circumscribed circle"),
    }.get(method, method)


def method_help(kind: str, method: str) -> str:
    """Explanation of a method's number."""
    if method == "printed":
        return _("2·max |A·X − Y + B| / √(A² + 1) over the section centres; it ignores the heights")
    return {
        ("roundness", "minimum_zone"): _("width of the narrowest ring that contains all points (MZC)"),
        ("roundness", "least_squares"): _("greatest less smallest radius about the fitted circle's centre (LSC)"),
        ("roundness", "inscribed"): _("greatest less smallest radius about its centre (MIC)"),
        ("roundness", "circumscribed"): _("greatest less smallest radius about its centre (MCC)"),
        ("straightness", "minimum_zone"): _("width of the narrowest strip that contains all points"),
        ("straightness", "least_squares"): _("highest less lowest point from the fitted line"),
        ("axis_straightness", "minimum_zone"): _("diameter of the narrowest cylinder that holds all section centres"),
        ("axis_straightness", "least_squares"): _("2 × greatest distance of a section centre from the fitted line"),
        ("flatness", "minimum_zone"): _("distance of the closest two parallel planes that contain all points"),
        ("flatness", "least_squares"): _("highest less lowest point from the fitted plane"),
        ("coaxiality", "least_squares"): _("2 × greatest distance of a section centre from the datum axis"),
        ("position", "least_squares"): _("2 × distance of the centre from where it should be"),
        ("parallelism", "minimum_zone"): _("width of the zone in the datum's direction that holds the feature"),
        ("parallelism", "least_squares"): _("tilt of the fitted feature over the length"),
        ("perpendicularity", "minimum_zone"): _("width of the zone square to the datum that holds the feature"),
        ("perpendicularity", "least_squares"): _("tilt of the fitted feature over the length"),
    }.get((kind, method), "")


def verdict_word(verdict: str | None) -> str:
    """The verdict in one or two words."""
    return {
        "good": _("Good"),
        "good_unsure": _("Good, not certain"),
        "bad_unsure": _("Not good, not certain"),
        "bad": _("Not good"),
        None: _("No tolerance"),
    }.get(verdict, str(verdict))


def deviation(value: float | None, decimals: int = 1) -> str:
    r"""A form deviation or a tolerance in µm; it has no sign.

    >>> deviation(0.0082), deviation(None)
    ('8.2\xa0µm', '–')
    """
    return "–" if value is None else f"{value * 1000:.{decimals}f}{NO_BREAK_SPACE}µm"


def sentence(value: float, tolerance: float | None, uncertainty: float | None, verdict: str | None) -> str:
    """The verdict in a sentence."""
    values = {"value": deviation(value), "tolerance": deviation(tolerance), "uncertainty": deviation(uncertainty)}
    match verdict:
        case None:
            text = _("{value}; no tolerance was stated.")
        case "good" if uncertainty is None:
            text = _("{value} is within the tolerance {tolerance}; these points do not show how certain that is.")
        case "good":
            text = _("{value} ± {uncertainty} is within the tolerance {tolerance}.")
        case "bad" if uncertainty is None:
            text = _("{value} is more than the tolerance {tolerance}; these points do not show how certain that is.")
        case "bad":
            text = _("{value} ± {uncertainty} is more than the tolerance {tolerance}.")
        case "good_unsure":
            text = _(
                "{value} is within the tolerance {tolerance}, but its uncertainty of ± {uncertainty} reaches beyond: "
                "probe more points or repeat."
            )
        case _:
            text = _(
                "{value} is more than the tolerance {tolerance}, but its uncertainty of ± {uncertainty} reaches below: "
                "probe more points or repeat."
            )
    return text.format(**values)


def place(suspect: Mapping[str, Any]) -> str:
    """Name of a suspect point."""
    datum = suspect["of"] == "datum"
    if suspect["section"] is None:
        text = _("Datum, point {touch}") if datum else _("Point {touch}")
    elif datum:
        text = _("Datum, section {section}, point {touch}")
    else:
        text = _("Section {section}, point {touch}")
    return text.format(section=suspect["section"], touch=suspect["touch"])


def suspicion(suspect: Mapping[str, Any]) -> str:
    """Sentence on a suspect point, with the value that would fit."""
    given = " ".join(coordinate(value) for value in suspect["given"])
    text = _("{place} ({given}) deviates by {off} from the other points.").format(
        place=place(suspect), given=given, off=um(suspect["off"])
    )
    alone = likeliest(suspect)
    if alone is not None:
        axis, value = alone
        text += " " + _("A typing error? With {axis} near {value} it would fit.").format(
            axis="XYZ"[axis], value=coordinate(value)
        )
    else:
        nearest = " ".join(coordinate(value) for value in suspect["nearest"])
        text += " " + _("A fitting point would be near ({nearest}).").format(nearest=nearest)
    return text + " " + _("Look for a chip or a typing error and probe it again; no point was left out.")


def likeliest(suspect: Mapping[str, Any]) -> tuple[int, float] | None:
    """The coordinate that must change least for the touch to fit, and its value; None where no single one would do."""
    changes = [
        (abs(there - here), axis, there)
        for axis, (here, there) in enumerate(zip(suspect["given"], suspect["alone"], strict=True))
        if there is not None
    ]
    return min(changes)[1:] if changes else None


def coordinate(value: float) -> str:
    """A coordinate in mm, to the micrometre.

    >>> coordinate(-6.096)
    '−6.096'
    """
    return fixed(value, 3)


def flatness_in_words(points: list[list[float]], residuals: list[float]) -> str:
    """Content of the map in words, for people who cannot see it."""
    high, low = residuals.index(max(residuals)), residuals.index(min(residuals))
    return _("Highest at point {high} ({at_high}): {above}. Lowest at point {low} ({at_low}): {below}.").format(
        high=high + 1,
        at_high=" ".join(coordinate(value) for value in points[high]),
        above=um(residuals[high]),
        low=low + 1,
        at_low=" ".join(coordinate(value) for value in points[low]),
        below=um(residuals[low]),
    )


def refused(refusal: Degenerate | WrongSection | DatumRefused, kind: str, given: Mapping[str, Any]) -> Invalid:
    """Refusal of points that determine no result, with the remedy, at the field concerned."""
    folder, touched = "", given
    if isinstance(refusal, DatumRefused):
        folder, touched = "datum.", given.get("datum") or {}
        refusal = refusal.reason
    if isinstance(refusal, WrongSection):
        field = f"{folder}sections[{refusal.number - 1}].touches"
        where, reason = _("Section {number}: ").format(number=refusal.number), refusal.reason
    else:
        field = folder + ("sections" if touched.get("sections") else "points")
        where, reason = "", refusal
    if folder:
        where = _("Datum: ") + where
    why, what = _why(reason, kind, sections=field.endswith("sections"))
    return Invalid(where + why, what, errors=[FieldError(field, where + why)])


def tip_too_large() -> Invalid:
    """A tip that leaves no shaft: its centre cannot have gone round one on so small a circle."""
    return Invalid.at(
        "tip_diameter",
        _("the tip is as large as the circle of its centre, so no shaft remains"),
        do=_("State the diameter of the tip in mm; for a bore choose the side inside."),
    )


def _why(reason: Degenerate, kind: str, *, sections: bool) -> tuple[str, str]:
    at = ", ".join(map(str, reason.at))
    values = {"have": f"{reason.have:g}", "needed": f"{reason.needed:g}", "at": at, "kind": kind_word(kind)}
    why, what = {
        Reason.TOO_FEW: (
            _("{kind} needs {needed} sections or more; there are {have}.")
            if sections
            else _("{kind} needs {needed} points or more; there are {have}."),
            _("Probe the missing ones, spread over the whole feature."),
        ),
        Reason.NOT_FINITE: (_("Points {at} are not numbers."), _("Correct them.")),
        Reason.TOO_FAR: (_("Points {at} are more than a kilometre away."), _("Coordinates are in mm.")),
        Reason.COINCIDENT: (
            _("Sections {at} are at the same height, so they show no direction.")
            if sections
            else _("Points {at} coincide, so there are too few different points."),
            _("Take the sections at different heights.")
            if sections
            else _("Probe another place instead of one of them."),
        ),
        Reason.COLLINEAR: (
            _("All points lie on one straight line."),
            _("Probe at least one point well off that line."),
        ),
        Reason.SHORT_ARC: (
            _("The points cover an arc of only {have}°; {needed}° are needed: the centre is too uncertain.")
            if reason.have
            else _("The points lie on a line rather than on a circle."),
            _("Spread the points round the circle, over more than half of it if possible."),
        ),
        Reason.NO_DIRECTION: (
            _("The points do not show the direction of the feature."),
            _("State the height of every section.") if sections else _("Probe points further apart along it."),
        ),
    }.get(
        reason.reason,
        (
            _("Nothing can be fitted through these points."),
            _("Look for a point that is far off, and probe more points."),
        ),
    )
    return why.format(**values), what
