"""A drawing as SVG in a page, in the colours of its theme: attributes only, no styles, so that a strict policy lets it in."""

from html import escape

from app.charts.marks import Area, Dot, Drawing, Line, Mark, Words
from app.charts.palette import followed


def svg(drawing: Drawing, says: str, name: str) -> str:
    """The picture. says: what it shows, for those who cannot see it; name: unique on the page."""
    size = f'viewBox="0 0 {drawing.width:g} {drawing.height:g}"'
    parts = [f'<svg class="drawing" {size} role="img" aria-label="{escape(says)}" xmlns="http://www.w3.org/2000/svg">']
    for number, group in enumerate(drawing.groups):
        if group.clip is not None:
            box = group.clip
            parts.append(
                f'<clipPath id="{name}-{number}"><rect x="{box.left:g}" y="{box.top:g}" width="{box.width:g}" '
                f'height="{box.height:g}"/></clipPath><g clip-path="url(#{name}-{number})">'
            )
        else:
            parts.append("<g>")
        parts += [_mark(mark) for mark in group.marks]
        parts.append("</g>")
    parts.append("</svg>")
    return "".join(parts)


def _mark(mark: Mark) -> str:
    match mark:
        case Line():
            dash = f' stroke-dasharray="{" ".join(f"{part:g}" for part in mark.dash)}"' if mark.dash else ""
            points = _points(mark.places)
            return f'<polyline points="{points}" fill="none" stroke="{followed(mark.colour)}" stroke-width="{mark.width:g}"{dash}/>'
        case Area():
            return f'<polygon points="{_points(mark.places)}"{_paint(mark)}/>'
        case Dot():
            return f'<circle cx="{mark.at[0]:.1f}" cy="{mark.at[1]:.1f}" r="{mark.radius:g}"{_paint(mark)}/>'
        case Words():
            x, y = mark.at
            turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if mark.turned else ""
            bold = ' font-weight="600"' if mark.bold else ""
            return (
                f'<text x="{x:.1f}" y="{y:.1f}" font-size="{mark.size:g}" fill="{followed(mark.colour)}" '
                f'text-anchor="{mark.anchor}"{bold}{turned}>{escape(mark.text)}</text>'
            )


def _points(places: tuple[tuple[float, float], ...]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)


def _paint(mark: Area | Dot) -> str:
    edge = f' stroke="{followed(mark.edge)}" stroke-width="{mark.width:g}"' if mark.edge and mark.width else ""
    return f' fill="{followed(mark.fill) if mark.fill else "none"}"{edge}'
