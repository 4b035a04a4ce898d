"""Small pictures of capability for tables: an index with its interval on a scale of its own. Inline SVG, no script."""

from markupsafe import Markup, escape

from app.core.spc.capability import CAPABLE, VERY_CAPABLE, Index
from app.language.i18n import _
from app.quality.capability.tables import CapabilityVerdict
from app.quality.capability.wording import between, index

WIDTH, HEIGHT, MOST = 260.0, 28.0, 3.0
MARKS = (1.0, CAPABLE, VERY_CAPABLE)


def interval(found: Index, *, allowed: bool = True) -> Markup:
    """The index as a dot on its interval; lines at 1, 1.33 and 1.67. What lies beyond 3 is drawn at the edge."""

    def x(value: float) -> float:
        return 6 + min(max(value, 0.0), MOST) / MOST * (WIDTH - 12)

    lines = "".join(f'<path class="mark" d="M{x(mark):.1f} 3V{HEIGHT - 3:g}"/>' for mark in MARKS)
    low, high = (
        found.low if found.low is not None else 0.0,  # no reading bounds it from below
        found.high if found.high is not None else found.value,
    )
    label = _("{value}, interval {between}").format(value=index(found.value), between=between(found))
    return Markup(  # noqa: S704 - made of numbers, the label escaped
        f'<svg class="interval{"" if allowed else " unquoted"}" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(label)}">'
        f'<path class="axis" d="M6 {HEIGHT / 2:g}H{WIDTH - 6:g}"/>{lines}'
        f'<path class="reach" d="M{x(low):.1f} {HEIGHT / 2:g}H{x(high):.1f}"/>'
        f'<circle class="dot" cx="{x(found.value):.1f}" cy="{HEIGHT / 2:g}" r="5"/></svg>'
    )


def stored_interval(verdict: CapabilityVerdict) -> Markup:
    """The index that the periodic job stored; nothing where none may be quoted. A preliminary one is drawn hollow."""
    if verdict.value is None:
        return Markup()
    return interval(Index(verdict.value, verdict.low, verdict.high, None), allowed=not verdict.preliminary)
