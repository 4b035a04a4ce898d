"""Standard deviations of position errors for which a control's protocol states none. Pure."""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import sqrt

from app.core.rotary.axis import AXES, AxisName, NoAxis, Position, estimate, rotation

STEP = 0.001  # mm; the estimate is linear, so any will do
UNKNOWNS = 7  # four errors, and where the ball lies


def stated_deviations(
    axis: AxisName, angles: Sequence[float], radius: float, scatter: float
) -> dict[str, float] | None:
    """Standard deviations of the position errors, mm and degrees, by name; None where these angles determine no axis.

    angles: where the ball was measured, degrees; radius: of the measuring circle, mm; scatter: rms of what is left when the
    errors are taken away (Q144 to Q146), mm. The ball is taken for lying at the height of the axis' zero, because protocols
    do not state its height: there the errors are surest.

    >>> deviations = stated_deviations("C", (-90, 0, 90, 180), 180.0, 0.002)
    >>> [round(deviations[name], 4) for name in ("EX0C", "EY0C", "EA0C", "EB0C")]
    [0.0009, 0.0009, 0.0004, 0.0004]
    """
    freedom = 3 * len(angles) - UNKNOWNS
    if freedom < 1 or radius <= 0:
        return None
    units = _of_one(axis, tuple(angles), float(f"{radius:.3g}"))
    noise = scatter * sqrt(len(angles) / freedom)
    return {name: noise * value for name, value in units.items()} or None


@lru_cache(maxsize=512)
def _of_one(axis: AxisName, angles: tuple[float, ...], radius: float) -> dict[str, float]:
    """The standard deviations if every coordinate had one of 1 mm; runs at intervals have the same angles and radius."""
    ball = [0.0, 0.0, 0.0]
    ball[(AXES.index(axis) + 1) % 3] = radius
    ideal = [Position(angle, _moved(rotation(axis, angle) @ ball)) for angle in angles]
    square: dict[str, float] = {}
    try:
        for at, one in enumerate(ideal):
            for place in range(3):
                moved = [*ideal[:at], one._replace(centre=_moved(one.centre, place)), *ideal[at + 1 :]]
                for name, estimated in estimate(axis, moved, ball).errors.items():
                    square[name] = square.get(name, 0.0) + (estimated.value / STEP) ** 2
    except NoAxis:
        return {}
    return {name: sqrt(value) for name, value in square.items()}


def _moved(centre: Iterable[float], place: int | None = None) -> tuple[float, float, float]:
    x, y, z = (float(value) + (STEP if at == place else 0.0) for at, value in enumerate(centre))
    return x, y, z
