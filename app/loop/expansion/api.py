"""JSON routes: the thermal expansion of a characteristic."""

from app.access.deps import AnyCaller, Engineer
from app.loop.characteristics.queries import characteristic_for, hold_characteristic
from app.loop.expansion import actions, queries
from app.loop.expansion.schemas import ExpansionIn, ExpansionOut
from app.web.api import CharacteristicKey, api_router, problems
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged

router = api_router("characteristics")


@router.get("/characteristics/{characteristic}/expansion", responses=problems(404) | TAGGED)
@tagged
def get_expansion(session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey) -> ExpansionOut:
    """The thermal expansion of a characteristic; without a coefficient its readings have no size at 20 °C."""
    current = characteristic_for(session, caller, characteristic, "viewer")
    return ExpansionOut.of(characteristic, queries.row_of(session, current.machine.id, current.characteristic.id))


@router.put("/characteristics/{characteristic}/expansion", responses=problems(404, 412))
@guarded(get_expansion, hold_characteristic)
def set_expansion(
    session: SessionDep, caller: Engineer, characteristic: CharacteristicKey, given: ExpansionIn
) -> ExpansionOut:
    """Set it. Sizes at 20 °C of all readings follow, old ones too; decisions and corrections rest on the measured size alone."""
    return ExpansionOut.of(characteristic, actions.set_expansion(session, characteristic, given, caller))
