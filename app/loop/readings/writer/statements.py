"""The SQL of the writer. Parameters are arrays of numbers and JSON documents of rows.

Rows travel as JSON because the server takes it apart with `json_to_recordset`, which measured faster than arrays for one row
and for sixty-four.
"""

from collections.abc import Iterable
from typing import Any

import msgspec

from app.core.clock import FEWEST
from app.core.control_plan import MISSED_ALARM
from app.core.decision.limits import Zone
from app.core.opposite_effect import LONGEST
from app.core.variants import Results
from app.db.events import CHANNEL, PUBLISHED
from app.loop.readings.records import Record
from app.loop.readings.writer.snapshot import MOST_APPLIED
from app.loop.tables.tools import ASKED_AGAIN, DOUBT, UNTAKEN

_json = msgspec.json.Encoder(enc_hook=list)  # a list that is shared by many rows


def as_json(value: Any) -> str:
    """One statement's rows."""
    return _json.encode(value).decode()


def array(numbers: Iterable[int]) -> str:
    """An array of numbers."""
    return "{" + ",".join(map(str, numbers)) + "}"


LOCK = """
SELECT machine_id, last_correction, version, planned FROM machine_state
WHERE machine_id = ANY($1::int[]) ORDER BY machine_id FOR UPDATE
"""
# Of these machines the ones that nobody holds.
FREE = "SELECT machine_id FROM machine_state WHERE machine_id = ANY($1::int[]) FOR UPDATE SKIP LOCKED"
THERE = "SELECT id FROM machine WHERE id = ANY($1::int[])"
# Ends the transaction (by a division by zero) unless every machine is still at the version that its readings were decided
# on; moves the versions on. With several machines LOCK comes first, because an update takes rows in any order.
_GUARD = """
current AS (
    UPDATE machine_state m SET version = m.version + 1
    FROM json_to_recordset($1) AS w(machine_id int, version bigint)
    WHERE m.machine_id = w.machine_id AND m.version = w.version RETURNING 1
),
guard AS MATERIALIZED (SELECT 1 / (count(*) = json_array_length($1))::int FROM current)
"""
GUARD = f"WITH {_GUARD} SELECT * FROM guard"  # noqa: S608 - made of constants
# One statement for all that is needed, as one JSON document, because each statement costs more than what it reads here.
# Corrections of a tool: the open ones, and those applied since the oldest correction or time that a reading names, or with it if
# they had waited for a person; `named` are the corrections that readings name as the last ones in effect. The order is that of
# the fields of `LoadedStream`, `LoadedAverage` and `LoadedTool`.
# The row comparison with the keys can only be had from their own index; plain equalities the planner may also answer by
# walking the primary key through every reading of the characteristic.
LOAD = f"""
WITH doc AS MATERIALIZED (SELECT $1::json AS d),
named AS MATERIALIZED (
    SELECT c.machine_id, c.number, c.applied_at, c.fetched_at, c.status, c.tool_memory, c.created_at,
        CASE WHEN c.status IN ('pending', 'applied') THEN c.decided_at END AS decided_at  -- not when it was dropped
    FROM json_to_recordset((SELECT d -> 'named' FROM doc)) AS w(machine_id int, number int)
    JOIN correction c ON c.machine_id = w.machine_id AND c.number = w.number
)
SELECT json_build_object(
    'streams', (
        SELECT json_agg(json_build_array(
            json_build_array(
                json_build_array(w.machine_id, w.machine, w.characteristic_id, w.characteristic),
                s.sequence, s.parameters_version, a.location, t.number, s.paused_by, s.last_measured_at, s.level,
                s.level_sequence, s.gain_from,
                coalesce(CASE WHEN t.number IS NOT NULL THEN (
                    SELECT json_agg(json_build_array(r.sequence, r.deviation, r.compensated, r.decided - r.deviation,
                        r.action = 'correct' AND r.parameters_version = s.parameters_version)
                        ORDER BY r.sequence)
                    FROM reading r
                    WHERE r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id
                        AND r.sequence > s.sequence - {LONGEST} AND r.compensated IS NOT NULL AND NOT r.late
                        AND r.zone <> 'probe_fault' AND r.code NOT IN ('implausible', 'imported')
                        AND NOT EXISTS (
                            SELECT FROM exclusion e WHERE e.machine_id = r.machine_id
                                AND e.characteristic_id = r.characteristic_id AND e.sequence = r.sequence
                        )
                ) END, '[]'),
                coalesce(CASE WHEN t.number IS NOT NULL THEN (
                    SELECT json_agg(json_build_array(r.sequence, r.received_at, r.measured_at, r.machined_at)
                        ORDER BY r.sequence)
                    FROM reading r
                    WHERE r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id
                        AND r.sequence > s.sequence - {FEWEST} AND r.code <> 'imported'
                ) END, '[]'),
                coalesce((
                    SELECT json_agg(json_build_array(json_build_array(w.machine_id, w.machine, f.id, f.key), f.form)
                        ORDER BY f.id)
                    FROM characteristic f WHERE f.machine_id = s.machine_id AND f.form_of = s.characteristic_id
                ), '[]')
            ),
            CASE WHEN a.location IS NOT NULL THEN
                json_build_array(a.machine_id, a.location, a.average, a.empirical_value)
            END,
            CASE WHEN t.number IS NOT NULL THEN json_build_array(
                t.machine_id, t.number, t."offset", t.total, t.reset_at,
                coalesce(t.reset_at > coalesce(t.changed_at, '-infinity'), false), t.paused_by,
                coalesce((
                    SELECT json_agg(json_build_array(
                        c.number, c.amount, c.status, c.applied_at, c.decided_at, c.fetched_at) ORDER BY c.number) FROM (
                        SELECT number, amount, status, applied_at, decided_at, fetched_at FROM correction
                        WHERE machine_id = t.machine_id AND tool_memory = t.number
                            AND status IN ('held', 'awaiting_approval', 'pending')
                        UNION ALL
                        SELECT number, amount, status, applied_at, decided_at, fetched_at FROM correction
                        WHERE machine_id = t.machine_id AND tool_memory = t.number AND status = 'applied'
                            AND number > w.number
                        UNION ALL
                        SELECT number, amount, status, applied_at, decided_at, fetched_at FROM correction
                        WHERE machine_id = t.machine_id AND tool_memory = t.number AND status = 'applied'
                            AND (applied_at, decided_at IS NOT NULL) >= (w.since, true)
                            AND (number <= w.number OR w.number IS NULL)
                    ) c
                ), '[]'),
                w.number, w.since,
                coalesce((
                    SELECT json_agg(json_build_array(c.number, c.amount) ORDER BY c.number) FROM (
                        SELECT number, amount FROM correction
                        WHERE machine_id = t.machine_id AND tool_memory = t.number AND status = 'applied'
                        ORDER BY number DESC LIMIT {MOST_APPLIED}
                    ) c
                ), '[]'),
                (
                    SELECT json_build_array(a.id, a.data -> 'last') FROM alarm a
                    WHERE a.machine_id = t.machine_id AND a.tool_memory = t.number AND a.characteristic_id IS NULL
                        AND a.kind = '{UNTAKEN}' AND a.data ? 'last' ORDER BY a.id DESC LIMIT 1
                )
            ) END))
        FROM (
            SELECT machine_id, machine, characteristic_id, characteristic, number, least(
                w.since, (SELECT min(n.applied_at) FROM named n WHERE n.machine_id = w.machine_id)
            ) AS since
            FROM json_to_recordset((SELECT d -> 'streams' FROM doc)) AS w(machine_id int, machine text,
                characteristic_id int, characteristic text, number int, since timestamptz)
        ) w
        JOIN stream s ON s.machine_id = w.machine_id AND s.characteristic_id = w.characteristic_id
        LEFT JOIN average_memory a ON a.machine_id = s.machine_id AND a.location = s.average_memory
        LEFT JOIN tool t ON t.machine_id = s.machine_id AND t.number = s.tool_memory
    ),
    'named', (SELECT json_agg(json_build_array(machine_id, number, json_build_array(
        applied_at, decided_at, fetched_at, status, tool_memory, created_at))) FROM named),
    'known', (
        SELECT json_agg(json_build_array(r.characteristic_id, r.key, r.sequence, r.measured, r.parameters_version,
            r.code = 'first_move_triggered'))
        FROM json_to_recordset((SELECT d -> 'keys' FROM doc)) AS w(machine_id int, characteristic_id int, key text)
        CROSS JOIN LATERAL (
            SELECT * FROM reading
            WHERE key IS NOT NULL AND (machine_id, characteristic_id, key) >= (w.machine_id, w.characteristic_id, w.key)
            ORDER BY machine_id, characteristic_id, key LIMIT 1
        ) r
        WHERE r.machine_id = w.machine_id AND r.characteristic_id = w.characteristic_id AND r.key = w.key
    ))::text
"""  # noqa: S608 - made of constants
ACTIVE_ALARMS = """
SELECT machine_id, characteristic_id, CASE WHEN characteristic_id IS NULL THEN tool_memory END, kind, id FROM alarm
WHERE machine_id = ANY($1::int[]) AND acknowledged_at IS NULL
"""
PARAMETERS = """
SELECT p.parameters FROM json_to_record($1) AS w(machine_id int, characteristic_id int, version int)
JOIN parameters_version p ON p.machine_id = w.machine_id AND p.characteristic_id = w.characteristic_id
    AND p.version = w.version
"""
# Control plans that count parts, asked for only on machines that have any; the last reading before the tool change and the alarm
# that `app.loop.control_plan.signs` finds. An alarm is looked for in as many readings as it asks for: history that was imported
# meanwhile is none of them, so it errs to more measurements.
PLANS = f"""
SELECT p.characteristic_id, p.every, p.after_change, p.after_alarm,
    CASE WHEN p.after_change > 0 AND (t.changed_at IS NOT NULL OR EXISTS (
        SELECT FROM parameters_version v WHERE v.machine_id = s.machine_id AND v.characteristic_id = s.characteristic_id
            AND (v.parameters ->> 'tool_memory')::int <> s.tool_memory
    )) THEN s.sequence_at_tool_change END,
    CASE WHEN a.number IS NOT NULL OR a.at IS NOT NULL THEN s.sequence - (
        SELECT count(*) FROM reading r WHERE r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id
            AND r.sequence > greatest(s.sequence - p.after_alarm, a.number) AND r.code <> 'imported'
            AND (a.at IS NULL OR r.received_at > a.at)
    ) END
FROM json_to_recordset($1) AS w(machine_id int, characteristic_id int)
JOIN control_plan p ON p.machine_id = w.machine_id AND p.characteristic_id = w.characteristic_id
JOIN stream s ON s.machine_id = w.machine_id AND s.characteristic_id = w.characteristic_id
LEFT JOIN tool t ON t.machine_id = s.machine_id AND t.number = s.tool_memory
LEFT JOIN LATERAL (
    SELECT max(number) AS number, max(last_at) FILTER (WHERE number IS NULL) AS at FROM (
        (SELECT coalesce(last_sequence, sequence) AS number, last_at FROM alarm
        WHERE machine_id = s.machine_id AND characteristic_id = s.characteristic_id AND kind <> '{MISSED_ALARM}'
        ORDER BY id DESC LIMIT 100)
        UNION ALL
        (SELECT NULL::bigint, last_at FROM alarm
        WHERE machine_id = s.machine_id AND characteristic_id IS NULL AND tool_memory = s.tool_memory AND s.tool_memory > 0
        ORDER BY id DESC LIMIT 100)
    ) a
) a ON p.after_alarm > 0
WHERE p.every IS NOT NULL OR p.after_change > 0 OR p.after_alarm > 0
"""  # noqa: S608 - made of constants
# Doubts that have been answered: each is raised once, that of a clock while it is no further behind.
ANSWERED_DOUBTS = f"""
SELECT machine_id, tool_memory, data ->> 'why', data ->> 'number', data ->> 'lag' FROM alarm
WHERE machine_id = ANY($1::int[]) AND characteristic_id IS NULL AND kind = '{DOUBT}'
    AND acknowledged_at > now() - make_interval(days => {ASKED_AGAIN})
"""  # noqa: S608 - made of constants
ALARM_NUMBERS = "SELECT nextval('alarm_id') FROM generate_series(1, $1::int)"

_READING = """machine_id int4, characteristic_id int4, sequence int8, measured float8, deviation float8, decided float8,
    average_before float8, average_after float8, measured_at timestamptz, received_at timestamptz,
    machined_at timestamptz, parameters_version int4, correction_in_effect int4, correction int4, paused_by int8,
    late bool, zone text, action text, code text, key text, part text, outstanding int4[], alarms int8[],
    compensated float8"""
_COLUMNS = ", ".join(Record.__struct_fields__)
# A column that the writer encodes itself goes out as the bytes it is: COPY sends no types.
COPY_TYPES = ["bytea" if column.split()[0] == "outstanding" else column.split()[1] for column in _READING.split(",")]
MOVE_STREAMS = """
UPDATE stream s SET sequence = n.sequence, paused_by = n.paused_by, last_measured_at = n.last_measured_at,
    last_received_at = n.last_received_at, last_measured = n.last_measured, last_deviation = n.last_deviation,
    last_average = n.last_average, last_zone = n.last_zone
FROM json_to_recordset($2) AS n(machine_id int, characteristic_id int, sequence bigint,
    paused_by bigint, last_measured_at timestamptz, last_received_at timestamptz, last_measured float8,
    last_deviation float8, last_average float8, last_zone text)
WHERE s.machine_id = n.machine_id AND s.characteristic_id = n.characteristic_id
"""
MOVE_AVERAGES = """
UPDATE average_memory a SET average = n.average, updated_at = now()
FROM json_to_recordset($3) AS n(machine_id int, location int, average float8)
WHERE a.machine_id = n.machine_id AND a.location = n.location
"""
# All that an ordinary reading needs, in one statement, because each costs more than what it writes. Parameters: versions (see
# GUARD; none, if that has been asked), streams, averages, readings, changes, and whether to wake who listens.
SAVE = f"""
WITH {_GUARD}, moved AS ({MOVE_STREAMS}), averaged AS ({MOVE_AVERAGES}),
stored AS (INSERT INTO reading ({_COLUMNS}) SELECT {_COLUMNS} FROM json_to_recordset($4) AS r({_READING})),
{PUBLISHED.format(changes="$5", after="FROM guard")} WHERE $6::bool
"""  # noqa: S608 - made of constants
# For readings stored without a notification; anyone who is woken reads on in the journal from where it was.
NOTIFY = f"SELECT pg_notify({CHANNEL}, '')"
COPY = f"COPY reading ({_COLUMNS}) FROM STDIN (FORMAT BINARY)"
# The rarer rows, each statement sent only when there is something for it.
TOUCHES = """
INSERT INTO reading_touches (machine_id, characteristic_id, sequence, touches)
SELECT * FROM json_to_recordset($1) AS r(machine_id int, characteristic_id int, sequence bigint, touches jsonb)
"""
# A sensor's temperatures say nothing of the work: beside them the reading gets what the machine works at, as it does without them.
# Made first, then inserted, as in `SUMMARISE_READINGS`.
CONTEXT = """
WITH made AS MATERIALIZED (
SELECT r.machine_id, r.characteristic_id, r.sequence, coalesce(p.context, '{}') || r.context AS context
FROM json_to_recordset($1) AS r(machine_id int, characteristic_id int, sequence bigint, measured_at timestamptz, context jsonb)
LEFT JOIN present_context p ON p.machine_id = r.machine_id AND r.measured_at >= p.since
    AND r.context - '{part_temperature,machine_temperature}'::text[] = '{}'
)
INSERT INTO reading_context (machine_id, characteristic_id, sequence, context) SELECT * FROM made
"""
_RESULTS = """machine_id int, characteristic_id int, sequence bigint, run_out float8, out_of_roundness float8, taper float8,
    slope float8, repeat_range float8, repeat_deviation float8, sections_outside smallint, rejected bool, straightness float8"""
RESULTS = f"""
INSERT INTO reading_results (machine_id, characteristic_id, sequence, {", ".join(Results._fields)})
SELECT * FROM json_to_recordset($1) AS r({_RESULTS})
"""  # noqa: S608 - made of constants
NEXT = """
INSERT INTO reading_next (machine_id, characteristic_id, sequence, measure_next)
SELECT * FROM json_to_recordset($1) AS r(machine_id int, characteristic_id int, sequence bigint, measure_next int)
"""
COUNTERS = """
UPDATE machine_state m SET last_correction = n.last_correction
FROM json_to_recordset($1) AS n(machine_id int, last_correction int) WHERE m.machine_id = n.machine_id
"""
ISSUE = """
INSERT INTO correction (machine_id, number, characteristic_id, sequence, tool_memory, size_error, amount, status,
    decided_at, reason, superseded_by, applied_at, applied_by, offset_after)
SELECT machine_id, number, characteristic_id, sequence, tool_memory, size_error, amount, status,
    CASE WHEN status = 'superseded' THEN now() END, reason, superseded_by, applied_at, applied_by, offset_after
FROM json_to_recordset($1) AS r(machine_id int, number int, characteristic_id int, sequence bigint,
    tool_memory int, size_error float8, amount float8, status text, reason text, superseded_by int,
    applied_at timestamptz, applied_by text, offset_after float8)
"""
CHANGE_CORRECTIONS = """
UPDATE correction c SET status = n.status, superseded_by = n.superseded_by, applied_at = n.applied_at,
    applied_by = n.applied_by, offset_after = n.offset_after,
    decided_at = CASE WHEN n.status = 'superseded' THEN now() ELSE c.decided_at END,
    decided_by = CASE WHEN n.reason IS NULL THEN c.decided_by END, reason = coalesce(n.reason, c.reason)
FROM json_to_recordset($1) AS n(machine_id int, number int, status text, reason text, superseded_by int, applied_at timestamptz,
    applied_by text, offset_after float8)
WHERE c.machine_id = n.machine_id AND c.number = n.number
"""
MOVE_TOOLS = """
UPDATE tool t SET "offset" = n."offset", total = n.total, paused_by = n.paused_by
FROM json_to_recordset($1) AS n(machine_id int, number int, "offset" float8, total float8, paused_by bigint)
WHERE t.machine_id = n.machine_id AND t.number = n.number
"""
MOVE_LEVELS = """
UPDATE stream s SET level = n.level, level_sequence = n.level_sequence
FROM json_to_recordset($1) AS n(machine_id int, characteristic_id int, level float8, level_sequence bigint)
WHERE s.machine_id = n.machine_id AND s.characteristic_id = n.characteristic_id
"""
STEPS = """
INSERT INTO tool_event (machine_id, number, at, kind, offset_before, offset_after, correction, actor)
SELECT machine_id, number, at, 'correction', offset_before, offset_after, correction, actor
FROM json_to_recordset($1) AS r(machine_id int, number int, at timestamptz, offset_before float8,
    offset_after float8, correction int, actor text)
"""
# raised_at, last_at: when the readings that raise it were received, so that none of them comes after it, and by one clock.
RAISE = """
INSERT INTO alarm (
    machine_id, id, kind, characteristic_id, tool_memory, count, sequence, last_sequence, raised_at, last_at, data)
SELECT machine_id, id, kind, characteristic_id, tool_memory, count, sequence, last_sequence, last_at, last_at, data
FROM json_to_recordset($1) AS r(machine_id int, id bigint, kind text, characteristic_id int, tool_memory int,
    count int, sequence bigint, last_sequence bigint, last_at timestamptz, data jsonb)
"""
# The sentence tells the newest reading, as the correction that is held does; a tool's alarm keeps the one that raised it.
REPEAT = """
UPDATE alarm a SET count = a.count + n.count, last_at = greatest(a.last_at, n.last_at), last_sequence = n.last_sequence,
    data = CASE WHEN a.characteristic_id IS NULL THEN a.data ELSE n.data END
FROM json_to_recordset($1) AS n(machine_id int, id bigint, count int, last_sequence bigint, last_at timestamptz,
    data jsonb)
WHERE a.machine_id = n.machine_id AND a.id = n.id
"""

BASE_LEVEL, TOP_LEVEL, FAN = 5, 23, 2  # blocks of 32, 128, 512 … readings
_ZONES = ", ".join(f"count(*) FILTER (WHERE r.zone = '{zone.value}')" for zone in Zone)
_ZONE_SUMS = ", ".join(f"sum(l.zones[{at}])" for at in range(1, len(Zone) + 1))
_SUMMARY = """machine_id, characteristic_id, level, block, count, minimum, maximum, sum, sum_squares, first, last, average,
    corrections, zones, first_at, last_at"""
# Made first, then inserted: an INSERT of a SELECT that is routed to another node crashes Citus 14.0.1.
SUMMARISE_READINGS = f"""
WITH made AS MATERIALIZED (
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
)
INSERT INTO reading_summary ({_SUMMARY}) SELECT * FROM made
"""  # noqa: S608 - made of constants
SUMMARISE_SUMMARIES = f"""
WITH made AS MATERIALIZED (
SELECT b.machine_id, b.characteristic_id, b.level, l.block >> {FAN} AS block, sum(l.count), min(minimum), max(maximum),
    sum(l.sum), sum(sum_squares), min(l.first) FILTER (WHERE l.block % {1 << FAN} = 0),
    min(l.last) FILTER (WHERE l.block % {1 << FAN} = {(1 << FAN) - 1}),
    min(l.average) FILTER (WHERE l.block % {1 << FAN} = {(1 << FAN) - 1}),
    sum(corrections), ARRAY[{_ZONE_SUMS}], min(first_at), max(last_at)
FROM json_to_recordset($1) AS b(machine_id int, characteristic_id int, level int, first bigint, last bigint)
JOIN reading_summary l ON l.machine_id = b.machine_id AND l.characteristic_id = b.characteristic_id
    AND l.level = b.level - {FAN} AND l.block >= b.first << {FAN} AND l.block < b.last << {FAN}
GROUP BY 1, 2, 3, 4
)
INSERT INTO reading_summary ({_SUMMARY}) SELECT * FROM made
"""  # noqa: S608 - made of constants
