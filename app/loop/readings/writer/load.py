"""Load the snapshot that readings are decided against, under the machines' locks: one round trip.

Rows travel as one JSON document per statement: the server takes it apart with `json_to_recordset`, which measured
faster than arrays for one row and for sixty-four.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from app.core.control_plan import Plan
from app.core.parameters import Parameters
from app.db.pipeline import Pipeline, Step
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.snapshot import (
    KnownKey,
    LoadedAverage,
    LoadedPlan,
    LoadedStream,
    LoadedTool,
    NamedCorrection,
    Snapshot,
)
from app.loop.readings.writer.statements import LOAD, LOCK, PARAMETERS, PLANS, array, as_json

ParametersCache = dict[tuple[int, int], Parameters]
"""Parameters by (characteristic, version). A version never changes, so they are kept for good."""


class _Loaded(msgspec.Struct):
    streams: list[tuple[LoadedStream, LoadedAverage | None, LoadedTool | None]]
    named: list[tuple[int, int, NamedCorrection]] | None
    known: list[tuple[int, str, int, float, int, bool]] | None


_loaded = msgspec.json.Decoder(_Loaded)


async def load(
    pipeline: Pipeline,
    book: ParametersCache,
    snapshot: Snapshot,
    readings: Sequence[tuple[Entry, ReadingIn]],
    *,
    optimistic: bool = False,
) -> None:
    """Begin a transaction, lock the machines, bring what the readings are decided against into the snapshot.

    optimistic: take the keys for new ones. If one is not, `save` will fail with a `UniqueViolation`.
    """
    machines = _machines(readings)
    opening = (*pipeline.begin, (LOCK, array(machines)))
    planned = await _load(pipeline, book, snapshot, readings, machines, opening, optimistic=optimistic)
    if of_form := [
        (form, reading)
        for entry, reading in readings
        for form, _result in snapshot.streams[entry.characteristic_id].forms
    ]:
        await _load(pipeline, book, snapshot, of_form, machines, (), optimistic=optimistic)
    if planned:
        entries = {entry for entry, _ in (*readings, *of_form) if entry.machine_id in planned}
        await _load_plans(pipeline, snapshot, entries)


async def _load(
    pipeline: Pipeline,
    book: ParametersCache,
    snapshot: Snapshot,
    readings: Sequence[tuple[Entry, ReadingIn]],
    machines: dict[int, dict[str, Any]],
    opening: Sequence[Step],
    *,
    optimistic: bool,
) -> set[int]:
    """Bring the state of these readings into the snapshot; the machines of which a control plan counts parts.

    opening: begins the transaction and locks; empty if that is done.
    """
    entries = {entry.characteristic_id: entry for entry, _ in readings}
    document = {
        "streams": [{**e._asdict(), **machines[e.machine_id]} for e in entries.values()],
        "named": [
            {"machine_id": machine_id, "number": number}
            for machine_id, number in {
                (e.machine_id, r.correction_in_effect) for e, r in readings if r.correction_in_effect is not None
            }
        ],
        "keys": [
            {"machine_id": e.machine_id, "characteristic_id": e.characteristic_id, "key": r.key}
            for e, r in readings
            if r.key is not None and not optimistic
        ],
    }
    *opened, ((text,),) = await pipeline.run((*opening, (LOAD, as_json(document))))
    locked = opened[-1] if opened else ()
    loaded = _loaded.decode(text or b"")
    states = [(int(machine or 0), int(last or 0), int(version or 0)) for machine, last, version, _planned in locked]
    if any(snapshot.versions.get(machine_id, version) != version for machine_id, _last, version in states):
        snapshot.forget()
    for machine_id, last, version in states:
        snapshot.last_correction[machine_id], snapshot.versions[machine_id] = last, version
    for machine_id, number, named in loaded.named or ():
        snapshot.named[machine_id, number] = named
        applied_at = named.applied_at
        if applied_at is not None:  # for readings of form, which are loaded after these: their tools go back as far
            since = machines[machine_id]["since"]
            machines[machine_id]["since"] = applied_at if since is None else min(since, applied_at)
    for stream, average, tool in loaded.streams:
        c = stream.entry.characteristic_id
        snapshot.parameters[c] = await _parameters(pipeline, book, stream.entry, stream.version)
        snapshot.streams[c] = stream
        if average is not None:
            snapshot.averages[average.machine_id, average.location] = average
        if tool is not None:
            snapshot.tools[tool.machine_id, tool.number] = tool
    for c, key, sequence, measured, version, first_move in loaded.known or ():
        parameters = await _parameters(pipeline, book, entries[c], version)
        snapshot.stored_keys[c, key] = KnownKey(sequence, measured, parameters, first_move)
    return {int(machine or 0) for machine, _last, _version, planned in locked if planned == b"t"}


async def _load_plans(pipeline: Pipeline, snapshot: Snapshot, entries: Iterable[Entry]) -> None:
    """Bring the control plans of these characteristics that count parts into the snapshot."""
    asked = [{"machine_id": entry.machine_id, "characteristic_id": entry.characteristic_id} for entry in entries]
    (rows,) = await pipeline.run(((PLANS, as_json(asked)),))
    for row in rows:
        c, every, after_change, after_alarm, changed, alarmed = (None if value is None else int(value) for value in row)
        plan = Plan(every=every, after_change=after_change or 0, after_alarm=after_alarm or 0)
        snapshot.plans[c or 0] = LoadedPlan(plan, changed, alarmed)


def _machines(readings: Iterable[tuple[Entry, ReadingIn]]) -> dict[int, dict[str, Any]]:
    """The machines, each with the oldest correction and the oldest time that one of its readings names."""
    machines: dict[int, dict[str, Any]] = {}
    for entry, reading in readings:
        row = machines.get(entry.machine_id)
        if row is None:
            row = machines[entry.machine_id] = {"number": None, "since": None}
        if reading.correction_in_effect is not None:
            known = row["number"]
            row["number"] = reading.correction_in_effect if known is None else min(known, reading.correction_in_effect)
        elif reading.machined_at is not None:
            row["since"] = reading.machined_at if row["since"] is None else min(row["since"], reading.machined_at)
    return machines


async def _parameters(pipeline: Pipeline, book: ParametersCache, entry: Entry, version: int) -> Parameters:
    at = (entry.characteristic_id, version)
    parameters = book.get(at)
    if parameters is None:
        place = {"machine_id": entry.machine_id, "characteristic_id": entry.characteristic_id, "version": version}
        (((text,),),) = await pipeline.run(((PARAMETERS, as_json(place)),))  # a version that is named is there
        parameters = book[at] = Parameters.from_dict(msgspec.json.decode(text or b""))
    return parameters
