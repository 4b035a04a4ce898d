"""JSON route: the load by alarms."""

from datetime import UTC, datetime

from app.access.deps import Viewer
from app.views.alarm_load import queries
from app.views.alarm_load.schemas import AlarmLoadOut
from app.web.api import MachineFilter, api_router, problems
from app.web.choice import InPeriod
from app.web.deps import FROM_REPLICA, SessionDep, SettingsDep

router = api_router("alarms", FROM_REPLICA)


@router.get("/alarm-load", responses=problems(404))
def get_alarm_load(
    session: SessionDep, settings: SettingsDep, caller: Viewer, period: InPeriod, machine: MachineFilter = None
) -> AlarmLoadOut:
    """Alarms by position and ten minutes, floods, stale and chattering ones, and the ten noisiest with what makes them.

    Without a period the last 30 days, or since the first machine was added. The limits are those of ANSI/ISA-18.2-2016, table 7 (IEC 62682).
    """
    found = queries.alarm_load(session, period, datetime.now(UTC), settings.bridge_silent_after, machine)
    return AlarmLoadOut.of(found, caller)
