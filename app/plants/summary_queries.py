"""A plant in one line, for the overview of all plants. Never writes."""

from datetime import datetime, timedelta
from typing import NamedTuple

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.loop.alarm_response.queries import ACTIVE_COUNT
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.views.to_do.queries import COUNT as TO_DO_COUNT

HEARD = timedelta(hours=1)
"""Time within which a machine that has sent a reading counts as connected."""


class Summary(NamedTuple):
    """alarms: active ones. to_do: everything that waits for a person. heard: machines with a reading within `HEARD`."""

    alarms: int
    to_do: int
    machines: int
    heard: int
    last_reading: datetime | None


_last = select(Stream.machine_id, func.max(Stream.last_received_at).label("at")).group_by(Stream.machine_id).subquery()
_SUMMARY = select(
    ACTIVE_COUNT.scalar_subquery(),
    TO_DO_COUNT.scalar_subquery(),
    select(func.count()).select_from(Machine).scalar_subquery(),
    select(func.count()).select_from(_last).where(_last.c.at > func.now() - HEARD).scalar_subquery(),
    select(func.max(_last.c.at)).scalar_subquery(),
)


def summary(session: Session) -> Summary:
    """Return the summary of the plant of this session."""
    return Summary(*session.execute(_SUMMARY).one())
