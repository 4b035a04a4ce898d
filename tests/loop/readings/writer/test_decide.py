"""Deciding in memory, without web and database: properties of a sequence of readings."""

from datetime import UTC, datetime, timedelta
from typing import Any

import hypothesis.strategies as st
import psycopg
import pytest
from hypothesis import given

from app.core.parameters import Parameters, read
from app.db.engine import Database
from app.errors import Conflict, InbandError, Invalid
from app.loop.machines.queries import lock_machines
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.connection import connect
from app.loop.readings.writer.decide import decide_one_by_one
from app.loop.readings.writer.load import ParametersCache
from app.loop.readings.writer.pending import PendingTool, PendingWrites, Stored, Verdict
from app.loop.readings.writer.retry import committed
from app.loop.readings.writer.snapshot import LoadedAverage, LoadedStream, LoadedTool, Snapshot
from app.loop.readings.writer.transaction import CommitLost, transact
from tests.chance import examples
from tests.loops import run
from tests.shop import PARAMETERS

ENTRY = Entry(1, "lathe-1", 1, "shaft")
NOW = datetime(2026, 11, 21, 8, 0, tzinfo=UTC)


def pending_writes(parameters: Parameters | None = None) -> PendingWrites:
    snapshot = Snapshot({1: parameters or read(PARAMETERS)[0]}, last_correction={1: 0}, versions={1: 0})
    snapshot.tools[1, 3] = LoadedTool(machine_id=1, number=3)
    snapshot.averages[1, 5] = LoadedAverage(1, 5)
    snapshot.streams[1] = LoadedStream(entry=ENTRY, version=1, average=5, tool=3)
    return PendingWrites(snapshot)


def tool_of(pending: PendingWrites) -> PendingTool:
    tool = pending.stream(1).tool
    assert tool is not None
    return tool


def decided(pending: PendingWrites, readings: list[ReadingIn]) -> list[Verdict | Stored | InbandError]:
    return decide_one_by_one(pending, [(ENTRY, reading) for reading in readings], NOW)


def state(pending: PendingWrites) -> Any:
    """Everything that would be written."""
    stream, tool = pending.stream(1), tool_of(pending)
    return (
        stream.sequence,
        stream.average and stream.average.average,
        (tool.offset, tool.total),
        [(c.number, c.amount, c.status, c.superseded_by, c.applied_by) for c in tool.written()],
        [(alarm.kind, alarm.count, alarm.sequence, alarm.last_sequence) for alarm in pending.raised],
        [(v.sequence, v.measured, v.decision, v.outstanding, v.late) for v in pending.verdicts],
        pending.last_number(1),
        len(pending.offset_changes),
    )


micrometres = st.one_of(
    st.floats(-12, 12), st.floats(-400, 400), st.sampled_from([0.0, 1.0, -5.0, 8.0, 300.0, 1000.0, -2000.0])
)
readings = st.lists(
    st.tuples(micrometres, st.one_of(st.none(), st.integers(0, 4))).map(
        lambda drawn: ReadingIn("shaft", measured=round(40 + drawn[0] / 1000, 7), correction_in_effect=drawn[1])
    ),
    max_size=40,
)


def with_keys(drawn: list[ReadingIn]) -> list[ReadingIn]:
    for number, reading in enumerate(drawn):
        reading.key = f"k{number}"
    return drawn


@given(readings.map(with_keys), st.randoms(use_true_random=False))
@examples(150)
def test_any_order_of_duplicates_changes_nothing(drawn: list[ReadingIn], chance: Any) -> None:
    once, often = pending_writes(), pending_writes()
    decided(once, drawn)
    for number, reading in enumerate(drawn):
        decided(often, [reading])
        for _again in range(chance.randrange(3)):
            earlier = drawn[chance.randrange(number + 1)]
            before = state(often)
            (outcome,) = decided(often, [earlier])
            if isinstance(outcome, Verdict):  # the first one with this key, whatever came since
                assert outcome.reading.key == earlier.key
            else:
                assert isinstance(outcome, Invalid)  # it was refused then and is refused now
            if earlier.key in {v.reading.key for v in once.verdicts}:
                assert state(often) == before
    if all(reading.correction_in_effect is None for reading in drawn):
        assert state(often) == state(once)


@given(readings)
@examples(150)
def test_what_is_refused_leaves_the_state_as_it_was(drawn: list[ReadingIn]) -> None:
    pending = pending_writes()
    refusals = [
        ReadingIn("shaft", measured=40.0, correction_in_effect=99),
        ReadingIn("shaft", touches=[[40.0, 40.0]]),
        ReadingIn("shaft", touches=[[40.0], [40.0]]),
    ]
    for reading in drawn:
        decided(pending, [reading])
        before = state(pending)
        assert all(isinstance(outcome, Invalid) for outcome in decided(pending, refusals))
        assert state(pending) == before


@given(readings)
@examples(150)
def test_numbers_have_no_gaps_and_the_offset_is_the_sum_of_what_is_applied(drawn: list[ReadingIn]) -> None:
    pending = pending_writes()
    decided(pending, drawn)
    tool = tool_of(pending)
    assert [v.sequence for v in pending.verdicts] == list(range(1, pending.stream(1).sequence + 1))
    assert [c.number for c in tool.corrections] == list(range(1, pending.last_number(1) + 1))
    applied = sum(c.amount for c in tool.corrections if c.status == "applied")
    assert tool.offset == tool.total == pytest.approx(applied, abs=1e-9)
    assert sum(c.status == "held" for c in tool.corrections) <= 1
    assert len({alarm.kind for alarm in pending.raised}) == len(pending.raised)
    assert sum(alarm.count for alarm in pending.raised) == sum(len(v.alarms) for v in pending.verdicts)


@given(st.lists(micrometres, min_size=1, max_size=60))
@examples(150)
def test_with_nothing_confirmed_the_corrections_never_add_up_beyond_what_was_seen(drawn: list[float]) -> None:
    """While no correction takes effect, all of them together remove no more than the largest deviation seen."""
    pending = pending_writes()
    decided(pending, [ReadingIn("shaft", measured=round(40 + each / 1000, 7)) for each in drawn])
    total, largest = 0.0, max(abs(v.decision.deviation) for v in pending.verdicts)
    for verdict in pending.verdicts:
        if verdict.correction is not None and verdict.correction.status == "pending":
            total += verdict.correction.amount
            assert abs(total) <= largest + 1e-9


def test_late_is_what_was_measured_before_the_newest_of_all() -> None:
    pending = pending_writes()
    minutes = [-1, -61, -31, -1, 0]
    decided(pending, [ReadingIn("shaft", measured=40.0, measured_at=NOW + timedelta(minutes=each)) for each in minutes])
    assert [verdict.late for verdict in pending.verdicts] == [False, True, True, False, False]
    assert pending.stream(1).last_measured_at == NOW


def test_a_reading_from_the_future_makes_no_later_one_late() -> None:
    pending = pending_writes()
    minutes = [60, 0, 61, -1, None]
    times = [None if each is None else NOW + timedelta(minutes=each) for each in minutes]
    decided(pending, [ReadingIn("shaft", measured=40.0, measured_at=time) for time in times])
    assert [verdict.late for verdict in pending.verdicts] == [False, False, False, True, False]
    assert pending.stream(1).last_measured_at == NOW


def test_a_key_that_is_known_is_compared_by_value_only() -> None:
    pending = pending_writes()
    first = decided(pending, [ReadingIn("shaft", measured=40.0061, key="k")])[0]
    again = ReadingIn("shaft", measured=40.0061, key="k", part="another", correction_in_effect=99)
    assert decided(pending, [again])[0] is first
    assert isinstance(decided(pending, [ReadingIn("shaft", touches=[[40.0061]], key="k")])[0], Verdict)
    assert isinstance(decided(pending, [ReadingIn("shaft", measured=40.0062, key="k")])[0], Conflict)


def shaft_in_database(database: Database) -> None:
    with psycopg.connect(database.dsn, autocommit=True) as connection:
        connection.execute("INSERT INTO machine (key, name, control) VALUES ('lathe-1', 'Lathe', 'other')")
        connection.execute("INSERT INTO machine_state (machine_id) VALUES (1) ON CONFLICT DO NOTHING")
        connection.execute("INSERT INTO characteristic (machine_id, key, name) VALUES (1, 'shaft', 'Shaft')")
        connection.execute(
            "INSERT INTO parameters_version (machine_id, characteristic_id, version, parameters, created_by, reason)"
            " VALUES (1, 1, 1, %s, 'test', 'test')",
            [psycopg.types.json.Jsonb(read(PARAMETERS | {"tool_memory": 0, "average_memory": 0})[0].as_dict())],
        )
        connection.execute(
            "INSERT INTO stream (machine_id, characteristic_id, parameters_version, tool_memory, average_memory)"
            " VALUES (1, 1, 1, 0, 0)"
        )


def test_a_transaction_that_was_asked_after_cannot_commit_later(database: Database) -> None:
    """A backend may still hold what a lost connection sent; once its readings were looked for, it comes too late."""
    shaft_in_database(database)
    reading = [(ENTRY, ReadingIn("shaft", measured=40.0))]

    async def ask() -> None:
        pipeline, snapshot = await connect(database), Snapshot()
        await transact(pipeline, {}, snapshot, reading, optimistic=True)
        outcomes = await transact(pipeline, {}, snapshot, reading, optimistic=True)
        (verdict,) = outcomes
        assert isinstance(verdict, Verdict)
        assert verdict.sequence == 2
        assert await committed(pipeline, CommitLost(outcomes), 5.0)
        with pytest.raises(psycopg.errors.DivisionByZero):
            await transact(pipeline, {}, snapshot, reading, optimistic=True)
        await pipeline.run((("ROLLBACK",),))
        verdict.sequence = 3
        assert not await committed(pipeline, CommitLost(outcomes), 5.0)
        await pipeline.connection.close()

    run(ask())


def test_what_is_remembered_is_not_believed_when_the_machine_has_changed(database: Database) -> None:
    shaft_in_database(database)

    async def ask() -> None:
        pipeline, snapshot = await connect(database), Snapshot()
        parameters: ParametersCache = {}
        for wanted in range(1, 4):
            (verdict,) = await transact(
                pipeline, parameters, snapshot, [(ENTRY, ReadingIn("shaft", measured=40.0))], optimistic=True
            )
            assert isinstance(verdict, Verdict)
            assert verdict.sequence == wanted
        with database.begin() as session:
            lock_machines(session, [1])
        with pytest.raises(psycopg.errors.DivisionByZero):
            await transact(
                pipeline, parameters, snapshot, [(ENTRY, ReadingIn("shaft", measured=40.0))], optimistic=True
            )
        await pipeline.connection.close()

    run(ask())
