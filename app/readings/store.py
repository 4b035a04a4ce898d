"""Loading the ground under the machines' locks, and writing what was decided: two round trips and one commit.

Rows travel as one JSON document per statement: the server takes it apart with `json_to_recordset`, which measured
faster than arrays for one row and for sixty-four. Large batches send their readings by binary COPY.

This is the one place that writes the tables of offsets and alarms from here: a set-based statement for all readings of
a transaction cannot be had through the actions that serve one person at a time.
"""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

import msgspec

from app.core.parameters import Parameters
from app.core.zones import Zone
from app.db.events import PUBLISHED
from app.db.pipeline import Pipeline
from app.readings.judge import (
    AverageState,
    Ground,
    IssuedCorrection,
    Known,
    Named,
    OpenAlarm,
    StreamState,
    ToolState,
)
from app.readings.records import Entry, Record
from app.readings.schemas import ReadingIn

Book = dict[tuple[int, int], Parameters]
"""Parameters by (characteristic, version). A version never changes, so they are kept for good."""

COPY_FROM = 500  # readings in one transaction from which COPY is faster than one JSON document

LOCK = """
SELECT machine_id, last_correction, pg_current_xact_id()::text FROM machine_state
WHERE machine_id = ANY($1::int[]) ORDER BY machine_id FOR UPDATE
"""
# One statement for all that is needed, as one JSON document, because each statement costs more than what it reads here.
# Corrections of a tool: the open ones, and those applied since the oldest correction or time that a reading names; `named`
# are the corrections that readings name as the last ones in effect.
# The row comparison with the keys can only be had from their own index; plain equalities the planner may also answer by
# walking the primary key through every reading of the characteristic.
LOAD = """
WITH doc AS MATERIALIZED (SELECT $1::json AS d),
named AS MATERIALIZED (
    SELECT c.machine_id, c.number, c.applied_at, c.decided_at
    FROM json_to_recordset((SELECT d -> 'named' FROM doc)) AS w(machine_id int, number int)
    JOIN correction c ON c.machine_id = w.machine_id AND c.number = w.number
)
SELECT json_build_object(
    'streams', (
        SELECT json_agg(json_build_array(s.machine_id, s.characteristic_id, s.sequence, s.parameters_version, s.paused_by,
            s.last_measured_at, a.location, a.average, a.empirical_value, t.number, t."offset", t.total, t.reset_at,
            CASE WHEN t.number IS NOT NULL THEN (
                SELECT json_agg(json_build_array(c.number, c.amount, c.status, c.applied_at, c.decided_at) ORDER BY c.number) FROM (
                    SELECT number, amount, status, applied_at, decided_at FROM correction
                    WHERE machine_id = t.machine_id AND tool_memory = t.number
                        AND status IN ('held', 'awaiting_approval', 'pending')
                    UNION ALL
                    SELECT number, amount, status, applied_at, decided_at FROM correction
                    WHERE machine_id = t.machine_id AND tool_memory = t.number AND status = 'applied'
                        AND number > w.number
                    UNION ALL
                    SELECT number, amount, status, applied_at, decided_at FROM correction
                    WHERE machine_id = t.machine_id AND tool_memory = t.number AND status = 'applied'
                        AND applied_at > least(
                            w.since, (SELECT min(n.applied_at) FROM named n WHERE n.machine_id = t.machine_id)
                        ) AND (number <= w.number OR w.number IS NULL)
                ) c
            ) END))
        FROM json_to_recordset((SELECT d -> 'streams' FROM doc))
            AS w(machine_id int, characteristic_id int, number int, since timestamptz)
        JOIN stream s ON s.machine_id = w.machine_id AND s.characteristic_id = w.characteristic_id
        LEFT JOIN average_memory a ON a.machine_id = s.machine_id AND a.location = s.average_memory
        LEFT JOIN tool t ON t.machine_id = s.machine_id AND t.number = s.tool_memory
    ),
    'named', (SELECT json_agg(json_build_array(machine_id, number, applied_at, decided_at)) FROM named),
    'known', (
        SELECT json_agg(json_build_array(r.characteristic_id, r.key, r.sequence, r.measured, r.parameters_version))
        FROM json_to_recordset((SELECT d -> 'keys' FROM doc)) AS w(machine_id int, characteristic_id int, key text)
        CROSS JOIN LATERAL (
            SELECT * FROM reading
            WHERE key IS NOT NULL AND (machine_id, characteristic_id, key) >= (w.machine_id, w.characteristic_id, w.key)
            ORDER BY machine_id, characteristic_id, key LIMIT 1
        ) r
        WHERE r.machine_id = w.machine_id AND r.characteristic_id = w.characteristic_id AND r.key = w.key
    ))::text
"""
ACTIVE_ALARMS = """
SELECT machine_id, characteristic_id, CASE WHEN characteristic_id IS NULL THEN tool_memory END, kind, id FROM alarm
WHERE machine_id = ANY($1::int[]) AND acknowledged_at IS NULL
"""
PARAMETERS = """
SELECT p.parameters FROM json_to_record($1) AS w(machine_id int, characteristic_id int, version int)
JOIN parameters_version p ON p.machine_id = w.machine_id AND p.characteristic_id = w.characteristic_id
    AND p.version = w.version
"""
ALARM_NUMBERS = "SELECT nextval('alarm_id') FROM generate_series(1, $1::int)"

_READING = """machine_id int4, characteristic_id int4, sequence int8, measured float8, deviation float8, decided float8,
    average_before float8, average_after float8, measured_at timestamptz, received_at timestamptz,
    machined_at timestamptz, parameters_version int4, correction_in_effect int4, correction int4, paused_by int8,
    late bool, zone text, action text, code text, key text, part text, outstanding int4[], alarms int8[]"""
_COLUMNS = ", ".join(Record._fields)
COPY_TYPES = [column.split()[1] for column in _READING.split(",")]
MOVE_STREAMS = """
UPDATE stream s SET sequence = n.sequence, paused_by = n.paused_by, last_measured_at = n.last_measured_at,
    last_received_at = n.last_received_at, last_measured = n.last_measured, last_deviation = n.last_deviation,
    last_average = n.last_average, last_zone = n.last_zone
FROM json_to_recordset((SELECT d -> 'streams' FROM doc)) AS n(machine_id int, characteristic_id int, sequence bigint,
    paused_by bigint, last_measured_at timestamptz, last_received_at timestamptz, last_measured float8,
    last_deviation float8, last_average float8, last_zone text)
WHERE s.machine_id = n.machine_id AND s.characteristic_id = n.characteristic_id
"""
MOVE_AVERAGES = """
UPDATE average_memory a SET average = n.average, updated_at = now()
FROM json_to_recordset((SELECT d -> 'averages' FROM doc)) AS n(machine_id int, location int, average float8)
WHERE a.machine_id = n.machine_id AND a.location = n.location
"""
SAVE = f"""
WITH doc AS MATERIALIZED (SELECT $1::json AS d), moved AS ({MOVE_STREAMS}), averaged AS ({MOVE_AVERAGES}),
stored AS (
    INSERT INTO reading ({_COLUMNS})
    SELECT {_COLUMNS} FROM json_to_recordset((SELECT d -> 'readings' FROM doc)) AS r({_READING})
), {PUBLISHED.format(changes="(SELECT d -> 'changes' FROM doc)")}
"""  # noqa: S608 - made of constants
COPY = f"COPY reading ({_COLUMNS}) FROM STDIN (FORMAT BINARY)"
# The rarer rows, each statement sent only when there is something for it.
TOUCHES = """
INSERT INTO reading_touches (machine_id, characteristic_id, sequence, touches)
SELECT * FROM json_to_recordset($1) AS r(machine_id int, characteristic_id int, sequence bigint, touches jsonb)
"""
COUNTERS = """
UPDATE machine_state m SET last_correction = n.last_correction
FROM json_to_recordset($1) AS n(machine_id int, last_correction int) WHERE m.machine_id = n.machine_id
"""
ISSUE = """
INSERT INTO correction (machine_id, number, characteristic_id, sequence, tool_memory, size_error, amount, status,
    decided_at, superseded_by, applied_at, applied_by, offset_after)
SELECT machine_id, number, characteristic_id, sequence, tool_memory, size_error, amount, status,
    CASE WHEN superseded_by IS NOT NULL THEN now() END, superseded_by, applied_at, applied_by, offset_after
FROM json_to_recordset($1) AS r(machine_id int, number int, characteristic_id int, sequence bigint,
    tool_memory int, size_error float8, amount float8, status text, superseded_by int, applied_at timestamptz,
    applied_by text, offset_after float8)
"""
CHANGE_CORRECTIONS = """
UPDATE correction c SET status = n.status, superseded_by = n.superseded_by, applied_at = n.applied_at,
    applied_by = n.applied_by, offset_after = n.offset_after,
    decided_at = CASE WHEN n.status = 'superseded' THEN now() ELSE c.decided_at END
FROM json_to_recordset($1) AS n(machine_id int, number int, status text, superseded_by int, applied_at timestamptz,
    applied_by text, offset_after float8)
WHERE c.machine_id = n.machine_id AND c.number = n.number
"""
MOVE_TOOLS = """
UPDATE tool t SET "offset" = n."offset", total = n.total
FROM json_to_recordset($1) AS n(machine_id int, number int, "offset" float8, total float8)
WHERE t.machine_id = n.machine_id AND t.number = n.number
"""
STEPS = """
INSERT INTO tool_event (machine_id, number, at, kind, offset_before, offset_after, correction, actor)
SELECT machine_id, number, at, 'correction', offset_before, offset_after, correction, actor
FROM json_to_recordset($1) AS r(machine_id int, number int, at timestamptz, offset_before float8,
    offset_after float8, correction int, actor text)
"""
RAISE = """
INSERT INTO alarm (machine_id, id, kind, characteristic_id, tool_memory, count, sequence, last_sequence, data)
SELECT * FROM json_to_recordset($1) AS r(machine_id int, id bigint, kind text, characteristic_id int, tool_memory int,
    count int, sequence bigint, last_sequence bigint, data jsonb)
"""
REPEAT = """
UPDATE alarm a SET count = a.count + n.count, last_at = now(), last_sequence = n.last_sequence
FROM json_to_recordset($1) AS n(machine_id int, id bigint, count int, last_sequence bigint)
WHERE a.machine_id = n.machine_id AND a.id = n.id
"""

BASE_LEVEL, TOP_LEVEL, FAN = 5, 23, 2  # blocks of 32, 128, 512 … readings
_ZONES = ", ".join(f"count(*) FILTER (WHERE r.zone = '{zone.value}')" for zone in Zone)
_ZONE_SUMS = ", ".join(f"sum(l.zones[{at}])" for at in range(1, len(Zone) + 1))
SUMMARISE_READINGS = f"""
INSERT INTO reading_summary
SELECT b.machine_id, b.characteristic_id, {BASE_LEVEL}, (r.sequence - 1) >> {BASE_LEVEL} AS block, count(*),
    min(deviation), max(deviation), sum(deviation), sum(deviation * deviation),
    min(deviation) FILTER (WHERE (r.sequence - 1) % {1 << BASE_LEVEL} = 0),
    min(deviation) FILTER (WHERE r.sequence % {1 << BASE_LEVEL} = 0),
    min(average_after) FILTER (WHERE r.sequence % {1 << BASE_LEVEL} = 0),
    count(correction), ARRAY[{_ZONES}], min(measured_at), max(measured_at)
FROM json_to_recordset($1) AS b(machine_id int, characteristic_id int, first bigint, last bigint)
JOIN reading r ON r.machine_id = b.machine_id AND r.characteristic_id = b.characteristic_id
    AND r.sequence > b.first << {BASE_LEVEL} AND r.sequence <= b.last << {BASE_LEVEL}
GROUP BY 1, 2, 4
"""  # noqa: S608 - made of constants
SUMMARISE_SUMMARIES = f"""
INSERT INTO reading_summary
SELECT b.machine_id, b.characteristic_id, b.level, l.block >> {FAN} AS block, sum(l.count), min(minimum), max(maximum),
    sum(l.sum), sum(sum_squares), min(l.first) FILTER (WHERE l.block % {1 << FAN} = 0),
    min(l.last) FILTER (WHERE l.block % {1 << FAN} = {(1 << FAN) - 1}),
    min(l.average) FILTER (WHERE l.block % {1 << FAN} = {(1 << FAN) - 1}),
    sum(corrections), ARRAY[{_ZONE_SUMS}], min(first_at), max(last_at)
FROM json_to_recordset($1) AS b(machine_id int, characteristic_id int, level int, first bigint, last bigint)
JOIN reading_summary l ON l.machine_id = b.machine_id AND l.characteristic_id = b.characteristic_id
    AND l.level = b.level - {FAN} AND l.block >= b.first << {FAN} AND l.block < b.last << {FAN}
GROUP BY 1, 2, 3, 4
"""  # noqa: S608 - made of constants

_json = msgspec.json.Encoder()


def as_json(value: Any) -> str:
    """One statement's rows."""
    return _json.encode(value).decode()


class _Issued(msgspec.Struct, array_like=True):
    number: int
    amount: float
    status: str
    applied_at: datetime | None
    decided_at: datetime | None


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
    corrections: list[_Issued] | None


class _Loaded(msgspec.Struct):
    streams: list[_Stream]
    named: list[tuple[int, int, datetime | None, datetime | None]] | None
    known: list[tuple[int, str, int, float, int]] | None


_loaded = msgspec.json.Decoder(_Loaded)


async def load(pipeline: Pipeline, book: Book, wanted: Sequence[tuple[Entry, ReadingIn]]) -> tuple[Ground, str]:
    """Begin a transaction, lock the machines, load what the readings are judged against; also its transaction id."""
    entries = {entry.characteristic_id: entry for entry, _ in wanted}
    machines = _machines(wanted)
    document = {
        "streams": [
            {"machine_id": e.machine_id, "characteristic_id": e.characteristic_id, **machines[e.machine_id]}
            for e in entries.values()
        ],
        "named": [
            {"machine_id": machine_id, "number": number}
            for machine_id, number in {
                (e.machine_id, r.correction_in_effect) for e, r in wanted if r.correction_in_effect is not None
            }
        ],
        "keys": [
            {"machine_id": e.machine_id, "characteristic_id": e.characteristic_id, "key": r.key}
            for e, r in wanted
            if r.key is not None
        ],
    }
    _begun, locked, ((text,),) = await pipeline.run(
        (("BEGIN", None), (LOCK, _array(machines)), (LOAD, as_json(document)))
    )
    loaded = _loaded.decode(text or b"")
    ground = Ground()
    ground.last_correction = {int(machine_id or 0): int(last or 0) for machine_id, last, _transaction in locked}
    for row in loaded.streams:
        parameters = await _parameters(pipeline, book, row.machine_id, row.characteristic_id, row.version)
        _add_stream(ground, entries[row.characteristic_id], parameters, row)
    for machine_id, number, applied_at, decided_at in loaded.named or ():
        ground.named[machine_id, number] = Named(applied_at, decided_at)
    for c, key, sequence, measured, version in loaded.known or ():
        parameters = await _parameters(pipeline, book, entries[c].machine_id, c, version)
        ground.stored_keys[c, key] = Known(sequence, measured, parameters)
    return ground, (locked[0][2] or b"").decode()


def _array(numbers: Iterable[int]) -> str:
    return "{" + ",".join(map(str, numbers)) + "}"


def _machines(wanted: Iterable[tuple[Entry, ReadingIn]]) -> dict[int, dict[str, Any]]:
    """The machines, each with the oldest correction and the oldest time that one of its readings names."""
    machines: dict[int, dict[str, Any]] = {}
    for entry, reading in wanted:
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
    pipeline: Pipeline, book: Book, machine_id: int, characteristic_id: int, version: int
) -> Parameters:
    parameters = book.get((characteristic_id, version))
    if parameters is None:
        wanted = {"machine_id": machine_id, "characteristic_id": characteristic_id, "version": version}
        (((text,),),) = await pipeline.run(((PARAMETERS, as_json(wanted)),))  # a version that is named is there
        parameters = book[characteristic_id, version] = Parameters.from_dict(msgspec.json.decode(text or b""))
    return parameters


def _add_stream(ground: Ground, entry: Entry, parameters: Parameters, row: _Stream) -> None:
    memory = tool = None
    if row.location is not None:
        memory = ground.averages.get((row.machine_id, row.location))
        if memory is None:
            memory = ground.averages[row.machine_id, row.location] = AverageState(
                row.machine_id, row.location, row.average or 0.0, row.empirical_value or 0.0
            )
    if row.tool is not None:
        tool = ground.tools.get((row.machine_id, row.tool))
        if tool is None:
            tool = ground.tools[row.machine_id, row.tool] = ToolState(
                row.machine_id, row.tool, row.offset or 0.0, row.total or 0.0, row.reset_at
            )
            tool.corrections = [
                IssuedCorrection(
                    row.machine_id,
                    c.number,
                    row.tool,
                    c.amount,
                    c.status,
                    applied_at=c.applied_at,
                    decided_at=c.decided_at,
                )
                for c in row.corrections or ()
            ]
    ground.streams[row.characteristic_id] = StreamState(
        entry,
        row.sequence,
        row.version,
        parameters,
        memory,
        tool,
        row.paused_by,
        row.last_measured_at,
        before=row.sequence,
    )


async def save(pipeline: Pipeline, ground: Ground) -> None:
    """Write everything that was decided on this ground and commit it."""
    await _number_alarms(pipeline, ground)
    records = [verdict.record() for verdict in ground.verdicts]
    touched = [stream for stream in ground.streams.values() if stream.last is not None]
    copying = len(records) >= COPY_FROM
    document = {
        "streams": [_stream_row(stream) for stream in touched],
        "averages": [
            {"machine_id": a.machine_id, "location": a.location, "average": a.average}
            for a in ground.averages.values()
            if a.changed
        ],
        "readings": [] if copying else [record._asdict() for record in records],
        "changes": _changes(ground, touched),
    }
    if copying:
        await _copy(pipeline, records)
    await pipeline.run(
        (
            *((statement, as_json(rows)) for statement, rows in _rarer(ground) if rows),
            (SAVE, as_json(document)),
            *(
                (statement, as_json(blocks))
                for statement, blocks in full_blocks([(s.entry, s.before, s.sequence) for s in touched])
            ),
            ("COMMIT", None),
        )
    )


async def _number_alarms(pipeline: Pipeline, ground: Ground) -> None:
    """Find the alarms that are active for the same trouble already, and draw numbers for the others."""
    if not ground.raised:
        return
    (rows,) = await pipeline.run(((ACTIVE_ALARMS, _array(ground.last_correction)),))
    active = {
        (int(machine or 0), _number(characteristic), _number(tool), (kind or b"").decode()): _number(alarm)
        for machine, characteristic, tool, kind, alarm in rows
    }
    for alarm in ground.raised:
        tool = alarm.tool_memory if alarm.characteristic_id is None else None
        alarm.id = active.get((alarm.machine_id, alarm.characteristic_id, tool, alarm.kind))
        alarm.new = alarm.id is None
    new = [alarm for alarm in ground.raised if alarm.new]
    if new:
        (numbers,) = await pipeline.run(((ALARM_NUMBERS, str(len(new))),))
        for alarm, (number,) in zip(new, numbers, strict=True):
            alarm.id = _number(number)


def _number(text: bytes | None) -> int | None:
    return None if text is None else int(text)


async def _copy(pipeline: Pipeline, records: list[Record]) -> None:
    async with pipeline.connection.cursor() as cursor, cursor.copy(COPY) as copy:
        copy.set_types(COPY_TYPES)
        for record in records:
            await copy.write_row(record)


def _stream_row(stream: StreamState) -> dict[str, Any]:
    last = stream.last
    assert last is not None
    return {
        "machine_id": stream.entry.machine_id,
        "characteristic_id": stream.entry.characteristic_id,
        "sequence": stream.sequence,
        "paused_by": stream.paused_by.id if isinstance(stream.paused_by, OpenAlarm) else stream.paused_by,
        "last_measured_at": stream.last_measured_at,
        "last_received_at": last.received_at,
        "last_measured": last.measured,
        "last_deviation": last.decision.deviation,
        "last_average": last.decision.average_after,
        "last_zone": last.decision.zone.value,
    }


def _rarer(ground: Ground) -> Iterable[tuple[str, list[Any]]]:
    yield (
        TOUCHES,
        [
            {
                "machine_id": v.stream.entry.machine_id,
                "characteristic_id": v.stream.entry.characteristic_id,
                "sequence": v.sequence,
                "touches": v.reading.touches,
            }
            for v in ground.verdicts
            if v.reading.touches is not None
        ],
    )
    if ground.touched_machines:
        yield (
            COUNTERS,
            [{"machine_id": m, "last_correction": ground.last_correction[m]} for m in ground.touched_machines],
        )
        yield ISSUE, [c for tool in ground.tools.values() for c in tool.corrections if c.new]
        yield (
            CHANGE_CORRECTIONS,
            [c for tool in ground.tools.values() for c in tool.corrections if c.changed and not c.new],
        )
        yield (
            MOVE_TOOLS,
            [
                {"machine_id": t.machine_id, "number": t.number, "offset": t.offset, "total": t.total}
                for t in ground.tools.values()
                if t.changed
            ],
        )
        yield STEPS, ground.steps
    if ground.raised:
        yield RAISE, [alarm for alarm in ground.raised if alarm.new]
        yield REPEAT, [alarm for alarm in ground.raised if not alarm.new]


def _full(touched: list[StreamState]) -> Iterable[tuple[str, list[dict[str, int]]]]:
    return full_blocks([(stream.entry, stream.before, stream.sequence) for stream in touched])


def full_blocks(spans: list[tuple[Entry, int, int]]) -> Iterable[tuple[str, list[dict[str, int]]]]:
    """The statements that summarise the blocks which these readings have filled, lowest level first.

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


def _changes(ground: Ground, touched: list[StreamState]) -> list[dict[str, Any]]:
    changes: list[dict[str, Any]] = [
        {
            "kind": "reading",
            "machine": stream.entry.machine,
            "characteristic": stream.entry.characteristic,
            "sequence": stream.sequence,
        }
        for stream in touched
    ]
    streams = {stream.entry.machine_id: stream.entry.machine for stream in touched}
    characteristics = {stream.entry.characteristic_id: stream.entry.characteristic for stream in touched}
    for tool in ground.tools.values():
        changes.extend(
            {
                "kind": "correction",
                "machine": streams[tool.machine_id],
                "characteristic": characteristics.get(c.characteristic_id),
                "tool": tool.number,
                "number": c.number,
                "status": c.status,
            }
            for c in tool.corrections
            if c.new or c.changed
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
        for alarm in ground.raised
    )
    return changes
