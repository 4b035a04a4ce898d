"""Common parts of the pictures of form."""

from collections.abc import Sequence
from math import cos, floor, log10, pi, sin
from typing import Any

from app.web.theme import Palette, ThemeName, layout, legend


def framed(theme: ThemeName, **more: Any) -> dict[str, Any]:
    """The layout with a legend above the picture."""
    margin = {"l": 72, "r": 16, "t": 36, "b": 52}
    return layout(theme, **({"margin": margin, "showlegend": True, "legend": legend(theme)} | more))


def titled(text: str, colours: Palette, **more: Any) -> dict[str, Any]:
    """An axis with its name."""
    return {"title": {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 8}} | more


def note(text: str, colours: Palette, **more: Any) -> dict[str, Any]:
    """A quiet word in the picture."""
    return {"text": text, "showarrow": False, "font": {"size": 13, "color": colours.quiet}} | more


def circle(x: float, y: float, radius: float, steps: int = 120) -> tuple[list[float], list[float]]:
    """A circle as a line."""
    angles = [2 * pi * step / steps for step in range(steps + 1)]
    return [x + radius * cos(angle) for angle in angles], [y + radius * sin(angle) for angle in angles]


def rounded_up(value: float) -> float:
    """The next of 1, 2, 5 times a power of ten.

    >>> rounded_up(0.0034), rounded_up(7.0)
    (0.005, 10.0)
    """
    if value <= 0:
        return 1e-6
    power = 10.0 ** floor(log10(value))
    return next(round(step * power, 12) for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9))


def line(x: Sequence[Any], y: Sequence[Any], colour: str, name: str | None = None, **more: Any) -> dict[str, Any]:
    """A line that says nothing when pointed at."""
    style = {"width": 1.5, "color": colour} | more.pop("line", {})
    return {
        "type": "scatter",
        "mode": "lines",
        "x": list(x),
        "y": list(y),
        "line": style,
        "name": name,
        "showlegend": name is not None,
        "hoverinfo": "skip",
    } | more
