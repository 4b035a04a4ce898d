"""Millions of readings at once, for benchmarks and tests: what the writer would have stored, made by the database itself.

The process wears, is corrected every hundred readings or so, gets a new tool every 50 000, and now and then makes a part
out of tolerance. Chance is the database's, seeded, so a run repeats. The summaries are made by the writer's own statements.
"""

import json
from typing import Any

import psycopg

from app.loop.readings.writer.statements import BASE_LEVEL, FAN, SUMMARISE_READINGS, SUMMARISE_SUMMARIES, TOP_LEVEL

CORRECTED = 97  # every so many readings a correction
TOOL_LIFE = 50_000
CORRECTIONS_OF_A_LIFE = TOOL_LIFE // CORRECTED
STEP = -0.0004  # mm, each of them
OUTSIDE = 40_009  # every so many readings a part out of tolerance

# Deviations (mm) that are put at places of their own, as shares of the way: whatever a chart leaves out, these it must show.
EXTREMES = {0.21: 0.0113, 0.37: 0.4213, 0.58: -0.0127, 0.83: 1.7019}

READINGS = f"""
INSERT INTO reading (machine_id, characteristic_id, sequence, measured, deviation, decided, average_before, average_after,
    measured_at, received_at, parameters_version, correction, late, zone, action, code, part, compensated)
SELECT m, c, s, round((t + d)::numeric, 6)::float8, d, d, 0, d / 2, at, at, 1,
    CASE WHEN s %% {CORRECTED} = 0 THEN s / {CORRECTED} END, false,
    CASE WHEN abs(d) >= 1 THEN 'probe_fault' WHEN abs(d) >= 0.3 THEN 'wear'
         WHEN d > w / 2 THEN 'oversize' WHEN d < -w / 2 THEN 'undersize'
         WHEN abs(d) > 0.0053 THEN 'full' WHEN abs(d) > 0.001 THEN 'average' ELSE 'zero' END,
    CASE WHEN s %% {CORRECTED} = 0 THEN 'correct' ELSE 'none' END, 'average_kept', 'SN-' || s,
    round(({STEP} * ((s - 1) / {CORRECTED} %% {CORRECTIONS_OF_A_LIFE}))::numeric, 9)::float8
FROM (SELECT %(machine)s::int AS m, %(characteristic)s::int AS c, %(target)s::float8 AS t, %(width)s::float8 AS w, s,
        timestamptz '2026-01-05 06:00+00' + s * interval '1 second' AS at,
        coalesce(%(extremes)s::jsonb ->> s::text,
            CASE WHEN s %% {OUTSIDE} = 0 THEN '0.0093' END)::float8 AS put,
        round((0.002 * sin(s / 30000.0) + 0.00002 * (s %% {CORRECTED}) - 0.001 + 0.003 * (random() + random() - 1))::numeric, 6)
            ::float8 AS made
      FROM generate_series(%(first)s::bigint, %(last)s::bigint) AS s) AS g,
     LATERAL (SELECT coalesce(put, made) AS d) AS deviation
"""  # noqa: S608 - made of constants
CORRECTIONS = f"""
INSERT INTO correction (machine_id, number, characteristic_id, sequence, tool_memory, size_error, amount, status,
    created_at, applied_at, applied_by, offset_after)
SELECT %(machine)s::int, n, %(characteristic)s::int, n * {CORRECTED}, 3, {-STEP}, {STEP}, 'applied', at, at, 'bench',
    {STEP} * (n %% {CORRECTIONS_OF_A_LIFE})
FROM generate_series(1, %(count)s::bigint / {CORRECTED}) AS n,
     LATERAL (SELECT timestamptz '2026-01-05 06:00+00' + n * {CORRECTED} * interval '1 second' AS at) AS moment
"""  # noqa: S608 - made of constants
TOOL_EVENTS = f"""
INSERT INTO tool_event (machine_id, number, at, kind, offset_before, offset_after, correction, actor)
SELECT %(machine)s::int, 3, applied_at, 'correction', offset_after - amount, offset_after, number, 'bench'
FROM correction WHERE machine_id = %(machine)s::int AND characteristic_id = %(characteristic)s::int
UNION ALL
SELECT %(machine)s::int, 3, timestamptz '2026-01-05 06:00+00' + n * {TOOL_LIFE} * interval '1 second', 'change',
    -0.2, 0, NULL, 'bench'
FROM generate_series(1, %(count)s::bigint / {TOOL_LIFE}) AS n
ORDER BY 3
"""  # noqa: S608 - made of constants
ALARMS = f"""
INSERT INTO alarm (machine_id, kind, characteristic_id, tool_memory, sequence, last_sequence, raised_at, acknowledged_at)
SELECT %(machine)s::int, 'oversize', %(characteristic)s::int, 3, s, s, now(), now()
FROM generate_series({OUTSIDE}, %(count)s::bigint, {OUTSIDE}) AS s
"""  # noqa: S608 - made of constants
STREAM = """
UPDATE stream SET sequence = r.sequence, last_measured_at = r.measured_at, last_received_at = r.received_at,
    last_measured = r.measured, last_deviation = r.deviation, last_average = r.average_after, last_zone = r.zone
FROM reading r WHERE r.machine_id = stream.machine_id AND r.characteristic_id = stream.characteristic_id
    AND r.sequence = %(count)s AND stream.machine_id = %(machine)s AND stream.characteristic_id = %(characteristic)s
"""


def fill(
    connection: psycopg.Connection[Any], characteristic: str, count: int, *, seed: float = 0.5, chunk: int = 1_000_000
) -> dict[int, float]:
    """Give an empty characteristic `count` readings, with corrections, tool changes and alarms.

    It must have R10 = 3 and be the only one of its machine. The answer is the extremes by sequence (mm).
    """
    stored = connection.execute(
        "SELECT c.machine_id, c.id, (p.parameters ->> 'target')::float8, (p.parameters ->> 'tolerance_width')::float8 "
        "FROM characteristic c JOIN parameters_version p ON p.machine_id = c.machine_id AND p.characteristic_id = c.id "
        "WHERE c.key = %s",
        [characteristic],
    ).fetchone()
    assert stored is not None
    machine, number, target, width = stored
    extremes = {max(1, round(share * count)): deviation for share, deviation in EXTREMES.items()}
    values = {
        "machine": machine,
        "characteristic": number,
        "target": target,
        "width": width,
        "count": count,
        "extremes": json.dumps(extremes),
    }
    connection.execute("SET statement_timeout = 0")
    connection.execute("SELECT setseed(%s)", [seed])
    for first in range(1, count + 1, chunk):
        connection.execute(READINGS, values | {"first": first, "last": min(count, first + chunk - 1)})
        _summarise(connection, machine, number, first - 1, min(count, first + chunk - 1))
    for statement in (CORRECTIONS, TOOL_EVENTS, ALARMS, STREAM):
        connection.execute(statement, values)
    connection.execute(
        "UPDATE machine_state SET last_correction = %s WHERE machine_id = %s", [count // CORRECTED, machine]
    )
    return extremes


def _summarise(connection: psycopg.Connection[Any], machine: int, characteristic: int, before: int, now: int) -> None:
    """The blocks that are full now and were not before, as the writer makes them."""
    for level in range(BASE_LEVEL, TOP_LEVEL + 1, FAN):
        if before >> level == now >> level:
            return
        row = {
            "machine_id": machine,
            "characteristic_id": characteristic,
            "level": level,
            "first": before >> level,
            "last": now >> level,
        }
        statement = SUMMARISE_READINGS if level == BASE_LEVEL else SUMMARISE_SUMMARIES
        psycopg.RawCursor(connection).execute(statement, [json.dumps([row])])
