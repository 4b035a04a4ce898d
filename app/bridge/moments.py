"""Times of measurements, by a control's clock that knows the time of day only: pure."""

from datetime import datetime, timedelta

from app.bridge.links import Clock

DAY = 86_400.0  # s


def learn(clock: Clock, time: float, now: datetime) -> None:
    """Note how far the clock is ahead, from a time of day (s) that the control has just written."""
    midnight = now.replace(hour=0, minute=0, second=0, microsecond=0)
    ahead = time - (now - midnight).total_seconds()
    clock.offset = (ahead + DAY / 2) % DAY - DAY / 2


def measured_at(clock: Clock, time: float | None, now: datetime, *, fresh: bool) -> datetime | None:
    """Time of the measurement: now if it is fresh; else by the control's clock (s of the day), if that is known."""
    if fresh:
        return now
    if time is None or clock.offset is None:
        return None
    there = now + timedelta(seconds=clock.offset)
    at = there.replace(hour=0, minute=0, second=0, microsecond=0) + timedelta(seconds=time)
    at -= timedelta(seconds=clock.offset)
    return min(at, now) if at <= now + timedelta(seconds=5) else at - timedelta(days=1)
