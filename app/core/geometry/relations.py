"""Form and position against a datum or a drawing: coaxiality, position, parallelism, perpendicularity. Lengths in mm.

Parallelism and perpendicularity come down to one question: are the direction of the feature (of an axis; of a plane its
normal) and the direction of the datum meant to agree, or to stand square? Two axes or two planes agree when parallel, an
axis and a plane when square.

The zone is that of ISO 1101: an axis that is to agree lies in a cylinder along the datum, one that is to stand square in a
slab across it; a plane that is to agree in a slab across it, one that is to stand square in the narrowest slab that holds
the datum's direction. Over a stated length the angle counts: ``L |f x d|`` or ``L |f d|``.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.core.geometry.discs import circumscribed
from app.core.geometry.elements import Element, Point, WrongSection, axis_through, centres_of, heights_of, plane_through
from app.core.geometry.form import (
    Form,
    FormKind,
    Method,
    ProbedFeature,
    Value,
    across,
    axis_details,
    axis_straightness,
    flatness,
    replaced,
    roundness,
    section_details,
    straightness,
)
from app.core.geometry.form_uncertainty import zone_multipliers
from app.core.geometry.minimum_zones import minimum_zone_line
from app.core.geometry.points import Degenerate, Reason, frame
from app.core.geometry.suspect_points import in_bore, in_plane

ENGINE = 1  # counts up when a change makes stored touches evaluate otherwise


@dataclass(frozen=True, slots=True)
class Task:
    """Request for one deviation: its kind, the feature, and the datum or tolerance it refers to.

    nominal: where the centre should be, mm, for position. length: over which a tilt counts, mm; else over the feature.
    """

    kind: FormKind
    feature: ProbedFeature
    datum: ProbedFeature | None = None
    nominal: Point | None = None
    length: float | None = None


class DatumRefused(ValueError):
    """The datum's touches do not carry an element, and why."""

    def __init__(self, reason: Degenerate | WrongSection) -> None:
        super().__init__(f"datum: {reason}")
        self.reason = reason


def evaluate(task: Task) -> Form:
    """The deviation by every method that applies, with suspects and details. Raises `Degenerate`, `WrongSection`,
    `DatumRefused`.

    >>> from app.core.geometry.elements import Section
    >>> bore = lambda x, z: Section(((x + 5.0, 0.0), (x, 5.0), (x - 5.0, 0.0)), z)
    >>> datum = ProbedFeature((bore(0.0, 0.0), bore(0.0, 20.0)))
    >>> round(evaluate(Task(FormKind.COAXIALITY, ProbedFeature((bore(0.003, 40.0),)), datum)).values[0].value, 6)
    0.006
    """
    match task.kind:
        case FormKind.ROUNDNESS:
            return roundness(task.feature)
        case FormKind.STRAIGHTNESS:
            return straightness(task.feature)
        case FormKind.AXIS_STRAIGHTNESS:
            return axis_straightness(task.feature)
        case FormKind.FLATNESS:
            return flatness(task.feature)
        case FormKind.POSITION:
            return position(task.feature, task.nominal or (0.0, 0.0))
    datum = task.datum or ProbedFeature()
    try:
        against = _element(datum)
    except (Degenerate, WrongSection) as reason:
        raise DatumRefused(reason) from None
    suspect = in_bore(datum.sections) if datum.sections else in_plane(datum.points)
    form = coaxiality(task.feature, datum, against) if task.kind is FormKind.COAXIALITY else orientation(task, against)
    return replace(form, datum=suspect)


def corrected(task: Task, form: Form) -> Form | None:
    """The same with suspected touches where they would have to be; None where there are none."""
    if not form.suspicion.suspects and not form.datum.suspects:
        return None
    datum = task.datum and replaced(task.datum, form.datum.suspects)
    return evaluate(replace(task, feature=replaced(task.feature, form.suspicion.suspects), datum=datum))


def coaxiality(feature: ProbedFeature, datum: ProbedFeature, axis: Element) -> Form:
    """Twice the greatest distance of the feature's centres from the datum's axis. Raises `Degenerate`, `WrongSection`."""
    heights = heights_of(feature.sections) if len(feature.sections) > 1 else None
    if heights is None and [section.height for section in feature.sections if section.height is not None]:
        heights = np.array([section.height for section in feature.sections], dtype=np.float64)
    if not feature.sections:
        raise Degenerate(Reason.TOO_FEW, have=0, needed=1)
    if heights is None or not axis.lengthwise:
        raise Degenerate(Reason.NO_DIRECTION)
    centres = centres_of(feature.sections)
    points = np.column_stack([[centre.at for centre in centres], heights])
    away = across(points, axis.point, axis.direction)
    distances = np.linalg.norm(away, axis=1)
    worst = int(distances.argmax())
    unit = away[worst] / distances[worst] if distances[worst] > 0 else frame(axis.direction)[0]
    lever = float((points[worst] - axis.point) @ axis.direction)
    own = float(unit[:2] @ centres[worst].cofactors @ unit[:2])
    rests = float(unit @ axis.cofactors.mean(axis=0) @ unit) / len(axis.points) + lever**2 * float(
        unit @ axis.tilt @ unit
    )
    details_of_sections = section_details(feature.sections)
    for section, off in zip(details_of_sections, away.tolist(), strict=True):
        section["off"] = off
    details = {
        "sections": details_of_sections,
        "datum": axis_details(axis),
        "datum_sections": section_details(datum.sections),
    }
    value = Value(Method.LEAST_SQUARES, 2 * float(distances[worst]), 4 * (own + rests))
    return Form((value,), in_bore(feature.sections), details=details)


def position(feature: ProbedFeature, nominal: Point) -> Form:
    """Twice the greatest distance of the feature's centres from where they should be. Raises `Degenerate`."""
    if not feature.sections:
        raise Degenerate(Reason.TOO_FEW, have=0, needed=1)
    centres = centres_of(feature.sections)
    away = np.array([centre.at for centre in centres]) - np.asarray(nominal[:2], dtype=np.float64)
    distances = np.linalg.norm(away, axis=1)
    worst = int(distances.argmax())
    unit = away[worst] / distances[worst] if distances[worst] > 0 else np.array([1.0, 0.0])
    details_of_sections = section_details(feature.sections)
    for section, off in zip(details_of_sections, away.tolist(), strict=True):
        section["off"] = off
    own = float(unit @ centres[worst].cofactors @ unit)
    value = Value(Method.LEAST_SQUARES, 2 * float(distances[worst]), 4 * own)
    return Form(
        (value,), in_bore(feature.sections), details={"sections": details_of_sections, "nominal": list(nominal[:2])}
    )


def orientation(task: Task, datum: Element) -> Form:
    """Parallelism or perpendicularity of an axis or a plane to an axis or a plane. Raises `Degenerate`, `WrongSection`."""
    feature = _element(task.feature)
    agree = (feature.lengthwise is datum.lengthwise) is (task.kind is FormKind.PARALLELISM)
    length = task.length or feature.length
    f, d = feature.direction, datum.direction
    if agree:
        off = f - d * (f @ d)
        sine = float(np.linalg.norm(off))
        tilts = feature.tilt + datum.tilt
        spread = off @ tilts @ off / sine**2 if sine > 1e-12 else float(np.linalg.eigvalsh(tilts)[-1])
    else:
        sine = abs(float(f @ d))
        spread = d @ feature.tilt @ d + f @ datum.tilt @ f
    tilted = Value(Method.LEAST_SQUARES, length * sine, length**2 * float(spread))
    zone = _zone(feature, datum, agree=agree)
    values = (tilted, zone) if task.length else (zone, tilted)
    suspicion = in_bore(task.feature.sections) if feature.lengthwise else in_plane(task.feature.points)
    details: dict[str, Any] = {
        "feature": axis_details(feature),
        "datum": axis_details(datum),
        "angle": float(np.degrees(np.arcsin(min(1.0, sine)))),
        "length": length,
    }
    if feature.lengthwise:
        about = feature.points - feature.point
        wrong = across(about, np.zeros(3), d) if agree else np.outer(about @ d, d)
        details_of_sections = section_details(task.feature.sections)
        for section, out in zip(details_of_sections, wrong.tolist(), strict=True):
            section["off"] = out
        details["sections"] = details_of_sections
    else:
        details["residuals"] = ((feature.points - feature.point) @ f).tolist()
    return Form(values, suspicion, details=details)


def _zone(feature: Element, datum: Element, *, agree: bool) -> Value:
    """The zone in the datum's direction; with the multipliers l and directions w of its bearing points its cofactor is
    ``sum l^2 w'Qw``, and ``m'Tm`` more for the tilt of the datum, with ``m = sum l w x p``.
    """
    d = datum.direction
    points = feature.points - feature.point
    flat = frame(d)[:2]
    if feature.lengthwise is agree:  # an axis along the datum, or a plane that holds its direction: looked at along it
        seen = points @ flat.T
        if feature.lengthwise:
            disc = circumscribed(seen)
            bearing, width = list(disc.at), 2 * disc.radius
            away = seen[bearing] - disc.centre
            units = away / max(disc.radius, 1e-300)
            shares = 2 * zone_multipliers(units, np.ones(len(bearing)))
        else:
            strip = minimum_zone_line(seen)
            bearing, width = list(strip.at), strip.width
            sides = np.where((seen[bearing] - strip.point) @ strip.normal > 0, 1.0, -1.0)
            along = (seen[bearing] - strip.point) @ np.array([strip.normal[1], -strip.normal[0]])
            shares = zone_multipliers(along[:, None], sides)
            units = sides[:, None] * strip.normal
        directions = units @ flat
    else:
        heights = points @ d
        bearing, width = [int(heights.argmax()), int(heights.argmin())], float(np.ptp(heights))
        shares, directions = np.ones(2), np.array([d, -d])
    own = float(shares**2 @ np.einsum("ji,jik,jk->j", directions, feature.cofactors[bearing], directions))
    moment = np.cross((shares[:, None] * np.cross(directions, points[bearing])).sum(axis=0), d)
    return Value(Method.MINIMUM_ZONE, width, own + float(moment @ datum.tilt @ moment))


def _element(touched: ProbedFeature) -> Element:
    """An axis where there are sections, a plane where there are points."""
    return axis_through(touched.sections) if touched.sections else plane_through(touched.points)
