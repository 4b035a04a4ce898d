"""JSON route: the ledger of a machine."""

from datetime import UTC, datetime

from app.access.deps import AnyCaller
from app.loop.machines.queries import machine_for
from app.quality.ledger import queries
from app.quality.ledger.schemas import LedgerOut
from app.web.api import MachineKey, api_router, problems
from app.web.choice import InPeriod
from app.web.deps import FROM_REPLICA, SessionDep, SettingsDep

router = api_router("what-if", FROM_REPLICA)


@router.get("/machines/{machine}/ledger", responses=problems(404, 429))
def get_ledger(
    session: SessionDep, caller: AnyCaller, settings: SettingsDep, machine: MachineKey, period: InPeriod
) -> LedgerOut:
    """Rejects that corrections have prevented and caused, against the same parts without any correction.

    Without a period the last eight weeks. The parts without corrections are a replay that only measures, as in *What if*.
    """
    at = machine_for(session, caller, machine, "viewer")
    found = queries.ledger_of(session, at, period, datetime.now(UTC))
    return LedgerOut.of(found, settings.part_cost, settings.currency)
