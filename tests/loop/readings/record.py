"""Invariants of the record after any sequence of events, and a replay of it by the core alone."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import psycopg
import pytest

from app.core.decision.decide import Decision, LoopState, decide, outstanding_effect
from app.core.decision.limits import Zone
from app.core.decision.step import deviation_of
from app.core.parameters import Parameters
from app.loop.readings.records import MOST_OUTSTANDING
from app.loop.readings.writer.statements import BASE_LEVEL, FAN, TOP_LEVEL


def rows(dsn: str, query: str, *values: Any) -> list[tuple[Any, ...]]:
    """Rows that a query returns."""
    with psycopg.connect(dsn, autocommit=True) as connection:
        return connection.execute(query, values).fetchall()


def counts(dsn: str) -> dict[str, int]:
    """Number of rows of each table, without those of the periodic jobs."""
    with psycopg.connect(dsn, autocommit=True) as connection:
        return counted(connection)


def counted(connection: psycopg.Connection[Any]) -> dict[str, int]:
    """As `counts`, of a connection that stays open."""
    tables = connection.execute(
        "SELECT relname::text FROM pg_class WHERE relkind = 'r' AND relnamespace = 'public'::regnamespace ORDER BY 1"
    ).fetchall()
    count = " UNION ALL ".join(f"SELECT '{name}', count(*) FROM \"{name}\"" for (name,) in tables)  # noqa: S608 - of the catalogue
    return {
        name: n for name, n in connection.execute(count) if name not in {"outlook", "capability_verdict", "job_run"}
    }


def must_hold(dsn: str) -> None:
    """Fail unless the whole record is consistent: numbers without gaps, states, summaries, corrections, tools, alarms."""
    with psycopg.connect(dsn, autocommit=True) as connection:
        for query in BROKEN:
            found = connection.execute(query).fetchmany(5)
            assert not found, f"{query}\n{found}"
        for level in range(BASE_LEVEL, TOP_LEVEL + 1, FAN):
            _summaries_must_hold(connection, level)


# Each finds what must not be there.
BROKEN = (
    # sequences 1 … n, and the stream knows n and its last reading
    """SELECT s.*, r.* FROM stream s JOIN LATERAL (
           SELECT count(*) AS n, coalesce(max(sequence), 0) AS last, coalesce(min(sequence), 1) AS first FROM reading r
           WHERE r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id) r ON true
       WHERE r.n <> s.sequence OR r.last <> s.sequence OR r.first <> 1""",
    """SELECT s.*, r.* FROM stream s JOIN reading r
           ON r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id AND r.sequence = s.sequence
       WHERE (s.last_measured, s.last_deviation, s.last_average, s.last_zone, s.last_received_at)
           IS DISTINCT FROM (r.measured, r.deviation, r.average_after, r.zone, r.received_at)
           AND r.code <> 'imported'""",  # history may be older than the state
    """SELECT s.characteristic_id, s.last_measured_at, max(least(r.measured_at, r.received_at)) FROM stream s JOIN reading r
           ON r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id
       GROUP BY s.machine_id, s.characteristic_id HAVING s.last_measured_at <> max(least(r.measured_at, r.received_at))""",
    "SELECT * FROM reading r LEFT JOIN stream s USING (machine_id, characteristic_id) WHERE s.sequence IS NULL",
    # a key names one reading
    "SELECT characteristic_id, key FROM reading WHERE key IS NOT NULL GROUP BY 1, 2 HAVING count(*) > 1",
    # corrections 1 … n of each machine, each from one reading that names it
    """SELECT m.*, c.* FROM machine_state m JOIN LATERAL (
           SELECT count(*) AS n, coalesce(max(number), 0) AS last FROM correction c WHERE c.machine_id = m.machine_id
       ) c ON true WHERE c.n <> m.last_correction OR c.last <> m.last_correction""",
    """SELECT c.*, r.sequence FROM correction c LEFT JOIN reading r ON r.machine_id = c.machine_id
           AND r.characteristic_id = c.characteristic_id AND r.sequence = c.sequence
       WHERE r.correction IS DISTINCT FROM c.number""",
    "SELECT machine_id, correction FROM reading WHERE correction IS NOT NULL GROUP BY 1, 2 HAVING count(*) > 1",
    # one held correction per tool at most
    "SELECT machine_id, tool_memory FROM correction WHERE status = 'held' GROUP BY 1, 2 HAVING count(*) > 1",
    # no open correction leads elsewhere than the parameters of now
    """SELECT c.*, was.parameters, force.parameters FROM correction c
           JOIN reading r USING (machine_id, characteristic_id, sequence)
           JOIN stream s USING (machine_id, characteristic_id)
           JOIN parameters_version was ON was.machine_id = c.machine_id AND was.characteristic_id = c.characteristic_id
               AND was.version = r.parameters_version
           JOIN parameters_version force ON force.machine_id = c.machine_id AND force.characteristic_id = c.characteristic_id
               AND force.version = s.parameters_version
       WHERE c.status IN ('held', 'awaiting_approval', 'pending') AND (
           c.tool_memory <> s.tool_memory OR force.parameters ->> 'mode' = 'measure_only'
           OR was.parameters -> 'factor' <> force.parameters -> 'factor'
           OR was.parameters -> 'target' <> force.parameters -> 'target'
           OR (force.parameters ->> 'mode' = 'approval' AND was.parameters ->> 'mode' <> 'approval'))""",
    # the sum of a tool is that of its applied corrections since it was changed; the offset is that of its last step
    """SELECT t.*, c.total FROM tool t JOIN LATERAL (
           SELECT coalesce(sum(amount), 0) AS total FROM correction c
           WHERE c.machine_id = t.machine_id AND c.tool_memory = t.number AND c.status = 'applied'
               -- by the machine's clock, which may be behind; what was issued since was applied since
               AND (t.changed_at IS NULL OR greatest(c.applied_at, c.created_at) > t.changed_at)) c ON true
       WHERE abs(t.total - c.total) > 1e-9""",
    """SELECT t.*, e.* FROM tool t JOIN LATERAL (
           SELECT offset_after FROM tool_event e WHERE e.machine_id = t.machine_id AND e.number = t.number
           ORDER BY id DESC LIMIT 1) e ON true WHERE abs(t."offset" - e.offset_after) > 1e-9""",
    """SELECT c.*, e.* FROM correction c JOIN LATERAL (
           SELECT count(*) AS n, min(id) AS first, max(id) AS last FROM tool_event
           WHERE machine_id = c.machine_id AND correction = c.number) e ON true
       WHERE e.n - (e.n = 2 AND EXISTS (
           -- a reading had confirmed it with the offset that was expected; then the machine named another one
           SELECT FROM tool_event r JOIN tool_event m ON m.machine_id = r.machine_id AND m.id = e.last
           JOIN alarm a ON a.machine_id = r.machine_id AND a.tool_memory = c.tool_memory AND a.kind = 'offset_differs'
               AND m.at BETWEEN a.raised_at AND a.last_at
           WHERE r.machine_id = c.machine_id AND r.id = e.first AND r.number = c.tool_memory AND m.number = c.tool_memory
               AND abs(r.offset_after - r.offset_before - c.amount) < 1e-9 AND m.offset_after = c.offset_after
               AND (a.count > 1 OR a.data @> jsonb_build_object(  -- of more the last one is kept
                   'correction', c.number, 'expected', m.offset_before, 'reported', m.offset_after))
       ))::int <> (c.status = 'applied')::int""",
    "SELECT * FROM alarm WHERE last_at < raised_at",
    # one active alarm for one trouble, counted as often as readings name it
    """SELECT machine_id, kind, about FROM alarm CROSS JOIN LATERAL (SELECT CASE
           WHEN characteristic_id IS NOT NULL THEN jsonb_build_array('characteristic', characteristic_id)
           WHEN tool_memory IS NOT NULL THEN jsonb_build_array('tool', tool_memory)
           ELSE jsonb_build_array(data -> 'memory', data -> 'location') END AS about) a
       WHERE acknowledged_at IS NULL GROUP BY machine_id, kind, about HAVING count(*) > 1""",
    """SELECT a.*, r.n FROM alarm a JOIN LATERAL (
           SELECT count(*) AS n, max(sequence) AS last FROM reading r WHERE r.machine_id = a.machine_id
               AND r.characteristic_id = a.characteristic_id AND a.id = ANY(r.alarms)) r ON true
       WHERE a.sequence IS NOT NULL AND a.characteristic_id IS NOT NULL AND a.kind <> 'signal'  -- of a run of readings
           AND (r.n <> a.count OR r.last <> a.last_sequence)""",
    # a summary for each full block and for no other
    f"""SELECT s.characteristic_id, g.lv, s.sequence, count(b.block) FROM stream s
           CROSS JOIN generate_series({BASE_LEVEL}, {TOP_LEVEL}, {FAN}) AS g(lv)
           LEFT JOIN reading_summary b ON b.machine_id = s.machine_id AND b.characteristic_id = s.characteristic_id
               AND b.level = g.lv
       GROUP BY s.machine_id, s.characteristic_id, s.sequence, g.lv HAVING count(b.block) <> s.sequence >> g.lv""",  # noqa: S608
    # touches belong to readings
    """SELECT t.* FROM reading_touches t LEFT JOIN reading r USING (machine_id, characteristic_id, sequence)
       WHERE r.measured IS NULL""",
)

_ZONES = ", ".join(f"count(*) FILTER (WHERE zone = '{zone.value}')" for zone in Zone)
_SUMMARIES = f"""
SELECT b.count, b.minimum, b.maximum, b.sum, b.sum_squares, b.first, b.last, b.average, b.corrections, b.zones,
    b.first_at, b.last_at, r.*
FROM reading_summary b JOIN LATERAL (
    SELECT count(*) AS count_, min(deviation), max(deviation), sum(deviation), sum(deviation * deviation),
        (array_agg(deviation ORDER BY sequence))[1], (array_agg(deviation ORDER BY sequence DESC))[1],
        (array_agg(average_after ORDER BY sequence DESC))[1], count(correction), ARRAY[{_ZONES}],
        min(measured_at), max(measured_at)
    FROM reading r WHERE r.machine_id = b.machine_id AND r.characteristic_id = b.characteristic_id
        AND r.sequence > b.block << b.level AND r.sequence <= (b.block + 1) << b.level) r ON true
WHERE b.level = %s
"""  # noqa: S608 - made of constants


def _summaries_must_hold(connection: psycopg.Connection[Any], level: int) -> None:
    for row in connection.execute(_SUMMARIES, [level]):
        kept, counted = row[: len(row) // 2], row[len(row) // 2 :]
        assert kept[0] == 1 << level
        for one, other in zip(kept, counted, strict=True):
            assert (pytest.approx(one, rel=1e-9, abs=1e-12) if isinstance(one, float) else one) == other, (
                kept,
                counted,
            )


def history(dsn: str, characteristic: str) -> list[dict[str, Any]]:
    """The stored readings of a characteristic in the order of arrival, with the amount of each correction."""
    with psycopg.connect(dsn, row_factory=psycopg.rows.dict_row) as connection:
        return connection.execute(
            """SELECT r.*, c.amount, c.status, c.tool_memory FROM reading r
               JOIN characteristic ch ON ch.machine_id = r.machine_id AND ch.id = r.characteristic_id
               LEFT JOIN correction c ON c.machine_id = r.machine_id AND c.number = r.correction
               WHERE ch.key = %s ORDER BY r.sequence""",
            [characteristic],
        ).fetchall()


def replay(parameters: Parameters, stored: Iterable[dict[str, Any]]) -> list[tuple[dict[str, Any], Decision]]:
    """Decide each reading again, one after the other, by `app.core` and the plainest bookkeeping there is.

    For a characteristic that has its tool and its average to itself; whether it was paused, and that corrections fell with it, is as
    stored. A part is cut with the corrections up to its `correction_in_effect`, or with none that is not confirmed.
    """
    average = 0.0
    issued: dict[int, float] = {}
    confirmed: set[int] = set()
    decided = []
    stored = list(stored)
    fell = {reading["correction"] for reading in stored if reading["status"] == "superseded"}
    for reading in stored:
        in_effect = reading["correction_in_effect"]
        if in_effect is None:
            outstanding = [number for number in issued if number not in confirmed]
        else:
            confirmed |= {number for number in issued if number <= in_effect}
            outstanding = [number for number in issued if number > in_effect]
        decision = decide(
            parameters,
            LoopState(average, paused=reading["paused_by"] is not None),
            deviation_of(reading["measured"], parameters.target),
            outstanding=outstanding_effect((issued[number] for number in outstanding), parameters.factor),
        )
        average = decision.average_after
        if decision.amount is not None:
            issued[reading["correction"]] = decision.amount
        if reading["paused_by"] is not None:  # by the alarm that this reading raised, or one before it
            issued = {number: amount for number, amount in issued.items() if number not in fell}
        decided.append((reading | {"expected_outstanding": outstanding[:MOST_OUTSTANDING]}, decision))
    return decided


def must_replay(parameters: Parameters, stored: Iterable[dict[str, Any]]) -> int:
    """Fail unless every stored decision is the one that the core takes in that order; the number of corrections."""
    corrections = 0
    for reading, decision in replay(parameters, stored):
        assert (
            reading["deviation"],
            reading["decided"],
            reading["zone"],
            reading["action"],
            reading["code"],
            reading["average_before"],
            reading["average_after"],
            reading["amount"],
            reading["outstanding"] or [],
        ) == (
            decision.deviation,
            decision.decided,
            decision.zone,
            decision.action,
            decision.code,
            decision.average_before,
            decision.average_after,
            decision.amount,
            reading["expected_outstanding"],
        ), reading
        corrections += decision.amount is not None
    return corrections


def by_answer(answers: Iterable[dict[str, Any]]) -> dict[tuple[str, int], dict[str, Any]]:
    """Answers by characteristic and sequence; no two may have the same."""
    found: dict[tuple[str, int], dict[str, Any]] = {}
    for answer in answers:
        at = (answer["characteristic"], answer["sequence"])
        assert at not in found, f"{answer} and {found[at]}"
        found[at] = answer
    return found


def must_be_stored(dsn: str, answers: Iterable[dict[str, Any]]) -> None:
    """Fail unless each answered reading is in the record under its number, as it was answered."""
    wanted: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for (characteristic, _sequence), answer in by_answer(answers).items():
        wanted[characteristic].append(answer)
    for characteristic, given in wanted.items():
        stored = {reading["sequence"]: reading for reading in history(dsn, characteristic)}
        for answer in given:
            reading = stored[answer["sequence"]]
            assert reading["key"] == answer["key"]
            assert reading["measured"] == answer["measured"]
            assert reading["average_after"] == answer["average_after"]
            assert reading["zone"] == answer["zone"]
            assert reading["correction"] == (answer["correction"] and answer["correction"]["number"])
