"""Small pictures of capability for tables: an index with its interval on a scale of its own. Inline SVG, no script."""

from collections.abc import Sequence

from markupsafe import Markup, escape

from app.core.spc.capability import CAPABLE, VERY_CAPABLE, Index
from app.language.i18n import _
from app.quality.capability.kinds import WEEKS, Week
from app.quality.capability.tables import CapabilityVerdict
from app.quality.capability.wording import between, index

WIDTH, HEIGHT, MOST = 260.0, 28.0, 3.0
MARKS = (1.0, CAPABLE, VERY_CAPABLE)
LOW, HIGH = 0.5, 2.2  # of the trend over weeks; what lies further out is drawn at the edge


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


def trend(weeks: Sequence[Week]) -> Markup:
    """The index week by week, the newest at the right, between lines at 1 and 1.33; nothing before there are two."""
    known = [week for week in weeks if week.value is not None]
    if len(known) < 2:
        return Markup()
    width, height, last = 80.0, 20.0, weeks[-1].begins

    def at(week: Week) -> str:
        ago = (last - week.begins).days / 7
        x = width - 4 - ago * (width - 8) / (WEEKS - 1)
        y = 2 + (HIGH - min(max(week.value or 0.0, LOW), HIGH)) / (HIGH - LOW) * (height - 4)
        return f"{x:.1f},{y:.1f}"

    lines = "".join(
        f'<path class="mark" d="M0 {2 + (HIGH - mark) / (HIGH - LOW) * (height - 4):.1f}H{width:g}"/>'
        for mark in MARKS[:2]
    )
    x, y = at(known[-1]).split(",")
    label = _("Index over {n} weeks: from {first} to {last}").format(
        n=len(known), first=index(known[0].value), last=index(known[-1].value)
    )
    return Markup(  # noqa: S704 - as above
        f'<svg class="index-trend" viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(label)}">{lines}'
        f'<polyline class="course" points="{" ".join(at(week) for week in known)}"/><circle class="dot" cx="{x}" cy="{y}" r="2.5"/></svg>'
    )
