"""Deciding in memory, without web and database: properties of a sequence of readings."""

from datetime import UTC, datetime
from typing import Any

import hypothesis.strategies as st
import psycopg
import pytest
from hypothesis import given, settings

from app.core.parameters import Parameters, read
from app.db.engine import Database
from app.errors import Conflict, InbandError, Invalid
from app.machines.queries import lock_machines
from app.readings.ground import AverageState, Ground, Stored, StreamState, ToolState, Verdict
from app.readings.judge import judge
from app.readings.keeper import committed, connect
from app.readings.loading import Book
from app.readings.records import Entry
from app.readings.schemas import ReadingIn
from app.readings.transaction import CommitLost, transact
from tests.loops import run
from tests.shop import PARAMETERS

ENTRY = Entry(1, "lathe-1", 1, "shaft")
NOW = datetime(2026, 11, 21, 8, 0, tzinfo=UTC)


def ground(parameters: Parameters | None = None) -> Ground:
    parameters = parameters or read(PARAMETERS)[0]
    made = Ground(last_correction={1: 0})
    made.tools[1, 3] = tool = ToolState(1, 3, 0.0, 0.0, None)
    made.averages[1, 5] = average = AverageState(1, 5, 0.0, 0.0)
    made.streams[1] = StreamState(ENTRY, 0, 1, parameters, average, tool, None, None)
    return made


def decided(made: Ground, readings: list[ReadingIn]) -> list[Verdict | Stored | InbandError]:
    outcomes: list[Verdict | Stored | InbandError] = []
    for reading in readings:
        try:
            outcomes.append(judge(made, ENTRY, reading, NOW))
        except InbandError as refusal:
            outcomes.append(refusal)
    return outcomes


def state(made: Ground) -> Any:
    """Everything that would be written."""
    stream, tool = made.streams[1], made.tools[1, 3]
    return (
        stream.sequence,
        stream.average and stream.average.average,
        (tool.offset, tool.total),
        [(c.number, c.amount, c.status, c.superseded_by, c.applied_by) for c in tool.corrections],
        [(alarm.kind, alarm.count, alarm.sequence, alarm.last_sequence) for alarm in made.raised],
        [(v.sequence, v.measured, v.decision, v.outstanding, v.late) for v in made.verdicts],
        made.last_correction,
        len(made.steps),
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
@settings(max_examples=150, deadline=None)
def test_any_order_of_duplicates_changes_nothing(drawn: list[ReadingIn], chance: Any) -> None:
    once, often = ground(), ground()
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
@settings(max_examples=150, deadline=None)
def test_what_is_refused_leaves_the_ground_as_it_was(drawn: list[ReadingIn]) -> None:
    made = ground()
    refusals = [
        ReadingIn("shaft", measured=40.0, correction_in_effect=99),
        ReadingIn("shaft", touches=[[40.0, 40.0]]),
        ReadingIn("shaft", touches=[[45.0]]),
    ]
    for reading in drawn:
        decided(made, [reading])
        before = state(made)
        assert all(isinstance(outcome, Invalid) for outcome in decided(made, refusals))
        assert state(made) == before


@given(readings)
@settings(max_examples=150, deadline=None)
def test_numbers_have_no_gaps_and_the_offset_is_the_sum_of_what_is_applied(drawn: list[ReadingIn]) -> None:
    made = ground()
    decided(made, drawn)
    tool = made.tools[1, 3]
    assert [v.sequence for v in made.verdicts] == list(range(1, made.streams[1].sequence + 1))
    assert [c.number for c in tool.corrections] == list(range(1, made.last_correction[1] + 1))
    applied = sum(c.amount for c in tool.corrections if c.status == "applied")
    assert tool.offset == tool.total == pytest.approx(applied, abs=1e-9)
    assert sum(c.status == "held" for c in tool.corrections) <= 1
    assert len({alarm.kind for alarm in made.raised}) == len(made.raised)
    assert sum(alarm.count for alarm in made.raised) == sum(len(v.alarms) for v in made.verdicts)


@given(st.lists(micrometres, min_size=1, max_size=60))
@settings(max_examples=150, deadline=None)
def test_with_nothing_confirmed_the_corrections_never_add_up_beyond_what_was_seen(drawn: list[float]) -> None:
    """While no correction takes effect, all of them together remove no more than the largest deviation seen."""
    made = ground()
    decided(made, [ReadingIn("shaft", measured=round(40 + each / 1000, 7)) for each in drawn])
    total, largest = 0.0, max(abs(v.decision.deviation) for v in made.verdicts)
    for verdict in made.verdicts:
        if verdict.correction is not None and verdict.correction.status == "pending":
            total += verdict.correction.amount
            assert abs(total) <= largest + 1e-9


def test_a_key_that_is_known_is_compared_by_value_only() -> None:
    made = ground()
    first = decided(made, [ReadingIn("shaft", measured=40.0061, key="k")])[0]
    again = ReadingIn("shaft", measured=40.0061, key="k", part="another", correction_in_effect=99)
    assert decided(made, [again])[0] is first
    assert isinstance(decided(made, [ReadingIn("shaft", touches=[[40.0061]], key="k")])[0], Verdict)
    assert isinstance(decided(made, [ReadingIn("shaft", measured=40.0062, key="k")])[0], Conflict)


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
        pipeline, made = await connect(database.dsn), Ground()
        await transact(pipeline, {}, made, reading, trusting=True)
        outcomes = await transact(pipeline, {}, made, reading, trusting=True)
        (verdict,) = outcomes
        assert isinstance(verdict, Verdict)
        assert verdict.sequence == 2
        assert await committed(pipeline, CommitLost(outcomes))
        with pytest.raises(psycopg.errors.DivisionByZero):
            await transact(pipeline, {}, made, reading, trusting=True)
        await pipeline.run((("ROLLBACK",),))
        verdict.sequence = 3
        assert not await committed(pipeline, CommitLost(outcomes))
        await pipeline.connection.close()

    run(ask())


def test_what_is_remembered_is_not_believed_when_the_machine_has_changed(database: Database) -> None:
    shaft_in_database(database)

    async def ask() -> None:
        pipeline, made = await connect(database.dsn), Ground()
        book: Book = {}
        for wanted in range(1, 4):
            (verdict,) = await transact(
                pipeline, book, made, [(ENTRY, ReadingIn("shaft", measured=40.0))], trusting=True
            )
            assert isinstance(verdict, Verdict)
            assert verdict.sequence == wanted
        with database.begin() as session:
            lock_machines(session, [1])
        with pytest.raises(psycopg.errors.DivisionByZero):
            await transact(pipeline, book, made, [(ENTRY, ReadingIn("shaft", measured=40.0))], trusting=True)
        await pipeline.connection.close()

    run(ask())
