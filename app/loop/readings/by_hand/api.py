"""JSON routes: measurements by hand."""

from typing import Annotated

from fastapi import Path

from app.access.deps import AnyCaller, Operator
from app.loop.readings import queries as readings
from app.loop.readings.by_hand import actions, queries
from app.loop.readings.by_hand.actions import HandResult
from app.loop.readings.by_hand.schemas import HandMeasurementIn, HandMeasurementOut
from app.loop.readings.by_hand.wording import as_json
from app.web.api import After, CharacteristicKey, Limit, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID, Page, page_of

router = api_router("readings")
Sequence = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the reading: 1, 2, 3 … without gaps.")]


@router.post("/readings/{characteristic}/{sequence}/by-hand", status_code=201, responses=problems(404))
def add_hand_measurement(
    session: SessionDep,
    caller: Operator,
    characteristic: CharacteristicKey,
    sequence: Sequence,
    given: HandMeasurementIn,
) -> HandMeasurementOut:
    """Enter what a person measured on this part. It is beside the machine's value; the decision stays as it was."""
    entry = readings.entry_for(session, caller, characteristic)
    good = None if given.verdict is None else given.verdict == "good"
    measurement = actions.measure(
        session, entry, sequence, HandResult(given.measured, good, given.comment), caller.name
    )
    return HandMeasurementOut.model_validate(as_json(measurement))


@router.get("/characteristics/{characteristic}/hand-measurements", responses=problems(404))
def list_hand_measurements(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    after: After = 0,
    limit: Limit = 100,
) -> Page[HandMeasurementOut]:
    """All measurements by hand of a characteristic, in the order in which they were entered."""
    entry = readings.entry_for(session, caller, characteristic)
    rows = queries.page(session, entry.machine_id, entry.characteristic_id, after, limit + 1)
    return page_of([HandMeasurementOut.model_validate(as_json(row)) for row in rows], limit, lambda row: row.id)
