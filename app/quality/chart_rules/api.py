"""JSON routes: the rules of a characteristic, and what they would have said."""

from typing import Annotated

from fastapi import Query

from app.access.deps import AnyCaller, Engineer
from app.loop.characteristics import queries as characteristics
from app.quality.baselines.queries import baseline_in_force
from app.quality.chart_rules import queries
from app.quality.chart_rules.actions import set_rules
from app.quality.chart_rules.schemas import PreviewOut, RulesIn, RulesOut
from app.web.api import CharacteristicKey, api_router, problems
from app.web.deps import SessionDep
from app.web.etags import TAGGED, guarded, tagged
from app.web.fields import LARGEST_ID

router = api_router("control charts")


@router.get("/characteristics/{characteristic}/rules", responses=problems(404) | TAGGED)
@tagged
def get_rules(session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey) -> RulesOut:
    """List the rules that watch the charts of a characteristic, and the rules that could: those that make sense there."""
    row = characteristics.characteristic_for(session, caller, characteristic, "viewer").characteristic
    return RulesOut.of(row.key, queries.rules_in_force(session, row), baseline_in_force(session, row))


@router.put("/characteristics/{characteristic}/rules", responses=problems(404, 409, 412))
@guarded(get_rules, characteristics.hold_characteristic)
def put_rules(session: SessionDep, caller: Engineer, characteristic: CharacteristicKey, given: RulesIn) -> RulesOut:
    """These rules watch from the next reading on, and no others; a new version, unless nothing is changed.

    Signals that were found before stay, whichever rules are on.
    """
    current = characteristics.characteristic_named(session, characteristic)
    watched = set_rules(
        session,
        current,
        given.rules,
        given.reason,
        caller,
        look_back=given.look_back,
        seen=given.seen_version,
    )
    baseline = baseline_in_force(session, current.characteristic)
    return RulesOut.of(current.characteristic.key, watched, baseline)


@router.get("/characteristics/{characteristic}/rules/preview", responses=problems(404))
def preview_rules(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    last: Annotated[
        int | None,
        Query(ge=1, le=LARGEST_ID, description="Of the last N readings; of all, a million at most, if left out."),
    ] = None,
) -> PreviewOut:
    """Count the signals of each rule on the last readings by the baseline in force, and the signals that chance explains.

    Chance: independent, normally distributed readings about the centre of the baseline, with its sigma.
    """
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    watched = queries.rules_in_force(session, current.characteristic)
    preview = queries.preview(session, current, watched.rules, last)
    return PreviewOut.of(current.characteristic.key, watched, preview)
