"""Pictures small enough for a list: inline SVG, no script. Their colours come from the page's style sheet."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup, escape

from app.core.decision.limits import HasLimits, Limits, classify, within_tolerance
from app.core.natural_limit import half_of, natural_of, tolerance_about_target
from app.language.formatting import read_um, um_limit
from app.language.i18n import _
from app.views.characteristic.figures.labels import judged_sides
from app.views.characteristic.figures.scale import ZoneScale, bands, ends_of
from app.web.states import tone_of
from app.web.theme import ZONE_OUTLINES, zone_name

WIDTH, HEIGHT = 240.0, 44.0
BEYOND = 0.15  # of the height of a trend, beyond a natural limit
TOP, BOTTOM = 7.0, 37.0  # of the bands; the reading's mark and the average reach a little beyond them


def _mark(zone: str, x: float, y: float, size: float) -> str:
    """The outline of a zone's shape about a point."""
    scale = size / 24
    return (
        f'<path class="reading" data-tone="{tone_of(zone)}" d="{ZONE_OUTLINES.get(zone, ZONE_OUTLINES["zero"])}" '
        f'transform="translate({x - size / 2:.2f} {y - size / 2:.2f}) scale({scale:.4f})" vector-effect="non-scaling-stroke"/>'
    )


def band_picture(
    deviation: float | None, limits: HasLimits, zone: str | None = None, average: float | None = None
) -> Markup:
    """The last deviation (mm) in its band, too small at the left, too large at the right; the running average as a bar.

    zone: as it was decided; worked out from the deviation if not given.
    """
    scale = ZoneScale.of(limits)
    low, high = ends_of(scale)

    def x(position: float) -> float:
        return 1 + (position - low) / (high - low) * (WIDTH - 2)

    def outward(place: int, sign: int) -> float:
        """An edge that many bands from the target; beyond a natural limit there is the zero band, and one of what cannot be."""
        if sign == scale.natural.side and place < len(scale.edges):
            return sign * min(place, scale.beyond - 1)
        return max(low, min(high, float(sign * place)))

    parts = []
    for place, band in reversed(list(enumerate(bands(limits)))):
        left, right = x(outward(place + 1, -1)), x(outward(place + 1, 1))
        parts.append(
            f'<rect class="band-{band.number}" x="{left:.2f}" y="{TOP:g}" width="{right - left:.2f}" height="{BOTTOM - TOP:g}"/>'
        )
    for place, band in enumerate(bands(limits)):
        if band.limits:
            kind = "tolerance" if band.begins_outside else "limit"
            ends = [x(sign * place) for sign in judged_sides(scale.natural)]
            parts += [f'<path class="{kind}" d="M{at:.2f} {TOP:g}V{BOTTOM:g}"/>' for at in ends]
    parts.extend(
        (
            f'<path class="{"tolerance" if scale.natural.side else "target"}" d="M{x(0):g} {TOP:g}V{BOTTOM:g}"/>',
            f'<rect class="frame" x="0.5" y="{TOP:g}" width="{WIDTH - 1:g}" height="{BOTTOM - TOP:g}"/>',
        )
    )
    label = _("No reading yet")
    if average is not None:
        at = x(scale.position(average))
        parts.append(f'<path class="mean" d="M{at:.2f} {TOP - 4:g}V{BOTTOM + 4:g}"/>')
    if deviation is not None:
        zone = zone or classify(deviation, Limits.of(limits))
        at = min(max(x(scale.position(deviation)), 9), WIDTH - 9)
        parts.append(_mark(zone, at, (TOP + BOTTOM) / 2, 18))
        label = _("Last deviation {deviation}, zone {zone}").format(
            deviation=read_um(deviation, half_of(limits)), zone=zone_name(zone)
        )
        if average is not None:
            label += "; " + _("running average {average}").format(average=read_um(average, half_of(limits)))
    return Markup(  # noqa: S704 - built here out of numbers and our own words, the label escaped
        f'<svg class="band-picture flat" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(label)}">'
        f"{''.join(parts)}</svg>"
    )


def sparkline(deviations: Sequence[float], limits: HasLimits) -> Markup:
    """The last deviations (mm), oldest first, between the tolerance limits (dashed); those outside are marked.

    Twice the tolerance is high enough: what lies further out is drawn at the edge, as a mark.
    """
    width, height = 200.0, 44.0
    borders = Limits.of(limits)
    tolerance, natural = max(half_of(limits), 1e-6), natural_of(limits)
    reach = max(1.0, min(2.0, max((abs(d) for d in deviations), default=0.0) / tolerance)) * tolerance * 1.08

    low = -BEYOND if natural.side < 0 else -1.0
    high = BEYOND if natural.side > 0 else 1.0

    def y(deviation: float) -> float:
        return 3 + (high - max(low, min(high, deviation / reach))) / (high - low) * (height - 6)

    limits_judged = reversed(tolerance_about_target(tolerance, natural).judged)
    step = (width - 8) / max(len(deviations) - 1, 1)
    points = [(4 + i * step, y(d)) for i, d in enumerate(deviations)]
    parts = [
        f'<path class="target" d="M0 {y(0):g}H{width:g}"/>',
        f'<path class="edge" d="{"".join(f"M0 {y(limit):.2f}H{width:g}" for limit in limits_judged)}"/>',
    ]
    if points:
        parts.append(f'<polyline class="line" points="{" ".join(f"{px:.1f},{py:.1f}" for px, py in points)}"/>')
        # Dots are lines of no length with wide ends: they stay round however the picture is stretched.
        parts += [
            f'<path class="outside" d="M{px:.1f} {py:.1f}h0"/>'
            for (px, py), d in zip(points, deviations, strict=True)
            if not within_tolerance(d, borders)
        ]
        parts.append(f'<path class="last" d="M{points[-1][0]:.1f} {points[-1][1]:.1f}h0"/>')
        label = _("Trend of the last {n} deviations, from {first} to {last}").format(
            n=len(deviations),
            first=read_um(deviations[0], half_of(limits)),
            last=read_um(deviations[-1], half_of(limits)),
        )
    else:
        label = _("No reading yet")
    return Markup(  # noqa: S704 - as above
        f'<svg class="sparkline" viewBox="0 0 {width:g} {height:g}" preserveAspectRatio="none" role="img" aria-label="{escape(label)}">{"".join(parts)}</svg>'
    )


def tolerance_bar(deviations: Sequence[float], limits: HasLimits) -> Markup:
    """The tolerance used: from the smallest to the largest of the deviations (mm) as a bar, the newest as a line, between the limits.

    One and a half times the tolerance is wide enough: what lies further out is drawn at the edge.
    """
    width, height, beyond = 200.0, 20.0, 1.5
    borders, natural = Limits.of(limits), natural_of(limits)
    tolerance = max(half_of(limits), 1e-6)
    low = -BEYOND if natural.side < 0 else -beyond
    high = BEYOND if natural.side > 0 else beyond

    def x(deviation: float) -> float:
        return 2 + (max(low, min(high, deviation / tolerance)) - low) / (high - low) * (width - 4)

    judged = tolerance_about_target(tolerance, natural).judged
    parts = [f'<path class="edge" d="M{x(limit):.1f} 1V{height - 1:g}"/>' for limit in judged]
    parts.append(f'<path class="target" d="M{x(0):.1f} 1V{height - 1:g}"/>')
    label = _("No reading yet")
    if deviations:
        least, most = min(deviations), max(deviations)
        outside = not (within_tolerance(least, borders) and within_tolerance(most, borders))
        wide, state = x(most) - x(least) + 2, " outside" if outside else ""
        parts += [
            f'<rect class="used{state}" x="{x(least) - 1:.1f}" y="6" width="{wide:.1f}" height="{height - 12:g}"/>',
            f'<path class="last" d="M{x(deviations[-1]):.1f} 3V{height - 3:g}"/>',
        ]
        label = _(
            "The last {n} deviations lie between {least} and {most}; the tolerance is {tolerance} about the target"
        ).format(
            n=len(deviations),
            least=read_um(least, tolerance),
            most=read_um(most, tolerance),
            tolerance=um_limit(tolerance),
        )
    return Markup(  # noqa: S704 - as above
        f'<svg class="tolerance-bar" viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(label)}">{"".join(parts)}</svg>'
    )
