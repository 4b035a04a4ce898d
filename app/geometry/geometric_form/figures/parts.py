"""Common parts of the pictures of form."""

from math import cos, floor, log10, pi, sin

from app.charts import Room

ROOM = Room(72, 16, 52, 36)


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
