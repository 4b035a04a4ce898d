"""Uncertainty from the signal path of the probe: the axis moves on while the signal travels (domain §4).

A probe wired straight to the control stops the axis position at the trigger. Through the PLC the signal waits for the
PLC's scan, up to a quarter of a millisecond, and the position is taken that much too late::

    position error = probing feed x delay        (150 mm/min x 0.25 ms = 0.625 µm)

A constant delay calibrates away at the same feed. The part that varies from point to point, its jitter, does not: it belongs in
the measurement uncertainty, and a zero range (R33) below it would correct what nobody has measured.
"""

from enum import StrEnum

DEFAULT_DELAY = 0.25  # ms, the greatest that the cycles' manual allows for the way through the PLC
DEFAULT_FEED = 150.0  # mm/min, the probing feed that the manual reckons with
MILLISECONDS_IN_A_MINUTE = 60_000.0


class SignalPath(StrEnum):
    """Path of the probe's signal to the control."""

    DIRECT = "direct"
    PLC = "plc"


def position_uncertainty(feed: float, delay: float) -> float:
    """Travel of the axis during the delay, mm. feed: mm/min; delay: ms.

    >>> position_uncertainty(150.0, 0.25)
    0.000625
    """
    return round(feed * delay / MILLISECONDS_IN_A_MINUTE, 9)


def zero_range_floor(
    path: SignalPath, feed: float = DEFAULT_FEED, delay: float = DEFAULT_DELAY, jitter: float | None = None
) -> float:
    """The smallest sensible R33 as far as the signal path goes, mm: the part of the position error that varies.

    A direct path has none. jitter: how much the delay varies, ms; where it is not measured the whole delay counts,
    because a signal that waits for the PLC's scan may wait for all of it or not at all.

    >>> zero_range_floor(SignalPath.PLC), zero_range_floor(SignalPath.PLC, jitter=0.1), zero_range_floor(SignalPath.DIRECT)
    (0.000625, 0.00025, 0.0)
    """
    if path is SignalPath.DIRECT:
        return 0.0
    return position_uncertainty(feed, delay if jitter is None else min(jitter, delay))
