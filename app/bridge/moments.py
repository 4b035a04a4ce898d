"""Times of measurements, by a control's clock: readings come with a time of day; some controls answer their date as well. Pure."""

from collections.abc import Iterable
from datetime import datetime, timedelta

from app.bridge.links import Clock, Received

DAY = 86_400.0  # s
AHEAD = timedelta(seconds=5)  # more is no delay of a clock that is right


def learn(clock: Clock, time: float, now: datetime) -> None:
    """Note how far the clock is ahead, from a time of day (s) that the control has just written."""
    midnight = now.replace(hour=0, minute=0, second=0, microsecond=0)
    ahead = time - (now - midnight).total_seconds()
    clock.offset = (ahead + DAY / 2) % DAY - DAY / 2 + clock.days * DAY


def learn_date(clock: Clock, shown: datetime, now: datetime) -> None:
    """Note how far the clock is ahead, from the date and time (local, without a zone) that the control shows now."""
    clock.offset = (shown - now.replace(tzinfo=None)).total_seconds()
    clock.days = round(clock.offset / DAY)


def learn_ahead(clock: Clock, received: Iterable[Received], now: datetime) -> None:
    """Note how far the clock is ahead at least, from times with which readings come: one in the past says nothing of the clock."""
    clock.offset, clock.days = None, 0
    for each in received:
        try:
            shown = datetime.fromisoformat(str(each.body.get("measured_at"))).astimezone()
        except (ValueError, OverflowError):
            continue  # it has none, or the server will say what is wrong
        if shown > now + AHEAD and (shown - now).total_seconds() > (clock.offset or 0.0):
            clock.offset = (shown - now).total_seconds()
            clock.days = round(clock.offset / DAY)


def wrong_date(clock: Clock) -> str:
    """A sentence if the control's date is wrong; empty if it is right, or not known."""
    if not clock.days:
        return ""
    days = "a day" if abs(clock.days) == 1 else f"{abs(clock.days)} days"
    return (
        f"The control's clock is {days} {'ahead of' if clock.days > 0 else 'behind'} the clock of the bridge's computer. Compare"
        " both with a watch, and set the date of the one that is wrong."
    )


def measured_at(clock: Clock, time: float | None, now: datetime, *, fresh: bool) -> datetime | None:
    """Time of the measurement: now if it is fresh; else by the control's clock (s of the day), if that is known."""
    if fresh:
        return now
    if time is None or clock.offset is None:
        return None
    there = now + timedelta(seconds=clock.offset)
    at = there.replace(hour=0, minute=0, second=0, microsecond=0) + timedelta(seconds=time)
    at -= timedelta(seconds=clock.offset)
    return min(at, now) if at <= now + AHEAD else at - timedelta(days=1)
