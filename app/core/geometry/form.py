"""Form and position from touches: what is asked, how it is answered, and the verdict.

===================  ===========================================================  ====================================
what                 least squares                                                minimum zone
===================  ===========================================================  ====================================
roundness            greatest less smallest radius about the circle's centre      narrowest ring
straightness         highest less lowest touch from the line                      narrowest strip
axis straightness    2 x greatest distance of a section's centre from the line    diameter of the narrowest cylinder
                     in space
flatness             highest less lowest touch from the plane                     narrowest slab
coaxiality           2 x greatest distance of a centre from the datum axis        --
position             2 x distance from where it should be                         --
parallelism,         length x sine of the angle that is wrong                     narrowest slab or cylinder in the
perpendicularity                                                                  datum's direction
===================  ===========================================================  ====================================

The verdict goes by the minimum zone, which is what ISO 1101 means, unless another method is asked for. A deviation on the
limit is good. Lengths are mm; `relations` holds what needs a datum.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from math import hypot, sqrt
from typing import Any, NamedTuple

import numpy as np

from app.core.decision.limits import nanometres
from app.core.geometry.circle import Circle, fit_circle
from app.core.geometry.discs import circumscribed, inscribed
from app.core.geometry.elements import Point, Section, WrongSection, axis_through, centres_of, heights_of
from app.core.geometry.form_uncertainty import COVERAGE, range_cofactor, zone_multipliers
from app.core.geometry.line import fit_line
from app.core.geometry.minimum_zones import (
    minimum_zone_axis,
    minimum_zone_circle,
    minimum_zone_line,
    minimum_zone_plane,
)
from app.core.geometry.plane import fit_plane
from app.core.geometry.points import Degenerate, Floats, Reason, frame, points_of, surface_of
from app.core.geometry.suspect_points import SuspectPoint, SuspectPoints, in_bore, in_line, in_plane, in_section


class FormKind(StrEnum):
    """Characteristic of form or position."""

    ROUNDNESS = "roundness"
    STRAIGHTNESS = "straightness"
    AXIS_STRAIGHTNESS = "axis_straightness"
    FLATNESS = "flatness"
    COAXIALITY = "coaxiality"
    POSITION = "position"
    PARALLELISM = "parallelism"
    PERPENDICULARITY = "perpendicularity"


class Method(StrEnum):
    """Rule by which a deviation is computed."""

    MINIMUM_ZONE = "minimum_zone"
    LEAST_SQUARES = "least_squares"
    PRINTED = "printed"
    INSCRIBED = "inscribed"
    CIRCUMSCRIBED = "circumscribed"


class Verdict(StrEnum):
    """Within the tolerance or not, and certain or not by the uncertainty."""

    GOOD = "good"
    GOOD_UNSURE = "good_unsure"
    BAD_UNSURE = "bad_unsure"
    BAD = "bad"

    @property
    def good(self) -> bool:
        """True if the measured deviation is within the tolerance."""
        return self in {Verdict.GOOD, Verdict.GOOD_UNSURE}

    @property
    def sure(self) -> bool:
        """True if the limit lies outside the uncertainty."""
        return self in {Verdict.GOOD, Verdict.BAD}


@dataclass(frozen=True, slots=True)
class ProbedFeature:
    """A feature: a bore or shaft in sections, or a surface or profile in points."""

    sections: tuple[Section, ...] = ()
    points: tuple[Point, ...] = ()


class Value(NamedTuple):
    """A deviation by one method, mm, and its cofactor where there is one."""

    method: Method
    value: float
    cofactor: float | None = None

    def uncertainty(self, repeatability: float | None) -> float | None:
        """Expanded (k = 2), mm. repeatability: standard deviation of a touch, mm."""
        if repeatability is None or self.cofactor is None:
            return None
        return COVERAGE * repeatability * sqrt(self.cofactor)


@dataclass(frozen=True, slots=True)
class Form:
    """Deviations with suspect points. details: centres, axes, residuals, as plain lists, for tables and pictures."""

    values: tuple[Value, ...]
    suspicion: SuspectPoints = field(default_factory=SuspectPoints)  # touches of the feature that do not belong
    datum: SuspectPoints = field(default_factory=SuspectPoints)  # touches of the datum that do not
    details: dict[str, Any] = field(default_factory=dict)

    def by(self, method: Method | None) -> Value:
        """The value by this method; by the first, which is what the standard means, where it has none such."""
        return next((value for value in self.values if value.method is method), self.values[0])


def verdict(value: float, tolerance: float, uncertainty: float | None) -> Verdict:
    """Compare a deviation with its tolerance, mm, to the nanometre; on the limit is good.

    >>> verdict(0.005, 0.005, None).value, verdict(0.0045, 0.005, 0.001).value, verdict(0.0082, 0.005, 0.001).value
    ('good', 'good_unsure', 'bad')
    """
    good = nanometres(value) <= nanometres(tolerance)
    if uncertainty is not None and abs(value - tolerance) < uncertainty:
        return Verdict.GOOD_UNSURE if good else Verdict.BAD_UNSURE
    return Verdict.GOOD if good else Verdict.BAD


def printed_straightness(centres: Sequence[Point]) -> float:
    """Straightness of an axis by the printed method, mm: ``2 max |A X_i - Y_i + B|/sqrt(A^2 + 1)``, ``Y = A X + B`` by
    least squares in Y. It ignores the heights, so it sees a bend only where it does not lie along the tilt.

    >>> round(printed_straightness([(0.0, 0.0), (1.0, 0.01), (2.0, 0.0)]), 6)
    0.013333
    """
    x, y = np.asarray(centres, dtype=np.float64).T
    about = x - x.mean()
    square = float(about @ about)
    if square <= 0:
        raise Degenerate(Reason.NO_DIRECTION)
    slope = float(about @ (y - y.mean())) / square
    return 2 * float(np.abs(slope * about - (y - y.mean())).max()) / hypot(slope, 1)


def roundness(feature: ProbedFeature) -> Form:
    """Evaluate the roundness of one section or more; the worst one counts. Raises `Degenerate` and `WrongSection`.

    >>> lobed = ((10.01, 0.0), (0.0, 9.99), (-10.01, 0.0), (0.0, -9.99))
    >>> [(value.method.value, round(value.value, 6)) for value in roundness(ProbedFeature((Section(lobed),))).values[:2]]
    [('minimum_zone', 0.02), ('least_squares', 0.02)]
    """
    if not feature.sections:
        raise Degenerate(Reason.TOO_FEW, have=0, needed=1)
    values_of_sections, details, tested = [], [], True
    suspects: list[SuspectPoint] = []
    for number, section in enumerate(feature.sections, start=1):
        try:
            points_of(section.touches, 2, 4)
            values, circle, ring = _round(section)
        except Degenerate as reason:
            raise WrongSection(number, reason) from None
        suspect = in_section(section.touches, number)
        values_of_sections.append(values)
        suspects += suspect.suspects
        tested = tested and suspect.tested
        details.append(
            _circle_details(circle, section) | {"ring": ring} | {value.method.value: value.value for value in values}
        )
    methods = [
        method for method in Method if all(any(v.method is method for v in values) for values in values_of_sections)
    ]
    worst = [
        max((v for values in values_of_sections for v in values if v.method is method), key=lambda v: v.value)
        for method in methods
    ]
    return Form(tuple(worst), SuspectPoints(tuple(suspects), tested), details={"sections": details})


def _round(section: Section) -> tuple[list[Value], Circle, dict[str, Any]]:
    touches = np.asarray(section.touches, dtype=np.float64)
    circle, ring = fit_circle(touches), minimum_zone_circle(touches)
    away = touches - circle.centre
    jacobian = np.column_stack([away / np.linalg.norm(away, axis=1)[:, None], np.ones(len(away))])
    least = range_cofactor(circle.residuals, jacobian)
    bearing = list(ring.at)
    distances = np.linalg.norm(touches[bearing] - ring.centre, axis=1)
    sides = np.where(distances > (ring.inner + ring.outer) / 2, 1.0, -1.0)
    zone = zone_multipliers(-(touches[bearing] - ring.centre) / distances[:, None], sides)
    values = [
        Value(Method.MINIMUM_ZONE, ring.width, float(zone @ zone)),
        Value(Method.LEAST_SQUARES, circle.range, least),
    ]
    try:
        inner = inscribed(touches)
        reach = float(np.linalg.norm(touches - inner.centre, axis=1).max())
        values.append(Value(Method.INSCRIBED, reach - inner.radius))
    except Degenerate:
        pass  # an arc holds no circle; the other methods stand
    outer = circumscribed(touches)
    least_reach = float(np.linalg.norm(touches - outer.centre, axis=1).min())
    values.append(Value(Method.CIRCUMSCRIBED, outer.radius - least_reach))
    return values, circle, {"centre": ring.centre.tolist(), "inner": ring.inner, "outer": ring.outer}


def straightness(feature: ProbedFeature) -> Form:
    """Evaluate the straightness of a profile: points along it and across it. Raises `Degenerate`."""
    points_of(feature.points, 2, 3)
    line, strip = fit_line(feature.points), minimum_zone_line(feature.points)
    points = np.asarray(feature.points, dtype=np.float64)
    jacobian = np.column_stack([line.along, np.ones(len(points))])
    along = (points - strip.point) @ np.array([strip.normal[1], -strip.normal[0]])
    return Form(
        (
            Value(Method.MINIMUM_ZONE, strip.width, _slab_cofactor(points, strip, along[:, None])),
            Value(Method.LEAST_SQUARES, float(np.ptp(line.residuals)), range_cofactor(line.residuals, jacobian)),
        ),
        in_line(feature.points),
        details={"along": line.along.tolist(), "residuals": line.residuals.tolist(), "point": line.point.tolist()}
        | {"direction": line.direction.tolist()},
    )


def flatness(feature: ProbedFeature) -> Form:
    """Evaluate the flatness of a surface. Raises `Degenerate`."""
    surface_of(feature.points, 4)
    plane, slab = fit_plane(feature.points), minimum_zone_plane(feature.points)
    points = np.asarray(feature.points, dtype=np.float64)
    local = (points - plane.point) @ frame(plane.normal)[:2].T
    jacobian = np.column_stack([local, np.ones(len(points))])
    levers = (points - slab.point) @ frame(slab.normal)[:2].T
    return Form(
        (
            Value(Method.MINIMUM_ZONE, slab.width, _slab_cofactor(points, slab, levers)),
            Value(Method.LEAST_SQUARES, plane.range, range_cofactor(plane.residuals, jacobian)),
        ),
        in_plane(feature.points),
        details={"residuals": plane.residuals.tolist(), "point": plane.point.tolist(), "normal": plane.normal.tolist()},
    )


def _slab_cofactor(points: Floats, slab: Any, levers: Floats) -> float:
    bearing = list(slab.at)
    sides = np.where((points[bearing] - slab.point) @ slab.normal > 0, 1.0, -1.0)
    shares = zone_multipliers(levers[bearing], sides)
    return float(shares @ shares)


def axis_straightness(feature: ProbedFeature) -> Form:
    """Of the axis through the centres of three sections or more; without heights by the printed method alone.

    Raises `Degenerate` and `WrongSection`.
    """
    sections = feature.sections
    if len(sections) < 3:
        raise Degenerate(Reason.TOO_FEW, have=len(sections), needed=3)
    centres = centres_of(sections)
    details = section_details(sections)
    printed: tuple[Value, ...] = ()
    with suppress(Degenerate):  # where all centres have one X the printed method has no line
        printed = (Value(Method.PRINTED, printed_straightness([tuple(point.at) for point in centres])),)
    heights = heights_of(sections)
    if heights is None:
        if not printed:
            raise Degenerate(Reason.NO_DIRECTION)
        return Form(printed, in_bore(sections), details={"sections": details})
    points_of(heights, 1, 3)  # two heights are always on a line, however often they are touched
    axis = axis_through(sections)
    zone = minimum_zone_axis(axis.points)
    away = across(axis.points, axis.point, axis.direction)
    distances = np.linalg.norm(away, axis=1)
    levers = np.column_stack([np.ones(len(heights)), (heights - heights.mean()) / np.ptp(heights)])
    hat = levers @ np.linalg.pinv(levers)
    worst = int(distances.argmax())
    direction = away[worst] / distances[worst] if distances[worst] > 0 else frame(axis.direction)[0]
    spread = np.einsum("i,jik,k->j", direction, axis.cofactors, direction)
    least = 4 * float(((np.eye(len(hat)) - hat)[worst] ** 2) @ spread)
    values = (
        Value(Method.MINIMUM_ZONE, 2 * zone.radius, _cylinder_cofactor(axis.points, axis.cofactors, zone)),
        Value(Method.LEAST_SQUARES, 2 * float(distances.max()), least),
        *printed,
    )
    for point, off in zip(details, away.tolist(), strict=True):
        point["off"] = off
    return Form(values, in_bore(sections), details={"sections": details, "axis": axis_details(axis)})


def _cylinder_cofactor(points: Floats, cofactors: Floats, zone: Any) -> float:
    bearing = list(zone.at)
    away = across(points[bearing], zone.point, zone.direction)
    units = away / np.maximum(np.linalg.norm(away, axis=1), 1e-300)[:, None]
    axes = frame(zone.direction)
    flat = units @ axes[:2].T
    along = (points[bearing] - zone.point) @ zone.direction
    shares = zone_multipliers(np.hstack([flat, flat * along[:, None]]), np.ones(len(bearing)))
    return 4 * float(shares**2 @ np.einsum("ji,jik,jk->j", units, cofactors[bearing], units))


def across(points: Floats, point: Floats, direction: Floats) -> Floats:
    """Components of points across a line in space."""
    about = points - point
    components: Floats = about - np.outer(about @ direction, direction)
    return components


def section_details(sections: Sequence[Section]) -> list[dict[str, Any]]:
    """Sections with centre, radius, residuals, as plain values."""
    details = []
    for section, centre in zip(sections, centres_of(sections), strict=True):
        if centre.circle is None:
            details.append({"centre": centre.at.tolist(), "height": section.height, "radius": None, "residuals": []})
        else:
            details.append(_circle_details(centre.circle, section))
    return details


def _circle_details(circle: Circle, section: Section) -> dict[str, Any]:
    return {
        "centre": circle.centre.tolist(),
        "height": section.height,
        "radius": circle.radius,
        "arc": circle.arc,
        "residuals": circle.residuals.tolist(),
    }


def axis_details(element: Any) -> dict[str, Any]:
    """An axis or plane as plain values."""
    return {
        "point": element.point.tolist(),
        "direction": element.direction.tolist(),
        "length": element.length,
        "lengthwise": element.lengthwise,
    }


def replaced(feature: ProbedFeature, suspects: Sequence[SuspectPoint]) -> ProbedFeature:
    """The feature with suspected touches where they would have to be."""
    sections, points = [list(section.touches) for section in feature.sections], list(feature.points)
    for suspect in suspects:
        place = points if suspect.section is None else sections[suspect.section - 1]
        place[suspect.touch - 1] = suspect.nearest
    return ProbedFeature(
        tuple(
            section._replace(touches=tuple(touches))
            for section, touches in zip(feature.sections, sections, strict=True)
        ),
        tuple(points),
    )
