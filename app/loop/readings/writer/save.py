"""Write what was decided, and commit: one round trip. Large batches send their readings by binary COPY.

This is the one place that writes the tables of offsets and alarms from here: a set-based statement for all readings of
a transaction cannot be had through the actions that serve one person at a time.
"""

from collections.abc import Iterable
from typing import Any

from msgspec import structs

from app.db.pipeline import Pipeline, Step
from app.loop.readings.records import Entry, Record
from app.loop.readings.writer.binary_copy import array_of_int4
from app.loop.readings.writer.doubts import Answered, doubts, leave_out_answered
from app.loop.readings.writer.pending import PendingStream, PendingTool, PendingWrites, Verdict, alarm_number
from app.loop.readings.writer.statements import (
    ACTIVE_ALARMS,
    ALARM_NUMBERS,
    ANSWERED_DOUBTS,
    BASE_LEVEL,
    CHANGE_CORRECTIONS,
    CONTEXT,
    COPY,
    COPY_TYPES,
    COUNTERS,
    FAN,
    GUARD,
    ISSUE,
    LOCK,
    MOVE_LEVELS,
    MOVE_TOOLS,
    NEXT,
    RAISE,
    REPEAT,
    RESULTS,
    SAVE,
    STEPS,
    SUMMARISE_READINGS,
    SUMMARISE_SUMMARIES,
    TOP_LEVEL,
    TOUCHES,
    array,
    as_json,
)

COPY_FROM = 500  # readings in one transaction from which COPY is faster than one JSON document


async def save(pipeline: Pipeline, pending: PendingWrites, *, begun: bool, notify: bool = True) -> None:
    """Write everything that is pending and commit it.

    begun: the machines are locked already; otherwise all of it happens in one round trip. notify: wake who listens to the
    journal of events. Raises psycopg's errors; `DivisionByZero` when a person has changed a machine since the snapshot was
    loaded.
    """
    touched = list(pending.touched.values())
    machines = {stream.entry.machine_id for stream in touched}
    versions = as_json(
        [{"machine_id": machine_id, "version": pending.snapshot.versions[machine_id]} for machine_id in machines]
    )
    copying = len(pending.verdicts) >= COPY_FROM
    locking: list[Step] = [(LOCK, array(machines))] if len(machines) > 1 and not begun else []
    if copying or pending.column_rows or pending.raised:  # something must be done before the last round trip
        opening: list[Step] = [*([] if begun else pipeline.begin), *locking, (GUARD, versions)]
        await (_number_alarms(pipeline, pending, opening) if pending.raised else pipeline.run(opening))
        begun, locking, versions = True, [], "[]"
    elif pipeline.distributed and not begun:  # what its transactions begin with goes along to the node
        begun, locking = True, [*pipeline.begin, *locking]
    records = [verdict.record() for verdict in pending.verdicts]
    if pending.column_rows:
        await _copy_columns(pipeline, pending.column_rows())
    if copying:
        await _copy(pipeline, records)
    averages = {id(stream.average): stream.average for stream in touched}.values()
    await pipeline.run(
        (
            *locking,
            (
                SAVE,
                versions,
                as_json([_stream_row(stream) for stream in touched]),
                as_json(
                    [
                        {"machine_id": a.machine_id, "location": a.location, "average": a.average}
                        for a in averages
                        if a is not None and a.changed
                    ]
                ),
                as_json([] if copying else records),
                as_json(_changes(pending, touched)),
                str(notify),
            ),
            *((statement, as_json(rows)) for statement, rows in _rarer(pending) if rows),
            *(
                (statement, as_json(blocks))
                for statement, blocks in full_blocks([(s.entry, s.start.sequence, s.sequence) for s in touched])
            ),
            *([("COMMIT",)] if begun else []),
        )
    )


async def _number_alarms(pipeline: Pipeline, pending: PendingWrites, opening: list[Step]) -> None:
    """Find the alarms that are active for the same trouble already, and draw numbers for the others."""
    machines = {alarm.machine_id for alarm in pending.raised}
    if any(doubts(pending)):
        *_opened, found = await pipeline.run([*opening, (ANSWERED_DOUBTS, array(machines))])
        answered = [
            Answered(
                int(machine or 0),
                int(tool or 0),
                (why or b"").decode(),
                int(n or 0),
                None if lag is None else float(lag),
            )
            for machine, tool, why, n, lag in found
        ]
        leave_out_answered(pending, answered)
        opening = []
    *_opened, rows = await pipeline.run([*opening, (ACTIVE_ALARMS, array(machines))])
    active = {
        (int(machine or 0), _number(characteristic), _number(tool), (kind or b"").decode()): _number(alarm)
        for machine, characteristic, tool, kind, alarm in rows
    }
    received_at = next(stream.last.received_at for stream in pending.touched.values() if stream.last)
    for alarm in pending.raised:
        tool = alarm.tool_memory if alarm.characteristic_id is None else None
        alarm.id = active.get((alarm.machine_id, alarm.characteristic_id, tool, alarm.kind))
        alarm.new = alarm.id is None
        alarm.last_at = received_at
    new = [alarm for alarm in pending.raised if alarm.new]
    if new:
        (numbers,) = await pipeline.run(((ALARM_NUMBERS, str(len(new))),))
        for alarm, (number,) in zip(new, numbers, strict=True):
            alarm.id = _number(number)


def _number(text: bytes | None) -> int | None:
    return None if text is None else int(text)


async def _copy_columns(pipeline: Pipeline, rows: memoryview) -> None:
    async with pipeline.connection.cursor() as cursor, cursor.copy(COPY) as copy:
        await copy.write(rows)


async def _copy(pipeline: Pipeline, records: list[Record]) -> None:
    async with pipeline.connection.cursor() as cursor, cursor.copy(COPY) as copy:
        copy.set_types(COPY_TYPES)
        for record in records:
            outstanding = array_of_int4(record.outstanding) if record.outstanding else None
            await copy.write_row(structs.astuple(structs.replace(record, outstanding=outstanding)))


def _place(stream: PendingStream) -> dict[str, Any]:
    return {"machine_id": stream.entry.machine_id, "characteristic_id": stream.entry.characteristic_id}


def _stream_row(stream: PendingStream) -> dict[str, Any]:
    last = stream.last
    assert last is not None
    return _place(stream) | {
        "sequence": stream.sequence,
        "paused_by": alarm_number(stream.paused_by),
        "last_measured_at": stream.last_measured_at,
        "last_received_at": last.received_at,
        "last_measured": last.measured,
        "last_deviation": last.decision.deviation,
        "last_average": last.decision.average_after,
        "last_zone": last.decision.zone.value,
    }


def _rarer(pending: PendingWrites) -> Iterable[tuple[str, list[Any]]]:
    """The statements that few transactions need, each with its rows."""
    yield from _beside_readings(pending.verdicts)
    if pending.touched_machines:
        yield from _of_tools(pending)
    if pending.raised:
        yield RAISE, [alarm for alarm in pending.raised if alarm.new]
        yield REPEAT, [alarm for alarm in pending.raised if not alarm.new]


def _beside_readings(verdicts: list[Verdict]) -> Iterable[tuple[str, list[Any]]]:
    def at(verdict: Verdict) -> dict[str, Any]:
        return _place(verdict.stream) | {"sequence": verdict.sequence}

    yield TOUCHES, [at(v) | {"touches": v.reading.touches} for v in verdicts if v.reading.touches is not None]
    yield (
        CONTEXT,
        [
            at(v) | {"measured_at": v.measured_at, "context": v.reading.context}
            for v in verdicts
            if v.reading.context is not None
        ],
    )
    yield RESULTS, [at(v) | v.results._asdict() for v in verdicts if v.results is not None]
    yield NEXT, [at(v) | {"measure_next": v.measure_next} for v in verdicts if v.measure_next is not None]
    moved = {id(v.stream): v.stream for v in verdicts if v.stream.level_moved}.values()
    yield MOVE_LEVELS, [_place(s) | {"level": s.level, "level_sequence": s.level_sequence} for s in moved]


def _of_tools(pending: PendingWrites) -> Iterable[tuple[str, list[Any]]]:
    yield COUNTERS, [{"machine_id": m, "last_correction": pending.last_number(m)} for m in pending.touched_machines]
    tools = _tools(pending)
    for tool in tools:
        tool.give_reasons()
    written = [correction for tool in tools for correction in tool.written()]
    yield ISSUE, [correction for correction in written if correction.new]
    yield CHANGE_CORRECTIONS, [correction for correction in written if not correction.new]
    names = ("machine_id", "number", "offset", "total")
    yield (
        MOVE_TOOLS,
        [
            {**{name: getattr(t, name) for name in names}, "paused_by": alarm_number(t.paused_by)}
            for t in tools
            if t.changed
        ],
    )
    yield STEPS, pending.offset_changes


def _tools(pending: PendingWrites) -> list[PendingTool]:
    """Return the tools of the decided readings."""
    tools = {id(verdict.stream.tool): verdict.stream.tool for verdict in pending.verdicts}
    return [tool for tool in tools.values() if tool is not None]


def full_blocks(spans: list[tuple[Entry, int, int]]) -> Iterable[tuple[str, list[dict[str, int]]]]:
    """Return the statements that summarise the blocks which these readings have filled, lowest level first.

    spans: where, the number of the last reading before them, and the number of their last.
    """
    for level in range(BASE_LEVEL, TOP_LEVEL + 1, FAN):
        rows = [
            {
                "machine_id": entry.machine_id,
                "characteristic_id": entry.characteristic_id,
                "level": level,
                "first": before >> level,
                "last": after >> level,
            }
            for entry, before, after in spans
            if before >> level < after >> level
        ]
        if not rows:
            return
        yield (SUMMARISE_READINGS if level == BASE_LEVEL else SUMMARISE_SUMMARIES), rows


def _changes(pending: PendingWrites, touched: list[PendingStream]) -> list[dict[str, Any]]:
    changes: list[dict[str, Any]] = [stream.entry.changed(stream.sequence) for stream in touched]
    streams = {stream.entry.machine_id: stream.entry.machine for stream in touched}
    characteristics = {stream.entry.characteristic_id: stream.entry.characteristic for stream in touched}
    for tool in _tools(pending) if pending.touched_machines else ():
        changes.extend(
            {
                "kind": "correction",
                "machine": streams[tool.machine_id],
                "characteristic": characteristics.get(c.characteristic_id),
                "tool": tool.number,
                "number": c.number,
                "status": c.status,
            }
            for c in tool.written()
        )
        if tool.changed:
            changes.append({"kind": "tool", "machine": streams[tool.machine_id], "tool": tool.number})
    changes.extend(
        {
            "kind": "alarm",
            "machine": streams[alarm.machine_id],
            "characteristic": characteristics.get(alarm.characteristic_id or 0),
            "tool": alarm.tool_memory,
            "id": alarm.id,
            "alarm": alarm.kind,
            "state": "active",
        }
        for alarm in pending.raised
    )
    return changes
