"""JSON routes: pushing readings and looking them up. Single readings with a key are answered by `door.py`, which see."""

import json
from collections import Counter
from datetime import UTC, datetime
from typing import Annotated, Any, cast

import msgspec
from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool

from app.access.deps import AnyCaller, Operator
from app.db.engine import Database
from app.errors import FieldError, Invalid, NotFound, TooLarge
from app.language.i18n import _
from app.loop.readings import actions, queries
from app.loop.readings.answers import ReadingAnswer, ReadingDetail
from app.loop.readings.door import LARGEST_BODY, Directory, answer_of, decoded, store_reading
from app.loop.readings.miscounted import TooManyTouches
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn, decode_many
from app.loop.readings.writer.batch import store_batch
from app.loop.readings.writer.columnar import ColumnarReadings, Outcome
from app.loop.readings.writer.group_commit import Writer
from app.loop.readings.writer.pending import Stored, Verdict
from app.web.api import BASE, CharacteristicKey, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import Body, Reason
from app.web.json_bodies import JsonRoute
from app.web.limits import MEGABYTE, takes
from app.web.openapi import example_of

MOST_IN_BATCH = 10_000
NDJSON = "application/x-ndjson"
EXAMPLE = example_of("ReadingIn")
(_schema,), _definitions = msgspec.json.schema_components((ReadingIn,), ref_template="#/components/schemas/{name}")
SCHEMAS = _definitions
_BODY = {"schema": _schema}

# Bodies are read by our own strict decoder, so these routes do not use the JSON route class of the others.
push = APIRouter(
    prefix=BASE, tags=["readings"], route_class=JsonRoute, generate_unique_id_function=lambda route: route.name
)
router = api_router("readings")
Sequence = Annotated[int, Path(ge=1, le=2**63 - 1, description="Number of the reading: 1, 2, 3 … without gaps.")]


class BatchCounts(BaseModel):
    """The result of a batch."""

    stored: Annotated[int, Field(description="Readings that are new.")]
    repeated: Annotated[int, Field(description="Readings whose key was sent before; nothing happened twice.")]
    zones: Annotated[dict[str, int], Field(description="How many of the new ones were decided in each zone.")]
    corrections: Annotated[int, Field(description="Corrections that were issued.")]
    alarms: Annotated[int, Field(description="Alarms that were raised, without repetitions.")]
    items: Annotated[
        list[ReadingAnswer] | None, Field(description="With `decisions=true`: each as a single reading is answered.")
    ] = None


class ExcludeIn(Body):
    """The reason for taking a reading out of the statistics."""

    reason: Reason


def _here(request: Request) -> tuple[Directory, Writer, Database]:
    state = request.app.state
    return state.directory, state.writer, state.doors


@push.post(
    "/readings",
    status_code=201,
    response_model=None,
    responses=problems(404, 409, 413)
    | {
        200: {
            "model": ReadingAnswer,
            "description": "The key was sent before: the first answer, nothing happened twice",
        },
        201: {"model": ReadingAnswer, "description": "Decided and stored durably"},
    },
    openapi_extra={"requestBody": {"required": True, "content": {"application/json": _BODY | {"example": EXAMPLE}}}},
)
@takes(LARGEST_BODY, by="operator")
async def push_reading(request: Request, caller: AnyCaller) -> Response:
    """Push one reading; the answer is given after the commit and says what was decided and why.

    `touches` may be in place of `measured`: one list per point, each with its repeats. `correction_in_effect` is the
    number of the last correction that the machine had applied when it cut this part; `machined_at` may say it by time.
    """
    caller.must_somewhere("operator")
    reading = await decoded(await request.body())
    status, value = await store_reading(caller, reading, *_here(request))
    return Response(msgspec.json.encode(value), status, media_type="application/json")


@push.post(
    "/readings/batch",
    status_code=201,
    response_model=None,
    responses=problems(404, 409, 413) | {201: {"model": BatchCounts, "description": "All of them are stored"}},
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {"schema": {"type": "array", "items": _schema}, "example": [EXAMPLE]},
                NDJSON: {"schema": _schema, "example": json.dumps(EXAMPLE)},
            },
        }
    },
)
@takes(32 * MEGABYTE, by="operator")
async def push_batch(
    request: Request,
    caller: AnyCaller,
    decisions: Annotated[bool, Query(description="Answer with every decision, not only with counts.")] = False,
) -> Response:
    """Push up to 10,000 readings as a JSON list or NDJSON: decided in the given order, all or nothing."""
    caller.must_somewhere("operator")
    directory, writer, database = _here(request)
    body = await request.body()
    lines = request.headers.get("content-type", "").partition(";")[0].strip().lower() == NDJSON

    def stored() -> tuple[list[Outcome], bytes]:
        readings = _looked_up(directory, decode_many(body, datetime.now(UTC), lines=lines))
        for entry in {entry.machine_id: entry for entry, _reading in readings}.values():
            caller.must_at(entry.machine_id, "operator")
        try:
            outcomes = store_batch(database, writer.parameters, readings, writer.idle) if readings else []
        except Invalid as error:
            if isinstance(refusal := error.__cause__, TooManyTouches) and caller.kind == "machine":
                writer.refused(refusal.entry, refusal.touch.as_dict())
            raise
        return outcomes, msgspec.json.encode(_counts(outcomes))

    outcomes, counts = await run_in_threadpool(stored)
    if decisions:
        counts = await run_in_threadpool(_with_decisions, outcomes, database)
    return Response(counts, 201, media_type="application/json")


def _looked_up(directory: Directory, readings: list[ReadingIn]) -> list[tuple[Entry, ReadingIn]]:
    if len(readings) > MOST_IN_BATCH:
        raise TooLarge(
            _("A batch has at most %(most)s readings; this one has %(count)s.")
            % {"most": MOST_IN_BATCH, "count": len(readings)},
            _("Send it in several batches. Nothing of this one was stored."),
        )
    entries: dict[str, Entry] = {}
    missing: dict[str, str] = {}
    for key in dict.fromkeys(reading.characteristic for reading in readings):  # each is looked up once
        try:
            entries[key] = directory.look_up(key)
        except NotFound as error:
            missing[key] = error.detail
    errors = [
        FieldError(f"[{at}].characteristic", missing[reading.characteristic])
        for at, reading in enumerate(readings)
        if reading.characteristic in missing
    ]
    if errors:
        raise NotFound(
            errors[0].message,
            _("Create the characteristic first, or correct its key. Nothing of this batch was stored."),
            errors=errors[:100],
        )
    return [(entries[reading.characteristic], reading) for reading in readings]


def _counts(outcomes: list[Outcome]) -> dict[str, Any]:
    once = {id(o): o for o in outcomes}.values()
    new = [outcome for outcome in once if isinstance(outcome, Verdict)]
    zones = Counter(verdict.decision.zone.value for verdict in new)
    for outcome in once:
        if isinstance(outcome, ColumnarReadings):
            zones.update(outcome.zones())
    stored = zones.total()
    return {
        "stored": stored,
        "repeated": len(outcomes) - stored,
        "zones": zones,
        "corrections": sum(verdict.correction is not None for verdict in new),
        "alarms": len({id(alarm) for verdict in new for alarm in verdict.alarms if alarm.new}),
    }


def _with_decisions(outcomes: list[Outcome], database: Database) -> bytes:
    repeated: dict[Entry, list[int]] = {}
    for outcome in outcomes:
        if isinstance(outcome, Stored):
            repeated.setdefault(outcome.entry, []).append(outcome.sequence)
    first: dict[Stored, dict[str, Any]] = {}
    if repeated:
        with database.begin() as session:
            for entry, sequences in repeated.items():
                answers = queries.first_answers(session, entry, sequences)
                first |= {Stored(entry, sequence): answer for sequence, answer in answers.items()}
    items = [
        first[outcome]
        if isinstance(outcome, Stored)
        else answer_of(outcome.verdict(at) if isinstance(outcome, ColumnarReadings) else cast("Verdict", outcome))
        for at, outcome in enumerate(outcomes)
    ]
    return msgspec.json.encode(_counts(outcomes) | {"items": items})


@router.get("/readings/{characteristic}/{sequence}", responses=problems(404))
def get_reading(
    session: SessionDep, caller: AnyCaller, characteristic: CharacteristicKey, sequence: Sequence
) -> ReadingDetail:
    """One reading with its touches and the full reason."""
    entry = queries.entry_for(session, caller, characteristic)
    return ReadingDetail.model_validate(queries.detail(session, entry, sequence))


@router.post("/readings/{characteristic}/{sequence}/exclude", responses=problems(404, 409))
def exclude_reading(
    session: SessionDep, caller: Operator, characteristic: CharacteristicKey, sequence: Sequence, exclusion: ExcludeIn
) -> ReadingDetail:
    """Take a reading out of the statistics, never out of the record. A correction that it asked for and that is not applied yet is
    rejected; what was applied stays.
    """
    entry = queries.entry_for(session, caller, characteristic)
    actions.exclude(session, entry, sequence, caller.name, exclusion.reason)
    return ReadingDetail.model_validate(queries.detail(session, entry, sequence))
