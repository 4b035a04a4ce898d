"""Load the snapshot that readings are decided against, under the machines' locks: one round trip.

Rows travel as one JSON document per statement: the server takes it apart with `json_to_recordset`, which measured
faster than arrays for one row and for sixty-four.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

import msgspec

from app.core.parameters import Parameters
from app.core.variants import FormResult
from app.db.pipeline import Pipeline, Step
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.snapshot import (
    KnownKey,
    LoadedAverage,
    LoadedCorrection,
    LoadedStream,
    LoadedTool,
    NamedCorrection,
    Part,
    Snapshot,
)
from app.loop.readings.writer.statements import LOAD, LOCK, PARAMETERS, array, as_json

ParametersCache = dict[tuple[int, int], Parameters]
"""Parameters by (characteristic, version). A version never changes, so they are kept for good."""


class _Stream(msgspec.Struct, array_like=True):
    machine_id: int
    characteristic_id: int
    sequence: int
    version: int
    paused_by: int | None
    last_measured_at: datetime | None
    location: int | None
    average: float | None
    empirical_value: float | None
    tool: int | None
    offset: float | None
    total: float | None
    reset_at: datetime | None
    set_by_hand: bool | None
    tool_paused_by: int | None
    level: float | None
    level_sequence: int | None
    corrections: list[LoadedCorrection] | None
    applied: list[tuple[int, float]] | None
    gain_from: int
    parts: list[Part] | None
    forms: list[tuple[int, str, FormResult]] | None


class _Loaded(msgspec.Struct):
    streams: list[_Stream]
    named: list[tuple[int, int, datetime | None, datetime | None, datetime | None]] | None
    known: list[tuple[int, str, int, float, int]] | None


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
    await _load(
        pipeline, book, snapshot, readings, machines, (*pipeline.begin, (LOCK, array(machines))), optimistic=optimistic
    )
    if of_form := [
        (form, reading)
        for entry, reading in readings
        for form, _result in snapshot.streams[entry.characteristic_id].forms
    ]:
        await _load(pipeline, book, snapshot, of_form, machines, (), optimistic=optimistic)


async def _load(
    pipeline: Pipeline,
    book: ParametersCache,
    snapshot: Snapshot,
    readings: Sequence[tuple[Entry, ReadingIn]],
    machines: dict[int, dict[str, Any]],
    opening: Sequence[Step],
    *,
    optimistic: bool,
) -> None:
    """Bring the state of these readings into the snapshot. opening: begins the transaction and locks; empty if that is done."""
    entries = {entry.characteristic_id: entry for entry, _ in readings}
    document = {
        "streams": [
            {"machine_id": e.machine_id, "characteristic_id": e.characteristic_id, **machines[e.machine_id]}
            for e in entries.values()
        ],
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
    states = [(int(machine_id or 0), int(last or 0), int(version or 0)) for machine_id, last, version in locked]
    if any(snapshot.versions.get(machine_id, version) != version for machine_id, _last, version in states):
        snapshot.forget()
    for machine_id, last, version in states:
        snapshot.last_correction[machine_id], snapshot.versions[machine_id] = last, version
    for machine_id, number, applied_at, decided_at, fetched_at in loaded.named or ():
        snapshot.named[machine_id, number] = NamedCorrection(applied_at, decided_at, fetched_at)
        if applied_at is not None:
            since = machines[machine_id]["since"]
            machines[machine_id]["since"] = applied_at if since is None else min(since, applied_at)
    for row in loaded.streams:
        parameters = await _parameters(pipeline, book, row.machine_id, row.characteristic_id, row.version)
        _add_stream(snapshot, entries[row.characteristic_id], parameters, row, **machines[row.machine_id])
    for c, key, sequence, measured, version in loaded.known or ():
        parameters = await _parameters(pipeline, book, entries[c].machine_id, c, version)
        snapshot.stored_keys[c, key] = KnownKey(sequence, measured, parameters)


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


async def _parameters(
    pipeline: Pipeline, book: ParametersCache, machine_id: int, characteristic_id: int, version: int
) -> Parameters:
    parameters = book.get((characteristic_id, version))
    if parameters is None:
        place = {"machine_id": machine_id, "characteristic_id": characteristic_id, "version": version}
        (((text,),),) = await pipeline.run(((PARAMETERS, as_json(place)),))  # a version that is named is there
        parameters = book[characteristic_id, version] = Parameters.from_dict(msgspec.json.decode(text or b""))
    return parameters


def _add_stream(
    snapshot: Snapshot, entry: Entry, parameters: Parameters, row: _Stream, number: int | None, since: datetime | None
) -> None:
    machine_id = row.machine_id
    if row.location is not None:
        snapshot.averages[machine_id, row.location] = LoadedAverage(
            machine_id, row.location, row.average or 0.0, row.empirical_value or 0.0
        )
    if row.tool is not None:
        snapshot.tools[machine_id, row.tool] = LoadedTool(
            machine_id,
            row.tool,
            row.offset or 0.0,
            row.total or 0.0,
            row.reset_at,
            row.tool_paused_by,
            row.corrections or (),
            number,
            since,
            row.applied or (),
            bool(row.set_by_hand),
        )
    snapshot.streams[row.characteristic_id] = LoadedStream(
        entry,
        row.sequence,
        row.version,
        parameters,
        row.location,
        row.tool,
        row.paused_by,
        row.last_measured_at,
        row.level,
        row.level_sequence,
        row.gain_from,
        row.parts or (),
        [(entry._replace(characteristic_id=number, characteristic=key), form) for number, key, form in row.forms or ()],
    )
