"""Probed points of a part: a small picture of the variant with its points, as inline SVG. Colours come from the page.

How far a point lies from the part is drawn much enlarged, the scale is said; whether it lies inside or outside of it is true.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

from markupsafe import Markup, escape

from app.core.parameters import Parameters, Variant
from app.core.variants import fitted_points
from app.language.formatting import mm, um
from app.language.i18n import _

WIDTH, HEIGHT = 320.0, 252.0
RADIUS, REACH = 58.0, 20.0  # of the drawn part, and how far the largest residual stands off it
WORD_AWAY = 30.0
HALF_TURN = 180.0


def angle_of(parameters: Parameters, at: int, points: int) -> float:
    """Degrees at which a point lies: R26 between points, evenly spread if that is not said."""
    even = HALF_TURN if parameters.variant is Variant.INDEXED and points == 2 else 360.0 / points
    return at * (even if parameters.index is None else parameters.index)


def residuals_of(parameters: Parameters, points: Sequence[float]) -> list[float]:
    """Residual of each point, mm, from the points' mean; along the part, from the fitted line."""
    if parameters.variant is Variant.TWO_POINT:
        return [0.0 for _point in points]
    if parameters.variant is Variant.ALONG and len(points) > 1:
        return [point - fitted for point, fitted in zip(points, fitted_points(points), strict=True)]
    mean = sum(points) / len(points)
    return [point - mean for point in points]


def touches_picture(parameters: Parameters, points: Sequence[float]) -> Markup:
    """The points (means, mm) of one reading on the part; nothing for one point alone."""
    if len(points) < 2:
        return Markup("")
    variant = parameters.variant
    if variant is Variant.TWO_POINT:
        shapes, words = _across(points), _("Two points and their distance")
    elif variant in {Variant.INDEXED, Variant.ROUND}:
        shapes, words = _round(parameters, points), _("Points round the part")
    else:
        shapes, words = _along(parameters, points), _("Points along the part")
    values = ", ".join(f"{at} {mm(point)}" for at, point in enumerate(points, start=1))
    return Markup(  # noqa: S704 - built here out of numbers and our own words, the label escaped
        f'<svg class="touches-picture" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(words)}: {escape(values)}">'
        f"{''.join(shapes)}</svg>"
    )


def _enlarged(residuals: Sequence[float]) -> float:
    """Pixels per mm."""
    largest = max(map(abs, residuals))
    return REACH / largest if largest > 0 else 0.0


def _round(parameters: Parameters, points: Sequence[float]) -> list[str]:
    residuals = residuals_of(parameters, points)
    scale = _enlarged(residuals)
    x0, y0 = WIDTH / 2, HEIGHT / 2
    shapes = [
        f'<circle class="part" cx="{x0:g}" cy="{y0:g}" r="{RADIUS:g}"/>',
        f'<path class="axis" d="M{x0 - 6:g} {y0:g}h12M{x0:g} {y0 - 6:g}v12"/>',
    ]
    for at, residual in enumerate(residuals):
        turn = -angle_of(parameters, at, len(points)) * pi / HALF_TURN
        ray = (cos(turn), sin(turn))
        foot, tip, word = (
            (x0 + r * ray[0], y0 + r * ray[1]) for r in (RADIUS, RADIUS + residual * scale, RADIUS + REACH + WORD_AWAY)
        )
        shapes += _point(at, foot, tip, word, residual)
    return shapes


def _along(parameters: Parameters, points: Sequence[float]) -> list[str]:
    """The profile: heights about the mean, with the fitted line where the taper is known."""
    mean = sum(points) / len(points)
    heights = [point - mean for point in points]
    scale = 2.2 * _enlarged(heights)
    left, right, middle = 34.0, WIDTH - 34.0, HEIGHT / 2
    at_x = [left + (right - left) * at / (len(points) - 1) for at in range(len(points))]
    shapes = [f'<path class="axis" d="M{left - 16:g} {middle:g}H{right + 16:g}"/>']
    if parameters.variant is Variant.ALONG:
        line = [fitted - mean for fitted in fitted_points(points)]
        shapes.append(
            f'<path class="fit" d="M{at_x[0]:.1f} {middle - line[0] * scale:.1f}L{at_x[-1]:.1f} {middle - line[-1] * scale:.1f}"/>'
        )
    for at, (x, height) in enumerate(zip(at_x, heights, strict=True)):
        tip = (x, middle - height * scale)
        shapes += _point(at, (x, middle), tip, (x, middle + 84.0), height)
    return shapes


def _across(points: Sequence[float]) -> list[str]:
    """Each pair of points with the distance between them."""
    pairs = list(zip(points[::2], points[1::2], strict=False))
    rows = [HEIGHT * (at + 1) / (len(pairs) + 1) for at in range(len(pairs))]
    shapes: list[str] = []
    for at, ((first, second), y) in enumerate(zip(pairs, rows, strict=True)):
        shapes += [
            f'<path class="fit" d="M48 {y:g}H{WIDTH - 48:g}"/>',
            *(f'<circle class="touch" cx="{x:g}" cy="{y:g}" r="6"/>' for x in (48, WIDTH - 48)),
            *(
                f'<text class="name" x="{x:g}" y="{y + 5:g}">{2 * at + number}</text>'
                for number, x in ((1, 30), (2, WIDTH - 30))
            ),
            f'<text class="value" x="{WIDTH / 2:g}" y="{y - 8:g}">{mm(abs(second - first))}</text>',
        ]
    return shapes


def _point(
    at: int, foot: tuple[float, float], tip: tuple[float, float], word: tuple[float, float], residual: float
) -> list[str]:
    return [
        f'<path class="residual" d="M{foot[0]:.1f} {foot[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}"/>',
        f'<circle class="touch" cx="{tip[0]:.1f}" cy="{tip[1]:.1f}" r="5"/>',
        f'<text class="name" x="{word[0]:.1f}" y="{word[1] - 2:.1f}">{at + 1}</text>',
        f'<text class="value" x="{word[0]:.1f}" y="{word[1] + 12:.1f}">{um(residual)}</text>',
    ]
